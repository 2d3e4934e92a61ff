//! `jaus replay`: sends the datagrams of a capture again, or a selection of them, from other ids if
//! wanted.
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "datagrams go out as recorded, with their timing, past our own links"
)]

use std::collections::BTreeMap;
use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::time::Duration;

use bytes::Bytes;
use clap::Args;
use jaus::address::JausId;
use jaus::link::{STANDARD_PORT, interface};
use jaus::wire::judp;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::say;
use jaus_cli::runtime;
use jaus_view::{Datagram, Filter, Line, MessageLog, Timestamp};
use serde_json::{Value as Json, json};
use socket2::SockRef;
use tokio::net::UdpSocket;
use tokio::time::{Instant, sleep_until};

use crate::decode::network;
use crate::definitions::Definitions;
use crate::events::EventFormat;
use crate::recordings;

/// Send the datagrams of a capture again, with their original timing
///
/// The destination is mandatory, because a replayed recording commands the vehicles on the network.
/// All datagrams are sent from one socket; answers to it are ignored. Messages of TCP connections
/// are sent as datagrams.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus replay drive.pcapng --dry-run\n  \
    jaus replay drive.pcapng --to 127.0.0.1:3794\n  \
    jaus replay drive.pcapng --to group --interface 127.0.0.1 --speed 10\n  \
    jaus replay drive.pcapng --to 10.0.0.7 --from 101.255.255 --loop 0\n  \
    jaus replay drive.pcapng --to group --start 90s --for 30s\n  \
    jaus replay drive.pcapng --to group --filter 'service=Pose' --map 101=201\n\n\
    Events of --json: \"capture\" with the number of \"datagrams\", their \"span\" in seconds, their \
    \"senders\" and what is \"left_out\"; \"sent\" with the number of \"datagrams\".")]
pub(crate) struct Replay {
    /// The capture: pcap, pcapng or MCAP from `jaus record`, tcpdump, Wireshark …
    file: PathBuf,

    /// The destination: ADDRESS, ADDRESS:PORT, or `group` for 239.255.0.1:3794
    #[arg(long, value_name = "ADDRESS", required_unless_present = "dry_run")]
    to: Option<Target>,

    /// Send from this interface, by name or address; selects the network for multicast
    #[arg(long, value_name = "INTERFACE", value_parser = interface_address)]
    interface: Option<IpAddr>,

    /// Speed factor; 0 sends without pauses
    #[arg(long, default_value = "1", value_parser = speed)]
    speed: f64,

    /// Leave out this much of the beginning, such as 90s
    #[arg(long, value_name = "DURATION", value_parser = runtime::duration)]
    start: Option<Duration>,

    /// Send only this much of the capture, such as 30s [default: all of it]
    #[arg(long = "for", value_name = "DURATION", value_parser = runtime::duration)]
    length: Option<Duration>,

    /// How many times to send the capture; 0 repeats it until Ctrl-C
    #[arg(long = "loop", value_name = "TIMES", default_value = "1")]
    times: u64,

    /// Only datagrams whose first message is from this id; 65535 and 255 are wildcards
    #[arg(long, value_name = "ID")]
    from: Option<JausId>,

    /// Only datagrams with a message that matches this filter (repeatable); see `jaus watch --help`.
    /// A fragment of a large message has an id, but no name and no fields
    #[arg(long, value_name = "FILTER")]
    filter: Vec<Filter>,

    /// Replace an id, or a subsystem, in source and destination: 101.2.33=201.2.33, 101=201
    /// (repeatable)
    #[arg(long, value_name = "OLD=NEW")]
    map: Vec<Mapping>,

    /// Only what is from or to this UDP or TCP port (repeatable) [default: 3794, and what is JAUS by
    /// its content on any other]
    #[arg(long, value_name = "PORT")]
    port: Vec<u16>,

    #[command(flatten)]
    definitions: Definitions,

    /// Print what would be sent, and exit
    #[arg(long)]
    dry_run: bool,

    #[command(flatten)]
    format: EventFormat,
}

