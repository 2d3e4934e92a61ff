//! Runs valid and invalid definitions written for another validator, if available.
//!
//! Most are fragments: the root is the element under test, which a template embeds in a definition.

use std::fs;
use std::path::{Path, PathBuf};

use jaus_test_kit::evidence;
use jsidl::{Diagnostic, Diagnostics, Loader};

/// The text before and after a fragment whose root is this element.
fn surroundings(element: &str) -> (&'static str, &'static str) {
    match element {
        "service_def" | "service_set" => ("", ""),
        "inherits_from" | "client_of" => ("<references>", "</references>"),
        "input_set" => ("<message_set>", "<output_set/></message_set>"),
        "internal_events_set" | "description" => ("", ""),
        "bit_range" => (
            "<declared_type_set name='T'><bit_field name='B' optional='false' field_type_unsigned='unsigned integer'><sub_field name='S'>",
            "<value_set><value_enum enum_index='0' enum_const='a'/></value_set></sub_field></bit_field></declared_type_set>",
        ),
        "scale_range" | "value_set" => (
            "<declared_type_set name='T'><fixed_field name='F' optional='false' field_type='unsigned integer' field_units='one'>",
            "</fixed_field></declared_type_set>",
        ),
        "value_range" => (
            "<declared_type_set name='T'><fixed_field name='F' optional='false' field_type='integer' field_units='one'><value_set>",
            "</value_set></fixed_field></declared_type_set>",
        ),
        "count_field" => (
            "<declared_type_set name='T'><variable_length_string name='S' optional='false'>",
            "</variable_length_string></declared_type_set>",
        ),
        "vtag_field" => (
            "<declared_type_set name='T'><variant name='V' optional='false'>",
            "</variant></declared_type_set>",
        ),
        "protocol_behavior" => ("", ""),
        "start" => (
            "<protocol_behavior>",
            "<state_machine name='FSM'><state name='Init'/></state_machine></protocol_behavior>",
        ),
        "state_machine" => ("<protocol_behavior>", "</protocol_behavior>"),
        "state" => (
            "<protocol_behavior><start state_machine_name='FSM' state_name='Idle'/><state_machine name='FSM'>",
            "</state_machine></protocol_behavior>",
        ),
        "transition" | "entry" | "exit" | "default_state" | "default_transition" => (
            "<protocol_behavior><start state_machine_name='FSM' state_name='Idle'/><state_machine name='FSM'><state name='Idle'>",
            "</state></state_machine></protocol_behavior>",
        ),
        "action" | "send_action" => (
            "<protocol_behavior><start state_machine_name='FSM' state_name='Idle'/><state_machine name='FSM'><state name='Idle'><entry>",
            "</entry></state></state_machine></protocol_behavior>",
        ),
        "simple" | "push" | "pop" | "internal" | "guard" => (
            "<protocol_behavior><start state_machine_name='FSM' state_name='Idle'/><state_machine name='FSM'><state name='Idle'><transition name='T'>",
            "</transition></state></state_machine></protocol_behavior>",
        ),
        "dimension" => (
            "<declared_type_set name='T'><array name='A' optional='false'>",
            "<fixed_field name='F' optional='false' field_type='byte' field_units='one'/></array></declared_type_set>",
        ),
        "format_field" => (
            "<declared_type_set name='T'><variable_format_field name='V' optional='false'>",
            "<count_field field_type_unsigned='unsigned integer'/></variable_format_field></declared_type_set>",
        ),
        _ => ("<declared_type_set name='T'>", "</declared_type_set>"),
    }
}

