//! Counters of a node at one moment, and the changes between two.
#![expect(clippy::disallowed_methods, reason = "rates are per second")]

use std::collections::BTreeMap;
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Directory, Identification, Level};
use jaus::endpoint::{Counter, Peer};
use jaus::node::{LinkReport, Node};
use jaus::service::ClockOffset;
use serde_json::{Value as Json, json};
use tokio::time::Instant;

/// Counters of a node at one moment.
pub(super) struct Sample {
    time: Instant,
    peers: BTreeMap<JausId, Peer>,
    links: Vec<LinkReport>,
    drops: BTreeMap<Counter, u64>,
}

/// Displayed values, all per second.
pub(super) struct View {
    pub(super) peers: Vec<PeerRow>,
    pub(super) links: Vec<LinkRow>,
    pub(super) drops: Vec<DropRow>,
}

pub(super) struct PeerRow {
    pub(super) id: JausId,
    /// Of the component.
    pub(super) name: String,
    /// Name and kind of its subsystem.
    pub(super) subsystem: String,
    pub(super) kind: String,
    pub(super) address: String,
    link: u16,
    header: &'static str,
    pub(super) received: f64,
    pub(super) received_octets: f64,
    pub(super) sent: f64,
    sent_octets: f64,
    pub(super) lost: u64,
    pub(super) repeated: u64,
    resent: u64,
    pub(super) round_trip: Option<Duration>,
    pub(super) silent: Duration,
    pub(super) clock: Option<ClockOffset>,
}

pub(super) struct LinkRow {
    pub(super) name: String,
    pub(super) received: f64,
    pub(super) received_octets: f64,
    pub(super) sent: f64,
    pub(super) sent_octets: f64,
    pub(super) errors: u64,
}

pub(super) struct DropRow {
    pub(super) reason: &'static str,
    pub(super) rate: f64,
    pub(super) total: u64,
}

impl Sample {
    pub(super) fn take(node: &Node) -> Self {
        let peers = node.peers().into_iter().map(|peer| (peer.id, peer));
        let is_drop = |&(counter, count): &(Counter, u64)| {
            count > 0 && counter.name().starts_with("dropped: ")
        };
        Self {
            time: Instant::now(),
            peers: peers.collect(),
            links: node.links(),
            drops: node.counters().iter().filter(is_drop).collect(),
        }
    }

    pub(super) fn ids(&self) -> impl Iterator<Item = JausId> {
        self.peers.keys().copied()
    }

    /// The changes since `before`, without those of `own`.
    pub(super) fn since(&self, before: &Self, directory: &Directory, own: JausId) -> View {
        let seconds = (self.time - before.time).as_secs_f64();
        let others = self.peers.values().filter(|peer| peer.id != own);
        let peer = |peer: &Peer| self.peer(peer, before.peers.get(&peer.id), seconds, directory);
        let drop = |(&counter, &total): (&Counter, &u64)| DropRow {
            reason: counter.name().trim_start_matches("dropped: "),
            rate: rate(total, before.drops.get(&counter).copied(), seconds),
            total,
        };
        View {
            peers: others.map(peer).collect(),
            links: self
                .links
                .iter()
                .map(|link| link_row(link, before, seconds))
                .collect(),
            drops: self.drops.iter().map(drop).collect(),
        }
    }

    fn peer(
        &self,
        peer: &Peer,
        before: Option<&Peer>,
        seconds: f64,
        directory: &Directory,
    ) -> PeerRow {
        let of = |level| directory.identification(level, peer.id);
        let (own, subsystem) = (of(Level::Component), of(Level::Subsystem));
        let name = |it: &Identification| it.name.clone();
        let per_second = |count: fn(&Peer) -> u64| rate(count(peer), before.map(count), seconds);
        PeerRow {
            id: peer.id,
            name: own.map(name).unwrap_or_default(),
            subsystem: subsystem.map(name).unwrap_or_default(),
            kind: subsystem.map_or_else(String::new, |it| it.kind.to_string()),
            address: peer.path.peer.to_string(),
            link: peer.path.link.0,
            header: peer.version.name(),
            received: per_second(|peer| peer.received.messages),
            received_octets: per_second(|peer| peer.received.octets),
            sent: per_second(|peer| peer.sent.messages),
            sent_octets: per_second(|peer| peer.sent.octets),
            lost: peer.lost,
            repeated: peer.duplicates,
            resent: peer.retransmissions,
            round_trip: peer.round_trip,
            silent: self
                .time
                .into_std()
                .saturating_duration_since(peer.last_heard),
            clock: None,
        }
    }
}

