//! Part A, task 6: a drive along four waypoints.

use std::time::Duration;

use jaus::codec::{FormattedBlob, Message};
use jaus::messages::core::set_element::{ElementDataFormat, ElementRec};
use jaus::messages::core::{
    ConfirmControl, ConfirmElementRequest, DeleteElement, QueryElementCount, QueryElementList,
    RejectControl, ReleaseControl, ReportElementCount, ReportElementList, Resume, SetElement,
    Standby, delete_element::DeleteElementRec,
};
use jaus::messages::mobility::{
    ExecuteList, QueryActiveElement, QueryLocalPose, QueryLocalWaypoint, QueryTravelSpeed,
    ReportActiveElement, ReportLocalPose, ReportLocalWaypoint, ReportTravelSpeed, SetLocalWaypoint,
};

use super::super::memory::Memory;
use super::super::step::{
    Act, Check, Exchange, Part, Speaker::Main, Step, Until, equal, near, present, step,
};
use super::challenge::{accepted, released, request_control, set_pose};
use super::{ACCESS_CONTROL, LOCAL_POSE_SENSOR, LOCAL_WAYPOINT_LIST_DRIVER, MANAGEMENT};

/// The waypoints, X and Y in metres; the drive starts at 0, 0, heading along X.
const WAYPOINTS: [[f64; 2]; 4] = [[2.0, 0.0], [4.0, 1.0], [6.0, 1.0], [8.0, 0.0]];
/// Tolerance of a waypoint, in metres.
const TOLERANCE: f64 = 1.0;
/// In m/s.
const SPEED: f64 = 1.0;
/// Time for 9 m at that speed, with a turn on the spot.
const DRIVE: Duration = Duration::from_secs(60);
/// Interval of position queries.
const ROUND: Duration = Duration::from_millis(250);
/// Deletes the whole list.
const WHOLE_LIST: u16 = u16::MAX;

pub(super) fn steps() -> Vec<Step> {
    let drive = step(Part::A, 6, "Waypoint navigation")
        .needs(&[
            ACCESS_CONTROL,
            MANAGEMENT,
            LOCAL_POSE_SENSOR,
            LOCAL_WAYPOINT_LIST_DRIVER,
        ])
        .ask(Main, request_control(), "control accepted", accepted)
        .act(set_pose([0.0; 3]).into())
        .act(set_elements().into())
        .ask(
            Main,
            QueryElementList,
            "elements 1, 2, 3, 4",
            |report: &ReportElementList, _| {
                let uids = report
                    .element_list
                    .iter()
                    .map(|element| element.element_uid);
                list_is(&uids.collect::<Vec<_>>(), &[1, 2, 3, 4])
            },
        )
        .ask(
            Main,
            QueryElementCount,
            "4 elements",
            |report: &ReportElementCount, _| equal("the element count", report.element_count, 4),
        )
        .tell(Main, Resume)
        .act(execute().into())
        .ask(
            Main,
            QueryActiveElement,
            "element 1",
            |report: &ReportActiveElement, _| equal("the active element", report.element_uid, 1),
        )
        .ask(
            Main,
            QueryTravelSpeed,
            "1 m/s",
            |report: &ReportTravelSpeed, _| near("the speed", report.speed_m_per_s(), SPEED, 0.05),
        )
        .ask(
            Main,
            QueryLocalWaypoint::none().with_z().with_roll(),
            "the first waypoint",
            |report: &ReportLocalWaypoint, _| is_waypoint(report, WAYPOINTS[0]),
        )
        .act(Act::Until(Until {
            words: "the four waypoints in order",
            // Some subjects revoke control that is not renewed.
            exchanges: vec![
                Exchange::new(Main, request_control()).expect(Main, "control accepted", accepted),
                Exchange::new(Main, QueryLocalPose::none().with_x().with_y()).expect(
                    Main,
                    "the position",
                    takes_position,
                ),
            ],
            reached: |memory| match WAYPOINTS.get(memory.reached) {
                None => Ok(()),
                Some([x, y]) => Err(format!(
                    "{} of {} waypoints were reached; the subject never came within {TOLERANCE} m \
                     of the next one, {x}, {y}",
                    memory.reached,
                    WAYPOINTS.len()
                )),
            },
            every: ROUND,
            at_most: DRIVE,
        }))
        .tell(Main, Standby)
        .ask(Main, ReleaseControl, "control released", released)
        .afterwards::<ConfirmControl>(Main, request_control())
        .afterwards::<ConfirmElementRequest>(Main, delete_list())
        .afterwards::<RejectControl>(Main, ReleaseControl);
    vec![drive]
}

