//! Differences of the two sides: refused messages and omitted fields.

use super::*;
use crate::RaId;
use crate::ids::{IdTable, RaComponent, Settings, Side};
use crate::messages::ra33;
use jaus::messages::mobility::v1_0;
use jaus::messages::{core, mobility};

fn refused<T: std::fmt::Debug>(result: Result<T, Refusal>, reason: Reason, about: &str) {
    let refusal = result.expect_err("must be refused");
    assert_eq!(refusal.reason(), reason, "{refusal}");
    assert!(refusal.to_string().contains(about), "{refusal}");
}

#[test]
fn each_code_has_one_counterpart_for_whoever_is_known() {
    for pair in pairs() {
        let parts = (1..=63).map(RaComponent).map(Some);
        for part in parts {
            for minor in [Some(0), Some(1)] {
                let context = Context {
                    part,
                    minor,
                    ..Context::default()
                };
                let meant = |code: &dyn Fn(&Pair) -> u16, of: u16| {
                    let all = pairs().filter(|it| code(it) == of);
                    all.filter(|it| it.is_meant(context)).count()
                };
                assert!(meant(&|it| it.ra, pair.ra) <= 2, "{pair:?}");
                assert!(meant(&|it| it.jaus, pair.jaus) <= 1, "{pair:?} {context:?}");
            }
        }
    }
}

#[test]
fn a_message_without_counterpart_is_refused_by_its_code() {
    refused(to_jaus(0x0406, &[]), Reason::NoCounterpart, "0406h");
    refused(
        to_ra(&Bytes::from_static(&[0xB5, 0x04])),
        Reason::NoCounterpart,
        "04B5h",
    );
    refused(
        to_ra(&Bytes::from_static(&[0xB5])),
        Reason::Malformed,
        "no message code",
    );
    refused(to_jaus(0x4402, &[0xFF]), Reason::Malformed, "");
}

#[test]
fn what_is_out_of_the_other_range_is_refused_with_the_field() {
    let mut ours = mobility::ReportVelocityState::default();
    ours.set_velocity_x_m_per_s(70.0).unwrap();
    let theirs = into_theirs::<_, ra33::ReportVelocityState>(&ours);
    refused(theirs, Reason::OutOfRange, "VelocityX");
    let mut ours = mobility::ReportLocalPose::default();
    ours.set_z_m(-20_000.0).unwrap();
    refused(
        into_theirs::<_, ra33::ReportLocalPose>(&ours),
        Reason::OutOfRange,
        "Z",
    );
    let mut theirs = ra33::SetTravelSpeed::default();
    theirs.set_speed_m_per_s(400.0).unwrap();
    refused(
        into_ours::<_, mobility::SetTravelSpeed>(&theirs),
        Reason::OutOfRange,
        "Speed",
    );
    // One step below the range, the position of the least integer.
    let yaw = to_jaus(0x4403, &octets("4000 0080"));
    refused(yaw, Reason::OutOfRange, "Yaw");
}

#[test]
fn bits_of_a_presence_vector_that_nobody_owns_are_forgiven_to_ra_systems_alone() {
    // OpenJAUS sets all bits by default, although four of them are undefined.
    let data = octets("FFFF 0100 0200 0300 0400 0500 0600 01 02 03 04 05 06");
    let payload = to_jaus(0x0405, &data).unwrap();
    let ours = mobility::SetWrenchEffort::decode(&payload).unwrap();
    near(
        ours.resistive_rotational_effort_z_percent(),
        600.0 / 255.0,
        1e-9,
    );
    let mut wrong = payload.to_vec();
    wrong[3] = 0xFF;
    refused(to_ra(&wrong.into()), Reason::Malformed, "presence vector");
    let query = ra33::QueryGlobalPose {
        presence_vector: 0xFFFF,
    };
    let ours: mobility::QueryGlobalPose = into_ours(&query).unwrap();
    assert_eq!(ours.presence_vector, 0x01FF);
}

#[test]
fn a_local_vector_is_a_speed_and_a_heading_in_the_reference_architecture() {
    let mut ours = mobility::SetLocalVector::default();
    ours.set_speed_m_per_s(1.0).unwrap();
    let set = |ours: &mobility::SetLocalVector| into_theirs::<_, ra33::SetLocalVector>(ours);
    refused(set(&ours), Reason::Missing, "Heading");
    ours.set_heading_rad(0.0).unwrap();
    assert!(set(&ours).is_ok());
    ours.set_pitch_rad(0.1).unwrap();
    refused(set(&ours), Reason::Inexpressible, "Pitch");
    let mut report = mobility::ReportLocalVector::default();
    report.set_heading_rad(0.0).unwrap();
    report.set_z_m(1.0).unwrap();
    assert!(into_theirs::<_, ra33::ReportLocalVector>(&report).is_ok());
}