fn link_row(link: &LinkReport, before: &Sample, seconds: f64) -> LinkRow {
    let now = &link.counters;
    let earlier = before.links.iter().find(|other| other.link == link.link);
    let earlier = earlier.map(|other| &other.counters);
    LinkRow {
        name: format!("{} {}", link.interface.name, link.local),
        received: rate(now.received, earlier.map(|c| c.received), seconds),
        received_octets: rate(
            now.received_octets,
            earlier.map(|c| c.received_octets),
            seconds,
        ),
        sent: rate(now.sent, earlier.map(|c| c.sent), seconds),
        sent_octets: rate(now.sent_octets, earlier.map(|c| c.sent_octets), seconds),
        errors: now.receive_errors
            + now.send_errors
            + now.send_overflows
            + link.kernel_drops.unwrap_or(0),
    }
}

/// Rate per second. A missing earlier value counts as 0.
fn rate(now: u64, before: Option<u64>, seconds: f64) -> f64 {
    let counted = now.saturating_sub(before.unwrap_or(0)) as f64;
    if seconds > 0.0 {
        counted / seconds
    } else {
        0.0
    }
}

impl View {
    pub(super) fn to_json(&self) -> Json {
        let peers = self.peers.iter().map(|peer| {
            json!({
                "id": peer.id.to_string(),
                "name": peer.name,
                "subsystem": peer.subsystem,
                "kind": peer.kind,
                "address": peer.address,
                "link": peer.link,
                "header": peer.header,
                "received_per_s": rounded(peer.received),
                "received_octets_per_s": rounded(peer.received_octets),
                "sent_per_s": rounded(peer.sent),
                "sent_octets_per_s": rounded(peer.sent_octets),
                "lost": peer.lost,
                "repeated": peer.repeated,
                "resent": peer.resent,
                "round_trip_ms": peer.round_trip.map(|time| rounded(time.as_secs_f64() * 1e3)),
                "silent_s": rounded(peer.silent.as_secs_f64()),
                "clock": peer.clock.map(clock_json),
            })
        });
        let links = self.links.iter().map(|link| {
            json!({
                "link": link.name,
                "received_per_s": rounded(link.received),
                "received_octets_per_s": rounded(link.received_octets),
                "sent_per_s": rounded(link.sent),
                "sent_octets_per_s": rounded(link.sent_octets),
                "errors": link.errors,
            })
        });
        let drops = self.drops.iter().map(|drop| {
            json!({ "reason": drop.reason, "per_s": rounded(drop.rate), "total": drop.total })
        });
        json!({
            "peers": peers.collect::<Vec<_>>(),
            "links": links.collect::<Vec<_>>(),
            "drops": drops.collect::<Vec<_>>(),
        })
    }
}

fn clock_json(clock: ClockOffset) -> Json {
    let drift = clock.drift;
    json!({
        "ahead_ms": rounded(clock.seconds * 1e3),
        "uncertainty_ms": rounded(clock.uncertainty * 1e3),
        "drift_ppm": drift.map(|it| rounded(it.ratio * 1e6)),
        "drift_uncertainty_ppm": drift.map(|it| rounded(it.uncertainty * 1e6)),
        "steps": clock.steps,
    })
}

/// Rounds to three decimals: the rest is noise.
fn rounded(number: f64) -> f64 {
    (number * 1e3).round() / 1e3
}
