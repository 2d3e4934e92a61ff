//! The picture with missing parts and outdated reports.

use super::*;
use jaus::messages::core::{ReportStatus, management};
use jaus::messages::mobility::report_local_pose::TimeStamp;
use jaus::messages::mobility::{
    ReportLocalPose, ReportVelocityState, local_pose_sensor, local_vector_driver, primitive_driver,
    velocity_state_sensor,
};
use jaus::service::Offer;
use jaus_vehicle::messages::ground::{ReportMission, ReportStage, mission_planner, stage};

const DRIVER: JausId = JausId::new(101, 2, 33);
const SENSORS: JausId = JausId::new(101, 2, 40);
const PLANNER: JausId = JausId::new(101, 2, 63);

fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

fn component(id: JausId, urns: &[&str]) -> ComponentEntry {
    let offer = |urn: &&str| Offer {
        urn: (*urn).to_owned(),
        major: 1,
        minor: 0,
    };
    ComponentEntry {
        id,
        identification: None,
        services: Some(urns.iter().map(offer).collect()),
    }
}

fn driver() -> ComponentEntry {
    component(DRIVER, &[management::URN, primitive_driver::URN])
}

fn sensors() -> ComponentEntry {
    component(
        SENSORS,
        &[local_pose_sensor::URN, velocity_state_sensor::URN],
    )
}

fn planner() -> ComponentEntry {
    component(PLANNER, &[management::URN, mission_planner::URN])
}

/// A vehicle with these components.
fn picture(now: Instant, components: &[ComponentEntry]) -> Picture {
    let mut picture = Picture::new(JausId::new(42, 1, 1), 101, Depth::Full);
    picture.set_parts(now, components.iter());
    picture
}

fn pose() -> ReportLocalPose {
    let mut pose = ReportLocalPose::default();
    pose.set_x_m(4.0).unwrap();
    pose.set_y_m(2.0).unwrap();
    pose
}

fn mission(stage: u8) -> ReportMission {
    ReportMission {
        mission: 7,
        stage: stage.into(),
        ..ReportMission::default()
    }
}

/// Reports everything.
fn report_all(picture: &mut Picture, now: Instant) {
    picture.handle_report(now, DRIVER, ReportStatus::default().into());
    picture.handle_report(now, SENSORS, pose().into());
    picture.handle_report(now, SENSORS, ReportVelocityState::default().into());
}

fn missing(picture: &Picture, now: Instant) -> Vec<String> {
    let all = picture.missing_state(now).into_iter();
    all.map(|it| format!("{} {} {}", it.name, it.id, it.how))
        .collect()
}

#[test]
fn the_picture_is_stale_without_a_status_a_pose_and_a_velocity_of_the_last_second() {
    let start = Instant::now();
    for topic in ["status", "pose", "velocity"] {
        let mut picture = picture(start, &[driver(), sensors()]);
        assert!(picture.stale(start).is_some(), "nothing was reported");
        report_all(&mut picture, start);
        assert_eq!(picture.stale(start + ms(999)), None);
        for now in [500, 1000].map(|it| start + ms(it)) {
            if topic != "status" {
                picture.handle_report(now, DRIVER, ReportStatus::default().into());
            }
            if topic != "pose" {
                picture.handle_report(now, SENSORS, pose().into());
            }
            if topic != "velocity" {
                picture.handle_report(now, SENSORS, ReportVelocityState::default().into());
            }
        }
        let why = picture.stale(start + ms(1000)).unwrap_or_default();
        assert!(why.contains(&format!("no new {topic}")), "{topic}: {why}");
    }
}

#[test]
fn turn_rates_of_an_imu_do_not_stand_in_for_the_speed() {
    let start = Instant::now();
    let imu_id = JausId::new(101, 52, 52);
    let imu = component(imu_id, &[velocity_state_sensor::URN]);
    let mut picture = picture(start, &[driver(), sensors(), imu]);
    let mut speed = ReportVelocityState::default();
    speed.set_velocity_x_m_per_s(0.5).unwrap();
    let mut turn = ReportVelocityState::default();
    turn.set_yaw_rate_rad_per_s(0.1).unwrap();
    picture.handle_report(start, imu_id, turn.clone().into());
    report_all(&mut picture, start);
    picture.handle_report(start, SENSORS, speed.into());
    for now in [500, 1000].map(|it| start + ms(it)) {
        picture.handle_report(now, DRIVER, ReportStatus::default().into());
        picture.handle_report(now, SENSORS, pose().into());
        picture.handle_report(now, imu_id, turn.clone().into());
    }
    let why = picture.stale(start + ms(1000)).unwrap_or_default();
    assert!(why.contains("no new velocity"), "{why}");
}

