//! `jaus demo`: runs a whole vehicle and its operator in one process, drives a mission and explains
//! it to newcomers.

mod operator;
mod story;
mod system;

use std::time::Duration;

use clap::Args;
use jaus::component::{Component, Kind};
use jaus::node::Node;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::runtime;
use jaus_ocu::Station;
use jaus_vehicle::parts::{
    Communicator, DEBUG_ADDRESS, PathDriver, Planner, PoseSensor, PrimitiveDriver, VectorDriver,
    VelocitySensor,
};

use operator::{Ending, Operator};
use story::{Story, Who};
use system::{OPERATOR, System, VEHICLE};

/// Watch a whole vehicle drive a mission on this computer, with the operator's page
///
/// A vehicle of nine components on three nodes and an operator's station start in this process and
/// find each other; then the planner is asked to drive somewhere. It needs no network, no
/// configuration and no rights.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus demo                         with the page; goes on after the mission, until Ctrl-C\n  \
    jaus demo --stay                  drives nowhere by itself: do it on the page\n  \
    jaus demo --headless              without the page; ends when the vehicle has arrived\n  \
    jaus demo --to 3,-5 --headless --seconds 60")]
pub(crate) struct Demo {
    /// End after this time. Without the page, a mission that has not arrived by then has failed:
    /// exit status 1 [default: at Ctrl-C; without the page, when the mission is over]
    #[arg(long, value_parser = runtime::seconds)]
    seconds: Option<Duration>,

    /// Without the operator's page
    #[arg(long)]
    headless: bool,

    /// Where to drive: NORTH,EAST of the start in metres
    #[arg(long, value_name = "X,Y", default_value = "6,5", value_parser = place, allow_hyphen_values = true)]
    to: (f64, f64),

    /// Drive nowhere by itself
    #[arg(long, conflicts_with = "headless")]
    stay: bool,
}

impl Demo {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        runtime::run(async {
            let mut story = Story::new();
            self.opening(&mut story)?;
            let mut system = System::new();
            let started = self.start(&mut system, &mut story).await;
            let outcome = match started {
                Ok(operator) => tokio::select! {
                    failure = system.failure() => Err(failure),
                    () = runtime::end(self.seconds) => Ok(None),
                    outcome = self.play(operator, &mut story) => outcome.map(Some),
                },
                Err(failure) => Err(failure),
            };
            system.stop().await;
            self.closing(outcome?, &mut story)
        })
    }

    fn opening(&self, story: &mut Story) -> Result<(), Failure> {
        story.line(
            "A ground vehicle and its operator's station start on this computer. Every part is a JAUS\n\
             component that could as well be a program on a board of its own; none knows of the others\n\
             before Discovery finds them. They talk through real UDP sockets on the loopback\n\
             interface, and nothing leaves this machine.\n",
        )?;
        let jaus = std::env::args().next().unwrap_or_else(|| "jaus".to_owned());
        story.line(format_args!(
            "While this runs, try in another terminal:\n  \
             {jaus} discover --loopback\n  \
             {jaus} query {VEHICLE}.2.41 QueryLocalPose '{{\"PresenceVector\":67}}' --loopback\n  \
             {jaus} query {VEHICLE}.3.36 QueryMission --loopback\n  \
             {jaus} watch\n"
        ))
    }

    /// Starts everything; returns the operator's component.
    async fn start(&self, system: &mut System, story: &mut Story) -> Result<Component, Failure> {
        let vehicle = system.node(VEHICLE, 1)?;
        start_part(
            system,
            story,
            &vehicle,
            35,
            "communicator",
            self.communicator(),
        )?;
        let wheels = system.node(VEHICLE, 2)?;
        start_part(
            system,
            story,
            &wheels,
            33,
            "primitive driver",
            PrimitiveDriver::default(),
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
        let mind = system.node(VEHICLE, 3)?;
        start_part(
            system,
            story,
            &mind,
            44,
            "local vector driver",
            VectorDriver::default(),
        )?;
        start_part(
            system,
            story,
            &mind,
            48,
            "local path segment driver",
            PathDriver::default(),
        )?;
        start_part(
            system,
            story,
            &mind,
            61,
            "vector knowledge store",
            system.store(),
        )?;
        start_part(system, story, &mind, 36, "planner", Planner::default())?;
        let desk = system.node(OPERATOR, 1)?;
        if !self.headless {
            let station = Station::default().open().await.map_err(Failure::of)?;
            let urls = station.urls();
            start_part(system, story, &desk, 1, "operator's page", station)?;
            for url in urls {
                story.tell(Who::Operator, format_args!("the page is at {url}"))?;
            }
        }
        Component::builder(Kind::OperatorControlUnit, "Operator")
            .component_name("Demo")
            .attach(&desk, 2)
            .map_err(Failure::of)
    }

    /// With the debug view, unless another program uses its port.
    fn communicator(&self) -> Communicator {
        Communicator {
            debug: (!self.headless).then_some(DEBUG_ADDRESS),
            ..Communicator::default()
        }
    }

    /// Plays the operator.
    async fn play(&self, component: Component, story: &mut Story) -> Result<Ending, Failure> {
        if self.stay {
            story.tell(
                Who::Operator,
                "leaves it to you: take control on the page; Ctrl-C ends it",
            )?;
            std::future::pending::<()>().await;
        }
        let ending = Operator::new(component, story).drive(self.to).await?;
        if !self.headless {
            story.tell(
                Who::Operator,
                "the vehicle is yours on the page; Ctrl-C ends the demo",
            )?;
            std::future::pending::<()>().await;
        }
        Ok(ending)
    }

    fn closing(&self, ending: Option<Ending>, story: &mut Story) -> Result<Outcome, Failure> {
        let words = match ending {
            Some(Ending::Arrived) => ": the vehicle has arrived",
            Some(Ending::Stopped) => ": the vehicle has not arrived",
            None if self.headless => ": the vehicle has not arrived by then",
            None => "",
        };
        story.line(format_args!(
            "\nThe demo ends after {:.1} s{words}.",
            story.seconds()
        ))?;
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

/// Parses a place: `6,5`.
fn place(text: &str) -> Result<(f64, f64), String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|it| it.is_finite());
    let pair = text
        .split_once(',')
        .and_then(|(x, y)| Some((number(x)?, number(y)?)));
    pair.ok_or_else(|| "write metres north and east of the start, such as 6,5 or 3,-5".to_owned())
}
