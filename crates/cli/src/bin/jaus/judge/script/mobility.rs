//! Part B, steps 27 to 35: waypoints, velocity and pose.

use jaus::messages::core::set_element::{ElementRec, RequestIdRec};
use jaus::messages::core::{
    ConfirmElementRequest, QueryElementCount, QueryElementList, ReleaseControl, ReportElementCount,
    ReportElementList, SetElement,
};
use jaus::messages::mobility::{
    QueryActiveElement, QueryLocalPose, QueryLocalWaypoint, QueryTravelSpeed, QueryVelocityState,
    ReportActiveElement, ReportLocalPose, ReportLocalWaypoint, ReportTravelSpeed,
    ReportVelocityState, SetLocalPose,
};

use super::super::memory::Memory;
use super::super::step::{Check, Exchange, Part, Speaker::Main, Step, equal, near, present, step};
use super::challenge::{accepted, released, request_control};
use super::drive::{element_data, is_waypoint, list_is, waypoint};
use super::{ACCESS_CONTROL, LOCAL_POSE_SENSOR, LOCAL_WAYPOINT_DRIVER};
use super::{LOCAL_WAYPOINT_LIST_DRIVER, VELOCITY_STATE_SENSOR};

/// The waypoint, X and Y in metres.
const WAYPOINT: [f64; 2] = [1.0, 1.0];
/// The request id of the element.
const REQUEST: u8 = 0x2C;
/// The pose to set, on both axes, in metres.
const FAR_AWAY: f64 = -1000.0;
/// Tolerance of a pose, in metres: one step of its fields, plus a margin for subjects that compute
/// in single precision.
const POSE_SLACK: f64 = 0.01;
/// Tolerated drift of a standing subject's pose, in metres.
const WANDERING: f64 = 1.0;

pub(super) fn steps() -> Vec<Step> {
    let mut steps = waypoints();
    steps.extend(sensors());
    steps
}

/// Steps 27 to 32.
fn waypoints() -> Vec<Step> {
    let driver = |number, title| step(Part::B, number, title).needs(&[LOCAL_WAYPOINT_DRIVER]);
    vec![
        driver(27, "Query Travel Speed before a waypoint is set").ask(
            Main,
            QueryTravelSpeed,
            "a speed",
            |_: &ReportTravelSpeed, _| Ok(()),
        ),
        step(Part::B, 28, "Set Local Waypoint")
            .needs(&[ACCESS_CONTROL, LOCAL_WAYPOINT_DRIVER])
            .ask(Main, request_control(), "control accepted", accepted)
            .act(set_waypoint().into())
            .ask(
                Main,
                QueryLocalWaypoint::none(),
                "X = Y = 1 m",
                |report: &ReportLocalWaypoint, _| is_waypoint(report, WAYPOINT),
            ),
        step(Part::B, 29, "Release Control, and Query Travel Speed")
            .needs(&[ACCESS_CONTROL, LOCAL_WAYPOINT_DRIVER])
            .rests_on(&[28])
            .ask(Main, ReleaseControl, "control released", released)
            .ask(
                Main,
                QueryTravelSpeed,
                "a speed",
                |_: &ReportTravelSpeed, _| Ok(()),
            ),
        step(Part::B, 30, "Set Element")
            .needs(&[ACCESS_CONTROL, LOCAL_WAYPOINT_LIST_DRIVER])
            .ask(Main, request_control(), "control accepted", accepted)
            .act(set_element().into()),
        step(
            Part::B,
            31,
            "Query the list, its length and the active element",
        )
        .needs(&[ACCESS_CONTROL, LOCAL_WAYPOINT_LIST_DRIVER])
        .rests_on(&[30])
        .ask(
            Main,
            QueryElementCount,
            "1 element",
            |report: &ReportElementCount, _| equal("the element count", report.element_count, 1),
        )
        .ask(
            Main,
            QueryElementList,
            "element 1",
            |report: &ReportElementList, _| {
                let uids = report
                    .element_list
                    .iter()
                    .map(|element| element.element_uid);
                list_is(&uids.collect::<Vec<_>>(), &[1])
            },
        )
        .ask(
            Main,
            QueryActiveElement,
            "an element",
            |_: &ReportActiveElement, _| Ok(()),
        )
        .ask(
            Main,
            QueryLocalWaypoint::none(),
            "a waypoint",
            |_: &ReportLocalWaypoint, _| Ok(()),
        ),
        step(Part::B, 32, "Release Control")
            .needs(&[ACCESS_CONTROL, LOCAL_WAYPOINT_LIST_DRIVER])
            .rests_on(&[30])
            .ask(Main, ReleaseControl, "control released", released),
    ]
}

