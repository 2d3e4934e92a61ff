//! Quantities convert by their value in engineering units.

use super::*;
use crate::messages::ra33;
use jaus::messages::mobility;

#[test]
fn an_effort_is_the_same_percentage_on_both_sides() {
    let mut theirs = ra33::SetWrenchEffort::default();
    theirs
        .set_propulsive_linear_effort_x_percent(-100.0)
        .unwrap();
    theirs
        .set_propulsive_rotational_effort_z_percent(12.5)
        .unwrap();
    theirs.set_resistive_linear_effort_x_percent(40.0).unwrap();
    let ours: mobility::SetWrenchEffort = into_ours(&theirs).unwrap();
    near(ours.propulsive_linear_effort_x_percent(), -100.0, 0.0);
    near(ours.propulsive_rotational_effort_z_percent(), 12.5, 0.002);
    near(ours.resistive_linear_effort_x_percent(), 40.0, 0.0);
    assert_eq!(ours.propulsive_linear_effort_y, None);
    assert_eq!(
        into_theirs::<_, ra33::SetWrenchEffort>(&ours).unwrap(),
        theirs
    );
}

#[test]
fn zero_velocity_stays_zero() {
    let mut ours = mobility::SetWrenchEffort::default();
    ours.set_propulsive_linear_effort_x_percent(0.0).unwrap();
    let theirs: ra33::SetWrenchEffort = into_theirs(&ours).unwrap();
    near(theirs.propulsive_linear_effort_x_percent(), 0.0, 0.0);
    let mut theirs = ra33::SetTravelSpeed::default();
    theirs.set_speed_m_per_s(0.0).unwrap();
    let ours: mobility::SetTravelSpeed = into_ours(&theirs).unwrap();
    near(Some(ours.speed_m_per_s()), 0.0, 0.0);
}

#[test]
fn a_place_on_the_globe_is_the_same_place() {
    let mut theirs = ra33::ReportGlobalPose::default();
    theirs.set_latitude_deg(-33.856_784).unwrap();
    theirs.set_longitude_deg(151.215_297).unwrap();
    theirs.set_elevation_m(4.5).unwrap();
    theirs.set_yaw_rad(-1.25).unwrap();
    theirs.set_attitude_rms_rad(0.1).unwrap();
    theirs.time_stamp = Some(ra33::report_global_pose::TimeStamp(0x1234_5678));
    let ours: mobility::ReportGlobalPose = into_ours(&theirs).unwrap();
    near(ours.latitude_deg(), -33.856_784, 1e-7);
    near(ours.longitude_deg(), 151.215_297, 1e-7);
    near(ours.altitude_m(), 4.5, 1e-4);
    near(ours.yaw_rad(), -1.25, 1e-4);
    near(ours.attitude_rms_rad(), 0.1, 1e-4);
    assert_eq!(ours.time_stamp.map(|stamp| stamp.0), Some(0x1234_5678));
    assert_eq!((ours.roll, ours.position_rms), (None, None));
}

#[test]
fn both_ends_of_a_shared_range_convert() {
    for end in [-std::f64::consts::PI, std::f64::consts::PI] {
        let mut theirs = ra33::ReportLocalPose::default();
        theirs.set_yaw_rad(end).unwrap();
        theirs.set_x_m(100_000.0 * end.signum()).unwrap();
        let ours: mobility::ReportLocalPose = into_ours(&theirs).unwrap();
        near(ours.yaw_rad(), end, 0.0);
        near(ours.x_m(), 100_000.0 * end.signum(), 0.0);
        let back: ra33::ReportLocalPose = into_theirs(&ours).unwrap();
        assert_eq!(back, theirs);
    }
}

#[test]
fn a_velocity_is_the_same_velocity() {
    let mut ours = mobility::ReportVelocityState::default();
    ours.set_velocity_x_m_per_s(-3.25).unwrap();
    ours.set_yaw_rate_rad_per_s(0.5).unwrap();
    let theirs: ra33::ReportVelocityState = into_theirs(&ours).unwrap();
    near(theirs.velocity_x_m_per_s(), -3.25, 1e-7);
    near(theirs.yaw_rate_rad_per_s(), 0.5, 1e-3);
    assert_eq!(theirs.velocity_y, None);
}

#[test]
fn a_vector_is_the_same_vector() {
    let mut theirs = ra33::SetLocalVector::default();
    theirs.set_speed_m_per_s(2.5).unwrap();
    theirs.set_heading_rad(0.75).unwrap();
    let ours: mobility::SetLocalVector = into_ours(&theirs).unwrap();
    near(Some(ours.speed_m_per_s()), 2.5, 0.003);
    near(ours.heading_rad(), 0.75, 1e-4);
    let mut ours = mobility::SetGlobalVector::default();
    ours.set_speed_m_per_s(2.5).unwrap();
    ours.set_heading_rad(0.75).unwrap();
    let theirs: ra33::SetGlobalVector = into_theirs(&ours).unwrap();
    near(theirs.speed_m_per_s(), 2.5, 0.08);
    near(theirs.heading_rad(), 0.75, 1e-4);
    assert_eq!(theirs.altitude, None);
}

#[test]
fn a_waypoint_is_the_same_place() {
    let mut theirs = ra33::SetLocalWaypoint::default();
    theirs.set_x_m(-120.5).unwrap();
    theirs.set_y_m(33.25).unwrap();
    theirs.set_yaw_rad(1.0).unwrap();
    let ours: mobility::SetLocalWaypoint = into_ours(&theirs).unwrap();
    near(Some(ours.x_m()), -120.5, 1e-4);
    near(Some(ours.y_m()), 33.25, 1e-4);
    near(ours.yaw_rad(), 1.0, 1e-4);
    assert_eq!(ours.z, None);
    assert_eq!(
        into_theirs::<_, ra33::SetLocalWaypoint>(&ours).unwrap(),
        theirs
    );
}

#[test]
fn a_path_segment_is_the_same_curve() {
    let mut theirs = ra33::ReportGlobalPathSegment::default();
    theirs.set_p1_latitude_deg(29.001).unwrap();
    theirs.set_p1_longitude_deg(-80.002).unwrap();
    theirs.set_p2_latitude_deg(29.003).unwrap();
    theirs.set_p2_longitude_deg(-80.004).unwrap();
    theirs.set_weighting_factor_value(250.0).unwrap();
    let ours: mobility::ReportGlobalPathSegment = into_ours(&theirs).unwrap();
    near(Some(ours.p1_latitude_deg()), 29.001, 1e-7);
    near(Some(ours.p1_longitude_deg()), -80.002, 1e-7);
    near(Some(ours.p2_latitude_deg()), 29.003, 1e-7);
    near(Some(ours.p2_longitude_deg()), -80.004, 1e-7);
    near(Some(ours.weighting_factor_value()), 250.0, 0.01);
    assert_eq!(
        into_theirs::<_, ra33::ReportGlobalPathSegment>(&ours).unwrap(),
        theirs
    );
}
