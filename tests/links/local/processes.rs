//! Component processes that are killed, stopped and restarted.

use std::process::Stdio;
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::component::{Component, Kind};
use jaus::node::{
    ComponentEvent, Departure, Host, HostEvent, HostEvents, Node, SendError, Undelivered,
};
use jaus_test_kit::waiting::{LIMIT, within_limit};
use tokio::io::{AsyncBufReadExt, BufReader, Lines};
use tokio::process::{Child, ChildStdout, Command};

use crate::local::place::{Place, component_event, message, receive};

/// Environment variables for the role of a child process, and for its socket.
const ROLE: (&str, &str) = ("JAUS_TEST_ROLE", "JAUS_TEST_SOCKET");

const ECHO: JausId = JausId::new(101, 1, 33);

/// This test binary as a child process, in a role.
struct Actor {
    child: Child,
    lines: Lines<BufReader<ChildStdout>>,
}

impl Actor {
    async fn start(place: &Place, role: &str) -> Self {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args([
                "--exact",
                "local::processes::a_process_that_plays_a_part",
                "--nocapture",
            ])
            .env(ROLE.0, role)
            .env(ROLE.1, place.path())
            .stdout(Stdio::piped())
            .kill_on_drop(true)
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let mut actor = Self { child, lines };
        within_limit(async {
            while actor.lines.next_line().await.unwrap().expect(role) != "ready" {}
        })
        .await;
        actor
    }

    fn pid(&self) -> u32 {
        self.child.id().expect("it runs")
    }

    /// Sends a signal, by its name. The shell's built-in `kill` works even without an installed
    /// program.
    async fn signal(&self, name: &str) {
        let command = format!("kill -{name} {}", self.pid());
        let status = Command::new("sh").args(["-c", &command]).status().await;
        assert!(status.unwrap().success());
    }

    async fn kill(mut self) {
        self.child.kill().await.unwrap();
    }
}

/// Not a test by itself: does nothing unless another test starts it in a role.
#[tokio::test]
async fn a_process_that_plays_a_part() {
    let (Ok(role), Some(socket)) = (std::env::var(ROLE.0), std::env::var_os(ROLE.1)) else {
        return;
    };
    let socket = std::path::PathBuf::from(socket);
    let address = jaus::node::Address::Path(socket);
    // Limited in time, in case the waiting test is killed.
    let play = async {
        match role.as_str() {
            "node" => run_node(address).await,
            "echo" => echo(Host::at(address).name("echo")).await,
            other => panic!("unknown role {other}"),
        }
    };
    let _ = tokio::time::timeout(3 * LIMIT, play).await;
}

async fn run_node(address: jaus::node::Address) {
    let config = jaus::node::Config::loopback(101, 1).group(jaus::link::Group::Off);
    let _node = Node::start(config.local(address)).unwrap();
    println!("\nready");
    std::future::pending::<()>().await;
}

async fn echo(host: Host) {
    let mut port = host.attach(ECHO.component()).await.unwrap();
    println!("\nready");
    while let Some(heard) = port.recv().await {
        let answer = message(&port, heard.source, &heard.payload[2..]);
        match port.send(answer) {
            // The node is gone; the library reconnects.
            Ok(_) | Err(SendError::NotConnected(_)) => {}
            Err(error) => panic!("{error}"),
        }
    }
}

async fn host_event(events: &mut HostEvents, wanted: impl Fn(&HostEvent) -> bool) -> HostEvent {
    within_limit(async {
        loop {
            let event = events.recv().await.expect("an attached component");
            if wanted(&event) {
                return event;
            }
        }
    })
    .await
}

#[tokio::test]
async fn the_death_of_a_component_is_known_at_once_and_its_id_is_free_again() {
    let place = Place::new();
    let node = place.node();
    let mut events = node.component_events();
    let echo = Actor::start(&place, "echo").await;
    let pid = echo.pid();
    let attached = |event: &ComponentEvent| matches!(event, ComponentEvent::Attached { .. });
    let attached = component_event(&mut events, attached).await;
    let ComponentEvent::Attached {
        id,
        process: Some(process),
    } = attached
    else {
        panic!("{attached:?}")
    };
    assert_eq!(
        (id, process.pid, process.name.as_str()),
        (ECHO, Some(pid), "echo")
    );
    let refused = place.host().attach(ECHO.component()).await.unwrap_err();
    assert!(
        refused
            .to_string()
            .contains(&format!("\"echo\" (process {pid})")),
        "{refused}"
    );

    let killed = Instant::now();
    echo.kill().await;
    let gone = |event: &ComponentEvent| matches!(event, ComponentEvent::Detached { .. });
    let gone = component_event(&mut events, gone).await;
    println!("the death was known after {:?}", killed.elapsed());
    let ComponentEvent::Detached {
        id,
        process: Some(process),
        why,
    } = gone
    else {
        panic!("{gone:?}")
    };
    assert_eq!(
        (id, process.pid, why),
        (ECHO, Some(pid), Departure::Vanished)
    );
    let _again = Actor::start(&place, "echo").await;
}