fn complete(text: &str) -> String {
    let fragment = match text.split_once("?>") {
        Some((_, rest)) if text.contains("<?xml") => rest,
        _ => text,
    };
    let document = roxmltree::Document::parse(fragment).expect("the cases are well-formed");
    let element = document.root_element().tag_name().name();
    let (before, after) = surroundings(element);
    if matches!(element, "service_def" | "service_set") {
        return fragment.to_owned();
    }
    let messages = if element == "input_set" {
        ""
    } else {
        "<message_set><input_set/><output_set/></message_set>"
    };
    format!(
        "<service_def name='S' id='urn:test:S' version='1.0' xmlns='urn:jaus:jsidl:1.0'>{before}{fragment}{after}{messages}</service_def>"
    )
}

/// The valid case that an invalid case inherits from.
fn base(file: &Path) -> Option<PathBuf> {
    let base = match file.file_stem()?.to_str()? {
        "ProtocolBehaviorTest2b" => "ProtocolBehaviorTest2a",
        "StateTest4" => "StateTest3",
        "TransitionTest2" => "TransitionTest1",
        _ => return None,
    };
    let folder = file.parent()?.parent()?.parent()?.join("valid/pbvalidator");
    Some(folder.join(base).with_extension("xml"))
}

fn findings(file: &Path) -> Diagnostics {
    let mut loader = Loader::new();
    for file in base(file).iter().map(PathBuf::as_path).chain([file]) {
        let text = fs::read_to_string(file).expect("the cases are UTF-8");
        loader.text(file, &complete(&text));
    }
    loader.load().diagnostics
}

fn cases(kind: &str, folder: &str) -> Vec<PathBuf> {
    let Some(cases) = evidence::outside("validator-cases") else {
        return Vec::new();
    };
    let folder = cases.join(kind).join(folder);
    let mut files: Vec<_> = fs::read_dir(folder)
        .expect("the folder exists")
        .map(|entry| entry.expect("readable").path())
        .filter(|path| path.is_file())
        .collect();
    files.sort();
    files
}

/// The cases that are whole sets of files, which refer to each other.
fn sets() -> Vec<PathBuf> {
    let Some(cases) = evidence::outside("validator-cases") else {
        return Vec::new();
    };
    let pbvalidator = "valid/pbvalidator/urn.jaus.jss.core.NoReferences";
    ["valid/core-fixed-declarations", pbvalidator]
        .map(|set| cases.join(set))
        .to_vec()
}

/// Whether a finding on a valid case is expected: this compiler is stricter on purpose, or the case
/// refers to files that are not loaded.
fn tolerated(finding: &Diagnostic) -> bool {
    let message = &finding.message;
    [
        // A message that does not start with its code cannot be told apart from others.
        "the header is empty",
        "the header does not start with the message code",
        // The standard does not say whether such a vector is on the wire.
        "has a `presence_vector` but no optional member",
        // The case stands alone, without the files that it refers to.
        "is not loaded",
        "is omitted from",
    ]
    .iter()
    .any(|known| message.contains(known))
}

/// Whether a finding is about a missing state, machine or start of a fragment on its own.
fn lonely(finding: &Diagnostic) -> bool {
    let message = &finding.message;
    ["is not a state of", "to start: add it", "has no `start`"]
        .iter()
        .any(|known| message.contains(known))
}

fn name(file: &Path) -> &str {
    let name = file.file_stem().and_then(|stem| stem.to_str());
    name.expect("a file has a name")
}

#[test]
fn valid_definitions_have_no_errors() {
    for folder in ["validator", "gui-test", "pbvalidator"] {
        for file in cases("valid", folder) {
            let found = findings(&file);
            let known = |finding: &&Diagnostic| {
                // Tests of a code generator name end states relative to the enclosing state; the
                // standard and all published definitions use full paths.
                let relative = folder == "gui-test" && name(&file).starts_with("FSM");
                tolerated(finding) || ((folder == "validator" || relative) && lonely(finding))
            };
            let errors: Vec<_> = found.errors().filter(|e| !known(e)).collect();
            assert!(errors.is_empty(), "{}: {errors:#?}", file.display());
        }
    }
}

