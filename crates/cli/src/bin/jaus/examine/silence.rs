//! Explains why a peer does not answer by unicast: it has moved, its host is off, its port is closed,
//! a firewall drops the queries, or its program hangs.

use std::collections::BTreeSet;
use std::fmt;
use std::net::SocketAddr;
use std::time::Duration;

use jaus::address::JausId;
use jaus::messages::core::QueryHeartbeatPulse;
use jaus::wire::ra::RaId;
use jaus::wire::{Frame, Version};

use super::case::{Case, Question, Send, octets, query_identification};
use super::exchange::Verdict;
use super::judgement::Judgement;
use super::seen::{Heard, Refusal};

/// A UDP port that is closed on every host: IANA reserves it. A host that refuses it, but not the
/// peer's port, takes datagrams for the peer.
pub(super) const CLOSED_PORT: u16 = 49_151;

/// After the timeout of an answer: searches for the cause, then names it.
pub(super) fn unanswered(case: &mut Case) -> Judgement {
    let Some(address) = case.address else {
        return Judgement::Over(not_refused(case, 0));
    };
    if !std::mem::replace(&mut case.is_silent, true) {
        return Judgement::Ask(search(case, address));
    }
    Judgement::Over(cause(case, address))
}

/// Queries all nodes by multicast and all components at the address, and probes a closed port.
fn search(case: &mut Case, address: SocketAddr) -> Question {
    let query = query_identification();
    let mut sends = Vec::new();
    if case.settings.no_group.is_none() {
        sends.push(case.ask_everybody(&query));
    }
    sends.push(case.ask_all_at(address, &query));
    let pulse = octets(&QueryHeartbeatPulse);
    let probe = Frame::new(case.probe_id(), JausId::EVERYONE, pulse);
    let closed = SocketAddr::new(address.ip(), CLOSED_PORT);
    sends.push(Send::Probe(closed, probe));
    Question {
        sends,
        again: Some(Duration::from_millis(300)),
        patience: Duration::from_secs(1),
    }
}

fn cause(case: &mut Case, address: SocketAddr) -> Verdict {
    let ip = address.ip();
    if let Some(refusal) = case.seen.refused {
        return refused(case, address, refusal);
    }
    let framings = case.seen.framings(ip);
    if framings.iter().any(|version| *version != Version::As5669a) {
        return only_older(address);
    }
    let heard = case.seen.of_host(ip).next().cloned();
    if let Some(heard) = heard {
        return heard_only(case, address, &heard);
    }
    if let Some(beginning) = case.seen.unreadable_from(ip) {
        return Verdict::failed(
            format!("{ip} sends datagrams without JAUS framing: they start with {beginning}"),
            "another program uses that port",
            format!(
                "on that host, `ss -ulpn 'sport = :{}'` shows which",
                address.port()
            ),
        );
    }
    silent(case, address)
}

/// The next exchange finds out which one.
pub(super) fn only_older(address: SocketAddr) -> Verdict {
    Verdict::ok(format!("{} answers, but not in AS5669A", address.ip()))
}

/// It multicasts, but does not answer us.
fn heard_only(case: &mut Case, address: SocketAddr, heard: &Heard) -> Verdict {
    let (id, from) = (heard.frame.source, heard.from);
    if let Some(named) = case.settings.target.id.filter(|named| *named != id) {
        return Verdict::failed(
            format!("{named} does not answer there, but {id} sends from {from}"),
            "the peer has another id",
            format!("use that: jaus examine {id}@{from}"),
        );
    }
    case.id = case.id.or(Some(id));
    if from.port() != address.port() {
        return Verdict::failed(
            format!("{id} sends from {from}, and {address} does not answer"),
            "the peer has another port",
            format!("use that: jaus examine {from}"),
        );
    }
    Verdict::failed(
        format!("{id} sends from {from}, but does not answer queries to it"),
        "its firewall blocks incoming UDP, or it answers to an address that is not ours",
        format!(
            "on that host, allow UDP {} (`nft list ruleset`); `jaus record` there shows whether \
             our queries arrive",
            address.port()
        ),
    )
}

/// Nothing at all comes from its host.
fn silent(case: &Case, address: SocketAddr) -> Verdict {
    if let Some(moved) = moved(case, address) {
        return moved;
    }
    let seconds = case.settings.listen.as_secs_f64();
    if case.seen.closed_port_refused {
        return hangs(address, seconds);
    }
    let others = others(case);
    if let Some(found) = others.first() {
        return Verdict::failed(
            format!("{address} was silent for {seconds} s; others found: {others}"),
            "the peer has another address, is not running, or hangs; or its firewall drops UDP",
            format!(
                "if it is one of those found, use its address: jaus examine {found}; otherwise \
                 check the peer and its firewall"
            ),
        );
    }
    let remedy = if case.settings.target.id.is_some() {
        "check both firewalls, and run `jaus doctor`"
    } else {
        "give its id too (jaus examine ID@ADDRESS), check both firewalls, and run `jaus doctor`"
    };
    Verdict::failed(
        format!("{address} was silent for {seconds} s, and no other node was found"),
        "the peer is not running or hangs, or a firewall on either side drops UDP",
        remedy,
    )
}

