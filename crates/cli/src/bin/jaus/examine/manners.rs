//! Final exchanges: the TCP port, a burst of queries, and the sequence numbers, stacks and ids seen
//! so far.

use std::collections::{BTreeMap, BTreeSet};
use std::net::IpAddr;
use std::time::Duration;

use jaus::address::JausId;
use jaus::messages::core::{QueryHeartbeatPulse, ReportHeartbeatPulse};
use jaus::wire::Version;

use super::case::{Case, Question, Send};
use super::discovery::shown;
use super::exchange::{Exchange, Mark, Verdict};
use super::judgement::{Begin, Judgement};
use super::seen::{Heard, TcpAnswer};

pub(super) fn tcp(case: &mut Case) -> Begin {
    if let Some(skip) = case.cut_off() {
        return Begin::Over(skip);
    }
    match case.address {
        Some(address) => Begin::Ask(Question {
            sends: vec![Send::Connect(address)],
            ..Question::silence(Duration::from_secs(2))
        }),
        None => Begin::Over(Verdict::skipped("its address is not known")),
    }
}

pub(super) fn tcp_answered(case: &mut Case) -> Judgement {
    let port = case.address.map_or(0, |address| address.port());
    Judgement::Over(match case.seen.tcp {
        None => return Judgement::Wait,
        Some(TcpAnswer::Open) => Verdict::ok(format!("TCP {port} is open")),
        Some(TcpAnswer::Refused | TcpAnswer::Failed) => {
            Verdict::skipped(format!("TCP {port} is closed: it has no JTCP"))
        }
    })
}

pub(super) fn tcp_silent(case: &Case) -> Verdict {
    let port = case.address.map_or(0, |address| address.port());
    Verdict::skipped(format!(
        "TCP {port} does not answer: a firewall, or no JTCP"
    ))
}

/// Number of simultaneous queries.
const BURST: usize = 32;

pub(super) fn rate(case: &mut Case) -> Begin {
    if let Some(skip) = case.nobody() {
        return Begin::Over(skip);
    }
    if case.mark_of(Exchange::Heartbeat) != Some(Mark::Ok) {
        return Begin::Over(Verdict::skipped("it does not answer heartbeat queries"));
    }
    let mut sends = Vec::new();
    for _ in 0..BURST {
        sends.extend(case.ask_peer(&QueryHeartbeatPulse));
    }
    Begin::Ask(Question {
        sends,
        ..Question::silence(Duration::from_secs(1))
    })
}

fn answers(case: &Case, mark: usize) -> usize {
    case.reports::<ReportHeartbeatPulse>(mark).count()
}

pub(super) fn all_answered(case: &mut Case, mark: usize) -> Judgement {
    if answers(case, mark) < BURST {
        return Judgement::Wait;
    }
    Judgement::Over(Verdict::ok(format!(
        "{BURST} simultaneous queries are all answered"
    )))
}

pub(super) fn some_answered(case: &Case, mark: usize) -> Verdict {
    let some = answers(case, mark);
    Verdict::failed(
        format!("{some} of {BURST} simultaneous queries are answered within 1 s"),
        "the peer limits its answer rate, or polls its messages one by one (JAUS++ takes about 1 \
         ms for each), or its receive buffer is small",
        "space queries out; subscribe instead of polling",
    )
}

/// Evaluates the sequence numbers of its messages to us.
pub(super) fn sequence(case: &Case) -> Verdict {
    if let Some(skip) = case.nobody() {
        return skip;
    }
    let mut messages: Vec<&Heard> = case.received(0).collect();
    // Acknowledgements repeat the number of the acknowledged message.
    messages.retain(|heard| !heard.frame.flags.acknowledgement().is_answer());
    if messages.len() < 3 {
        return Verdict::skipped("too few messages arrived");
    }
    let (mut twice, mut shared) = (0, 0);
    let mut last: BTreeMap<u16, &Heard> = BTreeMap::new();
    for &heard in &messages {
        let number = heard.frame.sequence;
        let Some(before) = last.insert(number, heard) else {
            continue;
        };
        if heard.at > before.at + Duration::from_secs(2) {
            continue;
        }
        match heard.frame.payload == before.frame.payload {
            true => twice += 1,
            false => shared += 1,
        }
    }
    let count = messages.len();
    if last.len() == 1 {
        return Verdict::failed(
            format!(
                "all {count} messages have the sequence number {}",
                messages[0].frame.sequence
            ),
            "the peer does not increment it; receivers that drop duplicates by number (Junior) \
             lose all messages but one",
            "let the peer increment its sequence number",
        );
    }
    judge_numbers(count, twice, shared)
}

