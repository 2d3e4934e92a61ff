//! `jaus vehicle`: reference vehicle, a simulated platform with its JAUS services.

use std::time::Duration;

use clap::{Args, ValueEnum};
use jaus::address::JausId;
use jaus::component::{
    AccessControl, Builder, Component, Condition, Kind, Management, Standing, State, Time,
    TimeOfDay,
};
use jaus::node::time_of_day;
use jaus::service::{MotionPolicy, StopCause};
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::logging::{self, LevelRequests};
use jaus_cli::metrics::{Metrics, MetricsFlags};
use jaus_cli::network::Network;
use jaus_cli::runtime::{self, RunFor, between, control_timeout};
use jaus_vehicle::handoff::Handoff;
use jaus_vehicle::mobility::Vehicle;
use jaus_vehicle::motion::{Frame, Limits, Motion, Pilot, SkidSteer, SkidSteerConfig};
use jaus_vehicle::parts::Telemetry;
use serde_json::{Value as Json, json};
use tokio::time::{MissedTickBehavior, interval};

use crate::events::{EventFormat, EventPrinter};
use crate::node;

/// Run a simulated vehicle that can be controlled and driven
///
/// It offers the core and mobility services, and prints the arrivals and losses of others, the
/// client in control and the vehicle's motion.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus vehicle --loopback               for trying it on one computer\n  \
    jaus vehicle --id 105.1.1 --interface eth0\n  \
    jaus vehicle --profile contest        for clients that send once and never renew control\n  \
    jaus vehicle --split                  Platform Management and Navigation as two components\n  \
    jaus vehicle --noise 0.1 --seed 7     with wheels that slip\n  \
    jaus vehicle --turning-radius 1       steers like a car\n  \
    jaus -v vehicle                       also logs clients' commands\n\n\
    Events of --json: \"started\" and \"discovery\" as of `jaus node`; \"standing\" with \"state\", \
    \"controller\" and \"authority\"; \"motion\" with \"x\" and \"y\" in m, \"yaw\" in rad and \"speed\" \
    in m/s; \"stopped\" with the cause.")]
pub(crate) struct VehicleCommand {
    #[command(flatten)]
    run_for: RunFor,

    /// The vehicle's name [default: Rover]
    #[arg(long)]
    name: Option<String>,

    /// Run two components instead of one: Platform Management with the chosen id, and Navigation
    /// with the next one, which alone can be controlled and driven
    #[arg(long)]
    split: bool,

    /// The minimum authority a client needs to control the vehicle
    #[arg(long, value_name = "CODE", default_value = "1")]
    authority: u8,

    /// The expected clients: `standard` clients renew control and repeat efforts; those of the
    /// public contests do neither, so `contest` implies --control-timeout never and
    /// --hold
    #[arg(long, value_enum, default_value_t)]
    profile: Profile,

    /// Control ends unless the client renews it within this time, in whole seconds to 255s, plus a
    /// grace of a quarter; `never` to keep it [default: 4s]
    #[arg(long, value_name = "DURATION", value_parser = control_timeout)]
    control_timeout: Option<u8>,

    /// Keep an effort or velocity while its client sends anything at least once per second, instead
    /// of for half a second
    #[arg(long)]
    hold: bool,

    #[command(flatten)]
    simulation: Simulation,

    #[command(flatten)]
    format: EventFormat,

    #[command(flatten)]
    network: Network,

    #[command(flatten)]
    metrics: MetricsFlags,
}

/// How clients are expected to behave.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum Profile {
    #[default]
    Standard,
    Contest,
}

#[derive(Args)]
#[command(next_help_heading = "Simulation")]
struct Simulation {
    /// The vehicle's start position, LATITUDE,LONGITUDE in degrees; it heads north
    #[arg(long, value_name = "PLACE", default_value = "52.5,13.4", value_parser = place, allow_hyphen_values = true)]
    at: Frame,

    /// The maximum speed in m/s, from 0.1 to 50; half of that in reverse
    #[arg(long, value_name = "M/S", default_value = "2", value_parser = |text: &str| between(text, 0.1, 50.0))]
    speed: f64,

    /// The maximum acceleration in m/s², from 0.1 to 20; it brakes twice as hard
    #[arg(long, value_name = "M/S²", default_value = "1", value_parser = |text: &str| between(text, 0.1, 20.0))]
    acceleration: f64,

    /// The maximum turn rate in rad/s, from 0.1 to 10
    #[arg(long, value_name = "RAD/S", default_value = "1.5", value_parser = |text: &str| between(text, 0.1, 10.0))]
    yaw_rate: f64,

