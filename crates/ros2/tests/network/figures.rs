//! What a bridge costs: from a report of the vehicle to a subscription of ROS, and its processor time.

use std::fs;
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use jaus::component::{Component, Handlers, Kind};
use jaus::messages::mobility::{
    QueryLocalPose, QueryLocalPoseExt, QueryVelocityState, QueryVelocityStateExt, ReportLocalPose,
    ReportVelocityState, local_pose_sensor, velocity_state_sensor,
};
use jaus::node::{Config, Node};
use jaus_ros2::{Interfaces, Qos};
use jaus_test_kit::figures::Figures;
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::within_limit;

use crate::bridge::Bridge;
use crate::scene::{Script, endpoint, session};

/// How long each measurement lasts.
const STRETCH: Duration = Duration::from_secs(10);
/// Of the system's clock ticks, in which it counts processor time, per second.
const TICKS: f64 = 100.0;

/// When each report was made. The number of a report is its X.
type Made = Arc<Mutex<Vec<Instant>>>;

fn poses(made: Made) -> Handlers {
    Handlers::new(local_pose_sensor::LATEST)
        .answer(move |_: QueryLocalPose| {
            let mut made = made.lock().unwrap();
            let mut report = ReportLocalPose::default();
            report.set_x_m(made.len() as f64).unwrap();
            report.set_y_m(0.0).unwrap();
            report.set_yaw_rad(0.0).unwrap();
            made.push(Instant::now());
            report
        })
        .declines::<QueryLocalPoseExt>()
}

fn velocities() -> Handlers {
    Handlers::new(velocity_state_sensor::LATEST)
        .answer(|_: QueryVelocityState| {
            let mut report = ReportVelocityState::default();
            report.set_velocity_x_m_per_s(1.0).unwrap();
            report
        })
        .declines::<QueryVelocityStateExt>()
}

/// The processor time of a process in seconds.
fn processor_time(id: u32) -> f64 {
    let stat = fs::read_to_string(format!("/proc/{id}/stat")).unwrap();
    let (_, fields) = stat.rsplit_once(')').unwrap();
    let fields: Vec<&str> = fields.split_whitespace().collect();
    let ticks: f64 = fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap();
    ticks / TICKS
}

fn percentile(sorted: &[Duration], percent: usize) -> String {
    let at = (sorted.len() * percent / 100).min(sorted.len() - 1);
    format!("{:.2}", sorted[at].as_secs_f64() * 1e3)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "takes half a minute, and packages of Python: .ci/ros2 --figures"]
async fn figures_of_poses_and_velocities_through_the_bridge() {
    let mut figures = Figures::new("ros2", ".ci/ros2 --figures");
    figures.table(
        "From a report to a subscription of ROS",
        [
            "rate (Hz)",
            "messages",
            "median (ms)",
            "p99 (ms)",
            "processor of the bridge (%)",
        ],
    );
    for rate in ["10", "100"] {
        let group = own_group();
        let node = Node::start(Config::loopback(101, 1).group(group)).unwrap();
        let made = Made::default();
        let vehicle = Component::builder(Kind::Vehicle, "Rover")
            .offer(poses(made.clone()))
            .offer(velocities())
            .attach(&node, 43)
            .unwrap();
        let network = endpoint();
        let _router = Script::router(&network);
        let bridge = Command::new(env!("CARGO_BIN_EXE_jaus-ros2"))
            .args([
                "--loopback",
                "--port",
                "0",
                "--id",
                "101.252.1",
                "--vehicle",
                "101",
            ])
            .args(["--group", &group.to_string()])
            .args(["--connect", &network, "--rate", rate, "--tf"])
            .env_remove("ROS_DOMAIN_ID")
            .stdin(Stdio::null())
            .spawn();
        let bridge = Bridge(bridge.unwrap());
        let ros = session(&network);
        let odometry = Interfaces::bundled().unwrap().get("nav_msgs/msg/Odometry");
        let listener = ros.node("/", "listener").unwrap();
        let qos = Qos::default().with_depth(1000);
        let subscribed = listener.subscription("/v101/odom", &odometry.unwrap(), qos);
        let mut subscription = subscribed.unwrap();
        within_limit(subscription.receive()).await;

        let processor = processor_time(bridge.0.id());
        let end = Instant::now() + STRETCH;
        let mut times = Vec::new();
        while Instant::now() < end {
            let received = within_limit(subscription.receive()).await;
            let now = Instant::now();
            let number = received.message.float("pose.pose.position.y").unwrap();
            let made = made.lock().unwrap()[number.round() as usize];
            times.push(now - made);
        }
        let processor = processor_time(bridge.0.id()) - processor;
        times.sort();
        figures.row([
            rate,
            &times.len().to_string(),
            &percentile(&times, 50),
            &percentile(&times, 99),
            &format!("{:.1}", 100.0 * processor / STRETCH.as_secs_f64()),
        ]);
        drop((bridge, vehicle));
        node.shutdown().await;
    }
    figures.finish();
}