#[test]
fn valid_sets_of_files_have_no_errors_beside_the_catalogue() {
    for set in sets() {
        let mut loader = Loader::new();
        loader.path(&set).catalogue();
        let found = loader.load().diagnostics;
        let errors: Vec<_> = found.errors().collect();
        assert!(errors.is_empty(), "{}: {errors:#?}", set.display());
    }
}

/// Invalid cases, and part of the expected error text.
const REJECTED: &[(&str, &str)] = &[
    ("Action1", "`Store In Sequence` cannot be a `name`"),
    (
        "ActionTest1",
        "`str2` is not a parameter of this transition",
    ),
    ("Array1", "`2Array1` cannot be a name"),
    (
        "Array3",
        "`temperature` is optional, but the element of an array",
    ),
    (
        "Array6",
        "`node_description` is optional, but the element of an array",
    ),
    (
        "Array8",
        "`QueryMessage` is optional, but the element of an array",
    ),
    ("BitField1", "belongs to `Milliseconds` already"),
    ("BitRange1", "range from 10 to 9"),
    (
        "Body2",
        "`HeaderRec` is optional, but the composite at the top",
    ),
    ("Body3", "`List2` is optional, but the composite at the top"),
    ("ClientOf1", "`2 WaypointDriver` cannot be a name"),
    ("CountField1", "`min_count` is -100"),
    ("DefaultState1", "the transition `Run` appears twice"),
    (
        "DefaultTransition4",
        "`default_transition` lacks its target",
    ),
    ("DefaultTransition5", "`msg` is not a text in `'`"),
    ("Dimension1", "`size` is -1"),
    ("EventDef1", "`10 Send` cannot be a name"),
    ("FSMTest4_a", "`transition` lacks its target"),
    ("FixedField1", "`orientation Rms` cannot be a name"),
    ("FixedField2", "a `scale_range` or a `value_set`, not both"),
    (
        "Footer5",
        "`GlobalPose` is optional, but the composite at the top",
    ),
    ("FormatField1", "two formats with the index 1"),
    (
        "Header1",
        "`JAUS Application Layer Header` cannot be a name",
    ),
    (
        "Header4",
        "`shape` is optional, but the composite at the top",
    ),
    ("InheritsFrom1", "`a1.1` cannot be a version"),
    ("InputSet1", "two messages named `LOGOUT`"),
    ("InternalEventsSet1", "two events named `Send`"),
    (
        "List2",
        "`subsystem_rec` is optional, but the element of a list",
    ),
    ("List3", "`List2` is optional, but the element of a list"),
    (
        "ProtocolBehavior3",
        "the start `Init2` is not a state of `FSM_A`",
    ),
    (
        "ProtocolBehavior4",
        "the start `Init` is not a state of `FSM_A`",
    ),
    (
        "ProtocolBehavior5",
        "no `state_machine` named `FSM_C` to start",
    ),
    ("Record1", "two members named `RequestID`"),
    ("ScaleRange1", "the limits of the scale are 2 and 1"),
    ("SendAction1", "`send Sequence` cannot be a `name`"),
    ("ServiceDef1", "`INVALID.0` cannot be a version"),
    ("Start1", "`Invalid Name` cannot be a `state_machine_name`"),
    ("State1", "`Idle 2` cannot be a name"),
    ("State4", "the attribute `initial_state` is empty"),
    ("StateMachine1", "`FSM A` cannot be a `name`"),
    ("StateMachine2", "two states `Init`"),
    ("StateMachine3", "the machine `FSM_A` has no states"),
    ("StateMachineTest1", "two state machines named `FSM`"),
    ("StateTest2", "choose its first one with `initial_state`"),
    ("StateTest5", "two states `StateA`"),
    (
        "Transition3",
        "`test` is not a parameter of this transition",
    ),
    ("Transition4", "`transition` has one target"),
    (
        "TransitionTest2",
        "`Timeout2` is neither an event nor a message",
    ),
    (
        "TransitionTest2",
        "`Message3` is neither an event nor a message",
    ),
    (
        "TransitionTest2",
        "`TransitionTest1.Message2` is neither an event nor a message",
    ),
    ("Transport", "`01` cannot be a message id"),
    ("ValueRange1", "no value lies between 10 and 9"),
    ("ValueSet1", "two values with the index 9"),
    ("VariableField1", "`Invalid temperature` cannot be a name"),
    ("VariableFormatField1", "lacks the element `count_field`"),
    ("VariableLengthField1", "`Query Message` cannot be a name"),
    (
        "VariableLengthString1",
        "`node description` cannot be a name",
    ),
    (
        "Variant2",
        "`rectangle` is optional, but an alternative of a variant",
    ),
    (
        "Variant3",
        "`List2` is optional, but an alternative of a variant",
    ),
    ("VtagField1", "`min_count` is 2"),
];