/// Its host refuses datagrams to closed ports, but not to the peer's.
fn hangs(address: SocketAddr, seconds: f64) -> Verdict {
    let port = address.port();
    Verdict::failed(
        format!(
            "{address} was silent for {seconds} s, but its host takes datagrams there: it refuses \
             only other ports"
        ),
        "its program hangs or is stopped: it holds the port and answers nothing; or it is no JAUS \
         program",
        format!(
            "on that host, `ss -ulpn 'sport = :{port}'` names the program, with the octets that it \
             has not read (Recv-Q); `ps -o stat,cmd -p PID` shows T if it is stopped: resume it \
             with `kill -CONT PID`, or restart it"
        ),
    )
}

/// The peer sends from another host.
fn moved(case: &Case, address: SocketAddr) -> Option<Verdict> {
    let is_elsewhere =
        |heard: &&Heard| Some(heard.frame.source) == case.id && heard.from.ip() != address.ip();
    let heard = case.seen.all().iter().find(is_elsewhere)?;
    let (id, from) = (heard.frame.source, heard.from);
    Some(Verdict::failed(
        format!("{address} does not answer, but {id} sends from {from}"),
        "the peer has another address",
        format!("use that: jaus examine {id}@{from}"),
    ))
}

/// The verdict on the port, after `stage` datagrams to it.
pub(super) fn not_refused(case: &Case, stage: u8) -> Verdict {
    match (case.address, case.seen.refused) {
        (Some(address), Some(refusal)) if stage > 0 => refused(case, address, refusal),
        (Some(address), _) => Verdict::ok(format!("UDP {address} is not refused")),
        (None, _) => Verdict::skipped("its address is not known"),
    }
}

/// The verdict on a refused port or host.
pub(super) fn refused(case: &Case, address: SocketAddr, refusal: Refusal) -> Verdict {
    let (ip, port) = (address.ip(), address.port());
    let ports = other_ports(case, address);
    if let Some(other) = ports.first() {
        return Verdict::failed(
            format!("{ip} reports UDP port {port} as closed, but {other} sends"),
            "the peer has another port",
            format!("use that: jaus examine {other}"),
        );
    }
    if let Some(moved) = moved(case, address) {
        return moved;
    }
    let others = others(case);
    let (what, cause, remedy) = match refusal {
        Refusal::Host => (
            format!("there is no route to {ip}, or no host has that address"),
            "the host is off, or has another address, or is on another network",
            format!("try `ip route get {ip}` and `ping {ip}`; check the cable and the address"),
        ),
        Refusal::Port => (
            format!("{ip} reports UDP port {port} as closed"),
            "no JAUS program runs there, or it is bound to another address or port of that host",
            format!(
                "on that host, `ss -ulpn 'sport = :{port}'` shows the listening program and its \
                 address"
            ),
        ),
    };
    match others.first() {
        None => Verdict::failed(what, cause, remedy),
        Some(found) => Verdict::failed(
            format!("{what}; others found: {others}"),
            format!("the peer has another address now; or {cause}"),
            format!(
                "if it is one of those found, use its address: jaus examine {found}; otherwise \
                 {remedy}"
            ),
        ),
    }
}

/// Other sources of JAUS messages at the host.
fn other_ports(case: &Case, address: SocketAddr) -> Vec<SocketAddr> {
    let others = case.seen.of_host(address.ip());
    let others = others
        .map(|heard| heard.from)
        .filter(|from| *from != address);
    others.collect::<BTreeSet<_>>().into_iter().collect()
}

/// Peers other than the examined one, with their addresses.
pub(super) struct Others(BTreeSet<(JausId, Option<RaId>, SocketAddr)>);

/// Other peers, with their addresses.
pub(super) fn others(case: &Case) -> Others {
    let all = case.seen.all().iter();
    let all = all.filter(|heard| Some(heard.frame.source) != case.id);
    let place = |heard: &Heard| {
        let of_ra = RaId::in_header(heard.frame.version, heard.frame.source);
        (heard.frame.source, of_ra, heard.from)
    };
    Others(all.map(place).collect())
}

impl Others {
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// One of them, as `jaus examine` takes it.
    fn first(&self) -> Option<String> {
        let mut named = self.0.iter().filter(|(_, of_ra, _)| of_ra.is_none());
        let (id, _, from) = named.next()?;
        Some(format!("{id}@{from}"))
    }
}

impl fmt::Display for Others {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const SOME: usize = 6;
        let named = self
            .0
            .iter()
            .take(SOME)
            .map(|(id, of_ra, from)| match of_ra {
                Some(id) => format!("{id} at {from} (Reference Architecture)"),
                None => format!("{id} at {from}"),
            });
        f.write_str(&named.collect::<Vec<_>>().join(", "))
    }
}
