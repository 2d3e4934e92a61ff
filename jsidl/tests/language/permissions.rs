//! What the senders of messages need, as definitions state it.

use jsidl::Loader;
use jsidl::permission::Permissions;

use crate::support::catalogue;

/// A service with these inputs and outputs, as text.
fn service(inputs: &str, outputs: &str) -> String {
    format!(
        r#"<service_def name="Lamp" id="urn:example:Lamp" version="1.0" xmlns="urn:jaus:jsidl:1.1"
xmlns:own="urn:jaus-rs:jsidl"><description/><assumptions/>
<message_set><input_set>{inputs}</input_set><output_set>{outputs}</output_set></message_set>
<internal_events_set/><protocol_behavior is_stateless="true">
<start state_machine_name="M" state_name="S"/><state_machine name="M"><state name="S"/></state_machine>
</protocol_behavior></service_def>"#
    )
}

/// A message with these attributes and this body.
fn message(name: &str, code: &str, attributes: &str, body: &str) -> String {
    let header = r#"<header name="Header"><record name="Rec" optional="false"><fixed_field name="MessageID"
optional="false" field_type="unsigned short integer" field_units="one"/></record></header>"#;
    format!(
        r#"<message_def name="{name}" message_id="{code}" {attributes}><description/>{header}
<body name="Body">{body}</body><footer name="Footer"/></message_def>"#
    )
}

/// The table and the names of messages without permission; or the first mistake.
fn permissions(inputs: &[String], outputs: &[String]) -> Result<(String, Vec<String>), String> {
    let mut loader = Loader::new();
    loader.text("lamp.xml", &service(&inputs.concat(), &outputs.concat()));
    let loaded = loader.load();
    if let Some(error) = loaded.diagnostics.errors().next() {
        return Err(error.message.clone());
    }
    let permissions = Permissions::of(&loaded.library);
    let missing = permissions.missing.iter().map(|it| it.name.clone());
    Ok((permissions.to_string(), missing.collect()))
}

const OCTETS: &str = r#"<record name="Rec" optional="false">
<fixed_field name="Kind" optional="false" field_type="unsigned short integer" field_units="one"/>
<fixed_field name="Rank" optional="false" field_type="unsigned byte" field_units="one"/></record>"#;

#[test]
fn a_query_and_a_report_need_nothing_and_every_other_input_says_what_it_needs() {
    let inputs = [
        message("QueryLamp", "E000", "", ""),
        message("SetLamp", "D000", r#"own:permission="command""#, ""),
        message("DimLamp", "D001", "", ""),
        // No report of the service answers it, or it is a command.
        message("QueryBulb", "E001", "", ""),
        message("QueryWatt", "E002", r#"is_command="true""#, ""),
    ];
    let outputs = [
        message("ReportLamp", "F000", "", ""),
        message("ReportWatt", "F002", "", ""),
    ];
    let (table, missing) = permissions(&inputs, &outputs).unwrap();
    assert_eq!(
        table,
        "D000 command SetLamp\nE000 observe QueryLamp\nF000 observe ReportLamp\n\
         F002 observe ReportWatt\nservice urn:example:Lamp D000 D001 E000 E001 E002\n"
    );
    assert_eq!(missing, ["DimLamp", "QueryBulb", "QueryWatt"]);
}

#[test]
fn a_message_that_a_client_sends_is_no_report() {
    let lamp = [message("DimLamp", "D001", "", "")];
    let (table, missing) = permissions(&lamp, &lamp).unwrap();
    assert_eq!(table, "service urn:example:Lamp D001\n");
    assert_eq!(missing, ["DimLamp"]);
    // The definition of a client alone.
    let lamp = [message("DimLamp", "D001", r#"is_command="true""#, "")];
    let (table, missing) = permissions(&[], &lamp).unwrap();
    assert_eq!(table, "service urn:example:Lamp \n");
    assert_eq!(missing, ["DimLamp"]);
}

#[test]
fn of_one_code_the_greater_right_counts() {
    let inputs = [
        message("QueryLamp", "E000", "", ""),
        message(
            "TakeLamp",
            "E000",
            r#"own:permission="control" own:authority="Rank""#,
            OCTETS,
        ),
    ];
    let (table, _) = permissions(&inputs, &[message("ReportLamp", "F000", "", "")]).unwrap();
    assert!(
        table.starts_with("E000 control@4 QueryLamp,TakeLamp\n"),
        "{table}"
    );
}

#[test]
fn a_field_that_a_node_cannot_find_and_a_wrong_word_are_mistakes() {
    let take = |attributes: &str| {
        let take = message("TakeLamp", "D002", attributes, OCTETS);
        permissions(&[take], &[]).unwrap_err()
    };
    for (attributes, words) in [
        (
            r#"own:permission="control" own:authority="Kind""#,
            "cannot find the field `Kind`",
        ),
        (
            r#"own:permission="control" own:authority="Nobody""#,
            "cannot find the field `Nobody`",
        ),
        (
            r#"own:permission="answer""#,
            "lacks the attribute `granted`",
        ),
        (
            r#"own:permission="command" own:authority="Rank""#,
            "`authority` belongs to",
        ),
        (r#"own:granted="Rank""#, "`granted` to"),
        (
            r#"own:permission="drive""#,
            "`drive` is not a value of `permission`: use `observe`",
        ),
    ] {
        let error = take(attributes);
        assert!(error.contains(words), "{attributes}: {error}");
    }
}

#[test]
fn every_message_of_the_catalogue_states_what_it_needs() {
    let permissions = Permissions::of(&catalogue());
    let missing: Vec<_> = permissions.missing.iter().map(|it| &it.name).collect();
    assert_eq!(missing, Vec::<&String>::new());
    let table = permissions.to_string();
    let carriers: Vec<_> = table.lines().filter(|it| it.ends_with(']')).collect();
    assert_eq!(
        carriers,
        [
            "01F0 observe CreateEvent [4m4]",
            "01F1 observe UpdateEvent [5m4]",
            "01F6 command CreateCommandEvent [5m4]",
            "041A command SetElement [1*1(6f2:0)]",
            "0E00 command SpoolMission [6*2(2*2(6m4.1)*2(2))]",
            "0E06 command InsertMessages [7*2(6m4.1)]",
            "0E08 command InsertMissionTask [9*2(6m4.1)*2(2)]",
        ]
    );
}
