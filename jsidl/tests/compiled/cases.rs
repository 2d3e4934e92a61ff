//! Definitions whose code did not compile, or took too much time or memory.

use jsidl::build::Build;
use jsidl::model::Service;
use jsidl::rust::Settings;

use crate::{emitted, rustc};

const HEADER: &str = r#"<header name="Header"><record name="HeaderRec" optional="false"><fixed_field name="MessageID" optional="false" field_type="unsigned short integer" field_units="one"/></record></header>"#;

/// A service with these messages and this behaviour.
fn service(messages: &str, behaviour: &str) -> String {
    format!(
        r#"<service_def name="Case" id="urn:example:Case" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<description/><assumptions/><message_set><input_set>{messages}</input_set><output_set/></message_set>{behaviour}
</service_def>"#
    )
}

/// A message with these fields.
fn message(name: &str, code: u16, fields: &str) -> String {
    format!(
        r#"<message_def name="{name}" message_id="{code:04X}" is_command="false"><description/>{HEADER}
<body name="Body"><record name="BodyRec" optional="false">{fields}</record></body><footer name="Footer"/></message_def>"#
    )
}

/// The module of a service with one message.
fn module_of(fields: &str) -> String {
    emitted(&[service(&message("Sample", 0xD001, fields), "")])
}

fn assert_compiles(module: &str) {
    if let Err(errors) = rustc::check(&[module.to_owned()]) {
        panic!("{errors}\n{module}");
    }
}

fn scaled(name: &str) -> String {
    format!(
        r#"<fixed_field name="{name}" optional="false" field_type="unsigned byte" field_units="meter"><scale_range real_lower_limit="0" real_upper_limit="1" integer_function="round"/></fixed_field>"#
    )
}

#[test]
fn a_getter_may_have_the_name_of_another_fields_setter() {
    for order in [["Speed", "SetSpeed"], ["SetSpeed", "Speed"]] {
        let module = module_of(&order.map(scaled).concat());
        assert_compiles(&module);
        assert!(module.contains("=> speed_m"), "{module}");
    }
}

#[test]
fn a_sub_field_may_have_the_name_of_anothers_replacement() {
    let sub_field = |name: &str, bit: u8| {
        format!(
            r#"<sub_field name="{name}"><bit_range from_index="{bit}" to_index="{bit}"/><value_set offset_to_lower_limit="false"><value_range lower_limit="0" lower_limit_type="inclusive" upper_limit="1" upper_limit_type="inclusive" interpretation=""/></value_set></sub_field>"#
        )
    };
    let fields = [sub_field("A", 0), sub_field("WithA", 1)].concat();
    let module = module_of(&format!(
        r#"<bit_field name="Bits" optional="false" field_type_unsigned="unsigned byte">{fields}</bit_field>"#
    ));
    assert_compiles(&module);
}