#[tokio::test]
async fn a_component_that_stops_reading_loses_its_own_messages_and_nobody_elses() {
    const FLOOD: u32 = 10_000;
    let place = Place::new();
    let node = place.node();
    let mut events = node.component_events();
    let stuck = Actor::start(&place, "echo").await;
    let mut here = node.attach(1).unwrap();
    let mut other = place.host().attach(2).await.unwrap();

    stuck.signal("STOP").await;
    for number in 0..FLOOD {
        let body = [&number.to_le_bytes()[..], &[0; 1000]].concat();
        here.send(message(&here, ECHO, &body)).unwrap();
        here.send(message(&here, other.id(), &body)).unwrap();
        let heard = receive(&mut other).await;
        assert_eq!(heard.payload[2..6], number.to_le_bytes());
    }
    let is_stuck = |event: &ComponentEvent| matches!(event, ComponentEvent::Stuck { .. });
    let said = component_event(&mut events, is_stuck).await;
    let ComponentEvent::Stuck { id, process } = said else {
        panic!()
    };
    assert_eq!((id, process.pid), (ECHO, Some(stuck.pid())));
    let counters = |wanted| {
        let mut components = node.components().into_iter();
        let found = components.find(|component| component.id == wanted);
        found.expect("an attached component").mailbox
    };
    assert!(counters(ECHO).dropped > 0, "{:?}", counters(ECHO));
    assert_eq!(counters(other.id()).dropped, 0);

    stuck.signal("CONT").await;
    let resumed = |event: &ComponentEvent| matches!(event, ComponentEvent::Resumed { .. });
    let resumed = component_event(&mut events, resumed).await;
    let ComponentEvent::Resumed { dropped, .. } = resumed else {
        panic!()
    };
    assert!(dropped > 0);
    // The newest message was kept: the oldest are dropped first.
    let last = (FLOOD - 1).to_le_bytes();
    within_limit(async { while receive(&mut here).await.payload[2..6] != last {} }).await;
}

#[tokio::test]
async fn a_restarted_node_is_rejoined_and_components_keep_what_they_know() {
    let place = Place::new();
    let first = Actor::start(&place, "node").await;
    let port = place.host().attach(33).await.unwrap();
    let mut events = port.host_events();
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .live_on(port)
        .unwrap();
    let port = place.host().attach(1).await.unwrap();
    let other = Component::builder(Kind::Vehicle, "Other")
        .live_on(port)
        .unwrap();
    let raw = place.host().attach(2).await.unwrap();
    within_limit(other.find("urn:jaus:jss:core:Liveness"))
        .await
        .unwrap();
    let known = other.directory().len();

    let in_flight = raw.sender();
    let unanswered = message(&raw, JausId::new(101, 1, 200), b"x");
    let in_flight = tokio::spawn(async move { in_flight.deliver(unanswered).await });
    raw.sender().flushed().await;
    tokio::task::yield_now().await;
    first.kill().await;
    host_event(&mut events, |event| matches!(event, HostEvent::Lost { .. })).await;
    assert_eq!(
        within_limit(in_flight).await.unwrap(),
        Err(Undelivered::Lost)
    );
    within_limit(async {
        while raw.is_connected() {
            tokio::task::yield_now().await;
        }
    })
    .await;
    let refused = raw.send(message(&raw, rover.id(), b"x")).unwrap_err();
    assert_eq!(refused, SendError::NotConnected(raw.id()));
    assert_eq!(other.directory().len(), known);

    let _second = Actor::start(&place, "node").await;
    host_event(&mut events, |event| *event == HostEvent::Back).await;
    assert_eq!(other.directory().len(), known);
    let outcome = within_limit(async {
        loop {
            match raw.deliver(message(&raw, rover.id(), b"x")).await {
                Err(Undelivered::NotSent(SendError::NotConnected(_))) => {
                    tokio::time::sleep(Duration::from_millis(5)).await;
                }
                outcome => return outcome,
            }
        }
    });
    assert_eq!(outcome.await, Ok(()));
}

#[tokio::test]
async fn a_component_whose_id_was_taken_meanwhile_is_told_and_gets_it_when_it_is_free() {
    let place = Place::new();
    let first = Actor::start(&place, "node").await;
    let port = place.host().attach(33).await.unwrap();
    let mut events = port.host_events();
    first.kill().await;
    host_event(&mut events, |event| matches!(event, HostEvent::Lost { .. })).await;

    let node = place.node();
    let Ok(thief) = node.attach(33) else {
        // The component reattached first.
        return;
    };
    let refused = |event: &HostEvent| matches!(event, HostEvent::Refused { .. });
    let HostEvent::Refused { why } = host_event(&mut events, refused).await else {
        panic!()
    };
    assert!(why.contains("101.1.33 is used by the node itself"), "{why}");
    drop(thief);
    host_event(&mut events, |event| *event == HostEvent::Back).await;
    assert!(port.is_connected());
}

#[tokio::test]
async fn a_stuck_component_does_not_outlive_the_node_it_was_attached_to() {
    let place = Place::new();
    let node = place.node();
    let echo = Actor::start(&place, "echo").await;
    let here = node.attach(1).unwrap();
    echo.signal("STOP").await;
    for _ in 0..2000 {
        here.send(message(&here, ECHO, [0; 1000])).unwrap();
    }
    drop(here);
    node.shutdown().await;
    let again = place.node();
    let mut events = again.component_events();
    echo.signal("CONT").await;
    let back = |event: &ComponentEvent| matches!(event, ComponentEvent::Attached { .. });
    component_event(&mut events, back).await;
}
