//! State machines: those of the published definitions, if available, and a hand-written one.

use std::collections::BTreeMap;

use jaus_test_kit::evidence;
use jsidl::behaviour::{Guard, Name, State, Transition, TransitionKind};
use jsidl::machine::{Machine, Stimulus};
use jsidl::{Library, Loaded, Loader, Severity};
use proptest::prelude::*;

fn corpus(sources: &[&str]) -> Option<Loaded> {
    let corpus = evidence::outside("jsidl-corpus")?;
    let mut loader = Loader::new();
    for source in sources {
        loader.path(corpus.join(source));
    }
    Some(loader.load())
}

fn states(library: &Library) -> Vec<&State> {
    let machines = library.services().flat_map(|service| &service.behaviour);
    machines.flat_map(|machine| machine.all_states()).collect()
}

fn transitions(library: &Library) -> Vec<&Transition> {
    let states = states(library).into_iter();
    states
        .flat_map(|state| state.transitions.iter().chain(&state.default_transitions))
        .collect()
}

/// The number of machines, states, guards and actions, and of transitions of each kind.
fn counts(library: &Library) -> ([usize; 4], BTreeMap<&'static str, usize>) {
    let machines = library.services().map(|service| service.behaviour.len());
    let (states, transitions) = (states(library), transitions(library));
    let mut kinds = BTreeMap::new();
    for transition in &transitions {
        let kind = match transition.kind {
            TransitionKind::Internal => "internal",
            TransitionKind::To(_) => "to",
            TransitionKind::Again => "again",
            TransitionKind::Push(_) => "push",
            TransitionKind::Pop(_) => "pop",
        };
        *kinds.entry(kind).or_default() += 1;
    }
    let guards = transitions.iter().filter(|t| t.guard.is_some()).count();
    let effects = states
        .iter()
        .map(|state| state.entry.len() + state.exit.len());
    let actions = transitions.iter().map(|t| t.actions.len());
    let actions = effects.chain(actions).sum();
    ([machines.sum(), states.len(), guards, actions], kinds)
}