fn judge_numbers(count: usize, twice: usize, shared: usize) -> Verdict {
    if shared > 0 {
        return Verdict::failed(
            format!("{shared} of {count} messages reuse a sequence number within 2 s"),
            "the peer has a counter per message type, or was restarted; receivers that drop \
             duplicates by number (Junior) lose one of each two",
            "let it use one counter for all messages of a component",
        );
    }
    if twice > 0 {
        return Verdict::failed(
            format!("{twice} of {count} messages arrived twice"),
            "there are two paths between the hosts (two interfaces, multicast and broadcast, a \
             relay)",
            "use one interface on both sides (--interface, interfaces = [\"eth0\"])",
        );
    }
    Verdict::ok(format!("{count} messages, no duplicates, no number reused"))
}

/// The JAUS stacks on its host.
pub(super) fn stacks(case: &Case) -> Verdict {
    if let Some(skip) = case.cut_off() {
        return skip;
    }
    let Some(address) = case.address else {
        return Verdict::skipped("its address is not known");
    };
    let mut ports: BTreeMap<u16, BTreeSet<(u16, u8)>> = BTreeMap::new();
    for heard in case.seen.of_host(address.ip()) {
        let source = heard.frame.source;
        if heard.frame.version == Version::As5669a && source.is_unicast() {
            let node = (source.subsystem(), source.node());
            ports.entry(heard.from.port()).or_default().insert(node);
        }
    }
    let names = |nodes: &BTreeSet<(u16, u8)>| {
        let names: Vec<String> = nodes.iter().map(|(s, n)| format!("{s}.{n}")).collect();
        names.join(" and ")
    };
    let all: Vec<String> = ports
        .iter()
        .map(|(port, nodes)| format!("{} at {port}", names(nodes)))
        .collect();
    let shared = ports.iter().find(|(_, nodes)| nodes.len() > 1);
    match shared {
        Some((port, nodes)) => Verdict::ok(format!("{} share port {port}", names(nodes))).advice(
            "if those are two programs with one port, only one of them receives unicast: give one \
             another port",
        ),
        None if all.is_empty() => Verdict::skipped("nothing was received"),
        None => Verdict::ok(all.join(", ")),
    }
}

/// Checks that each id is unique and in the right place.
pub(super) fn ids(case: &Case) -> Verdict {
    if let Some(skip) = case.nobody() {
        return skip;
    }
    let (Some(id), own) = (case.id, case.settings.own) else {
        return Verdict::skipped("no component id is known at that address");
    };
    let places = places(case, id);
    if places.len() > 1 {
        let named: Vec<String> = places.iter().map(ToString::to_string).collect();
        return Verdict::failed(
            format!("{id} sends from {}", named.join(" and from ")),
            "two programs have this id, or one program is on two networks",
            "give one of them another id; answers go to the one that sent last",
        );
    }
    if case.settings.wanted == Some(id) {
        return Verdict::failed(
            format!("{id} is the id chosen for our node"),
            "two nodes would have the same id, unless the peer is that node",
            "choose another id (--id)",
        );
    }
    if id.subsystem() == own.subsystem() {
        return Verdict::ok(format!("{id} is in our subsystem"));
    }
    Verdict::ok(format!("no other node has the id {}", shown(case)))
}

/// The hosts that send with an id.
fn places(case: &Case, id: JausId) -> BTreeSet<IpAddr> {
    let all = case.seen.all().iter();
    let of_it =
        all.filter(|heard| heard.frame.source == id && heard.frame.version == Version::As5669a);
    of_it.map(|heard| heard.from.ip()).collect()
}
