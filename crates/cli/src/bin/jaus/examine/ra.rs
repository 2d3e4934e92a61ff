//! Peers of the Reference Architecture (OpenJAUS 3.x and similar): they are recognised and queried
//! for their name. Anything more needs a gateway.

use std::net::SocketAddr;
use std::time::Duration;

use bytes::Bytes;
use jaus::wire::ra::RaId;
use jaus::wire::{Flags, Frame, Priority, Version, judp};

use super::case::{Case, Question, Send};
use super::exchange::Verdict;
use super::judgement::{Begin, Judgement};
use super::seen::{Heard, Listener};

/// The communicator, which represents the subsystem.
const COMMUNICATOR: u8 = 35;
const REPORT_IDENTIFICATION: u16 = 0x4B00;

/// Queries the communicator for its subsystem's name.
pub(super) fn ask(case: &mut Case, address: SocketAddr) -> Begin {
    let Some(heard) = of_ra(case, address).next() else {
        return Begin::Over(verdict(case, address, None));
    };
    let peer = RaId::from(heard.frame.source);
    let communicator = RaId {
        component: COMMUNICATOR,
        instance: 1,
        ..peer
    };
    let question = Frame {
        version: heard.frame.version,
        flags: Flags::new(Priority::Standard),
        // Query Identification (2B00h), of the subsystem.
        ..Frame::new(
            own(case).into(),
            communicator.into(),
            Bytes::from_static(&[0x00, 0x2B, 2]),
        )
    };
    // It answers to port 3794 of our host, whatever our source port.
    let to = SocketAddr::new(address.ip(), judp::PORT);
    Begin::Ask(Question::new(Send::To(to, question)).patience(Duration::from_millis(1500)))
}

/// Our RA id: the source needs an id, with one octet per number.
fn own(case: &Case) -> RaId {
    RaId {
        subsystem: 200 + (case.settings.own.subsystem() % 55) as u8,
        node: 1,
        component: 1,
        instance: 1,
    }
}

fn of_ra(case: &Case, address: SocketAddr) -> impl Iterator<Item = &Heard> {
    let all = case.seen.of_host(address.ip());
    all.filter(|heard| heard.frame.version != Version::As5669a)
}

pub(super) fn named(case: &mut Case) -> Judgement {
    let Some(address) = case.address else {
        return Judgement::Wait;
    };
    let report = |heard: &&Heard| heard.code() == Some(REPORT_IDENTIFICATION);
    let Some(name) = of_ra(case, address).find(report).and_then(name_in) else {
        return Judgement::Wait;
    };
    Judgement::Over(verdict(case, address, Some(&name)))
}

/// The text after code, query type, authority and type: 80 octets, padded with zeros.
fn name_in(heard: &Heard) -> Option<String> {
    let text = heard.frame.payload.get(6..)?;
    let end = text
        .iter()
        .position(|&octet| octet == 0)
        .unwrap_or(text.len());
    Some(String::from_utf8_lossy(&text[..end]).into_owned())
}

/// The verdict, also after the timeout.
pub(super) fn verdict(case: &Case, address: SocketAddr, name: Option<&str>) -> Verdict {
    let mut all = of_ra(case, address);
    let framing = match all.next().map(|heard| heard.frame.version) {
        Some(Version::Ra) => "RA 3.x (\"JAUS01.0\")",
        _ => "the first AS5669 (version octet 1)",
    };
    let subsystem = of_ra(case, address)
        .next()
        .map(|heard| format!(": subsystem {}", RaId::from(heard.frame.source).subsystem));
    // Quoted, so that control characters are escaped.
    let name = name.map(|name| format!(" {name:?}"));
    let multicast = of_ra(case, address).any(|heard| heard.listener == Listener::RaGroup);
    let multicast = if multicast {
        ", received on 224.1.0.1"
    } else {
        ""
    };
    let unnamed = name.is_none() && case.settings.port != judp::PORT;
    let unnamed = if unnamed {
        ". Its name is unknown: it answers to our port 3794, which is taken"
    } else {
        ""
    };
    Verdict::failed(
        format!(
            "it speaks {framing} only{}{}{multicast}{unnamed}",
            subsystem.unwrap_or_default(),
            name.unwrap_or_default()
        ),
        "OpenJAUS 3.x and other systems of the Reference Architecture do not understand AS5669A",
        "connect it through `jaus-ra-gateway`: docs/ra-gateway.md",
    )
}