    /// The least turning radius in metres, up to 100: a vehicle that steers like a car (Ackermann
    /// steering); 0 turns on the spot
    #[arg(long, value_name = "METRES", default_value = "0", value_parser = |text: &str| between(text, 0.0, 100.0))]
    turning_radius: f64,

    /// Wheel slip, as a fraction of the velocity from 0 to 0.5
    #[arg(long, value_name = "SHARE", default_value = "0", value_parser = |text: &str| between(text, 0.0, 0.5))]
    noise: f64,

    /// Random seed of the slip: the same seed gives the same slip
    #[arg(long, default_value = "1")]
    seed: u64,
}

/// Default id.
const ID: JausId = JausId::new(101, 1, 1);
/// Interval of motion reports.
const LOOK: Duration = Duration::from_secs(1);

impl VehicleCommand {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let (id, identity, config) = self.network.for_node(ID)?;
        let name = self.name.clone().or(identity.name);
        let name = name.unwrap_or_else(|| "Rover".to_owned());
        let navigation = self.navigation(id)?;
        logging::use_level(identity.log_level);
        runtime::run(async {
            let levels = LevelRequests::accept(self.network.file());
            let metrics = Metrics::open(self.metrics, identity.metrics).await?;
            let node = self.network.start_service(config)?;
            let time = TimeOfDay::new(time_of_day);
            let vehicle = self.simulation.vehicle().with_clock(time.clone());
            let vehicle = vehicle.motion_policy(self.motion_policy());
            let control = AccessControl::new()
                .authority(self.authority)
                .timeout(self.control_timeout());
            let manager = Component::builder(Kind::Vehicle, name.clone()).access_control(control);
            let driver = Component::builder(Kind::Vehicle, name).component_name("Navigation");
            let driver = drivable(driver, &vehicle, control, time);
            let attach = |builder: Builder, id: JausId| {
                builder.attach(&node, id.component()).map_err(Failure::of)
            };
            let manager = if self.split {
                let manager = manager.component_name("Platform Management");
                Some(attach(manager, id)?)
            } else {
                None
            };
            let driver = attach(driver, navigation)?;
            let mut printer = self.format.printer();
            if self.split {
                printer.words(format_args!(
                    "{id} is Platform Management, {navigation} Navigation"
                ))?;
            }
            node::introduce(&node, &driver, &mut printer)?;
            let telemetry = Telemetry::default();
            telemetry.attach(&driver);
            let outcome = tokio::select! {
                outcome = self.watch(&driver, &vehicle, &telemetry, &mut printer) => outcome,
                () = metrics.run(Some(node.clone()), telemetry.clone()) => Ok(Outcome::Done),
                () = levels.follow() => Ok(Outcome::Done),
            };
            telemetry.release();
            drop((manager, driver));
            node.shutdown().await;
            if let Some(cause @ StopCause::Ended) = vehicle.last_stop() {
                let details = json!({ "cause": cause.to_string() });
                printer.plain("stopped", details, format_args!("stopped: {cause}"))?;
            }
            outcome
        })
    }

    fn control_timeout(&self) -> u8 {
        self.control_timeout.unwrap_or(match self.profile {
            Profile::Standard => AccessControl::TIMEOUT,
            Profile::Contest => 0,
        })
    }

    fn motion_policy(&self) -> MotionPolicy {
        match self.hold || self.profile == Profile::Contest {
            true => MotionPolicy::Hold,
            false => MotionPolicy::default(),
        }
    }

    /// The id of the driving component.
    fn navigation(&self, id: JausId) -> Result<JausId, Failure> {
        let component = id.component().saturating_add(u8::from(self.split));
        let navigation = JausId::new(id.subsystem(), id.node(), component);
        if navigation.is_unicast() {
            return Ok(navigation);
        }
        Err(Failure::new(format!(
            "--split needs two component numbers, and {id} has the last one: choose a component \
             from 1 to 253 (--id)"
        )))
    }

    /// Prints events until the end.
    async fn watch(
        &self,
        component: &Component,
        vehicle: &Vehicle,
        telemetry: &Telemetry,
        printer: &mut EventPrinter,
    ) -> Result<Outcome, Failure> {
        let mut changes = component.watch();
        let mut standings = component.watch_standing();
        let mut standing = Standing::default();
        standings.mark_changed();
        let end = self.run_for.end();
        tokio::pin!(end);
        let mut looks = interval(LOOK);
        looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut told = vehicle.motion();
        loop {
            tokio::select! {
                () = &mut end => return Ok(Outcome::Done),
                Some(change) = changes.next() => node::print_change(change, component, printer)?,
                Ok(()) = standings.changed() => {
                    let now = *standings.borrow_and_update();
                    if now.state == State::Initialize {
                        _ = component.set_condition(Condition::Initialized).await;
                    }
                    let before = std::mem::replace(&mut standing, now);
                    if let Some(words) = standing_in_words(&before, &now) {
                        printer.timed("standing", standing_json(&now), words)?;
                    }
                }
                _ = looks.tick() => {
                    let motion = vehicle.motion();
                    telemetry.set_speed(motion.velocity.x);
                    let is_news = motion.pose != told.pose;
                    told = motion;
                    if is_news {
                        printer.timed("motion", motion_json(&motion), in_words(&motion))?;
                    }
                }
                else => return Err(Failure::new("the node has stopped")),
            }
        }
    }
}