#[test]
fn a_vehicle_without_sensors_is_driven_by_its_status_alone() {
    let start = Instant::now();
    let mut picture = picture(start, &[driver()]);
    picture.handle_report(start, DRIVER, ReportStatus::default().into());
    assert_eq!(picture.stale(start + ms(900)), None);
    assert!(picture.stale(start + ms(1000)).is_some());
}

#[test]
fn a_sensor_that_disappears_makes_the_picture_stale() {
    let start = Instant::now();
    let mut picture = picture(start, &[driver(), sensors()]);
    report_all(&mut picture, start);
    picture.set_parts(start, [driver()].iter());
    picture.handle_report(start + ms(1000), DRIVER, ReportStatus::default().into());
    assert!(picture.stale(start + ms(1000)).is_some());
}

#[test]
fn a_pose_with_a_frozen_time_stamp_gets_old_although_reports_arrive() {
    let start = Instant::now();
    let mut picture = picture(start, &[driver(), sensors()]);
    let frozen = ReportLocalPose {
        time_stamp: Some(TimeStamp::default().with_seconds(7).unwrap()),
        ..pose()
    };
    for tenth in 0..=20 {
        let now = start + ms(100 * tenth);
        picture.handle_report(now, DRIVER, ReportStatus::default().into());
        picture.handle_report(now, SENSORS, frozen.clone().into());
        picture.handle_report(now, SENSORS, ReportVelocityState::default().into());
    }
    let now = start + ms(2000);
    assert!(picture.stale(now).is_some_and(|it| it.contains("pose")));
    assert!(missing(&picture, now).is_empty(), "it reports");
}

#[test]
fn an_unknown_position_is_not_known_although_it_is_reported() {
    let start = Instant::now();
    let mut picture = picture(start, &[driver(), sensors()]);
    picture.handle_report(start, SENSORS, ReportLocalPose::default().into());
    assert!(!picture.is_position_known());
    picture.handle_report(start, SENSORS, pose().into());
    assert!(picture.is_position_known());
}

#[test]
fn a_part_that_disappears_is_gone_until_it_is_back_or_replaced() {
    let start = Instant::now();
    let replacement = component(
        JausId::new(101, 3, 33),
        &[management::URN, primitive_driver::URN],
    );
    for back in [driver(), replacement] {
        let mut picture = picture(start, &[driver(), sensors()]);
        report_all(&mut picture, start);
        picture.set_parts(start, [sensors()].iter());
        let gone = vec!["Primitive Driver 101.2.33 gone".to_owned()];
        assert_eq!(missing(&picture, start), gone);
        let why = picture.stale(start).unwrap();
        assert_eq!(why, "the primitive driver 101.2.33 is gone");
        picture.set_parts(start, [sensors(), back].iter());
        assert!(missing(&picture, start).is_empty());
    }
}

#[test]
fn a_part_that_stays_away_is_forgotten_in_the_end() {
    let start = Instant::now();
    let mut picture = picture(start, &[driver(), sensors()]);
    picture.set_parts(start, [sensors()].iter());
    picture.handle_time(start + Duration::from_secs(299));
    assert_eq!(missing(&picture, start).len(), 1);
    picture.handle_time(start + Duration::from_secs(300));
    assert!(missing(&picture, start).is_empty());
}

#[test]
fn a_part_that_falls_silent_is_missing_after_1500_ms_and_until_it_reports() {
    let start = Instant::now();
    let mut picture = picture(start, &[driver(), sensors()]);
    report_all(&mut picture, start);
    assert!(missing(&picture, start + ms(1499)).is_empty());
    let silent = missing(&picture, start + ms(1500));
    let expected = [
        "Primitive Driver 101.2.33 silent",
        "Velocity Sensor 101.2.40 silent",
    ];
    assert_eq!(silent, expected);
    report_all(&mut picture, start + ms(1600));
    assert!(missing(&picture, start + ms(1600)).is_empty());
}