/// The four waypoints as a list.
fn set_elements() -> Exchange {
    let message = |_: &Memory| {
        let mut message = SetElement::default();
        message.request_id_rec.request_id = 1;
        for (uid, waypoint) in (1_u16..).zip(WAYPOINTS) {
            message.element_list.push(element(uid, waypoint)?);
        }
        Ok(message)
    };
    Exchange::with(Main, message).expect(
        Main,
        "request 1",
        |report: &ConfirmElementRequest, memory| {
            memory.reached = 0;
            equal("the request id", report.request_id, 1)
        },
    )
}

fn element(uid: u16, position: [f64; 2]) -> Result<ElementRec, String> {
    let is_last = usize::from(uid) == WAYPOINTS.len();
    Ok(ElementRec {
        element_uid: uid,
        previous_uid: uid - 1,
        next_uid: if is_last { 0 } else { uid + 1 },
        element_data: element_data(position)?,
    })
}

/// A waypoint at X and Y, in metres.
pub(super) fn waypoint([x, y]: [f64; 2]) -> Result<SetLocalWaypoint, String> {
    let mut waypoint = SetLocalWaypoint::default();
    let set = waypoint.set_x_m(x).and_then(|()| waypoint.set_y_m(y));
    set.map_err(|error| error.to_string())?;
    Ok(waypoint)
}

/// The same as list element data.
pub(super) fn element_data(position: [f64; 2]) -> Result<FormattedBlob<ElementDataFormat>, String> {
    let octets = waypoint(position)?.encode();
    let octets = octets.map_err(|error| error.to_string())?;
    Ok(FormattedBlob::new(ElementDataFormat::JAUS_MESSAGE, octets))
}

/// Executes the list from the first element.
fn execute() -> Exchange {
    Exchange::with(Main, |_| {
        let mut message = ExecuteList {
            element_uid: Some(1),
            ..ExecuteList::default()
        };
        let set = message.set_speed_m_per_s(SPEED);
        set.map_err(|error| error.to_string())?;
        Ok(message)
    })
}

fn delete_list() -> DeleteElement {
    DeleteElement {
        delete_element_list: vec![DeleteElementRec {
            element_uid: WHOLE_LIST,
        }],
        ..DeleteElement::default()
    }
}

/// Checks the order of a list.
pub(super) fn list_is(uids: &[u16], must_be: &[u16]) -> Check {
    if uids == must_be {
        Ok(())
    } else {
        Err(format!("the list is {uids:?}, not {must_be:?}"))
    }
}

/// Checks a waypoint, within one step of its fields.
pub(super) fn is_waypoint(report: &ReportLocalWaypoint, [x, y]: [f64; 2]) -> Check {
    /// 200 km in 2³² steps.
    const STEP: f64 = 200_000.0 / (u32::MAX as f64);
    near("X", report.x_m(), x, STEP)?;
    near("Y", report.y_m(), y, STEP)
}

/// Notes a reached waypoint.
fn takes_position(report: &ReportLocalPose, memory: &mut Memory) -> Check {
    let (x, y) = (present("X", report.x_m())?, present("Y", report.y_m())?);
    if let Some([to_x, to_y]) = WAYPOINTS.get(memory.reached)
        && (x - to_x).hypot(y - to_y) <= TOLERANCE
    {
        memory.reached += 1;
    }
    Ok(())
}