fn array(number: &str, sizes: &[u32]) -> String {
    let dimensions = sizes.iter().enumerate();
    let dimensions: String = dimensions
        .map(|(place, size)| format!(r#"<dimension name="D{place}" size="{size}"/>"#))
        .collect();
    format!(
        r#"<array name="Values" optional="false"><fixed_field name="Value" optional="false" field_type="{number}" field_units="one"/>{dimensions}</array>"#
    )
}

#[test]
fn an_array_of_long_arrays_compiles() {
    for sizes in [&[2, 40][..], &[40, 2], &[40, 40], &[3, 3, 100]] {
        assert_compiles(&module_of(&array("unsigned byte", sizes)));
    }
}

#[test]
fn an_array_of_more_than_a_kilobyte_is_on_the_heap() {
    let module = module_of(&array("long float", &[131_072]));
    assert!(
        module.contains("codec::LargeArray<f64, 131072>"),
        "{module}"
    );
    assert_compiles(&module);
    let module = module_of(&array("long float", &[4, 1000]));
    assert!(
        module.contains("[codec::LargeArray<f64, 1000>; 4]"),
        "{module}"
    );
    assert_compiles(&module);
    let module = module_of(&array("long float", &[128]));
    assert!(module.contains("[f64; 128]"), "{module}");
}

#[test]
fn text_that_reverses_its_direction_is_no_part_of_the_code() {
    let field = |text: &str| {
        format!(
            r#"<fixed_field name="Value" optional="false" field_type="unsigned byte" field_units="one" interpretation="{text}"/>"#
        )
    };
    let module = module_of(&field(
        "turned \u{202E}round\u{202C} and \u{2066}isolated\u{2069}",
    ));
    assert!(module.contains("turned round and isolated"), "{module}");
    assert_compiles(&module);
}

#[test]
fn the_module_of_a_version_differs_from_the_modules_of_messages() {
    let version = |minor: u8, field: &str| {
        let messages = message("V1_0", 0xD001, &scaled(field));
        service(&messages, "").replace(r#"version="1.0""#, &format!(r#"version="1.{minor}""#))
    };
    assert_compiles(&emitted(&[version(0, "Old"), version(1, "New")]));
}

#[test]
fn the_largest_minimum_count_is_no_overflow() {
    let list = |inner: &str| {
        format!(
            r#"<list name="Items" optional="false"><count_field min_count="18446744073709551615" max_count="18446744073709551615" field_type_unsigned="unsigned long integer"/>{inner}</list>"#
        )
    };
    let record = format!(
        r#"<record name="ItemRec" optional="false">{}</record>"#,
        scaled("X")
    );
    let body = list(&list(&record));
    let text = service(&message("Sample", 0xD001, ""), "").replace(
        r#"<record name="BodyRec" optional="false"></record>"#,
        &body,
    );
    assert_compiles(&emitted(&[text]));
}

/// A machine with states in one state, which has all transitions.
fn machine(states: usize, events: usize) -> String {
    let states: String = (0..states)
        .map(|state| format!(r#"<state name="S{state}"/>"#))
        .collect();
    let transitions: String = (0..events)
        .map(|event| {
            format!(
                r#"<transition name="Event{event}"><simple><end_state state="Top.S1"/></simple><action name="act{event}"/></transition>"#
            )
        })
        .collect();
    format!(
        r#"<internal_events_set/><protocol_behavior is_stateless="false"><start state_machine_name="ReceiveFSM" state_name="Top"/><state_machine name="ReceiveFSM"><state name="Top" initial_state="S0">{states}{transitions}</state></state_machine></protocol_behavior>"#
    )
}

#[test]
fn a_machine_with_too_many_reactions_is_refused_by_the_compiler() {
    let module = emitted(&[service("", &machine(400, 2000))]);
    assert!(module.contains("compile_error!"), "{module}");
    assert!(module.len() < 1 << 20, "{}", module.len());
}

#[test]
fn a_machine_without_actions_compiles() {
    let message = message("Sample", 0xD001, &plain("A", false));
    let machine = |guard: &str| {
        format!(
            r#"<protocol_behavior is_stateless="false"><start state_machine_name="ReceiveFSM" state_name="S0"/><state_machine name="ReceiveFSM"><state name="S0"><transition name="Receive"><parameter type="Sample" value="msg"/>{guard}<internal/></transition></state></state_machine></protocol_behavior>"#
        )
    };
    let guard = |condition: &str| format!(r#"<guard condition="{condition}"/>"#);
    for guard in [
        "",
        &guard("isSound(msg)"),
        &guard("isControllingClient(msg)"),
    ] {
        assert_compiles(&emitted(&[service(&message, &machine(guard))]));
    }
}

#[test]
fn an_older_machine_may_have_no_transitions() {
    let messages = message("Sample", 0xD001, &plain("A", false));
    let version = |minor: u8, transition: &str| {
        let machine = format!(
            r#"<protocol_behavior is_stateless="false"><start state_machine_name="ReceiveFSM" state_name="S0"/><state_machine name="ReceiveFSM"><state name="S0">{transition}</state></state_machine></protocol_behavior>"#
        );
        service(&messages, &machine).replace(r#"version="1.0""#, &format!(r#"version="1.{minor}""#))
    };
    let transition = r#"<transition name="Receive"><parameter type="Sample" value="msg"/><internal/></transition>"#;
    for transitions in [["", transition], [transition, ""], ["", ""]] {
        let [old, new] = transitions;
        assert_compiles(&emitted(&[version(0, old), version(1, new)]));
    }
}

#[test]
fn a_guard_may_have_the_name_of_a_message_that_is_a_keyword() {
    let messages =
        message("Sample", 0xD001, &plain("A", false)) + &message("fn", 0xD002, &plain("A", false));
    let machine = r#"<protocol_behavior is_stateless="false"><start state_machine_name="ReceiveFSM" state_name="S0"/><state_machine name="ReceiveFSM"><state name="S0"><transition name="Receive"><parameter type="Sample" value="msg"/><guard condition="fn(msg)"/><internal/></transition></state></state_machine></protocol_behavior>"#;
    assert_compiles(&emitted(&[service(&messages, machine)]));
}

#[test]
fn the_code_of_a_large_machine_grows_with_its_reactions() {
    let length = |events| emitted(&[service("", &machine(60, events))]).len();
    let (one, four) = (length(100), length(400));
    assert!(four < 5 * one, "{one} {four}");
}

/// A service that reacts to a message of Management.
const DERIVED: &str = r#"<service_def name="Case" id="urn:example:Case" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<description/><assumptions/>
<references><inherits_from name="management" id="urn:jaus:jss:core:Management" version="1.1"/></references>
<message_set><input_set/><output_set/></message_set><internal_events_set/>
<protocol_behavior is_stateless="false"><start state_machine_name="management.accessControl.events.transport.ReceiveFSM" state_name="Receiving"/>
<state_machine name="management.accessControl.events.transport.ReceiveFSM"><state name="Receiving" initial_state="Ready"><state name="Ready">
<transition name="Receive"><parameter type="Standby" value="msg"/><internal/><action name="rest"><argument value="msg"/></action></transition>
</state></state></state_machine></protocol_behavior></service_def>"#;

#[test]
fn a_message_of_another_module_has_its_type_if_the_path_of_that_is_known() {
    let mut loader = jsidl::Loader::new();
    loader.catalogue().text("case.xml", DERIVED);
    let loaded = loader.load();
    let errors = loaded.diagnostics.to_string();
    assert!(!errors.contains("error: "), "{errors}");
    let module = |urn: &str, settings: &Settings| {
        let services = loaded.library.services().map(AsRef::as_ref);
        let chosen = services.filter(|it: &&Service| it.id.urn.starts_with(urn));
        jsidl::rust::module_with(&loaded.library, chosen, settings)
    };
    let plain = Settings::new("::jaus_codec");
    let octets = module("urn:example:", &plain);
    assert!(
        octets.contains("fn rest(&mut self, message: &[u8]"),
        "{octets}"
    );
    let core = module("urn:jaus:jss:core:", &plain);
    let typed = plain.extern_path("urn:jaus:jss:core:", "crate::case_0");
    let typed = module("urn:example:", &typed);
    assert!(
        typed.contains("fn rest(&mut self, message: &crate::case_0::v1_0::Standby"),
        "{typed}"
    );
    if let Err(errors) = rustc::check(&[core, typed]) {
        panic!("{errors}");
    }
}

#[test]
fn client_services_compile_with_their_messages() {
    let names = [
        "EventsClient",
        "AccessControlClient",
        "ManagementClient",
        "ListManagerClient",
        "DiscoveryClient",
    ];
    let build = Build::new().runtime("::jaus_codec");
    let build = names.into_iter().fold(build, |build, name| {
        build.module("clients", &format!("urn:jaus:jss:core:{name}"))
    });
    let (mut files, diagnostics) = build.generate();
    assert_eq!(diagnostics.to_string(), "");
    assert_compiles(&files.remove(0).1);
}

/// Messages of one service in two versions, the newer with these fields.
fn two_versions(old: &str, new: &str) -> String {
    let version = |minor: u8, fields: &str| {
        let body = format!(
            r#"<record name="BodyRec" optional="false"><presence_vector field_type_unsigned="unsigned byte"/>{fields}</record>"#
        );
        let message = message("Sample", 0xD001, "").replace(
            r#"<record name="BodyRec" optional="false"></record>"#,
            &body,
        );
        service(&message, "").replace(r#"version="1.0""#, &format!(r#"version="1.{minor}""#))
    };
    emitted(&[version(0, old), version(1, new)])
}

fn plain(name: &str, optional: bool) -> String {
    format!(
        r#"<fixed_field name="{name}" optional="{optional}" field_type="unsigned byte" field_units="one"/>"#
    )
}

#[test]
fn an_older_layout_converts_to_a_newer_one_that_only_adds_optional_fields() {
    let old = plain("A", true) + &plain("B", false) + &scaled("C");
    let added = old.clone() + &plain("D", true);
    let module = two_versions(&old, &added);
    assert!(
        module.contains("impl From<v1_0::Sample> for Sample"),
        "{module}"
    );
    assert_compiles(&module);
    let is_lost = plain("A", true) + &plain("D", true);
    let is_missing = old.clone() + &plain("D", false);
    for new in [is_lost, is_missing] {
        let module = two_versions(&old, &new);
        assert!(!module.contains("impl From"), "{module}");
        assert_compiles(&module);
    }
}

#[test]
fn a_name_in_the_module_of_a_version_keeps_its_meaning_if_a_version_is_added() {
    let old = plain("A", true) + &plain("B", false);
    let module = two_versions(&old, &(old.clone() + &plain("C", true)));
    let only_old = emitted(&[service(&message("Sample", 0xD001, &plain("B", false)), "")]);
    for module in [module, only_old] {
        let uses = format!("{module}\npub type Pinned = v1_0::Sample;\n");
        assert_compiles(&uses);
    }
}

#[test]
fn a_deprecated_message_says_so() {
    let message = message("Sample", 0xD001, &plain("A", false)).replace(
        r#"is_command="false""#,
        r#"is_command="false" deprecated="true""#,
    );
    let module = emitted(&[service(&message, "")]);
    assert!(module.contains("/// Deprecated: "), "{module}");
    assert_compiles(&module);
    let errors = rustc::check(&[format!("{module}\npub type Used = v1_0::Sample;\n")]);
    let errors = errors.expect_err("the compiler warns");
    assert!(errors.contains("use of deprecated struct"), "{errors}");
    let other = module_of(&plain("A", false));
    assert!(!other.to_lowercase().contains("deprecated"), "{other}");
}

#[test]
fn a_message_that_an_older_version_recommends_is_used_without_a_warning() {
    let version = |minor: u8, deprecated: bool| {
        let message = message("Sample", 0xD001, &plain("A", false)).replace(
            r#"is_command="false""#,
            &format!(r#"is_command="false" deprecated="{deprecated}""#),
        );
        service(&message, "").replace(r#"version="1.0""#, &format!(r#"version="1.{minor}""#))
    };
    let module = emitted(&[version(0, false), version(1, true)]);
    assert!(module.contains("/// Deprecated: "), "{module}");
    assert_compiles(&format!("{module}\npub type Used = Sample;\n"));
}

#[test]
fn a_floating_point_number_may_have_a_value_set() {
    let field = |number: &str| {
        format!(
            r#"<fixed_field name="{}" optional="false" field_type="{number}" field_units="meter"><value_set offset_to_lower_limit="false"><value_range lower_limit="-0.5" lower_limit_type="exclusive" upper_limit="1.5" upper_limit_type="inclusive" interpretation=""/><value_enum enum_index="-3" enum_const="Lost"/><value_enum enum_index="2" enum_const="Two"/></value_set></fixed_field>"#,
            number.replace(' ', "")
        )
    };
    let several = format!(
        r#"<array name="Values" optional="false">{}<dimension name="D" size="3"/></array>"#,
        field("float")
    );
    let module = module_of(&(field("float") + &field("long float") + &several));
    assert!(module.contains("above -0.5 to 1.5"), "{module}");
    assert_compiles(&module);
}

#[test]
fn scaled_fields_have_the_steps_of_a_builder() {
    let fields = scaled("X") + &scaled("Y") + &scaled("WithX") + &plain("Other", false);
    let module = module_of(&fields);
    let uses = format!(
        r#"{module}
/// A message.
pub fn built() -> Result<Sample, codec::OutOfRange> {{
    let sample = Sample {{ other: 1, ..Sample::default() }};
    sample.with_x_m(0.5)?.with_y_m(1.0)
}}
"#
    );
    assert_compiles(&uses);
}