#[test]
fn a_part_whose_subscription_is_down_is_missing_after_1_s() {
    let start = Instant::now();
    let mut picture = picture(start, &[driver()]);
    picture.handle_report(start, DRIVER, ReportStatus::default().into());
    let down = Report::Subscription { is_up: false };
    picture.handle_report(start + ms(900), DRIVER, down);
    assert!(missing(&picture, start + ms(999)).is_empty());
    assert_eq!(missing(&picture, start + ms(1000)).len(), 1);
    let up = Report::Subscription { is_up: true };
    picture.handle_report(start + ms(1100), DRIVER, up);
    assert!(missing(&picture, start + ms(1100)).is_empty());
}

#[test]
fn a_planner_that_is_gone_while_it_drives_leaves_its_mission_behind() {
    let start = Instant::now();
    let mut picture = picture(start, &[driver(), planner()]);
    picture.handle_report(start, PLANNER, mission(7).into());
    assert_eq!(picture.lost_planner(start), None);
    picture.set_parts(start, [driver()].iter());
    assert_eq!(picture.lost_planner(start), Some((PLANNER, Absence::Gone)));
    let shown = picture.mission_state(start, true).unwrap();
    let lost = state::LostPlanner {
        id: "101.2.63".to_owned(),
        how: "gone",
        told_to_stop: true,
    };
    assert_eq!((shown.mission, shown.lost), (7, Some(lost)));
}

#[test]
fn a_planner_that_did_not_drive_is_not_lost_with_its_mission() {
    let start = Instant::now();
    for stage in [0, 3, 8, 9, 10] {
        let mut picture = picture(start, &[driver(), planner()]);
        picture.handle_report(start, PLANNER, mission(stage).into());
        picture.set_parts(start, [driver()].iter());
        assert_eq!(picture.lost_planner(start), None, "{stage}");
        assert_eq!(picture.mission_state(start, false), None, "{stage}");
    }
}

#[test]
fn a_planner_that_is_silent_while_others_report_is_lost_after_2_s() {
    let start = Instant::now();
    let mut picture = picture(start, &[driver(), planner()]);
    picture.handle_report(start, PLANNER, mission(7).into());
    let now = start + ms(2000);
    assert_eq!(
        picture.lost_planner(now),
        None,
        "all are silent: the network"
    );
    picture.handle_report(now, DRIVER, ReportStatus::default().into());
    assert_eq!(picture.lost_planner(now), Some((PLANNER, Absence::Silent)));
    assert_eq!(picture.lost_planner(now - ms(1)), None);
    picture.handle_report(now, PLANNER, mission(7).into());
    assert_eq!(picture.lost_planner(now), None);
}

#[test]
fn a_planner_that_drove_and_reports_no_mission_has_restarted() {
    let start = Instant::now();
    let mut picture = picture(start, &[driver(), planner()]);
    picture.handle_report(start, PLANNER, mission(7).into());
    picture.handle_report(start + ms(250), PLANNER, mission(0).into());
    let lost = Some((PLANNER, Absence::Restarted));
    // The mission does not vanish without a word, however long the new planner reports none.
    for time in [250, 500, 60_000] {
        let now = start + ms(time);
        picture.handle_report(now, PLANNER, mission(0).into());
        assert_eq!(picture.lost_planner(now), lost, "{time} ms");
        let shown = picture.mission_state(now, true).unwrap();
        assert_eq!(shown.lost.map(|it| it.how), Some("restarted"));
        assert!(
            picture
                .missing(now)
                .any(|(id, _, how)| (id, Some(how)) == (PLANNER, lost.map(|it| it.1)))
        );
    }
    let now = start + ms(60_250);
    picture.handle_report(now, PLANNER, mission(2).into());
    assert_eq!(picture.lost_planner(now), None, "a new mission");
}

#[test]
fn a_planner_that_ends_its_mission_has_not_restarted() {
    let start = Instant::now();
    for stage in [8, 9, 10] {
        let mut picture = picture(start, &[driver(), planner()]);
        for stage in [7, stage, 0] {
            picture.handle_report(start, PLANNER, mission(stage).into());
        }
        assert_eq!(picture.lost_planner(start), None, "{stage}");
    }
}

