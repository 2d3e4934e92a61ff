//! A JAUS operator that discovers the RA vehicle 20, observes it, and drives it.

use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, Kind, When};
use jaus::messages::mobility::{
    QueryGlobalPose, QueryVelocityState, SetWrenchEffort, global_pose_sensor,
};
use jaus::node::{Config, Node};
use tokio::time::{Instant, sleep, timeout_at};

const DRIVER: JausId = JausId::new(20, 1, 33);
const POSE: JausId = JausId::new(20, 1, 38);
const VELOCITY: JausId = JausId::new(20, 1, 42);

pub(crate) async fn play() {
    let mut config = Config::new(42, 1);
    config.port = 0;
    let node = Node::start(config).unwrap();
    let operator = Component::builder(Kind::OperatorControlUnit, "Operator")
        .attach(&node, 1)
        .unwrap();
    find(&operator).await;
    ask(&operator).await;
    watch(&operator).await;
    drive(&operator).await;
    node.shutdown().await;
}

async fn find(operator: &Component) {
    let limit = Duration::from_secs(20);
    let found = operator.find_within(global_pose_sensor::URN, limit).await;
    assert_eq!(found.unwrap(), POSE);
    loop {
        let directory = operator.directory();
        let component = directory.component(POSE);
        let told = component.and_then(|it| it.identification.as_ref());
        if let Some(told) = told {
            return println!("\nfound {POSE} {}", told.name);
        }
        sleep(Duration::from_millis(50)).await;
    }
}

async fn ask(operator: &Component) {
    let query = QueryGlobalPose::all();
    let pose = operator.query(POSE, &query).await.unwrap();
    println!("latitude {:.4}", pose.latitude_deg().unwrap());
}

async fn watch(operator: &Component) {
    let query = QueryGlobalPose::none()
        .with_latitude()
        .with_longitude()
        .with_altitude()
        .with_position_rms()
        .with_roll()
        .with_pitch()
        .with_yaw()
        .with_attitude_rms();
    let when = When::hz(10.0);
    let poses = operator.subscribe(POSE, &query, when);
    let mut poses = poses.await.unwrap();
    let query = QueryVelocityState::none()
        .with_velocity_x()
        .with_velocity_y()
        .with_velocity_z()
        .with_velocity_rms()
        .with_roll_rate()
        .with_pitch_rate()
        .with_yaw_rate()
        .with_rate_rms();
    let velocities = operator.subscribe(VELOCITY, &query, when);
    let mut velocities = velocities.await.unwrap();
    let end = Instant::now() + Duration::from_secs(3);
    let (mut many, mut fast) = (0, 0);
    loop {
        tokio::select! {
            report = timeout_at(end, poses.report()) => match report {
                Ok(report) => many += u32::from(report.is_some()),
                Err(_) => break,
            },
            report = velocities.report() => fast += u32::from(report.is_some()),
        }
    }
    println!("velocities in 3 s {fast}");
    println!("poses in 3 s {many}");
}

async fn drive(operator: &Component) {
    let control = operator.control(DRIVER, 127).await.unwrap();
    println!("in control");
    control.resume().await.unwrap();
    println!("ready");
    let mut effort = SetWrenchEffort::default();
    effort.set_propulsive_linear_effort_x_percent(50.0).unwrap();
    for _ in 0..60 {
        control.send(&effort).unwrap();
        sleep(Duration::from_millis(50)).await;
    }
    let query = QueryVelocityState::none().with_velocity_x();
    let speed = operator.query(VELOCITY, &query).await.unwrap();
    println!("speed {:.2} m/s", speed.velocity_x_m_per_s().unwrap());
    control.release().await;
    println!("released");
}
