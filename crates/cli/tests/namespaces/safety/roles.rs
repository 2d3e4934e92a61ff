//! Roles of the node processes. They print the lines that the tests wait for.

use std::time::{Duration, SystemTime};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::{FormattedBlob, Message};
use jaus::component::{Component, Control, Kind};
use jaus::messages::core::set_element::{ElementDataFormat, ElementRec, RequestIdRec};
use jaus::messages::core::{QueryControl, ReportControl, SetElement};
use jaus::messages::mobility::{
    ExecuteList, QueryLocalPose, QueryVelocityState, ReportLocalPose, ReportVelocityState,
    SetLocalVector, SetLocalWaypoint, SetTravelSpeed, SetWrenchEffort, local_pose_sensor,
    primitive_driver,
};
use jaus::node::{Config, Host, Node};
use jaus::wire::{Frame, judp};
use tokio::net::UdpSocket;
use tokio::time::{interval, sleep, timeout};

use crate::testbed::TO_STRANGERS;
use jaus_test_kit::hosts::SETTINGS;

pub(crate) const VEHICLE: JausId = JausId::new(101, 1, 1);
/// Where the node on the controller's host accepts local components.
pub(crate) const LOCAL: &str = "127.0.0.1:37940";
/// Number of components that appear once and vanish.
pub(crate) const STRANGERS: u16 = 600;
/// Speed of the vehicle in m/s: its maximum.
const SPEED: f64 = 2.0;
/// Distance to the goal in metres: more than the vehicle covers in any case.
const FAR: f64 = 400.0;
/// Interval of the controller's efforts and of the observer's samples.
const BEAT: Duration = Duration::from_millis(100);
/// Timeout of finding the vehicle.
const SEARCH: Duration = Duration::from_secs(20);

/// The commands with which the controller drives the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Drive {
    /// An effort, ten times per second.
    Effort,
    /// One vector.
    Vector,
    /// One waypoint.
    Waypoint,
    /// A list of one waypoint, executed once.
    List,
}

impl Drive {
    const ALL: [Self; 4] = [Self::Effort, Self::Vector, Self::Waypoint, Self::List];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Effort => "effort",
            Self::Vector => "vector",
            Self::Waypoint => "waypoint",
            Self::List => "list",
        }
    }
}

/// Takes control of the vehicle, drives it, and ignores a loss of control. The settings name the
/// kind of command, and say whether the controller is attached `behind-node`.
pub(crate) async fn control() {
    let settings = std::env::var(SETTINGS).unwrap();
    let (drive, place) = settings.split_once(' ').unwrap();
    let drive = Drive::ALL.into_iter().find(|it| it.name() == drive);
    let builder = Component::builder(Kind::OperatorControlUnit, "Driver");
    let (_node, controller) = if place == "behind-node" {
        let host = Host::at(LOCAL.parse().unwrap());
        let port = host.attach(2).await.unwrap();
        (None, builder.live_on(port).unwrap())
    } else {
        let node = Node::start(Config::new(102, 1)).unwrap();
        let controller = builder.attach(&node, 1).unwrap();
        (Some(node), controller)
    };
    let found = controller.find_within(primitive_driver::URN, SEARCH).await;
    assert_eq!(found.unwrap(), VEHICLE);
    let control = controller.control(VEHICLE, 127).await.unwrap();
    control.resume().await.unwrap();
    println!("\ndrives");
    order(&control, drive.unwrap()).await;
    if drive == Some(Drive::Effort) {
        let mut beats = interval(BEAT);
        loop {
            beats.tick().await;
            // Not through `control`, which refuses to send once control is lost. The network may be
            // down.
            let _ = controller.send(VEHICLE, &effort());
        }
    }
    std::future::pending::<()>().await;
}

/// Sends the commands that are sent only once.
async fn order(control: &Control, drive: Drive) {
    match drive {
        Drive::Effort => {}
        Drive::Vector => control.deliver(&vector()).await.unwrap(),
        Drive::Waypoint => {
            control.deliver(&waypoint()).await.unwrap();
            let mut speed = SetTravelSpeed::default();
            speed.set_speed_m_per_s(SPEED).unwrap();
            control.deliver(&speed).await.unwrap();
        }
        Drive::List => {
            control.deliver(&list()).await.unwrap();
            let mut execute = ExecuteList {
                element_uid: Some(1),
                ..ExecuteList::default()
            };
            execute.set_speed_m_per_s(SPEED).unwrap();
            control.deliver(&execute).await.unwrap();
        }
    }
}

fn effort() -> SetWrenchEffort {
    let mut effort = SetWrenchEffort::default();
    effort
        .set_propulsive_linear_effort_x_percent(100.0)
        .unwrap();
    effort
}

