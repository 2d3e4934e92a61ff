//! A vehicle of real parts with the JAUS side of a bridge, in virtual time.

use std::ops::{Deref, DerefMut};
use std::panic::Location;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, Kind};
use jaus::node::{DecisionRecorder, Recorder, now};
use jaus::rights::Decided;
use jaus_ros2::Gid;
use jaus_ros2::bridge::samples::OdometrySample;
use jaus_ros2::bridge::vehicle::Selection;
use jaus_ros2::bridge::velocity::Twist;
use jaus_ros2::bridge::{Command, Input, Output, Reports, Settings, run};
use jaus_test_kit::waiting::LIMIT;
use tokio::sync::mpsc;

use crate::rover::Rover;

/// Time of day at the beginning of a test, since the beginning of 1970.
const BEGIN: Duration = Duration::from_secs(1_700_000_000);

pub(crate) const PUBLISHER: Gid = Gid([7; 16]);

/// A vehicle, a bridge, and an operator of JAUS.
pub(crate) struct Scene {
    rover: Rover,
    inputs: Option<mpsc::Sender<Input>>,
    /// The number of commands.
    sequence: AtomicI64,
    seen: Arc<Mutex<Seen>>,
    pub(crate) audit: Audit,
}

/// An audit log: what its entries are about, with their verdicts.
#[derive(Clone, Default)]
pub(crate) struct Audit {
    entries: Arc<Mutex<Vec<String>>>,
    is_broken: Arc<AtomicBool>,
}

impl Audit {
    /// From now on it cannot be written, or can be again.
    pub(crate) fn set_broken(&self, is_broken: bool) {
        self.is_broken.store(is_broken, Ordering::Relaxed);
    }

    /// How many entries have all of these texts.
    pub(crate) fn count(&self, texts: &[&str]) -> usize {
        let entries = self.entries.lock().unwrap();
        let has_all = |entry: &&String| texts.iter().all(|text| entry.contains(text));
        entries.iter().filter(has_all).count()
    }
}

impl DecisionRecorder<Gid> for Audit {
    fn record(&mut self, decided: Decided<Gid>) {
        let (decision, who) = (decided.decision, decided.client);
        let entry = format!("{who}: {decision}, {:?}", decision.verdict);
        self.entries.lock().unwrap().push(entry);
    }

    fn refuses_commands(&self) -> bool {
        self.is_broken.load(Ordering::Relaxed)
    }
}

impl Deref for Scene {
    type Target = Rover;

    fn deref(&self) -> &Rover {
        &self.rover
    }
}

impl DerefMut for Scene {
    fn deref_mut(&mut self) -> &mut Rover {
        &mut self.rover
    }
}

/// The last outputs of the bridge.
#[derive(Default)]
struct Seen {
    odometry: Option<OdometrySample>,
    /// The messages of all states, one a line.
    status: String,
}

impl Scene {
    pub(crate) fn new() -> Self {
        Self {
            rover: Rover::new(BEGIN),
            inputs: None,
            sequence: AtomicI64::new(0),
            seen: Arc::default(),
            audit: Audit::default(),
        }
    }

    /// Starts a bridge with this authority.
    pub(crate) fn start_bridge(&mut self, authority: Option<u8>) {
        self.start_bridge_with(authority.map(|it| format!("control={it} clear-emergency")));
    }

