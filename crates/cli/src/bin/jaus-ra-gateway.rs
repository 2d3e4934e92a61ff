//! `jaus-ra-gateway`: connects OpenJAUS 3.3 and other RA 3.x systems with JAUS components, in both
//! directions.

use std::net::Ipv4Addr;
use std::process::ExitCode;
use std::str::FromStr;
use std::time::Duration;

use clap::{Args, ValueEnum};
use jaus::address::JausId;
use jaus::component::Kind;
use jaus::link::{Group, STANDARD_PORT};
use jaus::node::{Config, units};
use jaus::rights::{Acceptance, Grant};
use jaus_cli::audit::{AuditLog, recorder};
use jaus_cli::output::Output;
use jaus_cli::runtime::{control_timeout, duration};
use jaus_cli::{Failure, Ready, launch};
use jaus_ra::RaId;
use jaus_ra::carrier::Dialect;
use jaus_ra::gateway::{Gateway, RaGateway, Report, Settings, Show};
use jaus_ra::ids::{self, ComponentEntry, SubsystemEntry};
use jaus_vehicle::parts::Part;

#[derive(Args)]
struct Flags {
    /// How long to wait for an answer of the other side
    #[arg(long, value_name = "DURATION", default_value = "1s", value_parser = duration)]
    timeout: Duration,

    /// The maximum authority used to control RA components, even if the JAUS client's is higher
    #[arg(long, value_name = "CODE", default_value = "255")]
    authority: u8,

    /// Control of RA components ends unless the JAUS client renews it within this time, in whole
    /// seconds to 255s, plus a grace of a quarter; `never` to keep it
    #[arg(long, value_name = "DURATION", default_value = "4s", value_parser = control_timeout)]
    control_timeout: u8,

    /// Expose only this JAUS subsystem to RA systems (repeatable) [default: all that map to an RA
    /// number]
    #[arg(long, value_name = "SUBSYSTEM", value_parser = clap::value_parser!(u16).range(1..=65534))]
    show: Vec<u16>,

    /// Print the address mapping and the counters of converted and refused messages at the end;
    /// with =TIME, such as =10s, also at that interval
    #[arg(
        long,
        value_name = "TIME",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "0s",
        value_parser = units::duration,
    )]
    stats: Option<Duration>,

    /// Print --stats as JSON, one object a line
    #[arg(long, requires = "stats")]
    json: bool,

    #[command(flatten)]
    ra: RaNetwork,

    #[command(flatten)]
    ids: Ids,

    /// What RA components may and may not do.
    #[arg(skip)]
    audit: Option<AuditLog>,
}

#[derive(Args)]
#[command(next_help_heading = "RA network")]
struct RaNetwork {
    /// The interface of the RA network, by name or IPv4 address [default: the JAUS node's first]
    #[arg(long, value_name = "INTERFACE")]
    ra_interface: Option<String>,

    /// The framing of multicast messages; unicast ones use the receiver's framing
    #[arg(long, value_enum, default_value = "auto")]
    framing: Framing,

    /// The multicast group of the RA network, or off
    #[arg(long, value_name = "ADDRESS", default_value = "224.1.0.1:3794")]
    ra_group: Group,

    /// The IPv4 address of an RA host that multicast does not reach; it receives heartbeats and
    /// other multicast messages by unicast (repeatable)
    #[arg(long, value_name = "ADDRESS")]
    ra_peer: Vec<Ipv4Addr>,

    /// What RA components may send to JAUS components, by the JAUS ids that they have here: "20
    /// control=127" or "65535.255.255 observe"; the first that matches counts, and others are refused
    /// (repeatable) [default: all may observe: query, subscribe and set emergencies]
    ///
    /// RA systems prove no ids. `jaus keys trust --help` has the words.
    #[arg(long, value_name = "IDS RULES")]
    ra_grant: Vec<Grant>,

    /// Our UDP port there; RA systems always answer to 3794
    #[arg(long, value_name = "PORT", default_value_t = STANDARD_PORT)]
    ra_port: u16,

    /// The TTL of multicast there
    #[arg(long, value_name = "HOPS", default_value = "32")]
    ra_ttl: u8,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Framing {
    /// All framings received so far; nothing is sent before the first is received
    Auto,
    /// "JAUS01.0", JAUS_OPC_UDP_Interface of OpenJAUS
    Opc,
    /// AS5669 1.0, JUDP_Interface of OpenJAUS
    Judp,
}

#[derive(Args)]
#[command(next_help_heading = "Address mapping")]
struct Ids {
    /// Offset from an RA subsystem's number to its JAUS number
    #[arg(
        long,
        value_name = "NUMBER",
        default_value = "0",
        allow_hyphen_values = true
    )]
    ra_offset: i32,

    /// Offset from a JAUS subsystem's number to its RA number
    #[arg(
        long,
        value_name = "NUMBER",
        default_value = "0",
        allow_hyphen_values = true
    )]
    jaus_offset: i32,

    /// Map an RA subsystem to a JAUS number, such as 20=1200 (repeatable)
    #[arg(long, value_name = "RA=JAUS", value_parser = pair::<u8, u16>)]
    ra_subsystem: Vec<(u8, u16)>,

    /// Map a JAUS subsystem to an RA number, such as 4711=101 (repeatable)
    #[arg(long, value_name = "JAUS=RA", value_parser = pair::<u16, u8>)]
    jaus_subsystem: Vec<(u16, u8)>,

    /// Map an RA component to a JAUS id, such as 20.1.70.1=20.1.200 (repeatable)
    #[arg(long, value_name = "RA=JAUS", value_parser = pair::<RaId, JausId>)]
    ra_component: Vec<(RaId, JausId)>,

    /// Map a JAUS component to an RA instance, such as 101.1.9=101.1.33.1 (repeatable)
    #[arg(long, value_name = "JAUS=RA", value_parser = pair::<JausId, RaId>)]
    jaus_component: Vec<(JausId, RaId)>,
}

