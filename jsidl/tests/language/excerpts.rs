//! Common mistakes and their complete error texts, with location, reason and remedy.

use std::path::Path;

use jsidl::{Loaded, Loader, Style};

fn shown(loaded: &Loaded) -> String {
    let excerpt = |finding| loaded.diagnostics.excerpt(finding, Style::default());
    loaded.diagnostics.iter().map(excerpt).collect()
}

#[track_caller]
fn check(text: &str, expected: &str) {
    let mut loader = Loader::new();
    loader.text("t.xml", text);
    assert_eq!(shown(&loader.load()).trim_end(), expected.trim());
}

#[test]
fn a_directory_without_services_is_shown() {
    let mut loader = Loader::new();
    let empty = Path::new(env!("CARGO_TARGET_TMPDIR")).join("no-services");
    let made = std::fs::create_dir_all(&empty);
    assert!(made.is_ok(), "{made:?}");
    loader.path(&empty);
    let text = shown(&loader.load());
    let (said, place) = text.split_once('\n').unwrap_or_default();
    assert_eq!(
        said,
        "error: this directory has no service definitions: their files end in `.xml`, `.csd` or \
         `.cjsidl`"
    );
    assert!(place.contains("no-services"), "{place}");
}

#[test]
fn a_duplicate_field_is_shown() {
    check(
        r#"<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<declared_type_set name="T">
<record name="R" optional="false">
<fixed_field name="A" optional="false" field_type="byte" field_units="one"/>
<fixed_field name="A" optional="false" field_type="byte" field_units="one"/>
</record>
</declared_type_set>
<message_set><input_set/><output_set/></message_set>
</service_def>"#,
        r#"
error: there are two members named `A`: rename one
 --> t.xml:5:1
  |
4 | <fixed_field name="A" optional="false" field_type="byte" field_units="one"/>
  | ------------ the other one
5 | <fixed_field name="A" optional="false" field_type="byte" field_units="one"/>
  | ^^^^^^^^^^^^
"#,
    );
}

#[test]
fn a_presence_vector_that_is_too_narrow_is_shown() {
    check(
        r#"<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<declared_type_set name="T">
<record name="R" optional="false">
<presence_vector field_type_unsigned="unsigned byte"/>
<fixed_field name="A0" optional="true" field_type="byte" field_units="one"/>
<fixed_field name="A1" optional="true" field_type="byte" field_units="one"/>
<fixed_field name="A2" optional="true" field_type="byte" field_units="one"/>
<fixed_field name="A3" optional="true" field_type="byte" field_units="one"/>
<fixed_field name="A4" optional="true" field_type="byte" field_units="one"/>
<fixed_field name="A5" optional="true" field_type="byte" field_units="one"/>
<fixed_field name="A6" optional="true" field_type="byte" field_units="one"/>
<fixed_field name="A7" optional="true" field_type="byte" field_units="one"/>
<fixed_field name="A8" optional="true" field_type="byte" field_units="one"/>
</record>
</declared_type_set>
<message_set><input_set/><output_set/></message_set>
</service_def>"#,
        r#"
error: the record `R` has 9 optional members, but its `presence_vector` has only 8 bits: use a wider `field_type_unsigned`
 --> t.xml:4:1
  |
4 | <presence_vector field_type_unsigned="unsigned byte"/>
  | ^^^^^^^^^^^^^^^^
"#,
    );
}

#[test]
fn a_type_that_does_not_exist_is_shown() {
    check(
        r#"<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<declared_type_set name="T">
<record name="R" optional="false">
<declared_fixed_field name="A" optional="false" declared_type_ref="Speeed"/>
</record>
</declared_type_set>
<message_set><input_set/><output_set/></message_set>
</service_def>"#,
        r#"
error: `Speeed` is not declared: declare it, or correct the name
 --> t.xml:4:68
  |
2 | <declared_type_set name="T">
  | ------------------ the type set searched for `Speeed`
3 | <record name="R" optional="false">
4 | <declared_fixed_field name="A" optional="false" declared_type_ref="Speeed"/>
  |                                                                    ^^^^^^
"#,
    );
}

