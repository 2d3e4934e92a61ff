//! Following curves.

use super::*;
use jaus::messages::mobility::{
    QueryActiveElement, QueryGlobalPathSegment, QueryLocalPathSegment, QueryLocalPathSegmentExt,
    ReportActiveElement, ReportGlobalPathSegment, ReportLocalPathSegment,
    ReportLocalPathSegmentExt, SetGlobalPathSegment, SetLocalPathSegment, SetLocalPathSegmentExt,
};

fn local(control: (f64, f64), end: (f64, f64), weight: f64) -> SetLocalPathSegment {
    let mut path = SetLocalPathSegment::default();
    path.set_p1_x_m(control.0).unwrap();
    path.set_p1_y_m(control.1).unwrap();
    path.set_p2_x_m(end.0).unwrap();
    path.set_p2_y_m(end.1).unwrap();
    path.set_weighting_factor_value(weight).unwrap();
    path
}

#[test]
fn two_quarters_of_a_circle_are_driven_one_after_the_other() {
    let (mut rig, vehicle) = rig();
    let weight = std::f64::consts::FRAC_1_SQRT_2;
    let first = local((10.0, 0.0), (10.0, 10.0), weight);
    let second = local((10.0, 20.0), (0.0, 20.0), weight);
    let elements = vec![element(1, 0, 2, &first), element(2, 1, 0, &second)];
    assert!(set_elements(&mut rig, elements));
    rig.send(CLIENT, &execute(Some(1), 1.0));
    let query = QueryLocalPathSegment::all();
    let report: ReportLocalPathSegment = rig.ask(&query).unwrap();
    assert!(report.p1_x == first.p1_x && report.weighting_factor == first.weighting_factor);
    let mut seen = Vec::new();
    for _ in 0..2000 {
        rig.run(seconds(0.02));
        let pose = vehicle.motion().pose;
        let off = (pose.distance(0.0, 10.0) - 10.0).abs();
        assert!(off < 0.5, "{off} m off the circle at {pose:?}");
        let active: ReportActiveElement = rig.ask(&QueryActiveElement).unwrap();
        seen.push(active.element_uid);
        if active.element_uid == 0 {
            break;
        }
    }
    seen.dedup();
    assert_eq!(seen, [1, 2, 0]);
    rig.run(seconds(2.0));
    assert!(vehicle.motion().pose.distance(0.0, 20.0) <= 0.5);
}

#[test]
fn a_curve_is_gone_on_with_after_a_stop_in_its_middle() {
    let (mut rig, vehicle) = rig();
    let path = local((10.0, 0.0), (10.0, 10.0), 1.0);
    assert!(set_elements(&mut rig, vec![element(1, 0, 0, &path)]));
    rig.send(CLIENT, &execute(Some(1), 1.0));
    rig.run(seconds(6.0));
    rig.send(CLIENT, &execute(None, 0.0));
    rig.run(seconds(2.0));
    let stopped = vehicle.motion();
    assert!(stopped.velocity.is_rest() && stopped.pose.x > 3.0);
    rig.send(CLIENT, &execute(None, 1.0));
    for _ in 0..1000 {
        rig.run(seconds(0.02));
        assert!(
            vehicle.motion().pose.x > stopped.pose.x - 0.5,
            "it turned back"
        );
    }
    assert!(vehicle.motion().pose.distance(10.0, 10.0) <= 0.5);
}

#[test]
fn segments_of_version_1_1_are_driven_as_well() {
    let (mut rig, vehicle) = rig();
    let mut path = SetLocalPathSegmentExt::default();
    path.set_p1_x_m(5.0).unwrap();
    path.set_p1_y_m(0.0).unwrap();
    path.set_p2_x_m(10.0).unwrap();
    path.set_p2_y_m(0.0).unwrap();
    path.set_path_tolerance_m(2.0).unwrap();
    assert!(set_elements(&mut rig, vec![element(1, 0, 0, &path)]));
    rig.send(CLIENT, &execute(Some(1), 2.0));
    let query = QueryLocalPathSegmentExt::all();
    let report: ReportLocalPathSegmentExt = rig.ask(&query).unwrap();
    assert!(report.p2_x == path.p2_x && report.path_tolerance == path.path_tolerance);
    rig.run(seconds(20.0));
    assert!(vehicle.motion().pose.distance(10.0, 0.0) <= 0.5);
}

#[test]
fn a_segment_on_the_globe_leads_where_it_says() {
    let (mut rig, vehicle) = rig();
    let mut path = SetGlobalPathSegment::default();
    path.set_p1_latitude_deg(FRAME.0 + 0.0001).unwrap();
    path.set_p1_longitude_deg(FRAME.1).unwrap();
    path.set_p2_latitude_deg(FRAME.0 + 0.0001).unwrap();
    path.set_p2_longitude_deg(FRAME.1 + 0.0002).unwrap();
    path.set_weighting_factor_value(1.0).unwrap();
    assert!(set_elements(&mut rig, vec![element(1, 0, 0, &path)]));
    rig.send(CLIENT, &execute(Some(0), 2.0));
    let query = QueryGlobalPathSegment::none();
    let report: ReportGlobalPathSegment = rig.ask(&query).unwrap();
    assert_eq!(report.p2_longitude, path.p2_longitude);
    rig.run(seconds(30.0));
    let pose = vehicle.global_pose();
    assert!((pose.latitude - FRAME.0 - 0.0001).abs() < 5e-6, "{pose:?}");
    assert!((pose.longitude - FRAME.1 - 0.0002).abs() < 8e-6, "{pose:?}");
}

#[test]
fn a_segment_that_cannot_be_read_is_refused() {
    let (mut rig, _) = rig();
    let path = local((10.0, 0.0), (10.0, 10.0), 1.0);
    let mut damaged = element(1, 0, 0, &path);
    damaged.element_data.data.truncate(7);
    assert!(!set_elements(&mut rig, vec![damaged]));
}