#[test]
fn the_vectors_of_version_1_0_keep_their_layout() {
    let old = Context {
        minor: Some(0),
        ..Context::default()
    };
    let mut theirs = ra33::SetGlobalVector::default();
    theirs.set_heading_rad(1.5).unwrap();
    let without_speed = into_ours_with::<_, v1_0::SetGlobalVector>(old, &theirs);
    refused(without_speed, Reason::Missing, "Speed");
    theirs.set_speed_m_per_s(0.0).unwrap();
    let ours: v1_0::SetGlobalVector = into_ours_with(old, &theirs).unwrap();
    near(ours.heading_rad(), 1.5, 1e-4);
    assert_eq!(
        into_theirs_with::<_, ra33::SetGlobalVector>(old, &ours).unwrap(),
        theirs
    );
    let all = ra33::QueryGlobalVector {
        presence_vector: 0xFF,
    };
    let ours: mobility::QueryGlobalVector = into_ours_with(old, &all).unwrap();
    assert_eq!(ours.presence_vector, 0b1111);
    let theirs: ra33::QueryGlobalVector = into_theirs_with(old, &ours).unwrap();
    assert_eq!(theirs.presence_vector, 0b1_1111);
    let mut local = ra33::SetLocalVector::default();
    local.set_speed_m_per_s(5000.0 - 4900.0).unwrap();
    let ours: v1_0::SetLocalVector = into_ours_with(old, &local).unwrap();
    near(ours.speed_m_per_s(), 100.0, 0.01);
}

#[test]
fn only_one_waypoint_is_driven_to() {
    let theirs = ra33::SetGlobalWaypoint {
        waypoint_number: 1,
        ..Default::default()
    };
    refused(
        into_ours::<_, mobility::SetGlobalWaypoint>(&theirs),
        Reason::UnknownValue,
        "WaypointNumber 1",
    );
    let query = ra33::QueryGlobalWaypoint { waypoint_number: 0 };
    let ours: mobility::QueryGlobalWaypoint = into_ours(&query).unwrap();
    assert_eq!(ours.presence_vector, 0b1111);
}

#[test]
fn a_limit_of_the_path_is_refused_in_a_command_and_left_out_in_a_report() {
    let mut ours = mobility::SetLocalWaypoint::default();
    ours.set_waypoint_tolerance_m(1.0).unwrap();
    ours.set_path_tolerance_m(0.0).unwrap();
    let set = |ours: &mobility::SetLocalWaypoint| into_theirs::<_, ra33::SetLocalWaypoint>(ours);
    assert!(set(&ours).is_ok());
    ours.set_path_tolerance_m(2.0).unwrap();
    refused(set(&ours), Reason::Inexpressible, "PathTolerance");
    let mut report = mobility::ReportLocalWaypoint::default();
    report.set_path_tolerance_m(2.0).unwrap();
    assert!(into_theirs::<_, ra33::ReportLocalWaypoint>(&report).is_ok());
}

const LOCAL_PATH: Context<'static> = Context {
    ids: None,
    part: Some(RaComponent::LOCAL_PATH_SEGMENT_DRIVER),
    minor: None,
};

#[test]
fn a_path_segment_is_an_element_behind_the_one_before_it() {
    let mut theirs = ra33::SetLocalPathSegment {
        path_segment_number: 2,
        ..Default::default()
    };
    theirs.set_p2x_m(25.0).unwrap();
    let ours: core::SetElement = into_ours_with(LOCAL_PATH, &theirs).unwrap();
    let [element] = ours.element_list.as_slice() else {
        panic!("{ours:?}")
    };
    assert_eq!(
        (element.element_uid, element.previous_uid, element.next_uid),
        (3, 2, 0)
    );
    assert_eq!(element.element_data.data[..2], [0x10, 0x04]);
    let back: ra33::SetLocalPathSegment = into_theirs_with(LOCAL_PATH, &ours).unwrap();
    assert_eq!(back.path_segment_number, 2);
    near(Some(back.p2x_m()), 25.0, 1e-4);

    let set = |ours: &core::SetElement| {
        into_theirs_with::<_, ra33::SetLocalPathSegment>(LOCAL_PATH, ours)
    };
    let mut two = ours.clone();
    two.element_list.push(ours.element_list[0].clone());
    refused(set(&two), Reason::Inexpressible, "ElementList");
    let mut inserted = ours.clone();
    inserted.element_list[0].next_uid = 9;
    refused(set(&inserted), Reason::Inexpressible, "NextUID");
    let mut apart = ours.clone();
    apart.element_list[0].previous_uid = 1;
    refused(set(&apart), Reason::Inexpressible, "PreviousUID");
    let mut other = ours;
    other.element_list[0].element_data.data = Bytes::from_static(&[0x0F, 0x04]);
    refused(set(&other), Reason::Inexpressible, "ElementData");
}

#[test]
fn segments_that_come_in_the_order_of_their_numbers_make_a_list() {
    let mut list = jaus::service::ElementList::default();
    for path_segment_number in 0..3 {
        let theirs = ra33::SetLocalPathSegment {
            path_segment_number,
            ..Default::default()
        };
        let ours: core::SetElement = into_ours_with(LOCAL_PATH, &theirs).unwrap();
        list.set(&ours.element_list).unwrap();
    }
    assert_eq!(list.uids().collect::<Vec<_>>(), [1, 2, 3]);
}

