//! The measured messages.

use jaus::codec::FormattedBlob;
use jaus::messages::core::{
    self, Event, ReportServices, ReportTime, SetElement, report_time, set_element,
};
use jaus::messages::mobility::report_global_pose::TimeStamp;
use jaus::messages::mobility::{ReportGlobalPose, SetWrenchEffort};

/// All nine fields.
pub(crate) fn pose32() -> ReportGlobalPose {
    let mut pose = pose16();
    pose.set_position_rms_m(0.5).unwrap();
    pose.set_roll_rad(0.01).unwrap();
    pose.set_pitch_rad(-0.02).unwrap();
    pose.set_attitude_rms_rad(0.003).unwrap();
    pose.time_stamp = Some(TimeStamp(0x5a5a_1234));
    pose
}

/// Latitude, longitude, altitude and yaw.
pub(crate) fn pose16() -> ReportGlobalPose {
    let mut pose = ReportGlobalPose::default();
    pose.set_latitude_deg(48.137).unwrap();
    pose.set_longitude_deg(11.575).unwrap();
    pose.set_altitude_m(519.0).unwrap();
    pose.set_yaw_rad(1.5).unwrap();
    pose
}

/// All twelve fields.
pub(crate) fn wrench() -> SetWrenchEffort {
    let mut wrench = SetWrenchEffort::default();
    wrench.set_propulsive_linear_effort_x_percent(10.0).unwrap();
    wrench.set_propulsive_linear_effort_y_percent(20.0).unwrap();
    wrench
        .set_propulsive_linear_effort_z_percent(-30.0)
        .unwrap();
    wrench
        .set_propulsive_rotational_effort_x_percent(40.0)
        .unwrap();
    wrench
        .set_propulsive_rotational_effort_y_percent(-50.0)
        .unwrap();
    wrench
        .set_propulsive_rotational_effort_z_percent(60.0)
        .unwrap();
    wrench.set_resistive_linear_effort_x_percent(1.0).unwrap();
    wrench.set_resistive_linear_effort_y_percent(2.0).unwrap();
    wrench.set_resistive_linear_effort_z_percent(3.0).unwrap();
    wrench
        .set_resistive_rotational_effort_x_percent(4.0)
        .unwrap();
    wrench
        .set_resistive_rotational_effort_y_percent(5.0)
        .unwrap();
    wrench
        .set_resistive_rotational_effort_z_percent(6.0)
        .unwrap();
    wrench
}

/// One node with four components of six services each.
pub(crate) fn services() -> ReportServices {
    use core::report_services::{ComponentRec, ComponentSeq, NodeRec, NodeSeq, ServiceRec};
    let services = [
        "Transport",
        "Events",
        "AccessControl",
        "Management",
        "Discovery",
        "Liveness",
    ];
    let service = |name: &str| ServiceRec {
        uri: format!("urn:jaus:jss:core:{name}").into(),
        major_version_number: 1,
        minor_version_number: 1,
    };
    let component = |component_id| ComponentSeq {
        component_rec: ComponentRec {
            component_id,
            instance_id: 0,
        },
        service_list: services.into_iter().map(service).collect(),
    };
    let node = NodeSeq {
        node_rec: NodeRec { node_id: 1 },
        component_list: (1..=4).map(component).collect(),
    };
    ReportServices {
        node_list: vec![node],
    }
}

/// A list of 32 elements.
pub(crate) fn elements() -> SetElement {
    let element = |element_uid| set_element::ElementRec {
        element_uid,
        previous_uid: element_uid - 1,
        next_uid: element_uid + 1,
        element_data: FormattedBlob::new(set_element::ElementDataFormat(1), vec![7; 20]),
    };
    SetElement {
        request_id_rec: set_element::RequestIdRec { request_id: 1 },
        element_list: (1..=32).map(element).collect(),
    }
}

/// Time and date.
pub(crate) fn time() -> ReportTime {
    ReportTime {
        time_stamp: Some(report_time::TimeStamp(0x5a5a_1234)),
        date_stamp: Some(report_time::DateStamp(0x1234)),
    }
}

/// An event with a report of 64 KiB.
pub(crate) fn event() -> Event {
    Event {
        event_id: 1,
        sequence_number: 2,
        report_message: vec![7; 65536].into(),
    }
}
