//! What the senders of messages need, as definitions state it.

use std::collections::{BTreeMap, BTreeSet};

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
    permissions_of(&service(&inputs.concat(), &outputs.concat()))
}

fn permissions_of(text: &str) -> Result<(String, Vec<String>), String> {
    let mut loader = Loader::new();
    loader.text("lamp.xml", text);
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
fn a_query_by_the_state_machine_needs_nothing_and_every_other_input_says_what_it_needs() {
    let inputs = [
        message("SetLamp", "D000", r#"own:permission="command""#, ""),
        message("DimLamp", "D001", "", ""),
        // No name makes a query.
        message("QueryLamp", "E000", "", ""),
        message("AskLamp", "E001", "", ""),
        message("AskAndDim", "E002", "", ""),
        message("AskAndGo", "E003", "", ""),
        message("AskWatt", "E004", r#"is_command="true""#, ""),
        message("AskLimit", "E005", r#"own:permission="observe""#, ""),
    ];
    let outputs = [
        message("ReportLamp", "F000", "", ""),
        message("Brightness", "F001", "", ""),
    ];
    let answer = |asked: &str, kind: &str, actions: &str| {
        format!(
            r#"<transition name="Receive"><parameter type="{asked}" value="msg"/>{kind}
{actions}</transition>"#
        )
    };
    let send = |name: &str| format!(r#"<action name="Send"><argument value="'{name}'"/></action>"#);
    let dim = r#"<action name="dim"/>"#;
    let internal = "<internal/>";
    let again = r#"<simple><end_state state="S"/></simple>"#;
    let machine = [
        answer("AskLamp", internal, &send("Brightness")),
        answer("AskAndDim", internal, &[&send("Brightness"), dim].concat()),
        answer("AskAndGo", again, &send("Brightness")),
        answer("AskWatt", internal, &send("Brightness")),
    ];
    let text = service(&inputs.concat(), &outputs.concat());
    let text = text.replace(
        r#"<state name="S"/>"#,
        &format!(r#"<state name="S">{}</state>"#, machine.concat()),
    );
    let (table, missing) = permissions_of(&text).unwrap();
    assert_eq!(
        missing,
        ["DimLamp", "QueryLamp", "AskAndDim", "AskAndGo", "AskWatt"]
    );
    assert_eq!(
        table,
        "D000 command SetLamp\nE001 observe AskLamp\nE005 observe AskLimit\n\
         F000 observe ReportLamp\nF001 observe Brightness\n\
         service urn:example:Lamp D000 D001 E000 E001 E002 E003 E004 E005\n"
    );
}

#[test]
fn the_destination_of_carried_messages_is_named_and_found() {
    let carried = r#"<record name="Rec" optional="false">
<fixed_field name="To" optional="false" field_type="unsigned integer" field_units="one"/>
<fixed_field name="Kind" optional="false" field_type="unsigned byte" field_units="one"/>
<variable_length_field name="Order" optional="false" field_format="JAUS MESSAGE"><count_field
field_type_unsigned="unsigned byte"/></variable_length_field></record>"#;
    let send = |destination: &str| {
        let attributes = format!(r#"own:permission="command" own:destination="{destination}""#);
        permissions(&[message("PassOn", "D003", &attributes, carried)], &[])
    };
    let (table, _) = send("To").unwrap();
    assert!(table.starts_with("D003 command PassOn [d1m1]\n"), "{table}");
    for wrong in ["Kind", "Nobody"] {
        let error = send(wrong).unwrap_err();
        assert!(
            error.contains(&format!("cannot find the field `{wrong}`")),
            "{error}"
        );
    }
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
fn of_one_code_the_rights_to_all_messages_are_needed() {
    let inputs = [
        message("QueryLamp", "E000", r#"own:permission="observe""#, ""),
        message("WarmLamp", "E000", r#"own:permission="configure""#, ""),
        message(
            "TakeLamp",
            "E000",
            r#"own:permission="control" own:authority="Rank""#,
            OCTETS,
        ),
    ];
    let (table, _) = permissions(&inputs, &[]).unwrap();
    assert!(
        table.starts_with("E000 configure,control@4,observe QueryLamp,TakeLamp,WarmLamp\n"),
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
            "01F6 carry CreateCommandEvent [5m4]",
            "041A command SetElement [1*1(6f2:0)]",
            "0E00 command SpoolMission [6*2(2*2(2dm4.1)*2(2))]",
            "0E06 command InsertMessages [7*2(2dm4.1)]",
            "0E08 command InsertMissionTask [9*2(2dm4.1)*2(2)]",
        ]
    );
}

#[test]
fn those_of_the_catalogue_that_stop_or_end_and_do_nothing_else_say_so() {
    let table = Permissions::of(&catalogue()).to_string();
    let stops = table.lines().filter_map(|it| it.strip_suffix(" stops"));
    let stops: Vec<_> = stops.collect();
    // Not Shutdown and Reset: what they end may be what watches over others, and what they leave does not stop
    // at once. Nor what removes zones, tasks or elements: what is left may move farther.
    assert_eq!(
        stops,
        [
            "0003 command Standby",
            "0006 emergency SetEmergency",
            "000E release ReleaseControl",
            "0E02 command AbortMission",
            "0E03 command PauseMission",
            "D112 command StopMission",
            "FF34 release RemoveHandoffRequest",
        ]
    );
}

#[test]
fn a_code_stops_only_if_all_of_its_messages_do() {
    let stop = |name, code| {
        message(
            name,
            code,
            r#"own:permission="command" own:stops="true""#,
            "",
        )
    };
    let move_on = message("MoveOn", "D001", r#"own:permission="command""#, "");
    let inputs = [stop("Halt", "D000"), stop("Rest", "D001"), move_on];
    let (table, _) = permissions(&inputs, &[]).unwrap();
    let lines: Vec<_> = table.lines().take(2).collect();
    assert_eq!(
        lines,
        ["D000 command Halt stops", "D001 command MoveOn,Rest"]
    );
    let wrong = message(
        "Halt",
        "D000",
        r#"own:permission="command" own:stops="yes""#,
        "",
    );
    let error = permissions(&[wrong], &[]).unwrap_err();
    assert!(error.contains("`yes` is not a value of `stops`"), "{error}");
}

/// Messages that change or move something, or record and store it, by what the standards say of them.
const COMMANDS: &str = "
AbortMission AddNoGoZone ApproveMission CBRNCommand CBRNConfigurationCommand CBRNDisplayConfigurationCommand
CBRNScanWindowConfigurationCommand CancelPortMapping ContinueMission ControlDigitalVideoSensorRecording
ControlDigitalVideoSensorStream CreateRasterMap CreateVksObjects DeleteElement DeleteRasterMap
DeleteVksObjects DeleteZone ExecuteList ExecuteListExt InertialSensorControl InsertMessages InsertMissionTask
PauseMission RegisterDigitalResourceEndpoint RemoveDigitalResourceEndpoint RemoveMessages RemoveMissionTask
RemoveNoGoZone RequestGPSFix RequestPortMapping ResetOdometry Resume ResumeMission RunMission
SetAccelerationLimit SetAckermannConfiguration SetActuatorForceTorques SetAnalogVideoSensorConfiguration
SetAnnunciatorState SetDCM SetDestination SetDigitalAudioOutputSource SetDigitalAudioSensorConfiguration
SetDigitalVideoSensorConfiguration SetElement SetEndEffectorEffort SetEndEffectorPose
SetEndEffectorVelocityState SetGeomagneticProperty SetGlobalLoiter SetGlobalOperatingZone SetGlobalPathSegment
SetGlobalPathSegmentExt SetGlobalPose SetGlobalPoseExt SetGlobalVector SetGlobalVectorExt SetGlobalWaypoint
SetGlobalWaypointExt SetH264VideoEncodingConfiguration SetIlluminationState SetJointEffort SetJointEfforts
SetJointMotionProfile SetJointPositions SetJointVelocities SetJointVelocity SetLocalLoiter
SetLocalOperatingZone SetLocalPathSegment SetLocalPathSegmentExt SetLocalPose SetLocalPoseExt SetLocalVector
SetLocalVectorExt SetLocalWaypoint SetLocalWaypointExt SetMotionProfile SetPanTiltJointEffort
SetPanTiltJointEfforts SetPanTiltJointPositions SetPanTiltJointVelocities SetPanTiltJointVelocity
SetPanTiltMotionProfile SetParkingBrake SetPlatformMode SetPlatformState SetPowerPlantConfiguration
SetRangeSensorConfiguration SetRasterCells SetSkidSteerEffort SetStabilizerEffort SetStabilizerPosition
SetStillImageSensorConfiguration SetToolOffset SetTransferCaseState SetTransmissionState SetTravelSpeed
SetTravelSpeedExt SetVelocityCommand SetVelocityCommandExt SetVideoIlluminatorConfiguration
SetVisualSensorConfiguration SetVksFeatureClassMetadata SetWrenchEffort SpoolMission Standby StopMission
TerminateVksDataTransfer UpdateUGVSummary";

/// What a service sends without being a Report…: it changes nothing of its receiver.
const ANSWERS: &str = "
ActivateServiceConnection AddNoGoZoneResponse CBDetailedMeasurement CBRN4 CBRNConfigurationState CBRNDetection
CBRNOperatingState CBRNScanWindowOperatingState CancelEvent ClearEmergency CommandEvent
ConfirmComponentControl ConfirmDigitalResourceEndpoint ConfirmElementRequest ConfirmEventRequest
ConfirmPlatformStateRequest ConfirmSensorConfiguration ConfirmServiceConnection CreateEvent
CreateServiceConnection CreateVksObjects DeleteVksObjects Event GrantPortMapping RNDetailedMeasurement
RejectComponentControl RejectControl RejectElementRequest RejectEventRequest ReleaseComponentControl
RequestComponentControl Reset Resume SetComponentAuthority SetDataLinkSelect SetDataLinkStatus
SetDiscreteDevices SetEmergency SetGlobalPathSegment SetGlobalVector SetGlobalWaypoint SetLocalPathSegment
SetLocalVector SetLocalWaypoint SetSelectedDataLinkState SetTime SetTravelSpeed SetVelocityState
SetVksFeatureClassMetadata SetWrenchEffort Shutdown Standby SuspendServiceConnection
TerminateServiceConnection TerminateVksDataTransfer UpdateEvent";

/// The right that a message needs, by what the standards say that it does.
fn expected(name: &str) -> &'static str {
    let is_in = |list: &str| list.split_whitespace().any(|it| it == name);
    match name {
        "RequestControl" | "SetAuthority" | "RequestHandoff" | "ConfirmReleaseControl" => "control",
        "ConfirmControl" | "ConfirmHandoffRequest" => "answer",
        "ReleaseControl" | "RemoveHandoffRequest" => "release",
        "SetEmergency" => "emergency",
        "ClearEmergency" => "clear-emergency",
        "Shutdown" | "Reset" | "SetTime" => "configure",
        "CreateCommandEvent" => "carry",
        // Subscriptions, and what tells a registry or a controller something.
        "CreateEvent" | "UpdateEvent" | "CancelEvent" | "RegisterServices" => "observe",
        "RequestReleaseControl" => "observe",
        _ if is_in(COMMANDS) => "command",
        _ if name.starts_with("Query") || name.starts_with("Report") || is_in(ANSWERS) => "observe",
        other => panic!("what does {other} do?"),
    }
}

#[test]
fn every_message_of_the_catalogue_needs_what_the_standards_say_that_it_does() {
    let library = catalogue();
    let table = Permissions::of(&library).to_string();
    let rows: BTreeMap<_, _> = table
        .lines()
        .filter(|it| !it.starts_with("service "))
        .map(|line| {
            let words: Vec<_> = line.split(' ').collect();
            let needs = words[1].split(',').map(|it| it.split('@').next().unwrap());
            (words[0], needs.collect::<BTreeSet<_>>())
        })
        .collect();
    let mut wanted: BTreeMap<String, BTreeSet<&str>> = BTreeMap::new();
    for message in library.services().flat_map(|it| it.messages()) {
        let code = format!("{:04X}", message.code);
        wanted
            .entry(code)
            .or_default()
            .insert(expected(&message.name));
    }
    assert!(wanted.len() > 400, "{}", wanted.len());
    assert_eq!(rows.len(), wanted.len());
    for (code, needs) in &wanted {
        assert_eq!(&rows[&**code], needs, "{code}");
    }
    // A query and a command share this code.
    assert_eq!(rows["F92A"], BTreeSet::from(["command", "observe"]));
}