#[test]
fn a_planner_whose_restart_its_session_has_noticed_is_lost_before_it_reports() {
    let start = Instant::now();
    let mut picture = picture(start, &[driver(), planner()]);
    picture.handle_report(start, PLANNER, mission(3).into());
    picture.handle_planner_restart(PLANNER);
    assert_eq!(picture.lost_planner(start), None, "it did not drive");
    picture.handle_report(start, PLANNER, mission(7).into());
    picture.handle_planner_restart(PLANNER);
    let lost = Some((PLANNER, Absence::Restarted));
    assert_eq!(picture.lost_planner(start), lost);
    picture.handle_report(start, PLANNER, mission(7).into());
    assert_eq!(
        picture.lost_planner(start),
        lost,
        "nobody has approved that"
    );
    picture.handle_report(start, PLANNER, mission(3).into());
    picture.handle_report(start, PLANNER, mission(7).into());
    assert_eq!(picture.lost_planner(start), None, "a new mission");
}

#[test]
fn a_planner_that_was_lost_before_it_is_back_is_not_lost_again() {
    let start = Instant::now();
    let mut picture = picture(start, &[driver(), planner()]);
    picture.handle_report(start, PLANNER, mission(7).into());
    picture.set_parts(start, [driver()].iter());
    picture.handle_time(start);
    picture.set_parts(start, [driver(), planner()].iter());
    picture.handle_report(start, PLANNER, mission(0).into());
    assert_eq!(picture.lost_planner(start), None);
}

#[test]
fn the_restart_of_a_planner_is_forgotten_once_the_operator_drives_on() {
    let start = Instant::now();
    let mut picture = picture(start, &[driver(), planner()]);
    picture.handle_report(start, PLANNER, mission(7).into());
    picture.handle_report(start, PLANNER, mission(0).into());
    picture.forget_planner_restart();
    picture.handle_report(start, PLANNER, mission(0).into());
    assert_eq!(picture.lost_planner(start), None);
}

fn moving(speed: f64) -> ReportVelocityState {
    let mut report = ReportVelocityState::default();
    report.set_velocity_x_m_per_s(speed).unwrap();
    report.set_yaw_rate_rad_per_s(0.0).unwrap();
    report
}

fn shown(picture: &Picture, now: Instant) -> state::VehicleState {
    // The directory, which decides whether there is a vehicle at all, is empty here.
    picture
        .vehicle_state(now, (false, false), |_| None)
        .unwrap()
}

#[test]
fn no_source_of_velocities_hides_that_another_one_measures_motion() {
    let start = Instant::now();
    let other_id = JausId::new(101, 7, 42);
    let other = component(other_id, &[velocity_state_sensor::URN]);
    let mut picture = picture(start, &[driver(), sensors(), other]);
    let emergency = || ReportStatus {
        status: (State::Emergency as u8).into(),
        ..ReportStatus::default()
    };
    for step in 0..60 {
        let now = start + ms(40 * step);
        picture.handle_report(now, DRIVER, emergency().into());
        if step % 5 == 0 {
            picture.handle_report(now, SENSORS, moving(1.0).into());
        }
        picture.handle_report(now, other_id, moving(0.0).into());
        assert_eq!(shown(&picture, now).at_rest, Some(false), "{step}");
    }
    let end = start + ms(40 * 59);
    assert!(shown(&picture, end).runaway);
    // The only source that is left counts.
    let later = end + ms(1200);
    picture.handle_report(later, DRIVER, emergency().into());
    picture.handle_report(later, other_id, moving(0.0).into());
    assert_eq!(shown(&picture, later).at_rest, Some(true));
}

#[test]
fn an_emergency_does_not_count_as_a_stop_before_the_speed_is_measured() {
    let start = Instant::now();
    let mut picture = picture(start, &[driver(), sensors()]);
    let emergency = ReportStatus {
        status: (State::Emergency as u8).into(),
        ..ReportStatus::default()
    };
    picture.handle_report(start, DRIVER, emergency.into());
    let rest = |picture: &Picture, now| {
        let shown = shown(picture, now);
        assert!(shown.emergency);
        shown.at_rest
    };
    assert_eq!(rest(&picture, start), None, "no velocity was reported");
    picture.handle_report(start, SENSORS, moving(1.7).into());
    assert_eq!(rest(&picture, start), Some(false));
    picture.handle_report(start + ms(100), SENSORS, moving(0.0).into());
    assert_eq!(rest(&picture, start + ms(1099)), Some(true));
    assert_eq!(rest(&picture, start + ms(1100)), None, "the sample is old");
    let unknown = ReportVelocityState::default();
    picture.handle_report(start + ms(1100), SENSORS, unknown.into());
    assert_eq!(rest(&picture, start + ms(1100)), None);
}

