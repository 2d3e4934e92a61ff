//! Messages sent by OpenJAUS 3.3.1 with their expected meaning, and all messages of the capture if
//! it is available.

use super::*;
use jaus::messages::{core, mobility};

fn ours<M: Message>(code: u16, data: &str) -> M {
    M::decode(&to_jaus(code, &octets(data)).unwrap()).unwrap()
}

#[test]
fn the_vehicle_simulator_of_openjaus_is_understood() {
    let pose: mobility::ReportGlobalPose = ours(
        0x4402,
        "ff00 eb0eed34 25c8ccc6 3a8ee3b8 295c8f02 0000 0000 0040 1304",
    );
    near(pose.latitude_deg(), 37.213_600, 1e-6);
    near(pose.longitude_deg(), -80.437_600, 1e-6);
    near(pose.altitude_m(), 0.000, 1e-4);
    near(pose.position_rms_m(), 1.0, 1e-6);
    near(pose.yaw_rad(), std::f64::consts::FRAC_PI_2, 1e-4);
    assert_eq!(pose.time_stamp, None);

    let velocity: mobility::ReportVelocityState = ours(
        0x4404,
        "ff00 46f70000 00000000 00000000 b98d0600 0000 0000 0000 0000",
    );
    near(velocity.velocity_x_m_per_s(), 0.001_93, 1e-5);
    near(velocity.velocity_y_m_per_s(), 0.0, 1e-6);
    near(velocity.yaw_rate_rad_per_s(), 0.0, 1e-3);

    let effort: mobility::SetWrenchEffort = ours(0x0405, "6100 0000 0000 f9");
    near(effort.propulsive_linear_effort_x_percent(), 0.0, 0.002);
    near(effort.propulsive_rotational_effort_z_percent(), 0.0, 0.002);
    near(effort.resistive_linear_effort_x_percent(), 97.6, 0.1);
    assert_eq!(effort.propulsive_linear_effort_y, None);

    let effort: mobility::ReportWrenchEffort =
        ours(0x4405, "ff00 0000 0000 0000 0000 0000 0000 0000");
    near(effort.resistive_linear_effort_y_percent(), 0.0, 0.0);
    assert_eq!(effort.resistive_linear_effort_z, None);
}

#[test]
fn the_control_of_openjaus_is_understood() {
    assert_eq!(
        ours::<core::RequestControl>(0x000D, "7f").authority_code,
        127
    );
    let confirmed: core::ConfirmControl = ours(0x000F, "00");
    assert_eq!(
        confirmed.response_code,
        core::confirm_control::ResponseCode::CONTROL_ACCEPTED
    );
    let status: core::ReportStatus = ours(0x4002, "0200000000");
    assert_eq!(status.status, core::report_status::Status::STANDBY);
}

/// Captured codes that are not converted: connections, discovery.
const NOT_CONVERTED: &[u16] = &[0x0008, 0x0009, 0x2B00, 0x2B03, 0x4B00, 0x4B03];

#[test]
fn every_message_of_the_capture_is_converted_and_comes_back() {
    use std::collections::BTreeMap;

    use jaus_test_kit::evidence;

    use jaus::wire::ra::{HEADER_LEN, Header};
    use jaus_view::{Capture, Network};

    let file = evidence::captures().join("openjaus33/openjaus33-opc-lo.pcap");
    let mut capture = Capture::new(std::fs::File::open(file).unwrap()).unwrap();
    // Port between an OpenJAUS node manager and its components.
    let mut network = Network::new([24629]);
    let mut seen = BTreeMap::new();
    while let Some(frame) = capture.next_frame() {
        let [datagram] = &network.handle_frame(&frame.unwrap())[..] else {
            continue;
        };
        let header = Header::decode(&datagram.payload).unwrap();
        let data = &datagram.payload[HEADER_LEN..];
        if NOT_CONVERTED.contains(&header.code) {
            continue;
        }
        let payload = to_jaus(header.code, data).unwrap();
        let (code, back) = to_ra(&payload).unwrap();
        assert_eq!(code, header.code);
        // Our steps may be coarser; a value on a step converts without change.
        assert_eq!(to_jaus(code, &back).unwrap(), payload, "{code:04X}h");
        *seen.entry(code).or_insert(0) += 1;
    }
    let expected = [
        0x000D, 0x000F, 0x0405, 0x4002, 0x4202, 0x4402, 0x4404, 0x4405,
    ];
    assert_eq!(seen.into_keys().collect::<Vec<_>>(), expected);
}