impl Simulation {
    fn vehicle(&self) -> Vehicle {
        let limits = Limits {
            speed: self.speed,
            reverse: self.speed / 2.0,
            acceleration: self.acceleration,
            deceleration: 2.0 * self.acceleration,
            yaw_rate: self.yaw_rate,
            yaw_acceleration: 2.0 * self.yaw_rate,
            turning_radius: self.turning_radius,
        };
        let platform = SkidSteer::new(SkidSteerConfig {
            limits,
            noise: self.noise,
            seed: self.seed,
        });
        Vehicle::new(Pilot::new(platform, self.at))
    }
}

/// A component with all services of a drivable vehicle.
fn drivable(
    builder: Builder,
    vehicle: &Vehicle,
    control: AccessControl,
    time: TimeOfDay,
) -> Builder {
    builder
        .management(Management::new().access_control(control).initializes())
        .offer(Time::new(time))
        .offer(Handoff::new())
        .offer(vehicle.list_manager())
        .offer(vehicle.velocity_state_sensor())
        .offer(vehicle.local_pose_sensor())
        .offer(vehicle.primitive_driver())
        .offer(vehicle.local_waypoint_driver())
        .offer(vehicle.local_waypoint_list_driver())
        // The others in their newest version only, so that the list fits into one packet.
        .offer(vehicle.acceleration_state_sensor().only_newest())
        .offer(vehicle.global_pose_sensor().only_newest())
        .offer(vehicle.velocity_state_driver().only_newest())
        .offer(vehicle.local_vector_driver().only_newest())
        .offer(vehicle.local_path_segment_driver().only_newest())
        .offer(vehicle.global_vector_driver().only_newest())
        .offer(vehicle.global_waypoint_driver().only_newest())
        .offer(vehicle.global_waypoint_list_driver().only_newest())
        .offer(vehicle.global_path_segment_driver().only_newest())
}

/// Describes changes of the component's state and controller.
fn standing_in_words(before: &Standing, now: &Standing) -> Option<String> {
    let client = (now.controller != before.controller).then(|| match now.controller {
        Some(client) => format!(
            "{} is in control, authority {}",
            client.id, client.authority
        ),
        None => "no client is in control".to_owned(),
    });
    let state = (now.state != before.state).then(|| format!("the state is {}", now.state));
    match (client, state) {
        (Some(client), Some(state)) => Some(format!("{client}; {state}")),
        (client, state) => client.or(state),
    }
}

fn standing_json(standing: &Standing) -> Json {
    json!({
        "state": standing.state.to_string(),
        "controller": standing.controller.map(|it| it.id.to_string()),
        "authority": standing.controller.map(|it| it.authority),
    })
}

fn motion_json(motion: &Motion) -> Json {
    let Motion { pose, velocity, .. } = motion;
    json!({ "x": pose.x, "y": pose.y, "yaw": pose.yaw, "speed": velocity.x })
}

fn in_words(motion: &Motion) -> String {
    let (pose, velocity) = (&motion.pose, &motion.velocity);
    format!(
        "at x {:.1} m, y {:.1} m, heading {:.0}°, {:.1} m/s",
        pose.x,
        pose.y,
        pose.yaw.to_degrees().round().rem_euclid(360.0),
        velocity.x
    )
}

/// Parses a place on the globe: `52.5,13.4`.
fn place(text: &str) -> Result<Frame, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let pair = text
        .split_once(',')
        .and_then(|(latitude, longitude)| Some((number(latitude)?, number(longitude)?)));
    match pair {
        Some((latitude, longitude)) if latitude.abs() <= 85.0 && longitude.abs() <= 180.0 => {
            Ok(Frame::at(latitude, longitude))
        }
        _ => Err(
            "write latitude and longitude in degrees such as 52.5,13.4, the latitude from -85 to 85"
                .to_owned(),
        ),
    }
}