/// A capture with a longer span is damaged or not worth the wait.
const LONGEST: Duration = Duration::from_secs(366 * 86_400);

/// Destination of a replay.
#[derive(Clone, Copy, Debug)]
struct Target(SocketAddr);

impl std::str::FromStr for Target {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "group" {
            return Ok(Self(jaus::link::STANDARD_GROUP.into()));
        }
        let standard = |ip: IpAddr| SocketAddr::new(ip, STANDARD_PORT);
        let address = text.parse().or_else(|_| text.parse().map(standard));
        address.map(Self).map_err(|_| {
            format!("`{text}` is not an address: write 10.0.0.7, 10.0.0.7:3795 or group")
        })
    }
}

/// The address of an interface of this host.
fn interface_address(text: &str) -> Result<IpAddr, String> {
    if let Ok(address) = text.parse() {
        return Ok(address);
    }
    let present = interface::list().map_err(|error| error.to_string())?;
    let of_name = || present.iter().filter(|it| it.name == text);
    // Multicast is sent by IPv4.
    let chosen = of_name()
        .find(|it| it.address.is_ipv4())
        .or_else(|| of_name().next());
    match chosen {
        Some(chosen) => Ok(chosen.address),
        None => Err(format!(
            "there is no network interface `{text}` on this host; choose from: {}",
            interface::Available(present)
        )),
    }
}

fn speed(text: &str) -> Result<f64, String> {
    let speed: f64 = text
        .parse()
        .map_err(|_| "write a number such as 1, 0.5 or 10")?;
    if speed == 0.0 || (0.01..=1000.0).contains(&speed) {
        Ok(speed)
    } else {
        Err("write a factor from 0.01 to 1000, or 0 for no pauses".to_owned())
    }
}

/// Replacement of an id, or of a subsystem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mapping {
    Id(JausId, JausId),
    Subsystem(u16, u16),
}

impl std::str::FromStr for Mapping {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let usage = || format!("`{text}`: write 101.2.33=201.2.33 or 101=201");
        let (old, new) = text.split_once('=').ok_or_else(usage)?;
        if let (Ok(old), Ok(new)) = (old.parse(), new.parse()) {
            return Ok(Self::Id(old, new));
        }
        match (old.parse(), new.parse()) {
            (Ok(old @ 1..), Ok(new @ 1..)) => Ok(Self::Subsystem(old, new)),
            _ => Err(usage()),
        }
    }
}

impl Mapping {
    /// The id that takes the place of another. The first mapping that matches counts.
    fn replaced(mappings: &[Self], id: JausId) -> JausId {
        let new = mappings.iter().find_map(|mapping| match *mapping {
            Self::Id(old, new) => (old == id).then_some(new),
            Self::Subsystem(old, new) => {
                (old == id.subsystem()).then(|| JausId::new(new, id.node(), id.component()))
            }
        });
        new.unwrap_or(id)
    }

    /// A datagram with other ids: one for each of its messages, as these cannot be put together
    /// again. Without mappings it stays as it is.
    fn applied(mappings: &[Self], payload: Bytes) -> Vec<Bytes> {
        if mappings.is_empty() {
            return vec![payload];
        }
        let frames = judp::frames(payload).into_iter().flatten();
        let frames = frames.map_while(Result::ok).map(|mut frame| {
            frame.source = Self::replaced(mappings, frame.source);
            frame.destination = Self::replaced(mappings, frame.destination);
            frame
        });
        frames
            .filter_map(|frame| judp::encode(&frame).ok())
            .collect()
    }
}

/// A datagram, with its time relative to the first.
struct Recorded {
    after: Duration,
    payload: Bytes,
}

/// Content of a capture.
#[derive(Default)]
struct Found {
    recorded: Vec<Recorded>,
    /// By the source id of the first message.
    senders: BTreeMap<String, u64>,
    not_jaus: u64,
    others: u64,
    unlike: u64,
    at_other_times: u64,
    cut: u64,
}