#[test]
fn a_circle_of_references_is_shown() {
    check(
        r#"<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<declared_type_set name="T">
<sequence name="A" optional="false"><declared_sequence name="B" optional="false" declared_type_ref="B"/></sequence>
<sequence name="B" optional="false"><declared_sequence name="A" optional="false" declared_type_ref="A"/></sequence>
</declared_type_set>
<message_set><input_set/><output_set/></message_set>
</service_def>"#,
        r#"
error: `A` contains itself, which makes it infinite: break the cycle
 --> t.xml:4:101
  |
3 | <sequence name="A" optional="false"><declared_sequence name="B" optional="false" declared_type_ref="B"/></sequence>
  | --------- declared here
4 | <sequence name="B" optional="false"><declared_sequence name="A" optional="false" declared_type_ref="A"/></sequence>
  |                                                                                                     ^
"#,
    );
}

#[test]
fn a_text_that_is_not_xml_is_shown() {
    check(
        r#"hello"#,
        r#"
error: not well-formed XML: unknown token
 --> t.xml:1:1
  |
1 | hello
  | ^^^^^
"#,
    );
}

#[test]
fn an_end_state_that_does_not_exist_is_shown() {
    check(
        r#"<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<message_set><input_set/><output_set/></message_set>
<internal_events_set><event_def name="Go"><header name="H"/><body name="B"/><footer name="F"/></event_def></internal_events_set>
<protocol_behavior><start state_machine_name="FSM" state_name="On"/>
<state_machine name="FSM"><state name="On">
<transition name="Go"><simple><end_state state="Off"/></simple></transition>
</state></state_machine></protocol_behavior>
</service_def>"#,
        r#"
error: the `end_state` `Off` is not a state of `FSM`: add the state, or name one by its full path
 --> t.xml:6:1
  |
6 | <transition name="Go"><simple><end_state state="Off"/></simple></transition>
  | ^^^^^^^^^^^
"#,
    );
}

#[test]
fn a_guard_that_cannot_be_read_is_shown() {
    check(
        r#"<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<message_set><input_set/><output_set/></message_set>
<internal_events_set><event_def name="Go"><header name="H"/><body name="B"/><footer name="F"/></event_def></internal_events_set>
<protocol_behavior><start state_machine_name="FSM" state_name="On"/>
<state_machine name="FSM"><state name="On">
<transition name="Go"><guard condition="may( &amp;&amp; x"/><internal/></transition>
</state></state_machine></protocol_behavior>
</service_def>"#,
        r#"
error: `condition` must be made of calls, `!`, `&&` and `||`: `&& x` is not recognised
 --> t.xml:6:41
  |
6 | <transition name="Go"><guard condition="may( &amp;&amp; x"/><internal/></transition>
  |                                         ^^^^^^^^^^^^^^^^^
"#,
    );
}

#[test]
fn a_trigger_that_nobody_declares_is_shown() {
    check(
        r#"<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<message_set><input_set/><output_set/></message_set>
<internal_events_set><event_def name="Go"><header name="H"/><body name="B"/><footer name="F"/></event_def></internal_events_set>
<protocol_behavior><start state_machine_name="FSM" state_name="On"/>
<state_machine name="FSM"><state name="On">
<transition name="Goo"><internal/></transition>
</state></state_machine></protocol_behavior>
</service_def>"#,
        r#"
error: nothing triggers this transition: `Goo` is neither an event nor a message of the service or a service it inherits from: declare it in the `internal_events_set`, or correct the name
 --> t.xml:6:1
  |
6 | <transition name="Goo"><internal/></transition>
  | ^^^^^^^^^^^
"#,
    );
}

#[test]
fn a_start_that_does_not_exist_is_shown() {
    check(
        r#"<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<message_set><input_set/><output_set/></message_set>
<internal_events_set><event_def name="Go"><header name="H"/><body name="B"/><footer name="F"/></event_def></internal_events_set>
<protocol_behavior><start state_machine_name="FSM" state_name="Off"/>
<state_machine name="FSM"><state name="On">
<transition name="Go"><internal/></transition>
</state></state_machine></protocol_behavior>
</service_def>"#,
        r#"
error: the start `Off` is not a state of `FSM`: add the state, or name one by its full path
 --> t.xml:5:1
  |
5 | <state_machine name="FSM"><state name="On">
  | ^^^^^^^^^^^^^^
"#,
    );
}
