//! Differences between definitions: each kind, and whether it affects the wire format.

use jsidl::diff::compare;
use jsidl::{Library, Loader};

const BEFORE: &str = r#"<service_def name="Lights" id="urn:me:Lights" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<message_set><input_set>
<message_def name="SetLights" message_id="D001" is_command="true">
<header name="H"><record name="HR" optional="false"><fixed_field name="Code" optional="false" field_type="unsigned short integer" field_units="one"/></record></header>
<body name="B">
<record name="LightsRec" optional="false">
<presence_vector field_type_unsigned="unsigned byte"/>
<fixed_field name="Front" optional="true" field_type="unsigned byte" field_units="percent">
<scale_range real_lower_limit="0" real_upper_limit="100" integer_function="round"/>
</fixed_field>
<fixed_field name="Mode" optional="true" field_type="unsigned byte" field_units="one">
<value_set offset_to_lower_limit="false">
<value_enum enum_index="0" enum_const="Off"/><value_enum enum_index="1" enum_const="On"/>
</value_set>
</fixed_field>
<variable_length_string name="Label" optional="true"><count_field field_type_unsigned="unsigned byte" max_count="20"/></variable_length_string>
</record>
</body>
<footer name="F"/>
</message_def>
</input_set><output_set/></message_set>
</service_def>"#;

fn library(text: &str) -> Library {
    let mut loader = Loader::new();
    loader.text("t.xml", text);
    let loaded = loader.load();
    assert_eq!(loaded.diagnostics.to_string(), "");
    loaded.library
}

/// The changes, one per line.
fn changes(before: &str, after: &str) -> Vec<String> {
    let found = compare(&library(before), &library(after), |_| true);
    let line = |change: &jsidl::diff::Change| {
        let wire = if change.wire { "wire" } else { "same" };
        format!("{wire} {}: {change}", change.path.join("."))
    };
    found.iter().map(line).collect()
}

#[track_caller]
fn check(from: &str, to: &str, expected: &[&str]) {
    assert!(BEFORE.contains(from), "{from}");
    assert_eq!(changes(BEFORE, &BEFORE.replacen(from, to, 1)), expected);
}

#[test]
fn nothing_has_changed_in_the_same_definition() {
    assert!(changes(BEFORE, BEFORE).is_empty());
    let described = BEFORE.replace("name=\"B\"", "name=\"Body\" interpretation=\"All of it.\"");
    assert!(changes(BEFORE, &described).is_empty());
}

#[test]
fn names_and_limits_leave_the_wire_as_it_is() {
    check(
        "name=\"SetLights\"",
        "name=\"SwitchLights\"",
        &["same SwitchLights D001: the name is SwitchLights, was SetLights"],
    );
    check(
        "name=\"Front\"",
        "name=\"Head\"",
        &["same SetLights D001.LightsRec.Head: renamed, was `Front`"],
    );
    check(
        "max_count=\"20\"",
        "max_count=\"30\"",
        &["same SetLights D001.LightsRec.Label: the maximum count is 30, was 20"],
    );
    check(
        "is_command=\"true\"",
        "is_command=\"false\"",
        &["same SetLights D001: it is no longer a command: any client may send it"],
    );
    check(
        "enum_const=\"On\"/>",
        "enum_const=\"Bright\"/><value_enum enum_index=\"2\" enum_const=\"Blink\"/>",
        &[
            "same SetLights D001.LightsRec.Mode: the value 1 is `Bright`, was `On`",
            "same SetLights D001.LightsRec.Mode: the value 2 `Blink` was added",
        ],
    );
    check(
        "enum_const=\"On\"/>",
        "enum_const=\"On\"/><value_range lower_limit=\"1\" lower_limit_type=\"exclusive\" \
         upper_limit=\"9\" upper_limit_type=\"inclusive\"/>",
        &["same SetLights D001.LightsRec.Mode: the allowed range is above 1 to 9, was absent"],
    );
    check(
        "version=\"1.0\"",
        "version=\"1.1\"",
        &["same : the version is 1.1, was 1.0"],
    );
}

#[test]
fn types_scales_units_and_codes_affect_the_wire() {
    check(
        "message_id=\"D001\"",
        "message_id=\"D002\"",
        &["wire SetLights D002: the code is D002, was D001"],
    );
    check(
        "name=\"Front\" optional=\"true\" field_type=\"unsigned byte\"",
        "name=\"Front\" optional=\"true\" field_type=\"unsigned short integer\"",
        &[
            "wire SetLights D001.LightsRec.Front: the type is `unsigned short integer`, was `unsigned byte`",
        ],
    );
    check(
        "real_upper_limit=\"100\"",
        "real_upper_limit=\"1\"",
        &["wire SetLights D001.LightsRec.Front: the scale is 0 to 1, was 0 to 100"],
    );
    check(
        "field_units=\"percent\"",
        "field_units=\"one\"",
        &["wire SetLights D001.LightsRec.Front: the unit is `one`, was `percent`"],
    );
    check(
        "enum_index=\"1\"",
        "enum_index=\"2\"",
        &["wire SetLights D001.LightsRec.Mode: the index of the value `On` is 2, was 1"],
    );
    check(
        "field_type_unsigned=\"unsigned byte\"/>",
        "field_type_unsigned=\"unsigned integer\"/>",
        &[
            "wire SetLights D001.LightsRec: the presence vector is `unsigned integer`, was `unsigned byte`",
        ],
    );
}