fn vector() -> SetLocalVector {
    let mut vector = SetLocalVector::default();
    vector.set_speed_m_per_s(SPEED).unwrap();
    vector.set_heading_rad(0.0).unwrap();
    vector
}

fn waypoint() -> SetLocalWaypoint {
    let mut waypoint = SetLocalWaypoint::default();
    waypoint.set_x_m(FAR).unwrap();
    waypoint.set_y_m(0.0).unwrap();
    waypoint
}

fn list() -> SetElement {
    let goal = waypoint().encode().unwrap();
    SetElement {
        request_id_rec: RequestIdRec { request_id: 1 },
        element_list: vec![ElementRec {
            element_uid: 1,
            previous_uid: 0,
            next_uid: 0,
            element_data: FormattedBlob::new(ElementDataFormat::JAUS_MESSAGE, goal),
        }],
    }
}

/// One observation of the vehicle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    /// Time since 1970-01-01.
    pub(crate) at: Duration,
    /// Position, in metres.
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// In m/s.
    pub(crate) speed: f64,
    /// The subsystem in control, 0 for none.
    pub(crate) controller: u16,
}

impl Sample {
    /// Reads a line that the observer has printed.
    pub(crate) fn parse(line: &str) -> Self {
        let mut words = line.split(' ');
        let mut number = || words.next().unwrap().parse::<f64>().unwrap();
        Self {
            at: Duration::from_secs_f64(number()),
            x: number(),
            y: number(),
            speed: number(),
            controller: number() as u16,
        }
    }

    /// In metres.
    pub(crate) fn distance(&self, to: &Self) -> f64 {
        (to.x - self.x).hypot(to.y - self.y)
    }
}

/// Time since 1970-01-01, the same for all processes.
pub(crate) fn wall_clock() -> Duration {
    let since_1970 = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    since_1970.unwrap()
}

/// Queries the vehicle's pose, velocity and controller ten times per second.
pub(crate) async fn observe() {
    let node = Node::start(Config::new(103, 1)).unwrap();
    let builder = Component::builder(Kind::OtherSubsystem, "Observer");
    let observer = builder.attach(&node, 1).unwrap();
    let found = observer.find_within(local_pose_sensor::URN, SEARCH).await;
    assert_eq!(found.unwrap(), VEHICLE);
    let mut beats = interval(BEAT);
    println!();
    loop {
        beats.tick().await;
        let pose = QueryLocalPose::none().with_x().with_y();
        let pose = observer.query(VEHICLE, &pose).await;
        let velocity = QueryVelocityState::none().with_velocity_x();
        let velocity = observer.query(VEHICLE, &velocity).await;
        let control = observer.query(VEHICLE, &QueryControl {}).await;
        let (pose, velocity, control): (ReportLocalPose, ReportVelocityState, ReportControl) =
            match (pose, velocity, control) {
                (Ok(pose), Ok(velocity), Ok(control)) => (pose, velocity, control),
                // The vehicle has ended or is about to start.
                _ => continue,
            };
        println!(
            "sample {:.6} {} {} {} {}",
            wall_clock().as_secs_f64(),
            pose.x_m().unwrap(),
            pose.y_m().unwrap(),
            velocity.velocity_x_m_per_s().unwrap(),
            control.subsystem_id
        );
    }
}

/// Many components appear, each at its own address, and then fall silent.
pub(crate) async fn show_up() {
    const HEARTBEAT: Bytes = Bytes::from_static(&[0x02, 0x22]);
    const IDENTIFICATION: Bytes = Bytes::from_static(&[0x00, 0x2B, 0x02]);
    let mut sockets = Vec::new();
    for number in 0..STRANGERS {
        let [high, low] = (number + 256).to_be_bytes();
        let socket = UdpSocket::bind((format!("10.217.{high}.{low}"), judp::PORT));
        let socket = socket.await.unwrap();
        let id = JausId::new(1000 + number, 1, 1);
        for query in [HEARTBEAT, IDENTIFICATION] {
            let datagram = judp::encode(&Frame::new(id, VEHICLE, query)).unwrap();
            let vehicle = (TO_STRANGERS, judp::PORT);
            socket.send_to(&datagram, vehicle).await.unwrap();
        }
        sockets.push(socket);
        sleep(Duration::from_millis(2)).await;
    }
    let mut answered = 0;
    for socket in sockets {
        let mut answer = [0; 1500];
        let answer = timeout(BEAT, socket.recv_from(&mut answer)).await;
        answered += u16::from(answer.is_ok());
    }
    println!("\nanswered {answered}");
}
