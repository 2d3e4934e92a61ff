//! Comparisons in guards are evaluated by the generated code.

use crate::{emitted, rustc};

/// A machine that goes to the state of the first guard that holds when `Moved` arrives.
fn machine(guards: &[(&str, &str)]) -> String {
    let transitions = guards.iter().map(|(guard, state)| {
        format!(
            r#"<transition name="Moved"><parameter type="unsigned int" value="n"/>
<parameter type="unsigned int" value="most"/><guard condition="{guard}"/><simple><end_state state="{state}"/></simple>
</transition>"#
        )
    });
    let transitions: String = transitions.collect();
    let states = guards
        .iter()
        .map(|(_, state)| format!(r#"<state name="{state}"/>"#));
    let states: String = states.collect();
    emitted(&[format!(
        r#"<service_def name="Case" id="urn:example:Case" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<description/><assumptions/><message_set><input_set/><output_set/></message_set>
<internal_events_set><event_def name="Moved"><description/><header name="Header"/><body name="Body"/>
<footer name="Footer"/></event_def></internal_events_set>
<protocol_behavior><start state_machine_name="M" state_name="Begin"/>
<state_machine name="M"><state name="Begin">{transitions}</state>{states}</state_machine></protocol_behavior>
</service_def>"#
    )])
}

/// Checks to which state the machine goes for each pair of numbers.
#[track_caller]
fn goes(guards: &[(&str, &str)], behaviour: &str, expected: &[(i64, i64, &str)]) {
    let module = machine(guards);
    let checks = expected.iter().map(|(n, most, state)| {
        format!(
            "let mut machine = Machine::at(State::Begin);
             machine.step(Event::Moved({n}, {most}), &mut Asked);
             assert_eq!(machine.state(), State::{state}, \"{n}, {most}\");\n"
        )
    });
    let checks: String = checks.collect();
    let main = format!(
        "use case::case::machine::{{Behaviour, Event, Machine, State}};
         struct Asked;
         impl Behaviour for Asked {{ {behaviour} }}
         fn main() {{\n{checks}}}\n"
    );
    if let Err(said) = rustc::execute(&module, &main) {
        panic!("{said}\n{module}");
    }
}

#[test]
fn comparisons_of_one_event_choose_by_the_value() {
    goes(
        &[("n == 0", "Zero"), ("n != 0", "Other")],
        "",
        &[(0, 9, "Zero"), (1, 9, "Other"), (-1, 9, "Other")],
    );
    goes(
        &[
            ("n &lt; most &amp;&amp; ! (n == -3)", "Below"),
            ("n &gt; most || 3 &lt; 2", "Above"),
            ("n == most", "There"),
        ],
        "",
        &[
            (1, 2, "Below"),
            (-3, 2, "Begin"),
            (3, 2, "Above"),
            (2, 2, "There"),
        ],
    );
}

#[test]
fn what_the_event_does_not_say_is_asked_of_the_service() {
    goes(
        &[("speed() &lt; 3 &amp;&amp; n &gt; 0", "Slow")],
        "fn speed_is_less_than_3(&self, _: i64, _: i64) -> bool { true }",
        &[(0, 0, "Begin"), (1, 0, "Slow")],
    );
}
