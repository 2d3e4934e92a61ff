//! Merged state machines: their diagrams, how they run, and the soundness of the published ones.

use std::path::Path;

use jaus_test_kit::{evidence, snapshot};
use jsidl::behaviour::{Name, Push, Transition, TransitionKind};
use jsidl::machine::{Machine, Outcome, Run, Stimulus, dot, mermaid};
use jsidl::model::Service;
use jsidl::{Library, Loaded, Loader, rust};

const LAMP: &str = r#"<service_def xmlns="urn:jaus:jsidl:1.1" name="Lamp" id="urn:lamp" version="1.0">
<message_set><input_set/><output_set/></message_set>
<protocol_behavior is_stateless="false">
<start state_machine_name="FSM" state_name="Up"/>
<state_machine name="FSM"><state name="Up" initial_state="Dark">
<state name="Dark"><entry><action name="cool"/></entry>
<transition name="Receive"><parameter type="Switch" value="msg"/><guard condition="own.may( msg ) &amp;&amp; !late('x')"/><simple><end_state state="Up.Lit"/></simple><action name="own.Send"><argument value="'Gone'"/><argument value="msg"/></action></transition></state>
<state name="Lit"><entry><action name="warm"/></entry><exit><action name="fade"/></exit><transition name="Receive"><parameter type="Back" value="msg"/><pop/></transition>
<transition name="Receive"><parameter type="Flash" value="msg"/><simple/><action name="click"/></transition>
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
    let diagrams = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/language/machines");
    snapshot::check(diagrams.join("lamp.mmd"), &mermaid(machine));
    snapshot::check(diagrams.join("lamp.dot"), &dot(machine));
}

#[test]
fn a_state_that_is_left_or_entered_does_so_around_the_transition() {
    let library = library(LAMP);
    let service = library.services().next().expect("sound");
    let machine = &library.machines(service)[0];
    let mut done = Vec::new();
    let mut run = Run::start(machine, &mut |action| done.push(action.name.to_string()));
    let mut step = |message: &str, holds: bool| {
        let outcome = run.step(Stimulus::received(message), &mut |_| holds, &mut |action| {
            done.push(action.name.last().to_owned());
        });
        let state = machine.state(run.state()).path.last().to_owned();
        (outcome, state, std::mem::take(&mut done).join(" "))
    };
    let expect = |outcome, state: &str, done: &str| (outcome, state.to_owned(), done.to_owned());
    // `!late('x')` is false where everything holds.
    assert_eq!(
        step("Switch", true),
        expect(Outcome::Rejected, "Dark", "cool")
    );
    assert_eq!(step("Back", true), expect(Outcome::Ignored, "Dark", ""));
    assert_eq!(step("Test", true), expect(Outcome::Handled, "Lit", "warm"));
    assert_eq!(
        step("Back", true),
        expect(Outcome::Handled, "Dark", "fade cool")
    );
    assert_eq!(step("Test", true), expect(Outcome::Handled, "Lit", "warm"));
    assert_eq!(
        step("Flash", true),
        expect(Outcome::Handled, "Lit", "fade click warm")
    );
}

/// The end states that a machine's transitions name explicitly.
fn ends<'a>(machine: &Machine<'a>) -> Vec<(&'a Transition, &'a Name)> {
    let states = machine.states().map(|(_, state)| state);
    let transitions =
        states.flat_map(|state| state.transitions.iter().chain(&state.default_transitions));
    let end = |transition: &'a Transition| match &transition.kind {
        TransitionKind::To(end) | TransitionKind::Push(Push { to: end, .. }) => {
            Some((transition, end))
        }
        _ => None,
    };
    transitions
        .filter_map(|declared| end(declared.item))
        .collect()
}

/// The start states and end states of a service that do not exist, as `service: state`.
fn broken(library: &Library, service: &Service) -> Vec<String> {
    let mut broken = Vec::new();
    for machine in library.machines(service) {
        let parts = library.lineage(service).flat_map(|base| &base.behaviour);
        let own = |part: &&jsidl::behaviour::StateMachine| {
            part.name.last().eq_ignore_ascii_case(machine.name().last())
        };
        let start = parts.filter(own).map(|part| &part.start).next();
        let start = start.expect("a machine has a start");
        match machine.find(start) {
            Some(index) => assert_eq!(machine.leaf(index), machine.start(), "{}", service.id),
            None => broken.push(format!("{}: start {start}", service.id)),
        }
        for (transition, end) in ends(&machine) {
            match machine.find(end) {
                Some(index) => {
                    let target = machine.target(machine.start(), transition);
                    assert_eq!(target, Some(machine.leaf(index)), "{}", service.id);
                }
                None => broken.push(format!("{}: {end}", service.id)),
            }
        }
        for (index, state) in machine.states() {
            assert_eq!(machine.find(&state.path), Some(index));
            assert_eq!(state.initial.is_none(), state.children.is_empty());
        }
    }
    broken
}

/// The collections, the number of services with a machine in each, and the missing states.
const PUBLISHED: [(&str, usize, &[&str]); 3] =
    [("jts", 97, &[]), ("ffi", 76, &[]), ("fkie", 129, &[])];

/// The machines of each collection are consistent; a warning reports each missing state.
#[test]
fn every_published_machine_starts_and_leads_to_states_that_exist() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    for (source, services, unsound) in PUBLISHED {
        let mut loader = Loader::new();
        loader.path(corpus.join(source));
        let Loaded {
            library,
            diagnostics,
        } = loader.load();
        let with = library.services();
        let with: Vec<_> = with
            .filter(|service| !library.machines(service).is_empty())
            .collect();
        let found: Vec<_> = with.iter().flat_map(|it| broken(&library, it)).collect();
        for finding in &found {
            let (_, what) = finding.rsplit_once(' ').expect("two words");
            let mut warnings = diagnostics.warnings();
            let warned = warnings.any(|d| d.message.contains(&format!("`{what}`")));
            assert!(warned, "{finding}");
        }
        assert_eq!((source, with.len()), (source, services));
        assert_eq!(found, unsound, "{source}");
    }
}

/// Whether a machine has more than what the component's core services do.
fn is_generated(service: &Service, machine: &Machine<'_>) -> bool {
    let is_core = |service: &Service| service.id.urn.starts_with("urn:jaus:jss:core:");
    let mut states = machine.states();
    is_core(service)
        || states.any(|(_, state)| {
            let all = state.transitions.iter().chain(&state.default_transitions);
            all.into_iter().any(|declared| !is_core(declared.service))
        })
}

/// One type for each machine of each service that declares behaviour of its own.
#[test]
fn every_published_machine_can_be_written_as_rust() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    for (source, ..) in PUBLISHED {
        let mut loader = Loader::new();
        loader.path(corpus.join(source));
        let library = loader.load().library;
        let services = || library.services().map(AsRef::<Service>::as_ref);
        let text = rust::module(&library, services(), "::jaus::codec");
        let with = services().filter(|service| !service.behaviour.is_empty());
        let all = with.flat_map(|it| library.machines(it).into_iter().map(move |m| (it, m)));
        let machines = all
            .filter(|(it, machine)| is_generated(it, machine))
            .count();
        assert!(machines > 0, "{source}");
        assert_eq!(
            text.matches("pub struct Machine {").count(),
            machines,
            "{source}"
        );
        let leads_nowhere = text.matches("State:: ").count() + text.matches("State::}").count();
        assert_eq!(leads_nowhere, 0, "{source}");
    }
}
