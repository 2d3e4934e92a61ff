//! `jaus-zenoh`: joins JAUS systems over a zenoh network, and shows them to other zenoh programs.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use jaus::address::JausId;
use jaus::component::Kind;
use jaus::node::Config;
use jaus::rights::{Acceptance, Grant};
use jaus_cli::audit::{AuditLog, recorder};
use jaus_cli::permissions::table_with;
use jaus_cli::{Failure, Ready, launch};
use jaus_vehicle::parts::Part;
use jaus_zenoh::key::Prefix;
use jaus_zenoh::{Bridge, MinPeriod, NetworkSettings, Settings};

#[derive(Args)]
struct Flags {
    /// A zenoh router or another bridge to connect to, such as tcp/192.168.7.2:7447 (repeatable:
    /// with several routers, it changes to another one when it loses one)
    #[arg(long, value_name = "ENDPOINT")]
    connect: Vec<String>,

    /// Listen here for other bridges and zenoh programs, such as tcp/0.0.0.0:7447 (repeatable)
    #[arg(long, value_name = "ENDPOINT")]
    listen: Vec<String>,

    /// A zenoh settings file (JSON5), for TLS, access control and all else; --connect and --listen
    /// replace its endpoints [default: no file, no scouting]
    #[arg(long, value_name = "FILE")]
    zenoh_config: Option<PathBuf>,

    /// The first chunks of all keys; bridges with another prefix are another network
    #[arg(long, value_name = "PREFIX", default_value = "jaus")]
    prefix: Prefix,

    /// Accept these ids from the zenoh side, with these rights, such as "60 control=127" or
    /// "60.1.1 command" (repeatable; the first that matches counts) [default: all ids, which may watch]
    ///
    /// The rights are observe, command, control=AUTHORITY, clear-emergency, clear-emergency=any, configure,
    /// with=IDS, only=NAMES, except=NAMES and also=CODES, as in the file of trusted keys.
    #[arg(long, value_name = "IDS RIGHTS")]
    accept: Vec<Grant>,

    /// Decide on messages of one's own, too, by what the JSIDL file or directory states of them
    /// (repeatable)
    #[arg(long, value_name = "PATH")]
    accept_jsidl: Vec<PathBuf>,

    /// Let --accept give more rights than to watch although the links of zenoh are not all TLS with client
    /// certificates: anyone who reaches the network can then act as these ids
    #[arg(long)]
    trust_network: bool,

    /// Show only these ids of this side to the zenoh side, such as 101 or 101.1.255 (repeatable)
    /// [default: all]
    #[arg(long, value_name = "IDS", value_parser = ids)]
    offer: Vec<JausId>,

    /// Publish this message of one component to one receiver at most once in this period, for thin
    /// links, such as ReportVelocityState=200ms or 4404h=200ms (repeatable)
    ///
    /// The newest value always arrives. Messages that are acknowledged are never held back.
    #[arg(long, value_name = "MESSAGE=PERIOD")]
    min_period: Vec<MinPeriod>,

    /// What clients of the zenoh side may and may not do.
    #[arg(skip)]
    audit: Option<AuditLog>,
}

/// Parses a subsystem's number or ids with wildcards.
fn ids(text: &str) -> Result<JausId, String> {
    text.parse::<Grant>()
        .map(|grant| grant.ids)
        .map_err(|error| error.to_string())
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-zenoh";
    const ABOUT: &'static str = "Bridge between JAUS systems over a zenoh network";
    const EXAMPLES: &'static str = "Examples:\n  \
        jaus-zenoh --id 101.250.1 --listen tcp/0.0.0.0:7447             the others watch\n  \
        jaus-zenoh --id 60.250.1 --connect tcp/192.168.7.2:7447\n  \
        jaus-zenoh --id 101.250.1 --zenoh-config tls.json5 --accept \"60 control=127\"\n  \
        jaus-zenoh --id 101.250.1 --connect tcp/r1:7447 --connect tcp/r2:7447   two routers\n  \
        jaus-zenoh --id 101.250.1 --connect tcp/r1:7447 --min-period ReportVelocityState=1s";
    const ID: JausId = JausId::new(251, 1, 1);
    const KIND: Kind = Kind::OtherSubsystem;
    const SUBSYSTEM: &'static str = "zenoh bridge";
    const AUDITS: bool = true;

    fn for_node(&self) -> impl FnOnce(&mut Config) + 'static {
        |config: &mut Config| config.routing.forward = true
    }

    fn audit(&mut self, log: Option<AuditLog>) {
        self.audit = log;
    }

    fn part(self) -> Result<impl Part, Failure> {
        let mut settings = Settings::default();
        settings.prefix = self.prefix;
        settings.table = table_with(&self.accept_jsidl)?;
        if !self.accept.is_empty() {
            settings.accept = Acceptance::new(self.accept);
            let names = settings.accept.verify(&settings.table);
            names.map_err(Failure::of)?;
        }
        match settings.accept.only_watches() {
            true => tracing::info!(
                "clients of the zenoh side may look, and neither command nor stop; --accept gives rights, such \
                 as \"60 observe\" to stop"
            ),
            false => tracing::info!("clients of the zenoh side may do what --accept gives them"),
        }
        settings.trusts_network = self.trust_network;
        settings.offer = self.offer;
        settings.min_periods = self.min_period;
        let mut network = NetworkSettings::default();
        network.file = self.zenoh_config;
        network.connect = self.connect;
        network.listen = self.listen;
        let recorder = self.audit.map(|log| recorder(log, "zenoh bridge"));
        Bridge::new(settings, &network, recorder).map_err(Failure::of)
    }
}

fn main() -> ExitCode {
    launch::<Flags>()
}