impl Replay {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let found = self.read()?;
        let mut printer = self.format.printer();
        printer.plain("capture", found.to_json(), &found)?;
        let Some(Target(to)) = self.to.filter(|_| !self.dry_run) else {
            return Ok(Outcome::complete_if(!found.recorded.is_empty()));
        };
        if found.recorded.is_empty() {
            return Ok(Outcome::Incomplete);
        }
        runtime::run(async {
            let socket = self.socket(to).await?;
            let end = runtime::end(None);
            let mut sent = 0;
            let result = tokio::select! {
                () = end => Ok(()),
                result = self.send(&socket, to, &found.recorded, &mut sent) => result,
            };
            let details = json!({ "datagrams": sent, "to": to.to_string() });
            printer.plain(
                "sent",
                details,
                format_args!("{sent} datagrams sent to {to}"),
            )?;
            result.map(|()| Outcome::Done)
        })
    }

    /// Reads the whole capture first, so that errors are reported before anything is sent.
    fn read(&self) -> Result<Found, Failure> {
        let mut recording = recordings::open(&self.file)?;
        let mut network = network(&self.port);
        let dictionary = self.definitions.load()?;
        let mut log = MessageLog::new(&dictionary);
        let (mut found, mut first) = (Found::default(), None);
        while let Some(frame) = recording.next_frame() {
            let frame = match frame {
                Ok(frame) => frame,
                Err(error) => {
                    say(format_args!(
                        "{}: {error}; the part before it is used",
                        self.file.display()
                    ));
                    break;
                }
            };
            for datagram in network.handle_frame(&frame) {
                let time = frame.time.map_or(Duration::ZERO, since_1970);
                let after = time.saturating_sub(*first.get_or_insert(time)).min(LONGEST);
                let lines = log.read(frame.time, &datagram);
                match after.checked_sub(self.start.unwrap_or_default()) {
                    Some(after) if self.length.is_none_or(|it| after < it) => {
                        self.sort(&datagram, &lines, after, &mut found);
                    }
                    _ => found.at_other_times += 1,
                }
            }
        }
        let counts = network.counts();
        found.cut += counts.incomplete_datagrams;
        found.not_jaus += counts.foreign;
        Ok(found)
    }

    /// Selects a datagram, or counts why it is left out.
    fn sort(
        &self,
        datagram: &Datagram<'_>,
        lines: &[Line<'_>],
        after: Duration,
        found: &mut Found,
    ) {
        if datagram.missing > 0 {
            found.cut += 1;
            return;
        }
        let payload = Bytes::copy_from_slice(&datagram.payload);
        let first = judp::frames(payload.clone())
            .ok()
            .and_then(|mut frames| frames.next());
        let Some(Ok(frame)) = first else {
            found.not_jaus += 1;
            return;
        };
        if self.from.is_some_and(|from| !from.matches(frame.source)) {
            found.others += 1;
            return;
        }
        let passes = |filter: &Filter| lines.iter().any(|line| filter.passes(&line.into()));
        if !self.filter.iter().all(passes) {
            found.unlike += 1;
            return;
        }
        let source = Mapping::replaced(&self.map, frame.source);
        *found.senders.entry(source.to_string()).or_default() += 1;
        let payloads = Mapping::applied(&self.map, payload);
        let recorded = payloads.into_iter();
        found
            .recorded
            .extend(recorded.map(|payload| Recorded { after, payload }));
    }

    async fn socket(&self, to: SocketAddr) -> Result<UdpSocket, Failure> {
        let any: IpAddr = match to {
            SocketAddr::V4(_) => Ipv4Addr::UNSPECIFIED.into(),
            SocketAddr::V6(_) => std::net::Ipv6Addr::UNSPECIFIED.into(),
        };
        let from = self.interface.unwrap_or(any);
        let socket = UdpSocket::bind((from, 0)).await.map_err(|error| {
            Failure::new(format!(
                "cannot send from {from}: {error}; give --interface an address of this host"
            ))
        })?;
        let set_up = || {
            let options = SockRef::from(&socket);
            if let IpAddr::V4(address) = from
                && !address.is_unspecified()
            {
                options.set_multicast_if_v4(&address)?;
            }
            options.set_broadcast(true)
        };
        set_up().map_err(|error| Failure::new(format!("cannot set up the socket: {error}")))?;
        Ok(socket)
    }

    async fn send(
        &self,
        socket: &UdpSocket,
        to: SocketAddr,
        recorded: &[Recorded],
        sent: &mut u64,
    ) -> Result<(), Failure> {
        let mut round = 0;
        while self.times == 0 || round < self.times {
            round += 1;
            let start = Instant::now();
            for datagram in recorded {
                if self.speed > 0.0 {
                    sleep_until(start + datagram.after.div_f64(self.speed)).await;
                }
                socket
                    .send_to(&datagram.payload, to)
                    .await
                    .map_err(|error| Failure::new(format!("cannot send to {to}: {error}")))?;
                *sent += 1;
                if self.speed == 0.0 && sent.is_multiple_of(32) {
                    // Yield to the receiver, which may run on this processor.
                    tokio::time::sleep(Duration::from_micros(200)).await;
                }
            }
            // Even a short capture must not become a busy loop.
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
        Ok(())
    }
}

impl Found {
    /// Time from the beginning to the last datagram, in seconds.
    fn span(&self) -> f64 {
        let last = self.recorded.last().map(|last| last.after);
        last.unwrap_or_default().as_secs_f64()
    }

    fn to_json(&self) -> Json {
        json!({
            "datagrams": self.recorded.len(),
            "span": self.span(),
            "senders": self.senders,
            "left_out": {
                "not_jaus": self.not_jaus,
                "from_other_ids": self.others,
                "unlike_the_filter": self.unlike,
                "at_other_times": self.at_other_times,
                "truncated": self.cut,
            },
        })
    }
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = self.span();
        write!(f, "{} datagrams over {seconds:.1} s", self.recorded.len())?;
        for (sender, count) in &self.senders {
            write!(f, "\n  {count:>7} from {sender}")?;
        }
        let left_out = [
            (self.not_jaus, "that are not JAUS"),
            (self.others, "from other ids"),
            (self.unlike, "that do not match the filter"),
            (self.at_other_times, "before --start or after --for"),
            (self.cut, "that the capture truncates"),
        ];
        for (count, what) in left_out.into_iter().filter(|(count, _)| *count > 0) {
            write!(f, "\nleft out: {count} {what}")?;
        }
        Ok(())
    }
}

