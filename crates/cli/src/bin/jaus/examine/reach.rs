//! First exchanges: presence of the peer, its framing and its source port.

use std::net::SocketAddr;
use std::time::Duration;

use jaus::address::JausId;
use jaus::messages::core::QueryHeartbeatPulse;
use jaus::wire::{Frame, Version, judp};

use super::case::{Case, Question, Send, octets, query_identification};
use super::exchange::Verdict;
use super::judgement::{Begin, Judgement};
use super::ra;
use super::seen::{Heard, Listener};
use super::silence::{only_older, others};

/// Locates a peer that is named by its id only.
pub(super) fn find(case: &mut Case) -> Begin {
    let Some(id) = case.settings.target.id else {
        return Begin::Over(Verdict::skipped("its address is given"));
    };
    if let Some(address) = case.address {
        return Begin::Over(Verdict::ok(format!(
            "{id} was named with the address {address}"
        )));
    }
    if let Some(why) = &case.settings.no_group {
        return Begin::Over(Verdict::failed(
            format!("there is no multicast group to locate {id}"),
            why.clone(),
            "give the address too: jaus examine ID@ADDRESS",
        ));
    }
    // A peer without Discovery acknowledges at least.
    let mut sends = vec![case.ask_everybody(&query_identification())];
    sends.extend(case.call_alone());
    Begin::Ask(Question {
        sends,
        again: Some(Duration::from_secs(1)),
        patience: case.settings.listen,
    })
}

pub(super) fn found(case: &mut Case) -> Judgement {
    let of_it = |heard: &&Heard| Some(heard.frame.source) == case.id;
    let Some(heard) = case.seen.all().iter().find(of_it).cloned() else {
        return Judgement::Wait;
    };
    case.address = Some(heard.from);
    case.link = Some(heard.link);
    Judgement::Over(Verdict::ok(format!("it is at {}", heard.from)))
}

pub(super) fn not_found(case: &Case) -> Verdict {
    let seconds = case.settings.listen.as_secs_f64();
    let others = others(case);
    let id = case.id.map_or_else(String::new, |id| id.to_string());
    if others.is_empty() {
        return Verdict::failed(
            format!("neither {id} nor any other node was found in {seconds} s"),
            "multicast does not pass between the hosts, or the peer is not running or hangs",
            "give its address: jaus examine ID@ADDRESS; `jaus doctor` checks multicast \
             here",
        );
    }
    Verdict::failed(
        format!("{id} was not found in {seconds} s, but {others}"),
        "it has another id, is not running, or hangs",
        "take the id from its settings, or give its address: jaus examine ADDRESS",
    )
}

/// Probes for a refused port, from a temporary socket that expects no answer.
pub(super) fn reach(case: &mut Case) -> Begin {
    if let Some(skip) = case.cut_off() {
        return Begin::Over(skip);
    }
    let Some(address) = case.address else {
        return Begin::Over(Verdict::skipped("its address is not known"));
    };
    let destination = case.id.unwrap_or(JausId::EVERYONE);
    let frame = Frame::new(case.probe_id(), destination, octets(&QueryHeartbeatPulse));
    Begin::Ask(Question {
        sends: vec![Send::Probe(address, frame)],
        again: Some(Duration::from_millis(200)),
        patience: Duration::from_millis(500),
    })
}

pub(super) fn reached(case: &mut Case, stage: u8) -> Judgement {
    let Some(address) = case.address.filter(|_| stage == 0) else {
        return Judgement::Wait;
    };
    let probed =
        |heard: &Heard| heard.listener == Listener::Probe && heard.from.ip() == address.ip();
    if case.seen.all().iter().any(probed) {
        return Judgement::Over(Verdict::ok(format!("UDP {address} answers")));
    }
    if case.seen.refused.is_none() {
        return Judgement::Wait;
    }
    // It may use another port.
    let sends = match case.settings.no_group {
        None => vec![case.ask_everybody(&query_identification())],
        Some(_) => Vec::new(),
    };
    Judgement::Ask(Question {
        sends,
        ..Question::silence(Duration::from_secs(1))
    })
}

/// Requests any sign of life by unicast, so that any message in return is an answer.
pub(super) fn answer(case: &mut Case) -> Begin {
    if let Some(skip) = case.cut_off() {
        return Begin::Over(skip);
    }
    match case.address {
        Some(address) => Begin::Ask(any_sign(case, address)),
        None => Begin::Over(Verdict::skipped("its address is not known")),
    }
}

fn any_sign(case: &mut Case, address: SocketAddr) -> Question {
    let query = query_identification();
    let sends = match case.id {
        Some(id) => {
            // A peer without Discovery acknowledges at least.
            let query = case.frame(id, octets(&query));
            let padding = case.wanting_acknowledgement(id);
            vec![Send::To(address, query), Send::To(address, padding)]
        }
        None => {
            // Junior acknowledges even that; the ids of its components are unknown.
            let padding = case.wanting_acknowledgement(JausId::EVERYONE);
            vec![case.ask_all_at(address, &query), Send::To(address, padding)]
        }
    };
    Question {
        sends,
        again: Some(Duration::from_millis(500)),
        patience: case.settings.listen,
    }
}

