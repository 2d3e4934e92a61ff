//! Drawings of state machines.
#![allow(
    clippy::expect_used,
    reason = "a broken test setup should stop the test"
)]

use jsidl::behaviour::{dot, mermaid};
use jsidl::{Library, Loader};

const LAMP: &str = r#"<service_def xmlns="urn:jaus:jsidl:1.1" name="Lamp" id="urn:lamp" version="1.0">
<message_set><input_set/><output_set/></message_set>
<protocol_behavior is_stateless="false">
<start state_machine_name="FSM" state_name="Up"/>
<state_machine name="FSM"><state name="Up" initial_state="Dark">
<state name="Dark"><entry><action name="cool"/></entry>
<transition name="Receive"><parameter type="Switch" value="msg"/><guard condition="own.may( msg ) &amp;&amp; !late('x')"/><simple><end_state state="Up.Lit"/></simple><action name="own.Send"><argument value="'Gone'"/><argument value="msg"/></action></transition></state>
<state name="Lit"><transition name="Receive"><parameter type="Back" value="msg"/><pop/></transition>
<transition name="Tick"><internal/><action name="glow"/></transition></state>
<default_state><transition name="Receive"><parameter type="Test" value="msg"/><push><end_state state="Up.Lit"/></push></transition></default_state>
</state></state_machine></protocol_behavior></service_def>"#;

fn library(text: &str) -> Library {
    let mut loader = Loader::new();
    loader.text("lamp.xml", text);
    let loaded = loader.load();
    assert!(loaded.diagnostics.is_empty(), "{}", loaded.diagnostics);
    loaded.library
}

#[test]
fn a_machine_is_drawn_with_all_that_it_does() {
    let library = library(LAMP);
    let service = library.services().next().expect("sound");
    let machine = &library.machines(service)[0];
    insta::assert_snapshot!(mermaid(machine), @r#"
    stateDiagram-v2
        [*] --> s1
        state "Up" as s0 {
            [*] --> s1
            state "Dark" as s1
            state "Lit" as s2
        }
        s1 --> s2 : Test, to come back
        s2 --> s2 : Test, to come back
        s1 --> s2 : Switch [may() && !late('x')] / Send('Gone')
        note right of s1
            entry / cool()
        end note
        note right of s2
            Back, then back
            Tick / glow()
        end note
    "#);
    insta::assert_snapshot!(dot(machine), @r#"
    digraph machine {
        compound=true;
        newrank=true;
        rankdir=LR;
        node [shape=box, style=rounded, fontname="sans-serif"];
        edge [fontname="sans-serif", fontsize=10];
        graph [fontname="sans-serif", style=rounded, labeljust=l];
        start [shape=point, width=0.2, label=""];
        subgraph cluster_s0 {
            label="Up\n";
            s1 [label="Dark\nentry / cool()\l"];
            s2 [label="Lit\nBack, then back\lTick / glow()\l"];
        }
        start -> s1;
        s1 -> s2 [label="Test, to come back"];
        s2 -> s2 [label="Test, to come back"];
        s1 -> s2 [label="Switch [may() && !late('x')] / Send('Gone')"];
    }
    "#);
}