fn since_1970(time: Timestamp) -> Duration {
    Duration::new(time.seconds().try_into().unwrap_or(0), time.subsec_nanos())
}

#[cfg(test)]
mod tests {
    use super::*;
    use jaus::wire::Frame;

    #[test]
    fn ids_are_replaced_in_source_and_destination_of_every_message() {
        let mappings = ["101.2.33=7.8.9", "101=201"].map(|text| text.parse().unwrap());
        let id = |text: &str| text.parse::<JausId>().unwrap();
        let payload = Bytes::from_static(&[0x00, 0x2B, 0x02]);
        let frame = |source, destination| Frame::new(id(source), id(destination), payload.clone());
        let first = judp::encode(&frame("101.2.33", "42.1.1")).unwrap();
        let second = judp::encode(&frame("101.2.34", "101.2.33")).unwrap();
        let both = [&first[..], &second[1..]].concat();
        let sent = Mapping::applied(&mappings, both.clone().into());
        let expected = [frame("7.8.9", "42.1.1"), frame("201.2.34", "7.8.9")];
        assert_eq!(sent, expected.map(|frame| judp::encode(&frame).unwrap()));
        assert_eq!(Mapping::applied(&[], both.clone().into()), [both]);
    }

    #[test]
    fn a_mapping_without_both_sides_is_refused() {
        for text in [
            "101",
            "101=",
            "=7",
            "0=7",
            "101=70000",
            "101.2.33=7",
            "101=7.8.9",
        ] {
            assert!(text.parse::<Mapping>().is_err(), "{text}");
        }
    }
}
