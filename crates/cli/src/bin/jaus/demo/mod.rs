//! `jaus demo`: runs a whole vehicle and its operator in one process, drives a mission and explains
//! it to newcomers.

mod network;
mod operator;
#[cfg(feature = "secure")]
mod secure;
mod story;
mod surprise;
mod system;

use std::time::Duration;

use clap::Args;
use jaus::component::{Component, Kind};
use jaus::node::Node;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::runtime;
use jaus_ocu::Station;
use jaus_vehicle::motion::Ackermann;
use jaus_vehicle::parts::{
    Communicator, PathDriver, Planner, PoseSensor, PrimitiveDriver, RangeSensor, SteeringGear,
    VectorDriver, VelocitySensor,
};

use crate::events::EventFormat;
use network::{OPERATOR, OwnNetwork, VEHICLE};
use operator::{Ending, Operator};
use story::{Story, Who};
use surprise::Surprise;
use system::System;

/// Run a whole vehicle on this computer and watch it drive a mission on the operator's page
///
/// Starts a vehicle of nine components on three nodes and an operator control unit in this process.
/// They discover each other, and the planner is sent on a mission. Needs no network, configuration
/// or privileges.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus demo                         with the page; runs until Ctrl-C\n  \
    jaus demo --stay                  starts no mission: drive on the page\n  \
    jaus demo --ackermann             a vehicle that steers like a car\n  \
    jaus demo --secure                over authenticated, encrypted links\n  \
    jaus demo --headless              without the page; ends when the vehicle arrives\n  \
    jaus demo --to 3,-5 --headless --for 1min\n\n\
    Events of --json: \"story\" with \"actor\" and \"text\"; \"end\" with \"arrived\".")]
pub(crate) struct Demo {
    /// End after this time. With --headless, an unfinished mission then counts as failed: exit
    /// status 1 [default: at Ctrl-C; with --headless, when the mission is over]
    #[arg(long = "for", value_name = "DURATION", value_parser = runtime::duration)]
    duration: Option<Duration>,

    /// The same time as a number of seconds
    #[arg(long, value_name = "SECONDS", conflicts_with = "duration", value_parser = seconds)]
    seconds: Option<Duration>,

    /// Do not serve the operator's page
    #[arg(long)]
    headless: bool,

    /// The destination, in metres north and east of the start
    #[arg(long, value_name = "NORTH,EAST", default_value = "6,6.5", value_parser = place, allow_hyphen_values = true)]
    to: (f64, f64),

    /// Steer the front wheels, as in a car, instead of turning on the spot
    #[arg(long)]
    ackermann: bool,

    /// Start no mission
    #[arg(long, conflicts_with = "headless")]
    stay: bool,

    /// Link the nodes by authenticated, encrypted links instead of plain JUDP
    #[cfg(feature = "secure")]
    #[arg(long)]
    secure: bool,

    #[command(flatten)]
    format: EventFormat,
}

/// A model car of scale 1:10, which fits through the gaps of the demo's map with its turning radius of
/// 0.72 m.
const CAR: Ackermann = Ackermann {
    wheelbase: 0.32,
    max_angle: 0.42,
};
/// Its width in metres.
const CAR_WIDTH: f64 = 0.3;

