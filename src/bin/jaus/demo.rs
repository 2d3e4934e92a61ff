//! `jaus demo`: a vehicle and an operator station that find each other, told for newcomers.
#![expect(clippy::disallowed_methods, reason = "the story happens in real time")]

use std::collections::BTreeMap;
use std::fmt::Display;
use std::time::{Duration, Instant};

use clap::Args;
use jaus::address::JausId;
use jaus::cli::failure::{Failure, Outcome};
use jaus::cli::output::{Output, colours_wanted};
use jaus::cli::runtime::{self, Clock};
use jaus::cli::tree;
use jaus::component::{Change, Component, Handlers, Kind, Level, QueryError};
use jaus::messages::core::{QueryHeartbeatPulse, ReportHeartbeatPulse};
use jaus::messages::mobility::{QueryVelocityState, ReportVelocityState, velocity_state_sensor};
use jaus::node::{Config, Node};
use tokio::time::{MissedTickBehavior, interval};

/// Watch a vehicle and an operator station find each other on this computer
///
/// It needs no network, no configuration and no rights.
#[derive(Args)]
pub(crate) struct Demo {
    /// End after this time [default: at Ctrl-C]
    #[arg(long, value_parser = runtime::seconds)]
    seconds: Option<Duration>,
}

/// The vehicle: subsystem 101, node 1, component 33.
const VEHICLE: JausId = JausId::new(101, 1, 33);
/// The operator station: subsystem 42, node 1, component 1.
const OPERATOR: JausId = JausId::new(42, 1, 1);
/// Where the words of a line begin: behind time and name.
const INDENT: usize = 21;
/// Velocity_X, by its bit in the presence vector of a query and its report.
const FORWARD: u16 = 1;
/// How long discovery may take before the demo says that something is wrong.
const USUAL: Duration = Duration::from_secs(5);

impl Demo {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        runtime::run(async {
            let mut story = Story::new();
            story.opening(self.seconds)?;
            let (vehicle_node, vehicle) = start_vehicle(&mut story)?;
            let (operator_node, operator) = start_operator(&mut story)?;
            story.call(&operator_node)?;
            let mut watch = Watch::new(&operator, &mut story);
            let outcome = tokio::select! {
                () = runtime::end(self.seconds) => Ok(()),
                outcome = watch.run() => outcome,
            };
            let pulses = watch.pulses;
            outcome.and_then(|()| story.closing(pulses))?;
            drop((vehicle, operator));
            vehicle_node.shutdown().await;
            operator_node.shutdown().await;
            Ok(Outcome::complete_if(pulses.answered > 0))
        })
    }
}

/// A vehicle that goes now faster, now slower, and tells its velocity to whoever asks.
fn start_vehicle(story: &mut Story) -> Result<(Node, Component), Failure> {
    let config = Config::loopback(VEHICLE.subsystem(), VEHICLE.node());
    let node = Node::start(config).map_err(Failure::of)?;
    let start = Instant::now();
    let drive = Handlers::new(velocity_state_sensor::LATEST)
        .answer(move |query: QueryVelocityState| velocity(start.elapsed(), &query));
    let vehicle = Component::builder(Kind::Vehicle, "Rover")
        .offer(drive)
        .attach(&node, VEHICLE.component())
        .map_err(Failure::of)?;
    story.start(Who::Vehicle, &node, &vehicle, "Rover")?;
    Ok((node, vehicle))
}

fn start_operator(story: &mut Story) -> Result<(Node, Component), Failure> {
    let config = Config::loopback(OPERATOR.subsystem(), OPERATOR.node());
    let node = Node::start(config).map_err(Failure::of)?;
    let operator = Component::builder(Kind::OperatorControlUnit, "Operator station")
        .attach(&node, OPERATOR.component())
        .map_err(Failure::of)?;
    story.start(Who::Operator, &node, &operator, "Operator station")?;
    Ok((node, operator))
}