pub(super) fn answered(case: &mut Case, mark: usize) -> Judgement {
    // After the timeout, an answer may be one to a multicast.
    let Some(address) = case.address.filter(|_| !case.is_silent) else {
        return Judgement::Wait;
    };
    let own = case.settings.own;
    let to_us = |heard: &&Heard| {
        let of_it = match case.id {
            Some(id) => heard.frame.source == id,
            None => heard.from.ip() == address.ip() && heard.frame.source.is_unicast(),
        };
        of_it && heard.frame.destination == own && heard.listener == Listener::Unicast
    };
    let Some(heard) = case.seen.since(mark).iter().find(to_us).cloned() else {
        return overheard(case, address);
    };
    case.link = Some(heard.link);
    case.id = case.id.or(Some(heard.frame.source));
    Judgement::Over(Verdict::ok(format!(
        "{} answers from {}",
        heard.frame.source, heard.from
    )))
}

/// No message to us. Messages to other peers reveal an id to query; heartbeats in an older framing
/// without an answer mean that the peer uses only that framing.
fn overheard(case: &mut Case, address: SocketAddr) -> Judgement {
    const ENOUGH: usize = 3;
    let there = case.seen.of_host(address.ip());
    let (new, old): (Vec<_>, Vec<_>) =
        there.partition(|heard| heard.frame.version == Version::As5669a);
    if new.is_empty() && old.len() >= ENOUGH {
        return Judgement::Over(only_older(address));
    }
    let speaks = |heard: &&&Heard| heard.from == address && heard.frame.source.is_unicast();
    let source = new.iter().find(speaks).map(|heard| heard.frame.source);
    match source.filter(|_| case.id.is_none()) {
        Some(id) => {
            case.id = Some(id);
            Judgement::Ask(any_sign(case, address))
        }
        None => Judgement::Wait,
    }
}

/// The framings that its host uses.
pub(super) fn framing(case: &mut Case) -> Begin {
    if let Some(skip) = case.cut_off() {
        return Begin::Over(skip);
    }
    let Some(address) = case.address else {
        return Begin::Over(Verdict::skipped("its address is not known"));
    };
    let framings = case.seen.framings(address.ip());
    if framings.contains(&Version::As5669a) || framings.is_empty() {
        let besides = framings.len() > 1;
        let besides = if besides {
            ", and older framings too"
        } else {
            ""
        };
        return Begin::Over(Verdict::ok(format!("AS5669A{besides}")));
    }
    ra::ask(case, address)
}

/// Checks whether its source port is the queried port.
pub(super) fn source_port(case: &mut Case) -> Begin {
    if let Some(skip) = case.cut_off() {
        return Begin::Over(skip);
    }
    let (Some(address), Some(id)) = (case.address, case.id) else {
        return Begin::Over(Verdict::skipped("no answer"));
    };
    let Some(from) = case.received(0).map(|heard| heard.from).next() else {
        return Begin::Over(Verdict::skipped("nothing arrived by unicast"));
    };
    if from == address {
        let port = from.port();
        let usual = if port == judp::PORT {
            ""
        } else {
            ", which is not the usual 3794"
        };
        return Begin::Over(Verdict::ok(format!("it answers from {port}{usual}")));
    }
    if from.ip() != address.ip() {
        return Begin::Over(other_address(address, from, id));
    }
    // Does it receive at its source port?
    let frame = case.frame(id, octets(&query_identification()));
    Begin::Ask(Question::new(Send::To(from, frame)))
}

fn other_address(address: SocketAddr, from: SocketAddr, id: JausId) -> Verdict {
    Verdict::failed(
        format!("{id} is queried at {address} and answers from {from}"),
        "its host has several addresses, and the peer's socket is unbound or bound to another one",
        format!(
            "use the one it answers from (jaus examine {id}@{from}), or bind the peer to one address"
        ),
    )
}

pub(super) fn asked_at_its_source(case: &mut Case, mark: usize) -> Judgement {
    let Some(heard) = case.received(mark).next() else {
        return Judgement::Wait;
    };
    let (from, id) = (heard.from, heard.frame.source);
    let Some(address) = case.address else {
        return Judgement::Wait;
    };
    Judgement::Over(Verdict::failed(
        format!(
            "queried at port {}, it answers from {}",
            address.port(),
            from.port()
        ),
        "something on the path translates ports (NAT, a container), or it uses two sockets",
        format!("messages reach it at both; use the one it sends from: jaus examine {id}@{from}"),
    ))
}

/// It sends from a port that does not receive.
pub(super) fn deaf_source(case: &Case) -> Verdict {
    let (Some(address), Some(id)) = (case.address, case.id) else {
        return Verdict::skipped("no answer");
    };
    let from = case
        .received(0)
        .map(|heard| heard.from.port())
        .next()
        .unwrap_or(0);
    let port = address.port();
    Verdict::failed(
        format!("it answers from port {from}, but does not listen there"),
        format!(
            "the peer sends from another socket than the one bound to {port}; answers to a \
             message's source address (by Junior, JAUS++ and this stack) are lost"
        ),
        format!(
            "let the peer send from port {port}; until then pin its address in our settings: \
             peers = [\"{id}@{address}\"]"
        ),
    )
}
