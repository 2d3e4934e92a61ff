//! Motion commands of a controller.

use std::time::Duration;

use bytes::Bytes;
use jaus::codec::{FormattedBlob, Message};
use jaus::messages::core::set_element::{ElementDataFormat, ElementRec, RequestIdRec};
use jaus::messages::core::set_time::TimeStamp;
use jaus::messages::core::{
    QueryIncarnation, ReportIncarnation, ReportServiceList, ReportServices, SetElement, SetTime,
};
use jaus::messages::mobility::set_velocity_command::CommandType;
use jaus::messages::mobility::{
    ExecuteList, ReportLocalPathSegment, SetGlobalVector, SetGlobalWaypoint, SetLocalPathSegment,
    SetLocalVector, SetLocalWaypoint, SetTravelSpeed, SetVelocityCommand, SetWrenchEffort,
};
use jaus_vehicle::motion::Pose;

use crate::cell::Driver;
use crate::positioning::FRAME;

/// Metres to the goal: more than the vehicle covers in any run.
const FAR: f64 = 400.0;

/// The messages that set the vehicle in motion, in this order.
pub(crate) fn motion(driver: Driver) -> Vec<Bytes> {
    match driver {
        Driver::Effort | Driver::HeldEffort | Driver::Own => vec![encode(&effort())],
        Driver::Velocity | Driver::HeldVelocity => vec![encode(&velocity())],
        Driver::Vector => vec![encode(&vector())],
        Driver::Waypoint => vec![encode(&waypoint(FAR)), encode(&travel_speed())],
        Driver::GlobalVector => vec![encode(&global_vector())],
        Driver::GlobalWaypoint => vec![encode(&global_waypoint()), encode(&travel_speed())],
        Driver::List => {
            let elements = [waypoint(FAR / 2.0), waypoint(FAR)].map(|it| encode(&it));
            vec![encode(&list(elements)), encode(&execute())]
        }
        Driver::Path => {
            let elements = [0.0, FAR / 2.0].map(|x| encode(&segment(x)));
            vec![encode(&list(elements)), encode(&execute())]
        }
    }
}

/// The same for a client without lists: the places one by one, and then a speed. A segment is a
/// report here, which has the layout of the command.
pub(crate) fn places_and_speed(driver: Driver) -> Vec<Bytes> {
    let [first, second] = match driver {
        Driver::List => [FAR / 2.0, FAR].map(|x| encode(&waypoint(x))),
        Driver::Path => [0.0, FAR / 2.0].map(|x| encode(&report(&segment(x)))),
        _ => return motion(driver),
    };
    vec![first, second, encode(&travel_speed())]
}

/// Whether a message tells or queries an incarnation, or lists the services of its sender, which
/// would name that one.
pub(crate) fn is_of_incarnation(payload: &Bytes) -> bool {
    let code = payload.first_chunk().map(|it| u16::from_le_bytes(*it));
    let codes = [
        QueryIncarnation::CODE,
        ReportIncarnation::CODE,
        ReportServices::CODE,
        ReportServiceList::CODE,
    ];
    code.is_some_and(|code| codes.contains(&code))
}

/// Set Time, from the sender's wall clock.
pub(crate) fn set_time(since_1970: Duration) -> Bytes {
    let of_day = since_1970.as_secs() % 86_400;
    let stamp = TimeStamp::default()
        .with_seconds((of_day % 60) as u8)
        .and_then(|it| it.with_minutes((of_day / 60 % 60) as u8))
        .and_then(|it| it.with_hour((of_day / 3600) as u8));
    encode(&SetTime {
        time_stamp: Some(stamp.expect("within a day")),
        date_stamp: None,
    })
}

pub(crate) fn encode<M: Message>(message: &M) -> Bytes {
    message.encode().expect("small numbers")
}

/// An effort that stops the vehicle, one of several: without propulsion, because no field holds a
/// percentage of exactly 0.
pub(crate) fn stop(number: u8) -> Bytes {
    let mut effort = SetWrenchEffort::default();
    let set = effort.set_resistive_linear_effort_x_percent(50.0 + f64::from(number));
    set.expect("a percentage");
    encode(&effort)
}

fn effort() -> SetWrenchEffort {
    let mut effort = SetWrenchEffort::default();
    let set = effort.set_propulsive_linear_effort_x_percent(60.0);
    set.expect("a percentage");
    effort
}

fn velocity() -> SetVelocityCommand {
    let mut velocity = SetVelocityCommand {
        command_type: CommandType::SET_CURRENT_COMMAND,
        ..SetVelocityCommand::default()
    };
    velocity.set_velocity_x_m_per_s(1.0).expect("in range");
    velocity.set_yaw_rate_rad_per_s(0.1).expect("in range");
    velocity
}

fn vector() -> SetLocalVector {
    let mut vector = SetLocalVector::default();
    vector.set_speed_m_per_s(1.0).expect("in range");
    vector.set_heading_rad(0.5).expect("in range");
    vector
}

fn global_vector() -> SetGlobalVector {
    let mut vector = SetGlobalVector::default();
    vector.set_speed_m_per_s(1.0).expect("in range");
    vector.set_heading_rad(0.5).expect("in range");
    vector
}

fn global_waypoint() -> SetGlobalWaypoint {
    let place = FRAME.to_global(&Pose::at(FAR, 1.0));
    let mut waypoint = SetGlobalWaypoint::default();
    waypoint.set_latitude_deg(place.latitude).expect("in range");
    waypoint
        .set_longitude_deg(place.longitude)
        .expect("in range");
    waypoint
}

fn waypoint(x: f64) -> SetLocalWaypoint {
    let mut waypoint = SetLocalWaypoint::default();
    waypoint.set_x_m(x).expect("in range");
    waypoint.set_y_m(1.0).expect("in range");
    waypoint
}

fn travel_speed() -> SetTravelSpeed {
    let mut speed = SetTravelSpeed::default();
    speed.set_speed_m_per_s(1.0).expect("in range");
    speed
}

fn execute() -> ExecuteList {
    let mut execute = ExecuteList {
        element_uid: Some(1),
        ..ExecuteList::default()
    };
    execute.set_speed_m_per_s(1.0).expect("in range");
    execute
}

/// A path segment along the X axis, from `x` on.
fn segment(x: f64) -> SetLocalPathSegment {
    let mut path = SetLocalPathSegment::default();
    path.set_p1_x_m(x + FAR / 4.0).expect("in range");
    path.set_p1_y_m(0.0).expect("in range");
    path.set_p2_x_m(x + FAR / 2.0).expect("in range");
    path.set_p2_y_m(0.0).expect("in range");
    path.set_weighting_factor_value(1.0).expect("in range");
    path
}

/// The report with the same layout.
fn report(segment: &SetLocalPathSegment) -> ReportLocalPathSegment {
    ReportLocalPathSegment {
        p1_x: segment.p1_x,
        p1_y: segment.p1_y,
        p2_x: segment.p2_x,
        p2_y: segment.p2_y,
        weighting_factor: segment.weighting_factor,
        ..ReportLocalPathSegment::default()
    }
}

/// A list of two elements.
fn list([first, second]: [Bytes; 2]) -> SetElement {
    let element = |element_uid, previous_uid, next_uid, data| ElementRec {
        element_uid,
        previous_uid,
        next_uid,
        element_data: FormattedBlob::new(ElementDataFormat::JAUS_MESSAGE, data),
    };
    SetElement {
        request_id_rec: RequestIdRec { request_id: 1 },
        element_list: vec![element(1, 0, 2, first), element(2, 1, 0, second)],
    }
}