impl Demo {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        runtime::run(async {
            let mut story = Story::new(self.format);
            let network = OwnNetwork::take()?;
            let mut system = self.system(network)?;
            let started = self.start(&mut system, &mut story).await;
            let surprise = Surprise {
                scenery: system.scenery(),
                vehicle: self.planner().vehicle,
            };
            let outcome = match started {
                Ok(operator) => tokio::select! {
                    failure = system.failure() => Err(failure),
                    () = runtime::end(self.duration.or(self.seconds)) => Ok(None),
                    outcome = self.play(operator, surprise, &mut story) => outcome.map(Some),
                },
                Err(failure) => Err(failure),
            };
            system.stop().await;
            self.closing(outcome?, &mut story)
        })
    }

    fn system(&self, network: OwnNetwork) -> Result<System, Failure> {
        let system = System::new(network);
        #[cfg(feature = "secure")]
        if self.secure {
            return Ok(system.secured_by(secure::SecureLinks::make()?));
        }
        Ok(system)
    }

    /// How the nodes communicate.
    fn way(&self) -> &'static str {
        #[cfg(feature = "secure")]
        if self.secure {
            return "over secure links (QUIC) through a relay";
        }
        "over UDP on the loopback interface"
    }

    fn opening(&self, system: &System, story: &mut Story) -> Result<(), Failure> {
        story.line(format_args!(
            "A ground vehicle and its operator control unit start on this computer. Every part is a\n\
             JAUS component that could also run as a program on its own board. They find each other\n\
             by Discovery and communicate {}.\n",
            self.way()
        ))?;
        if let Some(group) = system.own_group() {
            story.line(format_args!(
                "Another demo runs on this computer. So that the two do not mix, this one has the\n\
                 multicast group {group}.\n",
            ))?;
        }
        let jaus = std::env::args().next().unwrap_or_else(|| "jaus".to_owned());
        let flags = system.flags();
        story.line(format_args!(
            "Meanwhile, try in another terminal:\n  \
             {jaus} discover {flags}\n  \
             {jaus} query {VEHICLE}.2.41 QueryLocalPose {flags}\n  \
             {jaus} query {VEHICLE}.3.36 QueryMission {flags}"
        ))?;
        match self.headless {
            true => story.line(""),
            false => story.line(format_args!("  {jaus} watch{}\n", system.watch_flags())),
        }
    }

    /// Starts everything; returns the operator's component.
    async fn start(&self, system: &mut System, story: &mut Story) -> Result<Component, Failure> {
        let radius = self.turning_radius();
        let vehicle = system.node(VEHICLE, 1)?;
        let wheels = system.node(VEHICLE, 2)?;
        let mind = system.node(VEHICLE, 3)?;
        let console = system.node(OPERATOR, 1)?;
        self.opening(system, story)?;
        let communicator = Communicator {
            debug: (!self.headless).then_some(system.debug_address()),
            beside: vec![wheels.clone(), mind.clone(), console.clone()],
            ..Communicator::default()
        };
        start_part(system, story, &vehicle, 35, "communicator", communicator)?;
        start_part(
            system,
            story,
            &wheels,
            33,
            "primitive driver",
            PrimitiveDriver::default().steering(self.geometry().map(SteeringGear::simulated)),
        )?;
        start_part(
            system,
            story,
            &wheels,
            42,
            "velocity state sensor",
            VelocitySensor::default(),
        )?;
        start_part(
            system,
            story,
            &wheels,
            41,
            "local pose sensor",
            PoseSensor::default(),
        )?;
        let sensor = RangeSensor {
            scenery: system.scenery(),
            ..RangeSensor::default()
        };
        start_part(system, story, &wheels, 51, "range sensor", sensor)?;
        start_part(
            system,
            story,
            &mind,
            44,
            "local vector driver",
            VectorDriver::default().turning_radius(radius),
        )?;
        start_part(
            system,
            story,
            &mind,
            48,
            "local path segment driver",
            PathDriver::default().turning_radius(radius),
        )?;
        start_part(
            system,
            story,
            &mind,
            61,
            "vector knowledge store",
            system.store(),
        )?;
        start_part(system, story, &mind, 36, "planner", self.planner())?;
        if !self.headless {
            let station = Station::default().open().await.map_err(Failure::of)?;
            let urls = station.secret_urls();
            start_part(system, story, &console, 1, "operator's page", station)?;
            for url in urls {
                story.tell(Who::Operator, format_args!("the page is at {url}"))?;
            }
        }
        Component::builder(Kind::OperatorControlUnit, "Operator")
            .component_name("Demo")
            .attach(&console, 2)
            .map_err(Failure::of)
    }

    /// The geometry of the steering, if the front wheels are steered.
    fn geometry(&self) -> Option<Ackermann> {
        self.ackermann.then_some(CAR)
    }

    fn turning_radius(&self) -> f64 {
        self.geometry().map_or(0.0, |it| it.turning_radius())
    }

    fn planner(&self) -> Planner {
        let mut planner = Planner::default().turning_radius(self.turning_radius());
        // Everything runs on one computer, which may be busy: a late sample does not end the demo.
        planner.mission.retries = 5;
        if self.ackermann {
            planner.vehicle.width = CAR_WIDTH;
        }
        planner
    }

    /// Plays the operator.
    async fn play(
        &self,
        component: Component,
        surprise: Surprise,
        story: &mut Story,
    ) -> Result<Ending, Failure> {
        if self.stay {
            story.tell(
                Who::Operator,
                "leaves the vehicle to you: press Drive by hand on the page; press Ctrl-C to end",
            )?;
            std::future::pending::<()>().await;
        }
        let ending = Operator::new(component, surprise, story)
            .drive(self.to)
            .await?;
        if !self.headless {
            story.tell(
                Who::Operator,
                "the vehicle is yours: press Drive by hand on the page; press Ctrl-C to end the demo",
            )?;
            std::future::pending::<()>().await;
        }
        Ok(ending)
    }

    fn closing(&self, ending: Option<Ending>, story: &mut Story) -> Result<Outcome, Failure> {
        let (arrived, words) = match ending {
            Some(Ending::Arrived) => (Some(true), ": the vehicle has arrived"),
            Some(Ending::Stopped) => (Some(false), ": the vehicle has not arrived"),
            None if self.headless => (Some(false), ": the vehicle has not arrived in time"),
            None => (None, ""),
        };
        story.end(arrived, words)?;
        Ok(Outcome::complete_if(
            ending == Some(Ending::Arrived) || !self.headless,
        ))
    }
}

fn start_part(
    system: &mut System,
    story: &mut Story,
    node: &Node,
    number: u8,
    name: &'static str,
    part: impl jaus_vehicle::parts::Part,
) -> Result<(), Failure> {
    let id = system.start(node, number, name, part)?;
    story.tell(Who::System, format_args!("starts {id}, the {name}"))
}

/// Parses a number of seconds.
fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok().filter(|&it| it > 0.0);
    seconds
        .and_then(|it| Duration::try_from_secs_f64(it).ok())
        .ok_or_else(|| "write a number of seconds such as 60, or --for with a unit".to_owned())
}

/// Parses a place: `6,5`.
fn place(text: &str) -> Result<(f64, f64), String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|it| it.is_finite());
    let pair = text
        .split_once(',')
        .and_then(|(x, y)| Some((number(x)?, number(y)?)));
    pair.ok_or_else(|| "write metres north and east of the start, such as 6,5 or 3,-5".to_owned())
}
