//! `jaus-communicator`: the vehicle's node, between its boards, the operator's network and a radio.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus::link::serial;
use jaus::node::{Config, Local, units};
use jaus_cli::{self, Failure, Ready};
use jaus_vehicle::parts::{Communicator, Part};
use jaus_view::debug::DebugAddress;
use jaus_view::{JournalFormat, JournalSettings};

#[derive(Args)]
struct Flags {
    /// Do not route between links; by default messages are routed between interfaces, connections
    /// and serial lines
    #[arg(long)]
    no_forward: bool,

    /// A serial line, such as a radio modem; BAUD defaults to 115200 (repeatable)
    #[arg(long, value_name = "DEVICE[:BAUD]", value_parser = line)]
    serial: Vec<serial::Settings>,

    /// Let component processes of this host attach to the node; ADDRESS is a socket path or a
    /// loopback port such as 127.0.0.1:37940 [default: the usual place]
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, require_equals = true, default_missing_value = "default")]
    local: Option<Local>,

    /// Where to serve the debug view for `jaus watch` and others: the path of a socket for this user
    /// alone, or off; or ADDRESS:PORT, where everyone who reaches it reads all messages [default:
    /// the socket `debug.sock` beside that of --local]
    #[arg(long, value_name = "ADDRESS")]
    debug: Option<Debug>,

    /// Record all traffic in this directory, for `jaus watch` and Wireshark
    #[arg(long, value_name = "DIRECTORY")]
    log: Option<PathBuf>,

    /// Limit on the size of all log files together; the oldest are deleted first
    #[arg(long, value_name = "SIZE", default_value = "1GiB", value_parser = units::size)]
    log_limit: usize,

    /// Start a new log file after this time at the latest
    #[arg(long, value_name = "TIME", default_value = "1h", value_parser = units::duration)]
    log_age: Duration,

    /// Log whole messages as JSON lines instead of packets
    #[arg(long)]
    log_json: bool,
}

/// Address of the debug view.
#[derive(Debug, Clone)]
enum Debug {
    Off,
    At(DebugAddress),
}

impl std::str::FromStr for Debug {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "off" => Ok(Self::Off),
            _ => text.parse().map(Self::At).map_err(|_| {
                "write the path of a socket such as ./debug.sock, an address with its port such as \
                 127.0.0.1:8794, or off"
                    .to_owned()
            }),
        }
    }
}

/// Parses `/dev/ttyUSB0` or `/dev/ttyUSB0:57600`.
fn line(text: &str) -> Result<serial::Settings, String> {
    let (device, baud) = match text.rsplit_once(':') {
        Some((device, baud)) => {
            let baud = baud.parse().map_err(|_| {
                format!("`{baud}` is not a baud rate: write for example /dev/ttyUSB0:57600")
            })?;
            (device, Some(baud))
        }
        None => (text, None),
    };
    let mut settings = serial::Settings::new(device);
    settings.baud = baud.unwrap_or(settings.baud);
    Ok(settings)
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-communicator";
    const ABOUT: &'static str =
        "The vehicle's node: routing, discovery, traffic log and debug view";
    const EXAMPLES: &'static str = "Examples:\n  \
        jaus-communicator\n  \
        jaus-communicator --interface eth0 --interface wlan0\n  \
        jaus-communicator --serial /dev/ttyUSB0:57600\n  \
        jaus-communicator --local                 components of this host attach (--attach)\n  \
        jaus-communicator --log /var/log/jaus --log-limit 200MiB\n  \
        jaus-communicator --config communicator.toml\n  \
        jaus watch                                shows the traffic";
    const ID: JausId = JausId::new(101, 1, 35);

    fn for_node(&self) -> impl FnOnce(&mut Config) + 'static {
        let (serial, local) = (self.serial.clone(), self.local.clone());
        let forward = !self.no_forward;
        move |config: &mut Config| {
            config.routing.forward = forward;
            config.serial.extend(serial);
            if let Some(local) = local {
                config.local = local;
            }
        }
    }

    fn part(self) -> Result<impl Part, Failure> {
        let log = self.log.map(|directory| {
            let settings = JournalSettings {
                file_age: self.log_age,
                format: if self.log_json {
                    JournalFormat::JsonLines
                } else {
                    JournalFormat::Packets
                },
                ..JournalSettings::new(directory)
            };
            settings.limited_to(self.log_limit as u64)
        });
        Ok(Communicator {
            debug_is_needed: self.debug.is_some(),
            debug: match self.debug {
                None => Some(DebugAddress::usual(0)),
                Some(Debug::At(address)) => Some(address),
                Some(Debug::Off) => None,
            },
            log,
            ..Communicator::default()
        })
    }
}

fn main() -> ExitCode {
    jaus_cli::launch::<Flags>()
}