#[test]
fn an_emergency_of_before_does_not_confirm_a_stop() {
    let start = Instant::now();
    let emergency = || ReportStatus {
        status: (State::Emergency as u8).into(),
        ..ReportStatus::default()
    };
    let mut picture = picture(start, &[driver()]);
    let is_confirmed = |picture: &Picture, now: Instant| {
        let listed = picture.fleet_state(now, String::new(), (false, false, true));
        let shown = picture.vehicle_state(now, (true, false), |_| None);
        assert_eq!(shown.unwrap().emergency, listed.emergency);
        assert_eq!(listed.state, Some("emergency"));
        assert_eq!(
            listed.emergency,
            picture.not_in_emergency(now).next().is_none()
        );
        listed.emergency
    };
    picture.handle_report(start, DRIVER, emergency().into());
    picture.handle_stop(start);
    assert!(
        !is_confirmed(&picture, start),
        "another one's, or of before"
    );
    picture.handle_report(start + ms(1999), DRIVER, emergency().into());
    assert!(
        !is_confirmed(&picture, start + ms(1999)),
        "under way before"
    );
    picture.handle_stop_answered(DRIVER);
    assert!(is_confirmed(&picture, start + ms(1999)));
    assert!(
        !is_confirmed(&picture, start + ms(3999)),
        "not heard any more"
    );
    // One that acknowledges nothing.
    picture.handle_stop(start + ms(4000));
    picture.handle_report(start + ms(5999), DRIVER, emergency().into());
    assert!(!is_confirmed(&picture, start + ms(6000)));
    picture.handle_report(start + ms(6000), DRIVER, emergency().into());
    assert!(is_confirmed(&picture, start + ms(6000)));
}

#[test]
fn a_vehicle_that_keeps_moving_in_emergency_is_a_runaway_while_its_speed_is_known() {
    let start = Instant::now();
    let mut picture = picture(start, &[driver(), sensors()]);
    for tenth in 0..=12 {
        let now = start + ms(100 * tenth);
        let emergency = ReportStatus {
            status: (State::Emergency as u8).into(),
            ..ReportStatus::default()
        };
        assert!(!shown(&picture, now).runaway, "{tenth}");
        if tenth < 11 {
            picture.handle_report(now, DRIVER, emergency.into());
            picture.handle_report(now, SENSORS, moving(0.6).into());
        }
        if tenth == 10 {
            break;
        }
    }
    assert!(shown(&picture, start + ms(1000)).runaway);
    assert!(
        picture
            .fleet_state(start + ms(1000), String::new(), (false, false, false))
            .runaway
    );
    assert!(!shown(&picture, start + ms(2000)).runaway);
}

#[test]
fn the_reason_of_the_driver_nearest_to_the_motors_says_why_the_vehicle_is_held() {
    let start = Instant::now();
    let vector = component(
        JausId::new(101, 2, 35),
        &[management::URN, local_vector_driver::URN, stage::URN],
    );
    let vector_id = vector.id;
    let mut picture = picture(start, &[driver(), vector, sensors()]);
    let report = |state: u8, reason: &str| ReportStage {
        state: state.into(),
        reason: reason.into(),
        ..ReportStage::default()
    };
    assert_eq!(shown(&picture, start).held, None);
    let obstacle = "an obstacle is 0.4 m away: turn or drive back";
    picture.handle_report(start, vector_id, report(3, obstacle).into());
    let held = shown(&picture, start).held.unwrap();
    assert_eq!((held.role, &*held.reason), ("vector_driver", obstacle));
    let edge = "the edge of the operating zone is 0.2 m away: turn or drive back";
    picture.handle_report(start, DRIVER, report(2, edge).into());
    let held = shown(&picture, start).held.unwrap();
    assert_eq!((held.role, &*held.reason), ("primitive_driver", edge));
    assert_eq!(shown(&picture, start + ms(1500)).held, None, "it is old");
    picture.handle_report(start, DRIVER, report(2, "").into());
    picture.handle_report(start, vector_id, report(0, "stopped: released").into());
    assert_eq!(shown(&picture, start).held, None, "nothing holds it");
}
