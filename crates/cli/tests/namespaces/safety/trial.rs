//! One case: a vehicle is driven, a fault affects its controller, and the observer records how the
//! vehicle stops.

use std::fmt;
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use super::roles::{Drive, LOCAL, STRANGERS, Sample, wall_clock};
use crate::testbed::{Host, Testbed};
use jaus_test_kit::evidence::this_test;
use jaus_test_kit::hosts::{Process, on_hosts};
use jaus_test_kit::vehicle_process::VehicleProcess;

/// The fault of the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// kill -9.
    Killed,
    /// kill -9, while attached to the node of another process.
    KilledBehindNode,
    /// kill -9 of the node to which it is attached.
    NodeKilled,
    /// kill -9, after many strangers have appeared and vanished.
    KilledAmongStrangers,
    /// SIGSTOP, later SIGCONT.
    Suspended,
    /// SIGSTOP, later SIGCONT, while attached to the node of another process, which keeps running.
    SuspendedBehindNode,
    /// Its cable is pulled at its own end, and later reconnected.
    CutAtController,
    /// Its cable is pulled at the vehicle's end, and later reconnected.
    CutAtVehicle,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Killed => f.write_str("kill -9 of the controller"),
            Self::KilledBehindNode => f.write_str("kill -9 of the controller behind `jaus node`"),
            Self::NodeKilled => f.write_str("kill -9 of the controller's `jaus node`"),
            Self::KilledAmongStrangers => {
                write!(f, "kill -9 of the controller after {STRANGERS} dead ids")
            }
            Self::Suspended => f.write_str("SIGSTOP of the controller"),
            Self::SuspendedBehindNode => {
                f.write_str("SIGSTOP of the controller behind `jaus node`")
            }
            Self::CutAtController => f.write_str("link down at the controller"),
            Self::CutAtVehicle => f.write_str("link down at the vehicle"),
        }
    }
}

/// Speed above which the vehicle counts as driven, in m/s.
const DRIVEN: f64 = 1.9;
/// Speed up to which the vehicle counts as at rest, in m/s.
const REST: f64 = 0.01;
/// Apparent movement of a vehicle at rest, in metres.
const STILL: f64 = 0.02;
/// Timeout until the vehicle is driven.
const START: Duration = Duration::from_secs(15);
/// How long a vehicle is observed after a fault, if it does not stop earlier.
const PATIENCE: Duration = Duration::from_secs(12);
/// How long it must stay at rest after the stop, and after the controller is back.
const QUIET: Duration = Duration::from_secs(1);
const BACK: Duration = Duration::from_secs(3);
/// Longest duration of control after a fault, with 1 s for a busy machine.
const CONTROL: Duration = Duration::from_secs(5 + 1);

impl Drive {
    /// Longest time until the vehicle is at rest: until the setpoint expires, 1 s of braking, and 1
    /// s for a busy machine.
    const fn limit(self) -> Duration {
        Duration::from_secs(match self {
            Self::Effort => 1 + 2,
            Self::Vector => 2 + 2,
            Self::Waypoint | Self::List => 5 + 2,
        })
    }
}

/// Runs one trial per fault in parallel, prints their rows of the table, and checks them. One call
/// at a time: each starts several processes for every fault.
pub(crate) fn check(drive: Drive, faults: &[Fault]) {
    static ALONE: Mutex<()> = Mutex::new(());
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let beds = || faults.iter().map(|_| Testbed::new()).collect();
    on_hosts(beds, |beds: &Vec<Testbed>| {
        let rows: Vec<Row> = thread::scope(|scope| {
            let start = |(bed, &fault)| {
                let run = move || Trial::start(bed, drive, fault).run(fault);
                // A thread that starts test nodes has the name of its test.
                let thread = thread::Builder::new().name(this_test());
                thread.spawn_scoped(scope, run).unwrap()
            };
            let trials: Vec<_> = beds.iter().zip(faults).map(start).collect();
            trials.into_iter().map(|it| it.join().unwrap()).collect()
        });
        rows.iter().for_each(|row| println!("{row}"));
        rows.iter().for_each(Row::check);
    });
}

/// A vehicle that is terminated while driven stops its drives before it ends.
pub(crate) fn check_termination() {
    on_hosts(Testbed::new, |bed| {
        let trial = Trial::start(bed, Drive::Effort, Fault::Killed);
        let lines = trial.vehicle.terminate();
        assert_eq!(lines.last().unwrap(), "stopped: the component ended");
    });
}

struct Trial<'a> {
    bed: &'a Testbed,
    drive: Drive,
    controller: Process,
    observer: Process,
    /// The node to which the controller is attached, if in another process. Its first output is the
    /// same as a vehicle's.
    node: Option<VehicleProcess>,
    vehicle: VehicleProcess,
    samples: Vec<Sample>,
}

