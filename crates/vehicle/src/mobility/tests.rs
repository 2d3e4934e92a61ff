//! The mobility services on a simulated vehicle in virtual time.

mod commands;
mod lists;
mod paths;
mod sensors;
mod velocities;
mod waypoints;

use std::time::Duration;

use super::*;
use crate::motion::{Frame, Motion, Observed, Pilot, SkidSteer, SkidSteerConfig};
use jaus::codec::{FormattedBlob, Message};
use jaus::messages::core;
use jaus::messages::core::set_element::{ElementDataFormat, ElementRec, RequestIdRec};
use jaus::messages::core::{ConfirmElementRequest, RejectElementRequest, SetElement};
use jaus::messages::mobility::{ExecuteList, SetLocalWaypoint};
use jaus::service::rig::{CLIENT, Rig, STRANGER};
use jaus::service::{MotionPolicy, Service, State, StopCause, Time, TimeOfDay};

/// Berlin, the location of the test vehicle.
const FRAME: (f64, f64) = (52.5, 13.4);

fn vehicle() -> Vehicle {
    let rover = SkidSteer::new(SkidSteerConfig::default());
    // One command suffices for as long as its client is alive.
    Vehicle::new(Pilot::new(rover, Frame::at(FRAME.0, FRAME.1))).motion_policy(MotionPolicy::Hold)
}

/// All services on one vehicle, Ready and controlled by [`CLIENT`].
fn rig() -> (Rig, Vehicle) {
    let vehicle = vehicle();
    let services: Vec<Box<dyn Service>> = vec![
        Box::new(vehicle.velocity_state_sensor()),
        Box::new(vehicle.acceleration_state_sensor()),
        Box::new(vehicle.local_pose_sensor()),
        Box::new(vehicle.global_pose_sensor()),
        Box::new(vehicle.primitive_driver()),
        Box::new(vehicle.local_waypoint_driver()),
        Box::new(vehicle.global_waypoint_driver()),
        Box::new(vehicle.list_manager()),
        Box::new(vehicle.local_waypoint_list_driver()),
        Box::new(vehicle.global_waypoint_list_driver()),
        Box::new(vehicle.velocity_state_driver()),
        Box::new(vehicle.local_vector_driver()),
        Box::new(vehicle.global_vector_driver()),
        Box::new(vehicle.local_path_segment_driver()),
        Box::new(vehicle.global_path_segment_driver()),
    ];
    let rig = Rig::new(services);
    // 2015-06-08 01:02:03.004 UTC.
    let since_1970 = Duration::from_millis(1_433_725_323_004);
    let vehicle = vehicle.with_clock(TimeOfDay::new(move || since_1970));
    (rig, vehicle)
}

fn seconds(seconds: f64) -> Duration {
    Duration::from_secs_f64(seconds)
}

fn local_waypoint(x: f64, y: f64) -> SetLocalWaypoint {
    let mut waypoint = SetLocalWaypoint::default();
    waypoint.set_x_m(x).unwrap();
    waypoint.set_y_m(y).unwrap();
    waypoint
}

/// Wraps a message in a list element.
fn element(uid: u16, previous_uid: u16, next_uid: u16, message: &impl Message) -> ElementRec {
    let data = message.encode().unwrap();
    ElementRec {
        element_uid: uid,
        previous_uid,
        next_uid,
        element_data: FormattedBlob::new(ElementDataFormat::JAUS_MESSAGE, data),
    }
}

/// Sets elements. Returns whether the change was confirmed.
fn set_elements(rig: &mut Rig, element_list: Vec<ElementRec>) -> bool {
    let request_id_rec = RequestIdRec { request_id: 44 };
    let request = SetElement {
        request_id_rec,
        element_list,
    };
    rig.send(CLIENT, &request);
    match rig.answer_code() {
        Some(ConfirmElementRequest::CODE) => true,
        Some(RejectElementRequest::CODE) => false,
        other => panic!("unexpected answer: {other:04X?}"),
    }
}

fn execute(uid: Option<u16>, speed: f64) -> ExecuteList {
    let mut message = ExecuteList {
        element_uid: uid,
        ..ExecuteList::default()
    };
    message.set_speed_m_per_s(speed).unwrap();
    message
}