/// Parses the two sides of an equals sign.
fn pair<A: FromStr, B: FromStr>(text: &str) -> Result<(A, B), String>
where
    A::Err: std::fmt::Display,
    B::Err: std::fmt::Display,
{
    let (from, to) = text
        .split_once('=')
        .ok_or("write two numbers or ids separated by an equals sign, such as 20=1200")?;
    let from = from.parse();
    let to = to.parse();
    Ok((
        from.map_err(|error: A::Err| format!("left of the equals sign: {error}"))?,
        to.map_err(|error: B::Err| format!("right of the equals sign: {error}"))?,
    ))
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-ra-gateway";
    const ABOUT: &'static str = "Gateway between JAUS and OpenJAUS 3.3 or other RA 3.x systems";
    const EXAMPLES: &'static str = "Examples:\n  \
        jaus-ra-gateway --interface eth0                  both networks on one cable\n  \
        jaus-ra-gateway --interface eth0 --ra-interface eth1\n  \
        jaus-ra-gateway --interface eth0 --ra-grant \"20 control=127\"   RA subsystem 20 may drive\n  \
        jaus-ra-gateway --interface eth0 --framing judp   for JUDP_Interface: true\n  \
        jaus-ra-gateway --interface eth0 --ra-peer 10.1.2.3   beyond a router\n  \
        jaus-ra-gateway --interface eth0 --ra-offset 1000 RA subsystem 20 becomes 1020\n  \
        jaus-ra-gateway --interface eth0 --show 101 --stats=10s";
    const ID: JausId = JausId::new(250, 1, 1);
    const KIND: Kind = Kind::OtherSubsystem;
    const SUBSYSTEM: &'static str = "RA gateway";
    const AUDITS: bool = true;

    fn for_node(&self) -> impl FnOnce(&mut Config) + 'static {
        // RA systems answer only to port 3794, JAUS peers to our source port.
        let shared = self.ra.ra_interface.is_none() && self.ra.ra_port == STANDARD_PORT;
        move |config: &mut Config| {
            if shared && config.port == STANDARD_PORT {
                config.port = 0;
            }
        }
    }

    fn audit(&mut self, log: Option<AuditLog>) {
        self.audit = log;
    }

    fn part(self) -> Result<impl Part, Failure> {
        let reporter = match self.json {
            true => print_json,
            false => print_text,
        };
        let settings = self.settings();
        match self.ra.ra_grant.is_empty() {
            true => tracing::info!(
                "RA clients may look and stop (set emergencies), and not command; --ra-grant gives rights"
            ),
            false => tracing::info!("RA clients may do what --ra-grant gives them"),
        }
        // Report invalid ids before anything is opened.
        Gateway::check(&settings).map_err(Failure::of)?;
        Ok(RaGateway {
            settings,
            interface: self.ra.ra_interface,
            group: self.ra.ra_group,
            ttl: self.ra.ra_ttl,
            port: self.ra.ra_port,
            reports: self.stats,
            reporter,
            recorder: self.audit.map(|log| recorder(log, "RA")),
        })
    }
}

impl Flags {
    fn settings(&self) -> Settings {
        let mut settings = Settings {
            ids: self.ids.settings(),
            patience: self.timeout,
            authority: self.authority,
            timeout: Duration::from_secs(self.control_timeout.into()),
            ..Settings::default()
        };
        if !self.show.is_empty() {
            settings.show = Show::Only(self.show.iter().copied().collect());
        }
        if !self.ra.ra_grant.is_empty() {
            settings.grants = Acceptance::new(self.ra.ra_grant.iter().cloned());
        }
        let peers = self.ra.ra_peer.iter().copied();
        settings.ra.carrier.peers = peers.map(Into::into).collect();
        settings.ra.carrier.group_dialects = match self.ra.framing {
            // In the framings of the peers; all RA systems send heartbeats.
            Framing::Auto => Vec::new(),
            Framing::Opc => vec![Dialect::Opc],
            Framing::Judp => vec![Dialect::As5669],
        };
        settings
    }
}

impl Ids {
    fn settings(&self) -> ids::Settings {
        let mut settings = ids::Settings::default();
        settings.ra_offset = self.ra_offset;
        settings.jaus_offset = self.jaus_offset;
        let subsystem = |ra, jaus| SubsystemEntry { ra, jaus };
        let component = |ra, jaus| ComponentEntry { ra, jaus };
        let ra = self.ra_subsystem.iter();
        settings.ra_subsystems = ra.map(|&(ra, jaus)| subsystem(ra, jaus)).collect();
        let jaus = self.jaus_subsystem.iter();
        settings.jaus_subsystems = jaus.map(|&(jaus, ra)| subsystem(ra, jaus)).collect();
        let ra = self.ra_component.iter();
        settings.ra_components = ra.map(|&(ra, jaus)| component(ra, jaus)).collect();
        let jaus = self.jaus_component.iter();
        settings.jaus_components = jaus.map(|&(jaus, ra)| component(ra, jaus)).collect();
        settings
    }
}

fn print_text(report: &Report) {
    // A closed output is no reason to stop.
    let _ = Output::new().part(&format!("\n{report}"));
}

fn print_json(report: &Report) {
    if let Ok(json) = serde_json::to_string(report) {
        let _ = Output::new().line(json);
    }
}

fn main() -> ExitCode {
    launch::<Flags>()
}