impl<'a> Trial<'a> {
    /// Starts the processes, and waits until the vehicle is driven.
    fn start(bed: &'a Testbed, drive: Drive, fault: Fault) -> Self {
        let mut vehicle = bed.jaus(Host::Vehicle, &["vehicle", "--id", "101.1.1"]);
        let vehicle = VehicleProcess::start(&mut vehicle);
        let is_behind_node = matches!(
            fault,
            Fault::KilledBehindNode | Fault::NodeKilled | Fault::SuspendedBehindNode
        );
        let node = is_behind_node.then(|| {
            let local = format!("--local={LOCAL}");
            let mut node = bed.jaus(Host::Controller, &["node", "--id", "102.1.1", &local]);
            VehicleProcess::start(&mut node)
        });
        let place = if is_behind_node {
            "behind-node"
        } else {
            "alone"
        };
        let settings = format!("{} {place}", drive.name());
        let mut trial = Self {
            bed,
            drive,
            observer: bed.start(Host::Observer, "observer", ""),
            controller: bed.start(Host::Controller, "controller", &settings),
            node,
            vehicle,
            samples: Vec::new(),
        };
        trial.controller.says("drives");
        let limit = wall_clock() + START;
        while trial.look().speed < DRIVEN {
            assert!(wall_clock() < limit, "the vehicle is not driven");
        }
        trial
    }

    /// Waits for the next sample.
    fn look(&mut self) -> Sample {
        let sample = Sample::parse(&self.observer.says("sample"));
        self.samples.push(sample);
        sample
    }

    /// Causes the fault, and observes the vehicle until it is at rest.
    fn run(mut self, fault: Fault) -> Row {
        if fault == Fault::KilledAmongStrangers {
            let strangers = self.bed.start(Host::Strangers, "strangers", "");
            let answered: u16 = strangers.says("answered").parse().unwrap();
            assert!(answered > STRANGERS / 2, "{answered} were answered");
        }
        let at = wall_clock();
        self.happen(fault);
        let free = self.watch(at);
        if self.undo(fault) {
            let back = wall_clock();
            while self.look().at < back + BACK {}
        }
        self.row(fault, at, free)
    }

    fn happen(&self, fault: Fault) {
        match fault {
            Fault::Killed | Fault::KilledBehindNode | Fault::KilledAmongStrangers => {
                self.controller.signal("KILL");
            }
            Fault::NodeKilled => self.node.as_ref().unwrap().signal("KILL"),
            Fault::Suspended | Fault::SuspendedBehindNode => self.controller.signal("STOP"),
            Fault::CutAtController => self.bed.cable(Host::Controller, false),
            Fault::CutAtVehicle => self.bed.cable(Host::Vehicle, false),
        }
    }

    /// Undoes the fault. Returns whether that is possible.
    fn undo(&self, fault: Fault) -> bool {
        match fault {
            Fault::Suspended | Fault::SuspendedBehindNode => self.controller.signal("CONT"),
            Fault::CutAtController => self.bed.cable(Host::Controller, true),
            Fault::CutAtVehicle => self.bed.cable(Host::Vehicle, true),
            Fault::Killed
            | Fault::KilledBehindNode
            | Fault::NodeKilled
            | Fault::KilledAmongStrangers => return false,
        }
        true
    }

    /// Observes until the vehicle is at rest without a controller, or until the time limit. Returns
    /// when control ended.
    fn watch(&mut self, fault: Duration) -> Option<Duration> {
        let mut free = None;
        let mut moved = fault;
        loop {
            let sample = self.look();
            if sample.at < fault {
                continue;
            }
            if sample.controller == 0 {
                free = free.or(Some(sample.at));
            }
            if sample.speed.abs() > REST {
                moved = sample.at;
            }
            let is_over = free.is_some() && sample.at > moved + QUIET;
            if is_over || sample.at > fault + PATIENCE {
                return free;
            }
        }
    }

    fn row(&self, fault: Fault, at: Duration, free: Option<Duration>) -> Row {
        let first = self.samples.partition_point(|it| it.at < at);
        let [before, after @ ..] = &self.samples[first.saturating_sub(1)..] else {
            panic!("the observer has seen nothing");
        };
        assert!(
            before.speed >= DRIVEN,
            "not driven any more before the fault: {before:?}"
        );
        let end = after.last().unwrap();
        let moves = |it: &&Sample| it.speed.abs() > REST || it.distance(end) > STILL;
        let last = after.iter().rev().find(moves).unwrap_or(before);
        let rest = after.iter().find(|it| it.at > last.at);
        Row {
            drive: self.drive,
            fault,
            stopped: rest.map(|it| it.at - at),
            // It drives straight ahead.
            metres: before.distance(end),
            free: free.map(|it| it - at),
        }
    }
}

/// A row of the table.
struct Row {
    drive: Drive,
    fault: Fault,
    /// From the fault to the first sample from which on it stays at rest.
    stopped: Option<Duration>,
    metres: f64,
    /// From the fault to the first sample without a controller.
    free: Option<Duration>,
}

impl Row {
    fn check(&self) {
        let stopped = self.stopped.expect("the vehicle stops for good");
        assert!(stopped <= self.drive.limit(), "stopped after {stopped:?}");
        let free = self.free.expect("control ends");
        assert!(free <= CONTROL, "control is free after {free:?}");
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = |time: Option<Duration>| {
            time.map_or_else(
                || "never".to_owned(),
                |time| format!("{:.1}", time.as_secs_f64()),
            )
        };
        write!(
            f,
            "| {}: {} | {} | {:.1} | {} |",
            self.drive.name(),
            self.fault,
            seconds(self.stopped),
            self.metres,
            seconds(self.free)
        )
    }
}
