//! Rules of state machines: targets, triggers, variables, and what the editor of the public tool
//! set adds.

use super::{check, text};

/// A service with one machine, whose state `Off` has these contents (line 4); the state `On` is
/// empty.
fn state(contents: &str) -> String {
    text(&format!(
        r#"<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<message_set><input_set/><output_set/></message_set><internal_events_set><event_def name="Go"><header name="H"/><body name="B"><record name="Rec"><fixed_field name="F" field_type="byte" field_units="one"/></record></body><footer name="F"/></event_def></internal_events_set>
<protocol_behavior><start state_machine_name="FSM" state_name="Off"/><state_machine name="FSM"><state name="Off">
{contents}
</state><state name="On"/></state_machine></protocol_behavior></service_def>"#
    ))
}

#[test]
fn a_pushed_state_has_a_way_back() {
    check(
        &state(r#"<transition name="Go"><push><end_state state="On"/></push></transition>"#),
        "t.xml:4:1: warning: nothing returns from `On` after this `push`: add a transition with a `pop` to that state, or make this one `simple`",
    );
}

#[test]
fn a_guard_is_made_of_calls_and_comparisons() {
    check(
        &state(
            r#"<transition name="Go"><guard condition="isReady &amp;&amp; isX()"/><internal/></transition>"#,
        ),
        "t.xml:4:1: error: `isReady` is not a condition: write a call such as `isReady()`, or compare it with something",
    );
    check(
        &state(r#"<transition name="Go"><guard condition="level == 3"/><internal/></transition>"#),
        "t.xml:4:1: error: `level` is not a parameter of this transition: add a `parameter`, or write a text in `'`",
    );
}

#[test]
fn a_default_transition_has_no_variables() {
    check(
        &state(
            r#"<default_transition><guard condition="may(msg)"/><internal/></default_transition>"#,
        ),
        "t.xml:4:1: error: `msg` is not a text in `'`, and a `default_transition` has no parameters: write a `transition`, or a text",
    );
    check(
        &state(
            r#"<default_transition><parameter type="Go" value="msg"/><internal/></default_transition>"#,
        ),
        "t.xml:4:21: error: `parameter` is not allowed in `default_transition`, which holds a `guard`, one of `internal`, `simple`, `push` and `pop`, and `action`s, but no `parameter`s, because it matches every event",
    );
}

#[test]
fn events_that_are_sent_and_followed_exist() {
    check(
        &state(r#"<transition name="Go"><internal/><send_action name="Gone"/></transition>"#),
        "t.xml:4:1: error: the `send_action` sends `Gone`, which is neither an event nor a message of the service or a service it inherits from: correct the name, or use an `action`",
    );
    check(
        &state(r#"<transition name="Go"><pop transition="Gone"/></transition>"#),
        "t.xml:4:1: error: the `pop` is followed by `Gone`, but no state of the machine has that transition: add one, or remove the attribute `transition`",
    );
    check(
        &state(r#"<transition name="Go"><pop><argument value="1"/></pop></transition>"#),
        "t.xml:4:28: error: an `argument` of a `pop` belongs to the event that its attribute `transition` names: add that, or remove the argument",
    );
    check(
        &state(
            r#"<transition name="Go"><pop transition="Go"><argument value="1"/></pop></transition>"#,
        ),
        "t.xml:4:1: error: `Go` has 0 parameters, but the `pop` has 1 `argument`s: give it one for each",
    );
}

#[test]
fn the_type_of_a_parameter_exists() {
    check(
        &state(
            r#"<transition name="Go"><parameter type="someObject" value="x"/><internal/></transition>"#,
        ),
        "t.xml:4:1: error: `someObject` cannot be the type of a parameter: name a message, a record of an event such as `Receive.Body.ReceiveRec`, or an unsigned number",
    );
    check(
        &state(
            r#"<transition name="Go"><parameter type="Go.Body.unknownRec" value="x"/><internal/></transition>"#,
        ),
        "t.xml:4:1: error: `Go.Body.unknownRec` cannot be the type of a parameter: name a message, a record of an event such as `Receive.Body.ReceiveRec`, or an unsigned number",
    );
    check(
        &state(
            r#"<transition name="Go"><parameter type="Go.Body.Rec" value="x"/><parameter type="unsigned byte" value="n"/><internal/></transition>"#,
        ),
        "",
    );
}

#[test]
fn the_start_arrow_of_an_editor_is_no_part_of_the_machine() {
    check(
        &state(
            r#"<pseudo_start_state><state/><transition><end_state/></transition></pseudo_start_state>"#,
        ),
        "",
    );
}

#[test]
fn an_heir_does_not_declare_the_messages_of_its_base_again() {
    let message = r#"<message_def name="A" message_id="2B00" is_command="false"><header name="H"><record name="R"><fixed_field name="C" field_type="unsigned short integer" field_units="one"/></record></header><body name="B"/><footer name="F"/></message_def>"#;
    check(
        &text(&format!(
            r#"<p:service_set xmlns:p="urn:jaus:jsidl:plus" xmlns="urn:jaus:jsidl:1.1" name="Set" id="urn:set" version="1.0">
<service_def name="A" id="urn:A" version="1.0"><message_set><input_set>{message}</input_set><output_set/></message_set></service_def>
<service_def name="B" id="urn:B" version="1.0"><references><inherits_from name="a" id="urn:A" version="1.0"/></references><message_set><input_set>
{message}</input_set><output_set/></message_set></service_def>
</p:service_set>"#
        )),
        "t.xml:4:1: warning: `A` is declared again: the service inherits it from `urn:A 1.0`, so remove it here",
    );
}
