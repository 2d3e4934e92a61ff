//! Well-behaved clients. They print the lines that the tests wait for.

use std::net::UdpSocket;
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::component::{Component, Kind, Update, When};
use jaus::link::Ip;
use jaus::messages::core::QueryControl;
use jaus::messages::mobility::{QueryLocalPose, local_pose_sensor};
use jaus::node::{Config, Node};
use tokio::time::{interval, timeout};

use jaus_test_kit::hosts::SETTINGS;
use jaus_test_kit::waiting::LIMIT;

pub(crate) const VEHICLE: JausId = JausId::new(101, 1, 1);
pub(crate) const CLIENT: JausId = JausId::new(102, 1, 1);
/// Port of the echo socket on the vehicle's host.
pub(crate) const ECHO: u16 = 9999;
/// The vehicle's address on the client's cable.
const TO_CLIENT: &str = "10.216.1.1";
/// The vehicle's address on the observer's cable.
const TO_OBSERVER: &str = "10.216.3.1";
const NEWCOMER: u16 = 104;
/// Interval of the client's reports.
const SPAN: Duration = Duration::from_secs(3);
/// An answer later than this counts as lost.
const LOST: Duration = Duration::from_millis(500);

/// The default settings, with the changes that the role was started with.
fn config(subsystem: u16) -> Config {
    let config = Config::new(subsystem, 1);
    match std::env::var(SETTINGS).unwrap_or_default().as_str() {
        "" | "echo" => config,
        "ip6" => {
            let cable = if subsystem == NEWCOMER { 3 } else { 1 };
            let mut config = config.interfaces([format!("fd00:216:{cable}::2")]);
            config.ip = Ip::V6;
            config
        }
        "tcp" => config
            .without_udp()
            .tcp_connect(TO_OBSERVER.parse().unwrap()),
        other => panic!("no setting is called {other}"),
    }
}

/// Starts a node with the settings of the role; `secure:FOLDER` are keys for a secure link.
fn start(subsystem: u16) -> Node {
    #[cfg(feature = "secure")]
    if let Some(folder) = super::secure::folder_of_keys() {
        return super::secure::start(subsystem, &folder);
    }
    Node::start(config(subsystem)).unwrap()
}