#[test]
fn a_speed_sets_a_path_segment_driver_off_and_a_waypoint_driver_its_speed() {
    let mut theirs = ra33::SetTravelSpeed::default();
    theirs.set_speed_m_per_s(100.0).unwrap();
    let ours: mobility::ExecuteList = into_ours_with(LOCAL_PATH, &theirs).unwrap();
    near(Some(ours.speed_m_per_s()), 100.0, 0.08);
    assert_eq!(ours.element_uid, Some(0), "from the first element on");
    let stop: mobility::ExecuteList =
        into_ours_with(LOCAL_PATH, &ra33::SetTravelSpeed::default()).unwrap();
    assert_eq!((stop.speed_m_per_s(), stop.element_uid), (0.0, None));
    let from_the_third = mobility::ExecuteList {
        element_uid: Some(3),
        ..ours
    };
    let theirs_again = into_theirs_with::<_, ra33::SetTravelSpeed>(LOCAL_PATH, &from_the_third);
    refused(theirs_again, Reason::Inexpressible, "ElementUID");
    assert!(into_ours::<_, mobility::SetTravelSpeed>(&theirs).is_ok());
}

#[test]
fn answers_to_a_request_for_control_say_the_same() {
    for code in 0..=2 {
        let theirs = ra33::ConfirmComponentControl {
            response_code: ra33::confirm_component_control::ResponseCode(code),
        };
        let ours: core::ConfirmControl = into_ours(&theirs).unwrap();
        assert_eq!(ours.response_code.0, code);
        assert_eq!(
            into_theirs::<_, ra33::ConfirmComponentControl>(&ours).unwrap(),
            theirs
        );
    }
    refused(
        to_jaus(0x000F, &[3]),
        Reason::UnknownValue,
        "ResponseCode 3",
    );
    let ours: core::RejectControl = into_ours(&ra33::RejectComponentControl).unwrap();
    assert_eq!(
        ours.response_code,
        core::reject_control::ResponseCode::CONTROL_RELEASED
    );
}

#[test]
fn who_is_in_control_is_named_by_the_id_that_the_receiver_knows() {
    let mut ids = IdTable::new(&Settings {
        ra_offset: 1000,
        ..Settings::default()
    })
    .unwrap();
    ids.claim(Side::Ra, 20).unwrap();
    ids.claim(Side::Jaus, 101).unwrap();
    let context = Context {
        ids: Some(&ids),
        ..Context::default()
    };
    let report = |id: RaId| ra33::ReportComponentControl {
        subsystem_id: id.subsystem,
        node_id: id.node,
        component_id: id.component,
        instance_id: id.instance,
        authority_code: 7,
    };
    for (there, here) in [
        ("20.1.32.1", "1020.1.32"),
        ("101.1.32.9", "101.1.9"),
        ("0.0.0.0", "0.0.0"),
    ] {
        let theirs = report(there.parse().unwrap());
        let ours: core::ReportControl = into_ours_with(context, &theirs).unwrap();
        let seen = format!(
            "{}.{}.{}",
            ours.subsystem_id, ours.node_id, ours.component_id
        );
        assert_eq!((seen.as_str(), ours.authority_code), (here, 7));
        assert_eq!(
            into_theirs_with::<_, ra33::ReportComponentControl>(context, &ours).unwrap(),
            theirs
        );
    }
    let nobody_knows = into_ours::<_, core::ReportControl>(&report("20.1.32.1".parse().unwrap()));
    refused(nobody_knows, Reason::UnknownId, "SubsystemID");
}

#[test]
fn a_state_that_only_one_side_knows_is_refused() {
    refused(
        to_jaus(0x4002, &[6, 0, 0, 0, 0]),
        Reason::UnknownValue,
        "PrimaryStatusCode 6",
    );
    let ready = to_jaus(0x4002, &[1, 0xAA, 0xBB, 0xCC, 0xDD]).unwrap();
    assert_eq!(ready.as_ref(), [0x02, 0x40, 1, 0, 0, 0, 0]);
    refused(
        to_jaus(0x0006, &[2, 0]),
        Reason::UnknownValue,
        "EmergencyCode 2",
    );
}

#[test]
fn a_velocity_command_has_one_meaning_in_the_reference_architecture() {
    let mut theirs = ra33::SetVelocityState::default();
    theirs.set_velocity_x_m_per_s(1.5).unwrap();
    let ours: mobility::SetVelocityCommand = into_ours(&theirs).unwrap();
    near(ours.velocity_x_m_per_s(), 1.5, 1e-6);
    let limit = mobility::SetVelocityCommand {
        command_type: mobility::set_velocity_command::CommandType::SET_MAX_ALLOWED,
        ..ours
    };
    refused(
        into_theirs::<_, ra33::SetVelocityState>(&limit),
        Reason::UnknownValue,
        "CommandType 1",
    );
}