/// Steps 33 to 35.
fn sensors() -> Vec<Step> {
    let pose =
        |number, title| step(Part::B, number, title).needs(&[ACCESS_CONTROL, LOCAL_POSE_SENSOR]);
    vec![
        step(Part::B, 33, "Query Velocity State: all fields, and none")
            .needs(&[VELOCITY_STATE_SENSOR])
            .ask(
                Main,
                EVERY_VELOCITY_BIT,
                "all available fields",
                |report: &ReportVelocityState, _| {
                    if *report == ReportVelocityState::default() {
                        return Err("the report is empty".to_owned());
                    }
                    Ok(())
                },
            )
            .ask(
                Main,
                QueryVelocityState::none(),
                "no fields",
                |report: &ReportVelocityState, _| {
                    is_empty(*report == ReportVelocityState::default())
                },
            ),
        pose(34, "Set Local Pose without control is ignored")
            .ask(Main, EVERY_POSE_BIT, "a position", |report, memory| {
                memory.position = Some(position(report)?);
                Ok(())
            })
            .act(set_far_away().into())
            .ask(
                Main,
                EVERY_POSE_BIT,
                "the same position",
                |report, memory| {
                    let [x, y] = memory.position.unwrap_or_default();
                    let [now_x, now_y] = position(report)?;
                    near("X", now_x, x, WANDERING)?;
                    near("Y", now_y, y, WANDERING)
                },
            ),
        pose(35, "Set Local Pose with control")
            .ask(Main, request_control(), "control accepted", accepted)
            .ask(Main, EVERY_POSE_BIT, "a position", |report, _| {
                position(report).map(drop)
            })
            .act(set_far_away().into())
            .ask(Main, EVERY_POSE_BIT, "X = Y = -1000 m", |report, _| {
                let [x, y] = position(report)?;
                near("X", x, FAR_AWAY, POSE_SLACK)?;
                near("Y", y, FAR_AWAY, POSE_SLACK)
            })
            .ask(
                Main,
                QueryLocalPose::none(),
                "no fields",
                |report: &ReportLocalPose, _| is_empty(*report == ReportLocalPose::default()),
            )
            .ask(Main, ReleaseControl, "control released", released),
    ]
}

/// All 16 bits, as the contests' tools set them, also those of no field.
pub(super) const EVERY_POSE_BIT: QueryLocalPose = QueryLocalPose {
    presence_vector: u16::MAX,
};
pub(super) const EVERY_VELOCITY_BIT: QueryVelocityState = QueryVelocityState {
    presence_vector: u16::MAX,
};

fn set_waypoint() -> Exchange {
    Exchange::with(Main, |_| waypoint(WAYPOINT))
}

fn set_element() -> Exchange {
    let message = |_: &Memory| {
        Ok(SetElement {
            request_id_rec: RequestIdRec {
                request_id: REQUEST,
            },
            element_list: vec![ElementRec {
                element_uid: 1,
                element_data: element_data(WAYPOINT)?,
                ..ElementRec::default()
            }],
        })
    };
    Exchange::with(Main, message).expect(Main, "request 44", |report: &ConfirmElementRequest, _| {
        equal("the request id", report.request_id, REQUEST)
    })
}

fn set_far_away() -> Exchange {
    Exchange::with(Main, |_: &Memory| {
        let mut message = SetLocalPose::default();
        let set = message
            .set_x_m(FAR_AWAY)
            .and_then(|()| message.set_y_m(FAR_AWAY));
        set.map_err(|error| error.to_string())?;
        Ok(message)
    })
}

fn position(report: &ReportLocalPose) -> Result<[f64; 2], String> {
    Ok([present("X", report.x_m())?, present("Y", report.y_m())?])
}

fn is_empty(empty: bool) -> Check {
    if empty {
        Ok(())
    } else {
        Err("it has unrequested fields".to_owned())
    }
}