/// Invalid cases that only cause a warning, with part of its text: published definitions break the
/// same rule, and the merged machine or the vocabulary is still well defined.
const WARNED: &[(&str, &str)] = &[
    (
        "ProtocolBehavior7",
        "`is_stateless` is `true`, but the machine `FSM_A` has 2 states",
    ),
    // A vocabulary is complete without the services that offer it.
    ("ServiceSet4", "this service is a client of"),
    // Published services start in other states than their bases.
    (
        "ProtocolBehaviorTest2b",
        "is `StateAA` in the inherited service",
    ),
];

/// Invalid cases that pass, on purpose.
const ACCEPTED: &[&str] = &[
    // An absent `optional` means `false`, and published definitions rely on that.
    "Variant1",
    // A derived machine need not repeat the states of its base: they are merged.
    "StateTest4",
    // The choices of a variable field had no names before version 1.1 of the language.
    "gui-test/VariableField1",
];

#[test]
fn invalid_definitions_are_rejected_for_the_stated_reason() {
    for folder in ["validator", "gui-test", "pbvalidator"] {
        for file in cases("invalid", folder) {
            let name = name(&file);
            let found = findings(&file);
            if ACCEPTED.contains(&name) || ACCEPTED.contains(&format!("{folder}/{name}").as_str()) {
                let errors: Vec<_> = found.errors().filter(|e| !tolerated(e)).collect();
                assert!(errors.is_empty(), "{name} is no exception: {errors:#?}");
                continue;
            }
            let reasons = |table: &'static [(&str, &str)]| {
                let mine = table.iter().filter(move |(case, _)| *case == name);
                mine.map(|(_, reason)| *reason)
            };
            let says = |mut findings: Box<dyn Iterator<Item = &Diagnostic> + '_>, reason: &str| {
                findings.any(|finding| finding.message.contains(reason))
            };
            for reason in reasons(REJECTED) {
                assert!(says(Box::new(found.errors()), reason), "{name}:\n{found}");
            }
            for reason in reasons(WARNED) {
                assert!(says(Box::new(found.warnings()), reason), "{name}:\n{found}");
            }
            let listed = reasons(REJECTED).chain(reasons(WARNED)).count();
            assert!(listed > 0, "{name} is not listed:\n{found}");
        }
    }
}

#[test]
fn missing_declarations_are_named() {
    let Some(cases) = evidence::outside("validator-cases") else {
        return;
    };
    let mut loader = Loader::new();
    loader.path(cases.join("invalid/core-broken-declarations"));
    let found = loader.load().diagnostics;
    let missing: Vec<_> = found
        .errors()
        .filter(|e| e.message.contains("is not declared"))
        .map(|e| e.message.as_str())
        .collect();
    assert_eq!(
        missing,
        [
            "`core.queryClass.QueryConfiguration` is not declared: declare it, or correct the name",
            "`core.queryClass.QuerySubsystemList` is not declared: declare it, or correct the name",
        ]
    );
}
