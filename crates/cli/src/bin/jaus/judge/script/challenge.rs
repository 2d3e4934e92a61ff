//! Part A, tasks 1 to 5: the challenges of 2010 to 2013 for a single component.

use std::time::Duration;

use jaus::codec::Message;
use jaus::messages::core::query_identification::QueryType;
use jaus::messages::core::query_services::{ComponentId, ComponentRec, NodeId, NodeRec, NodeSeq};
use jaus::messages::core::{
    ConfirmControl, QueryControl, QueryIdentification, QueryServices, QueryStatus, RejectControl,
    ReleaseControl, ReportControl, ReportIdentification, ReportServices, ReportStatus,
    RequestControl, Resume, Standby, confirm_control::ResponseCode, report_identification::Type,
    report_status::Status,
};
use jaus::messages::mobility::{
    QueryLocalPose, QueryVelocityState, ReportLocalPose, ReportVelocityState, SetLocalPose,
};

use super::super::memory::Memory;
use super::super::step::{
    Act, Check, Exchange, Part, Reach, Speaker::Main, Step, equal, near, present, step,
};
use super::VELOCITY_STATE_SENSOR;
use super::{ACCESS_CONTROL, AUTHORITY, DISCOVERY, LOCAL_POSE_SENSOR, MANAGEMENT};

/// Timeout of the subject's query to the judge: the rules require one every 5 s.
const QUERY_INTERVAL: Duration = Duration::from_secs(6);

/// The pose set at the subject: X, Y (m) and yaw (rad).
const SET_POSE: [f64; 3] = [12.0, -7.0, 0.5];
/// Tolerance of a reported pose: the coarsest field resolution, plus a margin.
const POSE_SLACK: f64 = 0.01;

pub(super) fn steps() -> Vec<Step> {
    vec![
        step(Part::A, 1, "Transport discovery")
            .needs(&[DISCOVERY])
            .ask(
                Main,
                QueryIdentification {
                    query_type: QueryType::SUBSYSTEM_IDENTIFICATION,
                },
                "the subsystem's type and name",
                identifies_a_subsystem,
            )
            .act(Act::Asked {
                code: QueryIdentification::CODE,
                name: QueryIdentification::NAME,
                within: QUERY_INTERVAL,
            }),
        step(Part::A, 2, "Capabilities discovery")
            .needs(&[DISCOVERY])
            .act(services_of_the_subject().into()),
        step(Part::A, 3, "System management")
            .needs(&[ACCESS_CONTROL, MANAGEMENT])
            .ask(Main, QueryControl, "uncontrolled", nobody_in_control)
            .ask(Main, request_control(), "control accepted", accepted)
            .ask(Main, QueryStatus, "a state", |_: &ReportStatus, _| Ok(()))
            .tell(Main, Resume)
            .ask(Main, QueryStatus, "ready", is_ready)
            .tell(Main, Standby)
            .ask(Main, QueryStatus, "standby", is_in_standby)
            .ask(Main, ReleaseControl, "control released", released),
        step(Part::A, 4, "Velocity state report")
            .needs(&[VELOCITY_STATE_SENSOR])
            .ask(
                Main,
                QueryVelocityState::none().with_yaw_rate().with_time_stamp(),
                "yaw rate and time stamp",
                |report: &ReportVelocityState, _| {
                    present("the yaw rate", report.yaw_rate)?;
                    present("the time stamp", report.time_stamp).map(drop)
                },
            )
            .ask(
                Main,
                QueryVelocityState::none()
                    .with_velocity_x()
                    .with_yaw_rate()
                    .with_time_stamp(),
                "velocity X, yaw rate and time stamp",
                |report: &ReportVelocityState, _| {
                    present("velocity X", report.velocity_x)?;
                    present("the yaw rate", report.yaw_rate)?;
                    present("the time stamp", report.time_stamp).map(drop)
                },
            ),
        step(Part::A, 5, "Position and orientation")
            .needs(&[ACCESS_CONTROL, LOCAL_POSE_SENSOR])
            .ask(Main, request_control(), "control accepted", accepted)
            .act(set_pose(SET_POSE).into())
            .ask(
                Main,
                QueryLocalPose::none().with_x().with_y().with_time_stamp(),
                "the set position and the time",
                is_at_set_position,
            )
            .act(Act::Pause(Duration::from_millis(200)))
            .ask(
                Main,
                QueryLocalPose::none().with_x().with_y().with_time_stamp(),
                "the same position, and a later time",
                |report, memory| {
                    let before = memory.time;
                    is_at_set_position(report, memory)?;
                    later(before, memory.time)
                },
            )
            .ask(
                Main,
                QueryLocalPose::none().with_yaw().with_time_stamp(),
                "the set yaw, and the time",
                |report: &ReportLocalPose, _| {
                    present("the time stamp", report.time_stamp)?;
                    near(
                        "the yaw",
                        present("the yaw", report.yaw_rad())?,
                        SET_POSE[2],
                        POSE_SLACK,
                    )
                },
            )
            .ask(Main, ReleaseControl, "control released", released),
    ]
}