/// Queries the vehicle and the echo socket 20 times per second, and subscribes to 25 poses per
/// second.
pub(crate) async fn client() {
    let node = start(CLIENT.subsystem());
    let builder = Component::builder(Kind::OperatorControlUnit, "Client");
    let client = builder.attach(&node, CLIENT.component()).unwrap();
    let found = client.find_within(local_pose_sensor::URN, LIMIT).await;
    assert_eq!(found.unwrap(), VEHICLE);
    let query = QueryLocalPose::none().with_x().with_y();
    let events = client.subscribe(VEHICLE, &query, When::hz(25.0));
    let mut events = events.await.unwrap();
    let echo = tokio::net::UdpSocket::bind(("0.0.0.0", 0)).await.unwrap();
    echo.connect((TO_CLIENT, ECHO)).await.unwrap();
    let asks_echo = std::env::var(SETTINGS).is_ok_and(|it| it == "echo");
    let place = async || {
        let pose = client.query(VEHICLE, &query).await;
        pose.ok()
            .map(|pose| (pose.x_m().unwrap(), pose.y_m().unwrap()))
    };
    let start = place().await.unwrap();
    println!("\nclient has found the vehicle");
    loop {
        let (mut lost, mut echoes_lost, mut pings) = (0, 0, 0);
        // Answers since the last event, and the most between two events.
        let (mut answers, mut answers_between) = (0, 0);
        let (mut last, mut gap) = (Instant::now(), Duration::ZERO);
        let mut round_trips = Vec::new();
        let end = Instant::now() + SPAN;
        let mut beats = interval(Duration::from_millis(50));
        while Instant::now() < end {
            tokio::select! {
                update = events.next() => if let Some(Update::Report(_)) = update {
                    gap = gap.max(last.elapsed());
                    last = Instant::now();
                    answers = 0;
                },
                _ = beats.tick() => {
                    pings += 1;
                    let echoed = async {
                        // No echo is requested, so none is lost.
                        if !asks_echo {
                            return true;
                        }
                        let _ = echo.send(b"ping").await;
                        let mut octets = [0; 8];
                        let answer = timeout(LOST, echo.recv(&mut octets)).await;
                        matches!(answer, Ok(Ok(_)))
                    };
                    let sent = Instant::now();
                    let timed = async {
                        let answer = timeout(LOST, place()).await;
                        (answer, sent.elapsed())
                    };
                    let ((answer, time), echoed) = tokio::join!(timed, echoed);
                    round_trips.push(time);
                    let is_answered = matches!(answer, Ok(Some(_)));
                    lost += u64::from(!is_answered);
                    answers += u64::from(is_answered);
                    answers_between = answers_between.max(answers);
                    echoes_lost += u64::from(!echoed);
                }
            }
        }
        gap = gap.max(last.elapsed());
        round_trips.sort_unstable();
        let median = round_trips[round_trips.len() / 2];
        let control = client.query(VEHICLE, &QueryControl {}).await;
        let controller = control.map_or(0, |it| it.subsystem_id);
        let now = place().await.unwrap_or(start);
        let moved = (now.0 - start.0).hypot(now.1 - start.1) * 1000.0;
        println!(
            "client pings={pings} lost={lost} echoes_lost={echoes_lost} gap_ms={} \
             median_us={} answers_between={answers_between} controller={controller} moved_mm={}",
            gap.as_millis(),
            median.as_micros(),
            moved.round()
        );
    }
}

/// Starts, finds the vehicle, queries it until it answers, prints how many queries and how long that
/// took, and stays.
pub(crate) async fn newcomer() {
    let begun = Instant::now();
    let node = Node::start(config(NEWCOMER)).unwrap();
    let builder = Component::builder(Kind::OtherSubsystem, "Newcomer");
    let newcomer = builder.attach(&node, 1).unwrap();
    let found = newcomer.find_within(local_pose_sensor::URN, LIMIT).await;
    assert_eq!(found.unwrap(), VEHICLE);
    let query = QueryLocalPose::none().with_x().with_y();
    let mut queries = 1;
    while newcomer.query(VEHICLE, &query).await.is_err() {
        queries += 1;
    }
    let ms = begun.elapsed().as_millis();
    println!("\nnewcomer queries={queries} ms={ms}");
    std::future::pending::<()>().await;
}

/// Subscribes to 1000 poses per second, and reads them until killed.
pub(crate) async fn subscriber() {
    let node = Node::start(config(NEWCOMER)).unwrap();
    let builder = Component::builder(Kind::OtherSubsystem, "Subscriber");
    let subscriber = builder.attach(&node, 1).unwrap();
    let found = subscriber.find_within(local_pose_sensor::URN, LIMIT).await;
    let query = QueryLocalPose::none().with_x().with_y();
    let often = When::hz(1000.0);
    let events = subscriber.subscribe(found.unwrap(), &query, often);
    let mut events = events.await.unwrap();
    let mut number = 0;
    while let Some(update) = events.next().await {
        number += u32::from(matches!(update, Update::Report(_)));
        if number == 100 {
            println!("\nsubscriber reads");
        }
    }
}

/// Echoes datagrams until killed.
pub(crate) fn echo() {
    let socket = UdpSocket::bind(("0.0.0.0", ECHO)).unwrap();
    println!("\nechoes");
    let mut buffer = [0; 2048];
    while let Ok((length, from)) = socket.recv_from(&mut buffer) {
        // Datagrams that the kernel refuses are lost.
        let _ = socket.send_to(&buffer[..length], from);
    }
}
