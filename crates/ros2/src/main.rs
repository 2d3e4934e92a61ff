//! `jaus-ros2`: shows a JAUS vehicle to ROS 2, and lets ROS 2 drive it.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus::component::Kind;
use jaus::rights::{Rules, Table};
use jaus_cli::audit::{AuditLog, recorder};
use jaus_cli::runtime::{between, duration_within};
use jaus_cli::{Failure, Ready, launch};
use jaus_ros2::bridge::vehicle::Selection;
use jaus_ros2::bridge::{Bridge, Reports, Settings, TopicSettings};
use jaus_ros2::graph::GREATEST_DOMAIN;
use jaus_ros2::session;
use jaus_vehicle::parts::Part;

#[derive(Args)]
struct Flags {
    /// The vehicle: the number of its subsystem
    #[arg(long, value_name = "SUBSYSTEM", value_parser = clap::value_parser!(u16).range(1..=65534))]
    vehicle: u16,

    /// Use these components of the vehicle only, such as 101.1.255 (repeatable) [default: all]
    #[arg(long, value_name = "IDS")]
    component: Vec<JausId>,

    /// The namespace of the topics [default: /v and the number of the vehicle, such as /v101]
    #[arg(long, value_name = "NAMESPACE")]
    namespace: Option<String>,

    /// The zenoh router of the ROS network (repeatable) [default: tcp/localhost:7447]
    #[arg(long, value_name = "ENDPOINT")]
    connect: Vec<String>,

    /// Listen here for nodes of ROS, such as tcp/0.0.0.0:7447 (repeatable)
    #[arg(long, value_name = "ENDPOINT")]
    listen: Vec<String>,

    /// A zenoh settings file (JSON5), for TLS, access control and all else; --connect and --listen
    /// replace its endpoints
    #[arg(long, value_name = "FILE")]
    zenoh_config: Option<PathBuf>,

    /// The domain of ROS, from 0 to 232
    #[arg(
        long,
        value_name = "NUMBER",
        env = "ROS_DOMAIN_ID",
        default_value_t = 0,
        value_parser = domain
    )]
    domain: u32,

    /// The rate of poses, velocities, positions and further reports, in hertz
    #[arg(long, value_name = "HZ", default_value = "10", value_parser = |text: &str| between(text, 0.1, 1000.0))]
    rate: f64,

    /// What everybody on the ROS network may do, such as "control=127 clear-emergency" [default: watch]
    ///
    /// observe: set emergencies, too. control=AUTHORITY: drive and set goals, with control of this
    /// authority; the higher one wins. clear-emergency: clear the emergencies that ROS has set. with=IDS,
    /// only=NAMES and except=NAMES limit this, as in the file of trusted keys.
    #[arg(long, value_name = "RIGHTS")]
    rights: Option<Rules>,

    /// The highest speed of cmd_vel, and the speed that a primitive driver reaches with full effort,
    /// in m/s
    #[arg(long, value_name = "M/S", default_value = "2", value_parser = |text: &str| between(text, 0.05, 100.0))]
    max_speed: f64,

    /// The highest yaw rate of cmd_vel, and the one that a primitive driver reaches with full effort,
    /// in rad/s
    #[arg(long, value_name = "RAD/S", default_value = "1.5", value_parser = |text: &str| between(text, 0.05, 10.0))]
    max_yaw_rate: f64,

    /// Stop the vehicle after this time without a cmd_vel, at most 2s: until then the bridge repeats the
    /// last one, so that the vehicle's own timeout does not stop it
    #[arg(long, value_name = "DURATION", default_value = "500ms", value_parser = |text: &str| duration_within(text, "50ms", "2s"))]
    timeout: Duration,

    /// Release control after this time without a cmd_vel that moves
    #[arg(long, value_name = "DURATION", default_value = "5s", value_parser = |text: &str| duration_within(text, "50ms", "60s"))]
    hold: Duration,

    /// The speed on the way to a goal, in m/s
    #[arg(long, value_name = "M/S", default_value = "1", value_parser = |text: &str| between(text, 0.05, 100.0))]
    goal_speed: f64,

    /// Take cmd_vel as geometry_msgs/TwistStamped instead of geometry_msgs/Twist
    #[arg(long)]
    stamped: bool,

    /// Publish the pose of the vehicle in /tf, too
    #[arg(long)]
    tf: bool,

    /// The name of the frame of poses and goals
    #[arg(long, value_name = "FRAME", default_value = "map")]
    map_frame: String,

    /// The name of the frame of the vehicle
    #[arg(long, value_name = "FRAME", default_value = "base_link")]
    base_frame: String,

    /// Publish this report of every component that offers it, such as ReportWrenchEffort, with a
    /// type of the package jaus_msgs (repeatable)
    #[arg(long, value_name = "NAME", conflicts_with = "all_reports")]
    report: Vec<String>,

    /// Publish all reports that a query answers, but those about the network itself
    #[arg(long)]
    all_reports: bool,

    /// What the publishers of ROS may and may not do.
    #[arg(skip)]
    audit: Option<AuditLog>,
}