/// Query Services for the subject's component only.
fn services_of_the_subject() -> Exchange {
    let query = |memory: &Memory| {
        let node_id = NodeId(memory.subject.node());
        let component_id = ComponentId(memory.subject.component());
        Ok(QueryServices {
            node_list: vec![NodeSeq {
                node_rec: NodeRec { node_id },
                component_list: vec![ComponentRec { component_id }],
            }],
        })
    };
    Exchange::with(Main, query).to(Reach::Component).expect(
        Main,
        "every service of the component, with its version",
        lists_services,
    )
}

/// Requests control with the usual authority.
pub(super) const fn request_control() -> RequestControl {
    RequestControl {
        authority_code: AUTHORITY,
    }
}

/// Sets the subject's position (m) and yaw (rad).
pub(super) fn set_pose([x, y, yaw]: [f64; 3]) -> Exchange {
    Exchange::with(Main, move |_| {
        let mut pose = SetLocalPose::default();
        let set = pose.set_x_m(x).and_then(|()| pose.set_y_m(y));
        set.and_then(|()| pose.set_yaw_rad(yaw))
            .map_err(|error| error.to_string())?;
        Ok(pose)
    })
}

fn is_at_set_position(report: &ReportLocalPose, memory: &mut Memory) -> Check {
    near("X", present("X", report.x_m())?, SET_POSE[0], POSE_SLACK)?;
    near("Y", present("Y", report.y_m())?, SET_POSE[1], POSE_SLACK)?;
    memory.time = Some(present("the time stamp", report.time_stamp)?.0);
    Ok(())
}

fn later(before: Option<u32>, now: Option<u32>) -> Check {
    if now > before {
        Ok(())
    } else {
        Err("the time stamp has not advanced".to_owned())
    }
}

/// Checks that a subsystem reports its kind and name.
pub(super) fn identifies_a_subsystem(report: &ReportIdentification, _: &mut Memory) -> Check {
    equal("the query type", report.query_type.0, 2)?;
    let kinds = [Type::VEHICLE, Type::OCU, Type::OTHER_SUBSYSTEM];
    if !kinds.contains(&report.r#type) {
        return Err(format!(
            "type {} is not a subsystem type: 10001 vehicle, 20001 OCU, 30001 other",
            report.r#type.0
        ));
    }
    is_named(report)
}

/// Checks that an identification has a name.
pub(super) fn is_named(report: &ReportIdentification) -> Check {
    if report.identification.is_empty() {
        return Err("the name is empty".to_owned());
    }
    Ok(())
}

/// Checks that a list of services has the subject's component with the mandatory services.
pub(super) fn lists_services(report: &ReportServices, memory: &mut Memory) -> Check {
    let subject = memory.subject;
    let nodes = report.node_list.iter();
    let nodes = nodes.filter(|node| node.node_rec.node_id == subject.node());
    let component = nodes
        .flat_map(|node| &node.component_list)
        .find(|one| one.component_rec.component_id == subject.component());
    let component = present(&format!("component {subject}"), component)?;
    let uris = component
        .service_list
        .iter()
        .map(|service| service.uri.to_string_lossy());
    let uris: Vec<_> = uris.collect();
    if let Some(uri) = uris.iter().find(|uri| !uri.starts_with("urn:")) {
        return Err(format!("`{uri}` is not a URN"));
    }
    present(
        "Transport",
        uris.iter()
            .find(|uri| **uri == jaus::messages::core::transport::URN),
    )?;
    present("Discovery", uris.iter().find(|uri| **uri == DISCOVERY)).map(drop)
}

pub(super) fn accepted(report: &ConfirmControl, _: &mut Memory) -> Check {
    responds(report, ResponseCode::CONTROL_ACCEPTED)
}

/// Checks the answer to a control request.
pub(super) fn responds(report: &ConfirmControl, must_be: ResponseCode) -> Check {
    equal("the response code", report.response_code.0, must_be.0)
}

pub(super) fn released(report: &RejectControl, _: &mut Memory) -> Check {
    equal("the response code", report.response_code.0, 0)
}

pub(super) fn nobody_in_control(report: &ReportControl, _: &mut Memory) -> Check {
    let id = (report.subsystem_id, report.node_id, report.component_id);
    if id != (0, 0, 0) {
        let (subsystem, node, component) = id;
        return Err(format!(
            "{subsystem}.{node}.{component} is in control; expected none (0.0.0)"
        ));
    }
    equal("the authority", report.authority_code, 0)
}

pub(super) fn is_ready(report: &ReportStatus, _: &mut Memory) -> Check {
    is_in(report, Status::READY)
}

pub(super) fn is_in_standby(report: &ReportStatus, _: &mut Memory) -> Check {
    is_in(report, Status::STANDBY)
}

/// Checks the subject's state.
pub(super) fn is_in(report: &ReportStatus, must_be: Status) -> Check {
    let named = |status: Status| match status {
        Status::INITIALIZE => "0 (initialize)".to_owned(),
        Status::READY => "1 (ready)".to_owned(),
        Status::STANDBY => "2 (standby)".to_owned(),
        Status::SHUTDOWN => "3 (shutdown)".to_owned(),
        Status::FAILURE => "4 (failure)".to_owned(),
        Status::EMERGENCY => "5 (emergency)".to_owned(),
        Status(other) => format!("{other}, which is not a state"),
    };
    equal("the status", named(report.status), named(must_be))
}