    /// Starts a bridge with these rights, or without any.
    pub(crate) fn start_bridge_with(&mut self, rights: Option<String>) {
        let mut settings = Settings::new(Selection {
            subsystem: 101,
            only: Vec::new(),
        });
        if let Some(words) = rights {
            settings.rules = words.parse().unwrap();
        }
        settings.rate_hz = 20.0;
        let node = self.node(JausId::new(101, 252, 1));
        let bridge = Component::builder(Kind::Vehicle, "Rover").attach(&node, 1);
        let (inputs, received) = mpsc::channel(64);
        let (outputs, mut published) = mpsc::channel(256);
        let seen = self.seen.clone();
        self.inputs = Some(inputs);
        self.tasks.push(tokio::spawn(async move {
            while let Some(output) = published.recv().await {
                seen.lock().unwrap().note(output);
            }
        }));
        let bridge = bridge.unwrap();
        let (time, audit) = (self.time.clone(), self.audit.clone());
        self.tasks.push(tokio::spawn(async move {
            let (recorder, ports) = (Some(Recorder::new(audit)), (received, outputs));
            run(bridge, time, settings, Reports::none(), recorder, ports).await;
        }));
    }

    pub(crate) async fn input(&self, input: Input) {
        let inputs = self.inputs.as_ref().unwrap();
        assert!(inputs.send(input).await.is_ok(), "the bridge has ended");
    }

    /// Publishes a velocity.
    pub(crate) async fn drive(&self, forward: f64, yaw_rate: f64) {
        let twist = Twist {
            linear: [forward, 0.0, 0.0],
            angular: [0.0, 0.0, yaw_rate],
        };
        let stamp = self.time.now().as_nanos();
        let command = Command {
            publisher: PUBLISHER,
            session: PUBLISHER,
            sequence: self.sequence.fetch_add(1, Ordering::Relaxed),
            stamp: i64::try_from(stamp).unwrap(),
            arrival: now(),
            twist,
        };
        self.input(Input::Twist(command)).await;
    }

    /// The last odometry.
    pub(crate) fn odometry(&self) -> Option<OdometrySample> {
        self.seen.lock().unwrap().odometry
    }

    /// The speed that ROS sees; 0 before the first odometry.
    pub(crate) fn speed(&self) -> f64 {
        self.odometry().map_or(0.0, |it| it.twist.linear[0])
    }

    /// Publishes a velocity at 10 Hz until something holds.
    #[track_caller]
    pub(crate) fn drive_until(
        &self,
        forward: f64,
        holds: impl Fn(&Self) -> bool,
    ) -> impl Future<Output = ()> {
        self.repeat(holds, async move || self.drive(forward, 0.0).await)
    }

    /// Waits until something holds.
    #[track_caller]
    pub(crate) fn until(&self, holds: impl Fn(&Self) -> bool) -> impl Future<Output = ()> {
        self.repeat(holds, async || {})
    }

    /// Repeats an act at 10 Hz until something holds; fails with the status.
    #[track_caller]
    fn repeat(
        &self,
        holds: impl Fn(&Self) -> bool,
        act: impl AsyncFn(),
    ) -> impl Future<Output = ()> {
        let place = Location::caller();
        async move {
            let end = now() + LIMIT;
            while !holds(self) {
                assert!(
                    now() < end,
                    "not within {LIMIT:?}, at {place}: {}",
                    self.status()
                );
                act().await;
                tokio::time::sleep(Duration::from_millis(100)).await;
            }
        }
    }

    /// Whether the status says this.
    pub(crate) fn says(&self, text: &str) -> bool {
        self.seen.lock().unwrap().status.contains(text)
    }

    pub(crate) fn status(&self) -> String {
        self.seen.lock().unwrap().status.clone()
    }

    pub(crate) async fn end(self) {
        self.rover.end().await;
    }
}

impl Seen {
    fn note(&mut self, output: Output) {
        match output {
            Output::Odometry(odometry) => self.odometry = Some(odometry),
            Output::Status { diagnostics, .. } => {
                let lines = diagnostics.iter().map(|it| {
                    let values = it
                        .values
                        .iter()
                        .map(|(name, value)| format!("{name}={value}"));
                    let values: Vec<_> = values.collect();
                    format!("{}: {}; {}", it.name, it.message, values.join(", "))
                });
                self.status = lines.collect::<Vec<_>>().join("\n");
            }
            _ => {}
        }
    }
}