/// What the vehicle's sensor reports: between half a metre and one and a half a second. Of what a
/// query may ask for it knows only the forward velocity.
fn velocity(driven: Duration, query: &QueryVelocityState) -> ReportVelocityState {
    let mut report = ReportVelocityState::default();
    if query.presence_vector & FORWARD != 0 {
        let metres_per_second = 1.0 + (driven.as_secs_f64() / 3.0).sin() / 2.0;
        // Far within the range of the field, so that it cannot fail.
        let _ = report.set_velocity_x_m_per_s(metres_per_second);
    }
    report
}

/// The operator's part: finds the vehicle, and keeps an eye on it.
struct Watch<'s> {
    operator: &'s Component,
    story: &'s mut Story,
    clock: Clock,
    vehicle: Option<JausId>,
    has_complained: bool,
    pulses: Pulses,
}

/// Heartbeats asked for, and answered.
#[derive(Debug, Clone, Copy, Default)]
struct Pulses {
    asked: u32,
    answered: u32,
}

impl<'s> Watch<'s> {
    fn new(operator: &'s Component, story: &'s mut Story) -> Self {
        Self {
            operator,
            story,
            clock: Clock::start(),
            vehicle: None,
            has_complained: false,
            pulses: Pulses::default(),
        }
    }

    /// Tells what the operator sees, without end.
    async fn run(&mut self) -> Result<(), Failure> {
        let mut changes = self.operator.watch();
        let mut seconds = interval(Duration::from_secs(1));
        seconds.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                Some(change) = changes.next() => {
                    let known = self.vehicle;
                    self.tell(change)?;
                    if self.vehicle.is_some() && known.is_none() {
                        seconds.reset_immediately();
                    }
                }
                _ = seconds.tick() => self.look().await?,
            }
        }
    }

    /// Tells a change of the directory.
    fn tell(&mut self, change: Change) -> Result<(), Failure> {
        let directory = self.operator.directory();
        match change {
            Change::Identified(level @ Level::Subsystem, id) => {
                let Some(told) = directory.identification(level, id) else {
                    return Ok(());
                };
                let (number, introduction) = (id.subsystem(), tree::introduction(told));
                let words = format!("discovers subsystem {number}: it is {introduction}");
                self.story.tell(Who::Operator, words)
            }
            Change::Services(id) => {
                let Some(component) = directory.component(id) else {
                    return Ok(());
                };
                let offers = component.services.as_deref().unwrap_or_default();
                self.story.services(id, &tree::by_urn(offers))?;
                if component.offers(velocity_state_sensor::URN) && self.vehicle != Some(id) {
                    self.vehicle = Some(id);
                    self.story.tell(
                        Who::Operator,
                        format!(
                            "asks {id} for its heartbeat and its velocity, every second from now on"
                        ),
                    )?;
                }
                Ok(())
            }
            Change::Lost(id, _) => {
                self.vehicle = self.vehicle.filter(|&vehicle| vehicle != id);
                let words = tree::in_words(change, &directory).unwrap_or_default();
                self.story.tell(Who::Operator, words)
            }
            Change::SubsystemFound(_)
            | Change::Found(_)
            | Change::Identified(..)
            | Change::SubsystemLost(_) => Ok(()),
        }
    }

    /// Once a second: asks the vehicle whether it lives, and how fast it is.
    async fn look(&mut self) -> Result<(), Failure> {
        let Some(vehicle) = self.vehicle else {
            if self.clock.elapsed() > USUAL && !self.has_complained {
                self.has_complained = true;
                self.story.nobody()?;
            }
            return Ok(());
        };
        self.pulses.asked += 1;
        match self.ask(vehicle).await {
            Ok((delay, speed)) => {
                self.pulses.answered += 1;
                let number = self.pulses.answered;
                let delay = delay.as_secs_f64() * 1000.0;
                self.story.tell(
                    Who::Vehicle,
                    format!("heartbeat {number} came after {delay:.1} ms; velocity {speed:.2} m/s"),
                )
            }
            Err(error) => self
                .story
                .tell(Who::Operator, format!("hears nothing: {error}")),
        }
    }

    async fn ask(&self, vehicle: JausId) -> Result<(Duration, f64), QueryError> {
        let asked = Instant::now();
        let _: ReportHeartbeatPulse = self.operator.query(vehicle, &QueryHeartbeatPulse).await?;
        let delay = asked.elapsed();
        let query = QueryVelocityState {
            presence_vector: FORWARD,
        };
        let report: ReportVelocityState = self.operator.query(vehicle, &query).await?;
        Ok((delay, report.velocity_x_m_per_s().unwrap_or_default()))
    }
}