/// Parses the domain. ROS takes an empty `ROS_DOMAIN_ID` as 0, too.
fn domain(text: &str) -> Result<u32, String> {
    if text.is_empty() {
        return Ok(0);
    }
    let number = text.parse().ok().filter(|it| *it <= GREATEST_DOMAIN);
    number.ok_or_else(|| format!("write a number from 0 to {GREATEST_DOMAIN}"))
}

impl Flags {
    /// Checks that the components are parts of the vehicle.
    fn check_components(&self) -> Result<(), Failure> {
        let is_part = |id: &JausId| {
            let subsystem = id.subsystem();
            subsystem == self.vehicle || subsystem == JausId::ANY_SUBSYSTEM
        };
        match self.component.iter().find(|id| !is_part(id)) {
            None => Ok(()),
            Some(other) => Err(Failure::new(format!(
                "--component {other} is not a part of --vehicle {}: start another bridge for it",
                self.vehicle
            ))),
        }
    }

    fn session(&self) -> session::Settings {
        let mut settings = session::Settings::default();
        settings.domain = self.domain;
        let has_network =
            !self.connect.is_empty() || !self.listen.is_empty() || self.zenoh_config.is_some();
        if has_network {
            settings.network.file.clone_from(&self.zenoh_config);
            settings.network.connect.clone_from(&self.connect);
            settings.network.listen.clone_from(&self.listen);
        }
        settings
    }

    fn topics(&self) -> TopicSettings {
        let namespace = self.namespace.clone();
        let namespace = namespace.unwrap_or_else(|| format!("/v{}", self.vehicle));
        let mut topics = TopicSettings::new(namespace);
        topics.is_stamped = self.stamped;
        topics.publishes_transform = self.tf;
        topics.frames.map.clone_from(&self.map_frame);
        topics.frames.base.clone_from(&self.base_frame);
        topics
    }

    fn settings(&self) -> Settings {
        let mut settings = Settings::new(Selection {
            subsystem: self.vehicle,
            only: self.component.clone(),
        });
        settings.rate_hz = self.rate;
        if let Some(rules) = &self.rights {
            settings.rules = rules.clone();
        }
        settings.drive.timeout = self.timeout;
        settings.drive.hold = self.hold;
        settings.drive.limits.speed = self.max_speed;
        settings.drive.limits.yaw_rate = self.max_yaw_rate;
        settings.goal_speed = self.goal_speed;
        settings
    }

    fn reports(&self) -> Result<Reports, Failure> {
        match self.all_reports {
            true => Ok(Reports::all()),
            false => Reports::named(&self.report).map_err(Failure::of),
        }
    }
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-ros2";
    const ABOUT: &'static str = "Bridge between a JAUS vehicle and ROS 2 over zenoh (rmw_zenoh)";
    const EXAMPLES: &'static str = "Examples:\n  \
        jaus-ros2 --vehicle 101                              read-only, router on this host\n  \
        jaus-ros2 --vehicle 101 --rights control=127 --tf     ROS drives: /v101/cmd_vel, /v101/goal_pose\n  \
        jaus-ros2 --vehicle 101 --connect tcp/192.168.7.2:7447 --domain 7\n  \
        jaus-ros2 --vehicle 101 --report ReportWrenchEffort --report ReportStatus --rate 5\n  \
        jaus-ros2 --vehicle 101 --max-speed 6 --max-yaw-rate 0.8 --rights \"control=127 clear-emergency\"";
    const ID: JausId = JausId::new(253, 1, 1);
    const KIND: Kind = Kind::OtherSubsystem;
    const SUBSYSTEM: &'static str = "ROS 2 bridge";
    const AUDITS: bool = true;

    fn audit(&mut self, log: Option<AuditLog>) {
        self.audit = log;
    }

    fn part(self) -> Result<impl Part, Failure> {
        self.check_components()?;
        if let Some(rules) = &self.rights {
            rules.verify(&Table::default()).map_err(Failure::of)?;
        }
        match self.rights.as_ref().is_none_or(Rules::only_watch) {
            true => tracing::info!(
                "ROS may look, and neither command nor stop; --rights gives rights, such as \"observe\" to stop"
            ),
            false => tracing::info!("ROS may do what --rights gives it"),
        }
        let reports = self.reports()?;
        let bridge = Bridge::new(self.settings(), self.topics(), reports, &self.session());
        let recorder = self.audit.map(|log| recorder(log, "ROS publisher"));
        Ok(bridge.map_err(Failure::of)?.recorded_by(recorder))
    }
}

fn main() -> ExitCode {
    launch::<Flags>()
}
