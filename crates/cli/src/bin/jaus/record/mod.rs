//! `jaus record`: records the traffic of JAUS peers into a capture file.

mod filter;

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use jaus::link::Group;
use jaus::node::units;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::say;
use jaus_cli::runtime::{self, RunFor};
use jaus_view::{CaptureWriter, InterfaceNumber, JAUS_PORT, LinkType};
use tokio::time::{MissedTickBehavior, interval};

use crate::packets::{Packet, Source};
use filter::Filter;

/// Record JAUS traffic to a capture file, for `jaus decode`, `jaus replay` and Wireshark
///
/// With the privilege to open packet sockets (root, or `setcap cap_net_raw+ep jaus`) it records all
/// traffic of this host: UDP and TCP of the chosen ports, and datagrams of other ports whose
/// content is JAUS. Without it, it records only the multicast group and prints a note. Press Ctrl-C
/// to end; packets are on disk within a second.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus record drive.pcapng\n  \
    jaus record drive.pcapng --interface eth0 --for 1min\n  \
    jaus record drive.pcapng --size 500MB --quiet &\n  \
    jaus decode drive.pcapng")]
pub(crate) struct Record {
    /// The file to write (pcapng); it must not exist without --overwrite
    file: PathBuf,

    /// Overwrite an existing file
    #[arg(long)]
    overwrite: bool,

    /// Record only this interface, by name or address (repeatable) [default: all, including
    /// loopback]
    #[arg(long, value_name = "INTERFACE")]
    interface: Vec<String>,

    /// Record this UDP and TCP port (repeatable)
    #[arg(long, default_values_t = [JAUS_PORT])]
    port: Vec<u16>,

    /// The multicast group to record without packet sockets
    #[arg(long, value_name = "ADDRESS", default_value_t)]
    group: Group,

    #[command(flatten)]
    run_for: RunFor,

    /// End when the file reaches this size, such as 500MB
    #[arg(long, value_name = "SIZE", value_parser = units::size)]
    size: Option<usize>,

    /// Print no progress
    #[arg(long, short)]
    quiet: bool,
}

impl Record {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        runtime::run(async {
            let mut source = Source::open(&self.interface, self.group)?;
            let mut recording = Recording::create(&self.file, self.overwrite, &self.port)?;
            let result = self.record(&mut source, &mut recording).await;
            recording.flush()?;
            if !self.quiet {
                say(format_args!(
                    "{} in {}",
                    recording.tally(),
                    self.file.display()
                ));
            }
            result.map(|()| Outcome::complete_if(recording.packets > 0))
        })
    }

    async fn record(&self, source: &mut Source, recording: &mut Recording) -> Result<(), Failure> {
        let end = self.run_for.end();
        tokio::pin!(end);
        let mut second = interval(Duration::from_secs(1));
        second.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut told = 0;
        loop {
            tokio::select! {
                () = &mut end => return Ok(()),
                _ = second.tick() => {
                    recording.flush()?;
                    if !self.quiet && recording.packets > told {
                        told = recording.packets;
                        say(recording.tally());
                    }
                }
                packets = source.next() => {
                    packets?.iter().try_for_each(|packet| recording.take(packet))?;
                }
            }
            let limit = self.size.map(|size| size as u64);
            if limit.is_some_and(|limit| recording.writer.written() >= limit) {
                return Ok(());
            }
        }
    }
}

/// The file with its counters.
struct Recording {
    file: PathBuf,
    writer: CaptureWriter<BufWriter<File>>,
    interfaces: BTreeMap<String, InterfaceNumber>,
    filter: Filter,
    packets: u64,
}

impl Recording {
    fn create(path: &Path, overwrite: bool, ports: &[u16]) -> Result<Self, Failure> {
        let mut options = OpenOptions::new();
        options.write(true).truncate(true);
        let options = if overwrite {
            options.create(true)
        } else {
            options.create_new(true)
        };
        let file = options.open(path).map_err(|error| match error.kind() {
            io::ErrorKind::AlreadyExists => Failure::new(format!(
                "{} exists already: choose another name, or add --overwrite",
                path.display()
            )),
            _ => Failure::file(path, &error),
        })?;
        let program = concat!("jaus ", env!("CARGO_PKG_VERSION"));
        let writer = CaptureWriter::new(BufWriter::new(file), program)
            .map_err(|error| Failure::file(path, &error))?;
        Ok(Self {
            file: path.to_owned(),
            writer,
            interfaces: BTreeMap::new(),
            filter: Filter::new(ports),
            packets: 0,
        })
    }

    /// Writes a packet, if it is selected.
    fn take(&mut self, packet: &Packet) -> Result<(), Failure> {
        if !self.filter.wants(&packet.octets) {
            return Ok(());
        }
        let failed = |error| Failure::file(&self.file, &error);
        let known = self.interfaces.get(&packet.interface).copied();
        let on = match known {
            Some(on) => on,
            None => {
                let name = &packet.interface;
                let on = self.writer.add_interface(name, LinkType::RAW);
                let on = on.map_err(failed)?;
                self.interfaces.insert(name.clone(), on);
                on
            }
        };
        self.packets += 1;
        self.writer
            .write(on, packet.time, &packet.octets)
            .map_err(failed)
    }

    fn flush(&mut self) -> Result<(), Failure> {
        let flushed = self.writer.flush();
        flushed.map_err(|error| Failure::file(&self.file, &error))
    }

    fn tally(&self) -> String {
        let (packets, octets) = (self.packets, self.writer.written() as f64);
        format!("{packets} packets recorded, {:.1} kB", octets / 1e3)
    }
}