#[test]
fn every_published_machine_is_read_whole() {
    let Some(jts) = corpus(&["jts", "jts-examples"]) else {
        return;
    };
    let (ffi, fkie) = (corpus(&["ffi"]), corpus(&["fkie"]));
    let (ffi, fkie) = (ffi.expect("is there"), fkie.expect("is there"));
    let kinds = |kinds: &[(&'static str, usize)]| kinds.iter().copied().collect();
    assert_eq!(
        counts(&ffi.library),
        (
            [152, 839, 180, 502],
            kinds(&[("internal", 426), ("pop", 2), ("push", 2), ("to", 11)])
        )
    );
    let (jts, fkie) = (counts(&jts.library), counts(&fkie.library));
    let (ffi, _) = counts(&ffi.library);
    let whole: Vec<_> = (0..4).map(|i| jts.0[i] + fkie.0[i] + ffi[i]).collect();
    // Three more states and transitions are drawings of an editor.
    assert_eq!(whole, [413, 1873 - 3, 691, 1996]);
    let transitions: usize = jts.1.values().chain(fkie.1.values()).sum();
    assert_eq!(transitions + 441, 1739 - 3);
}

#[test]
fn every_published_guard_reads_back_as_it_is_shown() {
    let Some(loaded) = corpus(&["jts", "ffi", "fkie", "jts-examples"]) else {
        return;
    };
    let mut guards = 0;
    for guard in transitions(&loaded.library)
        .iter()
        .filter_map(|t| t.guard.as_ref())
    {
        assert_eq!(Guard::parse(&guard.to_string()).as_ref(), Ok(guard));
        guards += 1;
    }
    assert!(guards > 300, "{guards}");
}

/// An inheriting service could not correct them.
#[test]
fn published_states_without_a_usable_initial_state_are_warned_of() {
    let Some(loaded) = corpus(&["fkie"]) else {
        return;
    };
    let warnings = loaded.diagnostics.warnings();
    let initial = warnings.filter(|d| d.message.contains("`initial_state`"));
    let (missing, named): (Vec<_>, Vec<_>) =
        initial.partition(|d| d.message.contains("no `initial_state`"));
    let (wrong, other): (Vec<_>, Vec<_>) = named
        .into_iter()
        .partition(|d| d.message.contains("does not exist"));
    assert_eq!((missing.len(), wrong.len(), other.len()), (5, 22, 41));
}

/// The state and the replies after a message, if exactly the guards in `holds` are true.
fn step(machine: &Machine<'_>, from: &str, message: &str, holds: &[&str]) -> (String, String) {
    let from = machine
        .find(&Name::parse(from).expect("a path"))
        .expect("a state");
    let mut ask = |question: &Guard| {
        let Guard::Call(call) = question else {
            return false;
        };
        holds.contains(&call.name.last())
    };
    let reaction = machine.reaction(from, Stimulus::received(message), &mut ask);
    let Some(reaction) = reaction else {
        return (String::new(), String::new());
    };
    let target = machine.target(from, reaction.item);
    let target = target.map_or("(back)".into(), |target| {
        machine.state(target).path.parts()[2..].join(".")
    });
    let sends = reaction
        .item
        .actions
        .iter()
        .filter(|action| action.sent().is_some());
    let texts = sends.flat_map(|action| action.arguments.iter().filter_map(|a| a.text()));
    (target, texts.collect::<Vec<_>>().join(" "))
}

#[test]
fn the_published_management_answers_with_all_its_bases() {
    let Some(loaded) = corpus(&["jts"]) else {
        return;
    };
    let mut versions = loaded.library.versions("urn:jaus:jss:core:Management");
    let service = versions
        .find(|service| service.id.version.minor == 1)
        .expect("1.1 is there");
    let machines = loaded.library.machines(service);
    let names: Vec<_> = machines.iter().map(|m| m.name().to_string()).collect();
    assert_eq!(
        names,
        ["accessControl.events.transport.ReceiveFSM", "SendFSM"]
    );
    let machine = &machines[0];
    let start = &machine.state(machine.start()).path;
    assert_eq!(
        start.to_string(),
        "Receiving.Ready.NotControlled.Available.Standby"
    );
    let leaves = machine
        .states()
        .filter(|(_, state)| state.children.is_empty());
    let leaves: Vec<_> = leaves.map(|(_, s)| s.path.parts()[2..].join(".")).collect();
    assert_eq!(
        leaves,
        [
            "NotControlled.Available.Standby",
            "NotControlled.NotAvailable.Init",
            "NotControlled.NotAvailable.Failure",
            "NotControlled.NotAvailable.Shutdown",
            "NotControlled.NotAvailable.Emergency",
            "Controlled.Available.Standby",
            "Controlled.Available.Ready",
            "Controlled.NotAvailable.Emergency",
        ]
    );
    let free = "Receiving.Ready.NotControlled.Available.Standby";
    let held = "Receiving.Ready.Controlled.Available.Standby";
    let emergency = "Receiving.Ready.Controlled.NotAvailable.Emergency";
    let client = ["isControllingClient"];
    let cases: [(&str, &str, &[&str], &str, &str); 9] = [
        (
            free,
            "RequestControl",
            &[],
            "Controlled.Available.Standby",
            "ConfirmControl CONTROL_ACCEPTED",
        ),
        (
            free,
            "RequestControl",
            &["isDefaultAuthorityGreater"],
            "NotControlled.Available.Standby",
            "ConfirmControl INSUFFICIENT_AUTHORITY",
        ),
        (
            free,
            "QueryControl",
            &[],
            "NotControlled.Available.Standby",
            "ReportControl",
        ),
        (
            free,
            "QueryStatus",
            &[],
            "NotControlled.Available.Standby",
            "ReportStatus",
        ),
        (free, "Resume", &client, "", ""),
        (held, "Resume", &client, "Controlled.Available.Ready", ""),
        (
            held,
            "SetEmergency",
            &[],
            "Controlled.NotAvailable.Emergency",
            "",
        ),
        (emergency, "ClearEmergency", &["isIDStored"], "(back)", ""),
        (
            emergency,
            "QueryEvents",
            &[],
            "Controlled.NotAvailable.Emergency",
            "ReportEvents",
        ),
    ];
    for (from, message, holds, to, sent) in cases {
        let (target, answer) = step(machine, from, message, holds);
        assert_eq!(
            (target.as_str(), answer.as_str()),
            (to, sent),
            "{message} in {from}"
        );
    }
}

/// Our machines match the library's services: after an emergency nothing moves by itself, and
/// control cannot be released during an emergency.
#[test]
fn our_management_differs_from_the_published_one_where_it_says_so() {
    let mut loader = Loader::new();
    loader.catalogue();
    let loaded = loader.load();
    assert!(loaded.diagnostics.is_empty(), "{}", loaded.diagnostics);
    let versions = loaded.library.versions("urn:jaus:jss:core:Management");
    let service = versions.last().expect("1.1 is there");
    let machines = loaded.library.machines(service);
    let machine = &machines[0];
    let path = |rest: &str| format!("Receiving.Ready.{rest}");
    let client = ["isControllingClient"];
    let cases: [(&str, &str, &[&str], &str, &str); 12] = [
        (
            "NotControlled.Available.Standby",
            "RequestControl",
            &[],
            "Controlled.Available.Standby",
            "ConfirmControl CONTROL_ACCEPTED",
        ),
        (
            "NotControlled.NotAvailable.Init",
            "RequestControl",
            &[],
            "NotControlled.NotAvailable.Init",
            "ConfirmControl NOT_AVAILABLE",
        ),
        (
            "NotControlled.Available.Standby",
            "SetEmergency",
            &[],
            "NotControlled.NotAvailable.Emergency",
            "",
        ),
        (
            "NotControlled.NotAvailable.Emergency",
            "ReleaseControl",
            &[],
            "NotControlled.NotAvailable.Emergency",
            "RejectControl NOT_AVAILABLE",
        ),
        (
            "NotControlled.NotAvailable.Emergency",
            "ClearEmergency",
            &["isIDStored", "isLastID"],
            "(back)",
            "",
        ),
        (
            "Controlled.Available.Ready",
            "SetEmergency",
            &[],
            "Controlled.NotAvailable.Emergency",
            "",
        ),
        (
            "Controlled.NotAvailable.Emergency",
            "ClearEmergency",
            &["isIDStored", "isLastID"],
            "Controlled.Available.Standby",
            "",
        ),
        (
            "Controlled.NotAvailable.Emergency",
            "ReleaseControl",
            &client,
            "Controlled.NotAvailable.Emergency",
            "RejectControl NOT_AVAILABLE",
        ),
        (
            "Controlled.Available.Ready",
            "ReleaseControl",
            &client,
            "NotControlled.Available.Standby",
            "RejectControl CONTROL_RELEASED",
        ),
        (
            "Controlled.Available.Ready",
            "Reset",
            &client,
            "NotControlled.Available.Standby",
            "RejectControl CONTROL_RELEASED",
        ),
        (
            "Controlled.Available.Ready",
            "QueryStatus",
            &[],
            "Controlled.Available.Ready",
            "ReportStatus",
        ),
        (
            "Controlled.Available.Ready",
            "CreateEvent",
            &["isSupported"],
            "Controlled.Available.Ready",
            "ConfirmEventRequest",
        ),
    ];
    for (from, message, holds, to, sent) in cases {
        let (target, answer) = step(machine, &path(from), message, holds);
        assert_eq!(
            (target.as_str(), answer.as_str()),
            (to, sent),
            "{message} in {from}"
        );
    }
}

const BASE: &str = r#"<service_def xmlns="urn:jaus:jsidl:1.1" name="Base" id="urn:base" version="1.0">
<message_set><input_set/><output_set/></message_set>
<protocol_behavior is_stateless="false">
<start state_machine_name="FSM" state_name="On"/>
<state_machine name="FSM"><state name="On" initial_state="Idle">
<state name="Idle"><entry><action name="rest"/></entry>
<transition name="Receive"><parameter type="Go" value="msg"/><parameter type="Receive.Body.ReceiveRec" value="data"/><guard condition="may( msg ) &amp;&amp; ! late('x')"/><simple><end_state state="On.Busy"/></simple><action name="Send"><argument value=" 'Gone' "/><argument value="data"/></action></transition></state>
<state name="Busy"><exit><action name="stop"/></exit></state>
<default_state><transition name="Receive"><parameter type="Ask" value="msg"/><simple/><action name="Send"><argument value="'Told'"/></action></transition></default_state>
</state></state_machine></protocol_behavior></service_def>"#;

const HEIR: &str = r#"<service_def xmlns="urn:jaus:jsidl:1.1" name="Heir" id="urn:heir" version="1.0">
<references><inherits_from name="base" id="urn:base" version="1.0"/></references>
<message_set><input_set/><output_set/></message_set>
<protocol_behavior>
<start state_machine_name="base.FSM" state_name="On.Busy"/>
<state_machine name="base.FSM"><state name="On"><state name="Busy"><state name="Deep">
<transition name="base.Receive"><parameter type="Stop" value="msg"/><pop/></transition></state>
<default_state><transition name="base.Receive"><parameter type="Ask" value="msg"/><internal/></transition></default_state>
</state><transition name="base.Receive"><parameter type="Go" value="msg"/><push><end_state state="on.idle"/></push></transition></state></state_machine></protocol_behavior></service_def>"#;

fn load(texts: &[&str]) -> Loaded {
    let mut loader = Loader::new();
    for (position, text) in texts.iter().enumerate() {
        loader.text(format!("{position}.xml"), text);
    }
    loader.load()
}

fn findings(texts: &[&str], severity: Severity) -> Vec<String> {
    let loaded = load(texts);
    let found = loaded.diagnostics.iter().filter(|d| d.severity == severity);
    found.map(ToString::to_string).collect()
}

#[test]
fn an_heir_extends_its_base_and_its_transitions_come_first() {
    let loaded = load(&[BASE, HEIR]);
    let heir = loaded.library.versions("urn:heir").next().expect("sound");
    let machines = loaded.library.machines(heir);
    let [machine] = machines.as_slice() else {
        panic!("{} machines", machines.len());
    };
    let path = |index| machine.state(index).path.to_string();
    assert_eq!(path(machine.start()), "On.Busy.Deep");
    let on = machine
        .find(&Name::parse("On").expect("a name"))
        .expect("there");
    assert_eq!(path(machine.leaf(on)), "On.Idle");

    let names = |state: &str, message: &str| -> Vec<String> {
        let state = machine
            .find(&Name::parse(state).expect("a name"))
            .expect("there");
        let found = machine.candidates(state, Stimulus::received(message));
        found.iter().map(|d| d.service.name.clone()).collect()
    };
    assert_eq!(names("On.Idle", "Go"), ["Heir", "Base"]);
    assert_eq!(names("On.Busy.Deep", "Ask"), ["Heir", "Base"]);
    assert_eq!(names("On.Idle", "Ask"), ["Base"]);
    assert_eq!(names("On.Busy.Deep", "Stop"), ["Heir"]);
    assert!(names("On.Idle", "Stop").is_empty());
}

#[test]
fn what_is_wrong_in_a_machine_is_reported_and_leaves_the_service_as_it_is() {
    assert_eq!(
        findings(&[BASE, HEIR], Severity::Warning),
        [
            "1.xml:6:1: warning: `base.FSM` starts in `On.Busy.Deep`, but the machine it extends starts in `On.Idle`: start there, or in one of its inner states",
            "1.xml:6:49: warning: the state `On.Busy` has inner states, but no `initial_state`: `Deep` is assumed",
            "1.xml:9:9: warning: the `end_state` `on.idle` is spelled `On.Idle` elsewhere",
            "1.xml:9:9: warning: nothing returns from `on.idle` after this `push`: add a transition with a `pop` to that state, or make this one `simple`",
        ]
    );
    let cases = [
        (
            "On.Busy\"/></simple>",
            "On.Lost\"/></simple>",
            "0.xml:7:1: error: the `end_state` `On.Lost` is not a state of `FSM`: add the state, or name one by its full path",
        ),
        (
            "state_name=\"On\"",
            "state_name=\"Off\"",
            "0.xml:5:1: error: the start `Off` is not a state of `FSM`: add the state, or name one by its full path",
        ),
        (
            "may( msg )",
            "may( msg",
            "0.xml:7:136: error: `condition` must be made of calls, `!`, `&&` and `||`: `&& ! late('x')` is not recognised",
        ),
        (
            "\"'Told'\"",
            "\"'Told\"",
            "0.xml:9:124: error: `value` must be a parameter's name or a text in `'`: `'Told` is not recognised",
        ),
        (
            "<simple/>",
            "",
            "0.xml:9:16: error: `transition` lacks its target: add `internal`, `simple`, `push` or `pop`",
        ),
        (
            "<simple/>",
            "<push/>",
            "0.xml:9:78: error: `push` lacks the element `end_state`: add it",
        ),
        (
            "<start state_machine_name=\"FSM\"",
            "<start state_machine_name=\"Other\"",
            "0.xml:4:1: error: there is no `state_machine` named `Other` to start: add it, or correct `state_machine_name`",
        ),
        (
            "name=\"Busy\"",
            "name=\"IDLE\"",
            "0.xml:8:1: error: there are two states `IDLE`: rename one\n  0.xml:6:1: note: the other one",
        ),
    ];
    for (from, to, expected) in cases {
        let loaded = load(&[&BASE.replacen(from, to, 1)]);
        let found: Vec<_> = loaded.diagnostics.iter().map(ToString::to_string).collect();
        assert_eq!(found.first().map(String::as_str), Some(expected));
        let service = loaded.library.services().next().expect("the service stays");
        // A parsed machine is kept, because others extend it.
        let read = expected.contains("is not a state");
        assert_eq!(service.behaviour.is_empty(), !read);
    }
}

proptest! {
    #[test]
    fn no_change_of_a_definition_makes_the_reader_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), 0..4_u8), 1..6),
    ) {
        let mut text: Vec<char> = HEIR.chars().collect();
        for (at, other, what) in changes {
            let (at, other) = (at.index(text.len()), other.index(text.len()));
            match what {
                0 => drop(text.remove(at)),
                1 => text.swap(at, other),
                2 => text.insert(at, text[other]),
                _ => {
                    let end = (at + 30).min(text.len());
                    let copy = text[at..end].to_vec();
                    text.splice(other..other, copy);
                }
            }
        }
        let text: String = text.into_iter().collect();
        let loaded = load(&[BASE, &text]);
        for service in loaded.library.services() {
            for machine in loaded.library.machines(service) {
                for (index, _) in machine.states() {
                    let _ = machine.reaction(index, Stimulus::received("Go"), &mut |_| true);
                }
            }
        }
    }
}