/// Whose doings a line tells.
#[derive(Debug, Clone, Copy)]
enum Who {
    Vehicle,
    Operator,
}

/// The narrator.
struct Story {
    output: Output,
    clock: Clock,
    colours: bool,
}

impl Story {
    fn new() -> Self {
        let colours = colours_wanted(&std::io::stdout());
        Self {
            output: Output::new(),
            clock: Clock::start(),
            colours,
        }
    }

    fn opening(&mut self, limit: Option<Duration>) -> Result<(), Failure> {
        self.output.line(
            "A vehicle and an operator station start on this computer. Each is a JAUS subsystem of its\n\
             own, and neither knows of the other. They talk through real UDP sockets on the loopback\n\
             interface; nothing leaves this machine.\n",
        )?;
        let jaus = std::env::args().next().unwrap_or_else(|| "jaus".to_owned());
        self.output.line(format_args!(
            "While this runs, try in another terminal:\n  \
             {jaus} discover --loopback\n  \
             {jaus} query {VEHICLE} QueryVelocityState '{{\"PresenceVector\":1}}' --loopback"
        ))?;
        self.output.line(match limit {
            Some(limit) => format!("The demo ends after {} s.\n", limit.as_secs_f64()),
            None => "Ctrl-C ends the demo.\n".to_owned(),
        })
    }

    /// A station starts.
    fn start(
        &mut self,
        who: Who,
        node: &Node,
        component: &Component,
        name: &str,
    ) -> Result<(), Failure> {
        let id = component.id();
        let address = node.links().first().map(|link| link.local);
        let place =
            address.map_or_else(String::new, |address| format!(" listens on UDP {address}"));
        let words = format!(
            "starts subsystem {} \"{name}\"; its component {id}{place}",
            id.subsystem()
        );
        self.tell(who, words)
    }

    /// The operator calls, as every component does when it starts.
    fn call(&mut self, operator: &Node) -> Result<(), Failure> {
        let group = operator.links().first().and_then(|link| link.group);
        let place = group.map_or_else(String::new, |group| format!(", by multicast to {group}"));
        self.tell(Who::Operator, format!("asks everybody who they are{place}"))
    }

    /// What a component offers, a line for each service.
    fn services(
        &mut self,
        id: JausId,
        services: &BTreeMap<&str, Vec<String>>,
    ) -> Result<(), Failure> {
        self.tell(
            Who::Operator,
            format!("learns what component {id} offers (service and versions):"),
        )?;
        let width = services.keys().map(|urn| urn.len()).max().unwrap_or(0);
        for (urn, versions) in services {
            self.output.line(format_args!(
                "{:INDENT$}{urn:width$}  {}",
                "",
                versions.join(", ")
            ))?;
        }
        Ok(())
    }

    /// Discovery takes unusually long.
    fn nobody(&mut self) -> Result<(), Failure> {
        self.tell(
            Who::Operator,
            "has found nobody yet. Multicast on the loopback interface may be blocked: \
             a firewall or a container without multicast does that",
        )
    }

    fn tell(&mut self, who: Who, words: impl Display) -> Result<(), Failure> {
        let (name, colour) = match who {
            Who::Vehicle => ("vehicle", "\x1b[32m"),
            Who::Operator => ("operator", "\x1b[36m"),
        };
        let (on, off) = if self.colours {
            (colour, "\x1b[0m")
        } else {
            ("", "")
        };
        self.output
            .line(format_args!("{}  {on}{name:8}{off}  {words}", self.clock))
    }

    fn closing(&mut self, pulses: Pulses) -> Result<(), Failure> {
        let Pulses { asked, answered } = pulses;
        let summary = match answered {
            0 => "no heartbeat was heard".to_owned(),
            _ => format!("{answered} of {asked} heartbeats were answered"),
        };
        self.output.line(format_args!(
            "\nThe demo ends after {:.1} s: {summary}.",
            self.clock.elapsed().as_secs_f64()
        ))
    }
}