#[test]
fn members_that_come_go_or_move_affect_the_wire() {
    check(
        "name=\"Front\" optional=\"true\"",
        "name=\"Front\" optional=\"false\"",
        &["wire SetLights D001.LightsRec.Front: it is no longer optional"],
    );
    check(
        "<fixed_field name=\"Mode\"",
        "<fixed_field name=\"Rear\" optional=\"true\" field_type=\"byte\" field_units=\"one\"/><fixed_field name=\"Mode\"",
        &["wire SetLights D001.LightsRec.Rear: the member was added"],
    );
    let gone = BEFORE.find("<variable_length_string").expect("is there");
    let end = BEFORE.find("</record>\n</body>").expect("is there");
    check(
        &BEFORE[gone..end],
        "",
        &["wire SetLights D001.LightsRec.Label: the member was removed"],
    );
    let (label, rest) = (&BEFORE[gone..end], BEFORE.replace(&BEFORE[gone..end], ""));
    let moved = rest.replacen(
        "<fixed_field name=\"Front\"",
        &format!("{label}<fixed_field name=\"Front\""),
        1,
    );
    assert_eq!(
        changes(BEFORE, &moved),
        [
            "wire SetLights D001.LightsRec: the order of the members changed: `Label`, `Front`, `Mode`"
        ]
    );
}

#[test]
fn messages_and_services_that_go_affect_the_wire_and_new_ones_do_not() {
    let start = BEFORE.find("<message_def").expect("is there");
    let end = BEFORE.find("</input_set>").expect("is there");
    let message = &BEFORE[start..end];
    let none = BEFORE.replace(message, "");
    assert_eq!(
        changes(BEFORE, &none),
        ["wire SetLights D001: the message was removed: the service no longer receives it"]
    );
    assert_eq!(
        changes(&none, BEFORE),
        ["same SetLights D001: the message was added: the service receives it"]
    );
    let sent = none.replace(
        "<output_set/>",
        &format!("<output_set>{message}</output_set>"),
    );
    assert_eq!(
        changes(BEFORE, &sent),
        ["wire SetLights D001: the service now sends it, and no longer receives it"]
    );
    let other = BEFORE.replace("urn:me:Lights", "urn:me:Lamps");
    assert_eq!(
        changes(BEFORE, &other),
        [
            "wire : the service was removed",
            "same : the service was added"
        ]
    );
}

#[test]
fn our_definitions_do_not_differ_from_themselves() {
    let mut loader = Loader::new();
    loader.catalogue();
    let library = loader.load().library;
    assert!(compare(&library, &library, |_| true).is_empty());
}

const MACHINE: &str = r#"<service_def name="Lamp" id="urn:me:Lamp" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<message_set><input_set/><output_set/></message_set>
<protocol_behavior><start state_machine_name="FSM" state_name="Off"/><state_machine name="FSM">
<state name="Off"><entry><action name="dim"/></entry>
<transition name="Switch"><guard condition="may()"/><simple><end_state state="On"/></simple></transition>
<transition name="Switch"><internal/><action name="refuse"><argument value="'Off'"/></action></transition>
</state>
<state name="On"/>
</state_machine></protocol_behavior></service_def>"#;

#[test]
fn a_change_of_behaviour_is_a_change_that_does_not_affect_the_wire() {
    let cases = [
        (
            "state_name=\"Off\"",
            "state_name=\"On\"",
            "same FSM: the start state is On, was Off",
        ),
        (
            "<state name=\"On\"/>",
            "<state name=\"On\"/><state name=\"Broken\"/>",
            "same FSM.Broken: the state was added",
        ),
        (
            "<action name=\"dim\"/>",
            "",
            "same FSM.Off: the list of actions on entry is nothing, was `dim()`",
        ),
        (
            "<simple><end_state state=\"On\"/></simple>",
            "<internal/>",
            "same FSM.Off.Switch [may()]: the target is the same state, without exit and entry, was `On`",
        ),
        (
            "'Off'",
            "'On'",
            "same FSM.Off.Switch: the list of actions is `refuse('On')`, was `refuse('Off')`",
        ),
    ];
    assert!(changes(MACHINE, MACHINE).is_empty());
    for (from, to, expected) in cases {
        assert_eq!(changes(MACHINE, &MACHINE.replacen(from, to, 1)), [expected]);
    }
    let unguarded = MACHINE.replacen(
        "<guard condition=\"may()\"/>",
        "<guard condition=\"must()\"/>",
        1,
    );
    assert_eq!(
        changes(MACHINE, &unguarded),
        [
            "same FSM.Off.Switch [may()]: the transition was removed",
            "same FSM.Off.Switch [must()]: the transition was added",
        ]
    );
}
