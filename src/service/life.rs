//! Liveness of the peers that matter: the client in control, clients that have set an emergency,
//! and subscribers.
//!
//! Discovery also detects dead peers, but it checks every peer it knows, so its detection time
//! grows with their number. Here the detection time depends only on the peer itself.
//!
//! | silent for | what happens |
//! |---|---|
//! | [`Life::MOVING`] | while motion depends on the peer: a probe, four times a second |
//! | [`Life::SILENCE`] | a probe, once a second, with acknowledgement |
//! | [`Life::DEATH`] | dead, if it has ever answered or acknowledged a probe; otherwise the timeout of control applies |
//!
//! A probe is Query Heartbeat Pulse, or Query Incarnation for a peer that offers [`Incarnation`].
//! The client in control of a ready component is asked for its incarnation every
//! [`Life::CHECK`] even if it is not silent: another number than before is a restart, however fast
//! it was. One without that service is sent Query Heartbeat Pulse instead whenever it has sent
//! nothing for [`Life::NUMBER_CHECK`], if it numbers its messages: the numbers show a restart. The answers with an
//! incarnation show how old what the client says can be (`freshness.rs`): when that becomes doubtful, it is asked more
//! often.
//!
//! Any message is a sign of life. A transport acknowledgement counts only for peers that have never
//! answered a probe with a message, because a node also acknowledges for a component that hangs.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::{Duration, Instant};

use super::discovery::Budget;
use super::freshness::Freshness;
use super::order::number_of;
use super::restart_watch::{RestartWatch, Sameness};
use super::{Incarnation, Outbox, code_of};
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::Received;
use crate::messages::core::{QueryHeartbeatPulse, ReportHeartbeatPulse, ReportIncarnation};
use crate::wire::Priority;

/// Why a peer is watched. The client in control is always probed, the others within a budget.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rank {
    /// It holds subscriptions.
    Subscriber,
    /// It has set an emergency and not cleared it.
    EmergencySetter,
    /// It is in control.
    Controller,
    /// It is in control of a component that is ready to move.
    ReadyController,
    /// It is in control, and motion continues only while it is alive.
    MovingController,
}

/// The peers that one component watches.
#[derive(Debug)]
pub struct Life {
    peers: BTreeMap<JausId, Peer>,
    /// One entry per peer: when to check it next.
    due: BTreeSet<(Instant, JausId)>,
    subscriber_probes: Budget,
    setter_probes: Budget,
    dead: VecDeque<JausId>,
    own: Incarnation,
    restarted: VecDeque<JausId>,
    /// The latest peer to tell its incarnation before it was watched: a client does so just before
    /// it requests control.
    announced: Option<(Instant, JausId, Incarnation)>,
}

#[derive(Debug)]
struct Peer {
    /// Whether it is still the same.
    watch: RestartWatch,
    /// How old what it says can be, if it tells its incarnation, and whether it is asked all the time.
    freshness: Freshness,
    is_checked: bool,
    /// When it was last asked whether it is still the same.
    asked: Option<Instant>,
    /// When it was last asked to tell its incarnation, which it has not told yet.
    introduced: Option<Instant>,
    /// Whether its next answer will show whether it is.
    is_doubtful: bool,
    /// How often it was asked since its last answer.
    unanswered: u32,
    /// Time of the last sign of life.
    alive: Instant,
    /// Whether it has ever answered a probe with a message, and whether it acknowledges probes.
    answers: bool,
    acknowledges: bool,
    /// Probes since the last sign of life.
    probes: u32,
    /// Whether it has ever been probed. A client in control is probed once even if it is never
    /// silent, because only a probe shows whether it answers with messages.
    is_known: bool,
    look: Instant,
}

impl Default for Life {
    fn default() -> Self {
        Self::new(Incarnation::random())
    }
}

impl Life {
    /// A component of this incarnation, which watches no peer yet.
    #[must_use]
    pub fn new(own: Incarnation) -> Self {
        Self {
            peers: BTreeMap::new(),
            due: BTreeSet::new(),
            subscriber_probes: Budget::new(Self::BURST, Self::REFILL),
            setter_probes: Budget::new(Self::BURST, Self::REFILL),
            dead: VecDeque::new(),
            own,
            restarted: VecDeque::new(),
            announced: None,
        }
    }

    /// A peer that has been silent for this time is probed, and again at this interval.
    pub const SILENCE: Duration = Duration::from_secs(1);
    /// The same while motion depends on the peer.
    pub const MOVING: Duration = Duration::from_millis(250);
    /// Interval of queries for the incarnation of a client in control of a ready component. One
    /// lost answer must not delay the detection of a restart beyond 0.5 s.
    pub const CHECK: Duration = Duration::from_millis(200);
    /// A client in control of a ready component that tells no incarnation is asked when it has sent
    /// nothing for this time. Two of its messages show a restart.
    pub const NUMBER_CHECK: Duration = Duration::from_millis(100);
    /// It is no longer asked after this many queries without an answer.
    const UNANSWERED: u32 = 10;
    /// A peer that answers probes and has been silent for this time is dead.
    pub const DEATH: Duration = Duration::from_secs(4);
    /// Budget for probes to subscribers, and another for those to setters of emergencies: a burst
    /// of `BURST`, then one per `REFILL`. Their ids may be forged.
    const BURST: u32 = 32;
    const REFILL: Duration = Duration::from_millis(50);
    /// An announcement counts for a peer that is watched within this time.
    const ANNOUNCEMENT: Duration = Duration::from_secs(1);

    /// The component's own incarnation.
    #[must_use]
    pub const fn own(&self) -> Incarnation {
        self.own
    }

    /// Watches a peer that has just sent a message. A peer that is already watched is checked no
    /// later than its rank demands.
    pub fn watch(&mut self, now: Instant, id: JausId, rank: Rank) {
        let announced = self.announced.filter(|&(at, by, _)| {
            by == id && now.saturating_duration_since(at) < Self::ANNOUNCEMENT
        });
        let peer = self.peers.entry(id).or_insert_with(|| {
            self.due.insert((now + rank.patience(), id));
            Peer {
                watch: RestartWatch::of(announced.map(|(_, _, incarnation)| incarnation)),
                freshness: Freshness::default(),
                is_checked: false,
                asked: None,
                introduced: None,
                is_doubtful: false,
                unanswered: 0,
                alive: now,
                answers: false,
                acknowledges: false,
                probes: 0,
                is_known: false,
                look: now + rank.patience(),
            }
        });
        if rank.is_checked() && !peer.is_checked {
            peer.is_checked = true;
            peer.freshness.begin(now);
        }
        let check = peer.next_check(now, rank);
        let probe = Some(peer.alive + rank.patience()).filter(|_| peer.probes == 0);
        let soon = probe.into_iter().chain(check).min();
        if let Some(soon) = soon.filter(|soon| *soon < peer.look) {
            self.due.remove(&(peer.look, id));
            peer.look = soon;
            self.due.insert((soon, id));
        }
    }

    /// Notes a message from a peer.
    pub fn hear(&mut self, now: Instant, message: &Received) {
        let (id, payload) = (message.source, &message.payload);
        let Some(peer) = self.peers.get_mut(&id) else {
            if let Some(incarnation) = Incarnation::told_in(payload) {
                self.announced = Some((now, id, incarnation));
            }
            return;
        };
        peer.alive = now;
        peer.probes = 0;
        let code = code_of(payload);
        if let Some(ReportHeartbeatPulse::CODE | ReportIncarnation::CODE) = code {
            (peer.answers, peer.unanswered) = (true, 0);
        }
        if code == Some(ReportIncarnation::CODE)
            && let Ok(report) = ReportIncarnation::decode(payload)
        {
            let number = number_of(message);
            peer.freshness.note(now, report.stamp, number);
        }
        match peer.watch.note(now, message) {
            Sameness::Same => {}
            Sameness::Doubtful => {
                // Its next answer decides, so it is asked at once.
                peer.is_doubtful = true;
                self.due.remove(&(peer.look, id));
                peer.look = now;
                self.due.insert((now, id));
            }
            Sameness::Restarted => {
                // The new one is asked from its beginning.
                (peer.freshness, peer.is_checked) = (Freshness::default(), false);
                self.restarted.push_back(id);
            }
        }
    }

    /// Whether a message of a client in control is so old that nothing may follow from it but a stop: it was held up
    /// for longer than any retransmission. An echo has a stamp that says more than its number.
    pub fn is_outdated(&self, message: &Received) -> bool {
        let is_echo = code_of(&message.payload) == Some(ReportIncarnation::CODE);
        let peer = self.peers.get(&message.source).filter(|_| !is_echo);
        peer.zip(number_of(message))
            .is_some_and(|(peer, number)| peer.freshness.is_outdated(number))
    }

    /// Whether what a peer says now is young enough to move something, as far as it shows that: a client in control
    /// that tells its incarnation must have echoed a recent stamp.
    pub fn is_fresh(&self, now: Instant, id: JausId) -> bool {
        let peer = self.peers.get(&id);
        peer.filter(|it| it.watch.incarnation().is_some())
            .is_none_or(|it| it.freshness.is_fresh(now))
    }

    /// Whether a setpoint was held up by itself, and others of its client were not.
    pub fn is_late(&self, message: &Received) -> bool {
        let peer = self.peers.get(&message.source);
        peer.zip(number_of(message))
            .is_some_and(|(peer, number)| peer.freshness.is_late(number))
    }

    /// Asks a watched peer that offers [`Incarnation`] for its incarnation until it has answered once. A client of
    /// this library tells it before it requests control, but not how old what it says can be.
    pub fn introduce(&mut self, now: Instant, id: JausId, out: &mut Outbox) {
        let Some(peer) = self.peers.get_mut(&id) else {
            return;
        };
        let is_due = peer.introduced.is_none_or(|at| now >= at + Self::CHECK);
        let is_known = peer.watch.incarnation().is_some() && peer.freshness.last_sign().is_some();
        if !is_known && is_due {
            (peer.introduced, peer.asked) = (Some(now), Some(now));
            let stamp = peer.freshness.stamp(now);
            out.send_with(id, Priority::High, &self.own.query(stamp));
        }
    }

    /// Notes that a peer's transport has acknowledged a probe.
    pub fn acknowledged(&mut self, now: Instant, id: JausId) {
        if let Some(peer) = self.peers.get_mut(&id).filter(|peer| !peer.answers) {
            peer.acknowledges = true;
            peer.alive = now;
            peer.probes = 0;
        }
    }

    /// The last sign of life of a watched peer, on which motion may depend. Where it echoes stamps, a message that was
    /// held up is none.
    pub fn last_sign(&self, id: JausId) -> Option<Instant> {
        let peer = self.peers.get(&id)?;
        Some(peer.freshness.last_sign().unwrap_or(peer.alive))
    }

    /// Whether a peer has shown life within [`DEATH`](Self::DEATH).
    pub fn is_alive(&self, now: Instant, id: JausId) -> bool {
        let peer = self.peers.get(&id);
        peer.is_some_and(|peer| now.saturating_duration_since(peer.alive) < Self::DEATH)
    }

    /// Whether a peer was probed until [`DEATH`](Self::DEATH) and has never answered a probe, so
    /// that its death would go undetected.
    pub fn is_mute(&self, now: Instant, id: JausId) -> bool {
        let peer = self.peers.get(&id);
        peer.is_some_and(|peer| !peer.answers && !peer.acknowledges) && !self.is_alive(now, id)
    }

    /// Probes silent peers, and asks controllers whether they are still the same. `rank` returns why
    /// a peer is still watched; `None` ends the watch.
    pub fn handle_timeout(
        &mut self,
        now: Instant,
        rank: impl Fn(JausId) -> Option<Rank>,
        out: &mut Outbox,
    ) {
        while let Some(&(look, id)) = self.due.first().filter(|(look, _)| *look <= now) {
            self.due.remove(&(look, id));
            match (self.peers.get_mut(&id), rank(id)) {
                (Some(peer), Some(rank)) => {
                    peer.is_checked &= rank.is_checked();
                    let silence = now.saturating_duration_since(peer.alive);
                    if silence >= Self::DEATH && peer.is_probed() {
                        self.peers.remove(&id);
                        self.dead.push_back(id);
                        continue;
                    }
                    let is_due = silence >= rank.patience() || !peer.is_known;
                    let has_budget = match rank {
                        Rank::Subscriber => self.subscriber_probes.take(now),
                        Rank::EmergencySetter => self.setter_probes.take(now),
                        Rank::Controller | Rank::ReadyController | Rank::MovingController => true,
                    };
                    if !is_due && peer.is_to_be_checked(now, rank) {
                        (peer.asked, peer.is_doubtful) = (Some(now), false);
                        peer.unanswered = peer.unanswered.saturating_add(1);
                        match peer.watch.incarnation() {
                            Some(_) => {
                                let stamp = peer.freshness.stamp(now);
                                out.send_with(id, Priority::High, &self.own.query(stamp));
                            }
                            None => out.send_with(id, Priority::High, &QueryHeartbeatPulse {}),
                        }
                    } else if is_due && has_budget {
                        peer.is_known = true;
                        peer.probes = peer
                            .probes
                            .saturating_add(u32::from(silence >= rank.patience()));
                        (peer.asked, peer.is_doubtful) = (Some(now), false);
                        if peer.watch.incarnation().is_some() {
                            let stamp = peer.freshness.stamp(now);
                            out.send_acknowledged(id, Priority::High, &self.own.query(stamp));
                        } else {
                            out.send_acknowledged(id, Priority::High, &QueryHeartbeatPulse {});
                        }
                    }
                    peer.look = peer.next_look(now, rank);
                    self.due.insert((peer.look, id));
                }
                _ => _ = self.peers.remove(&id),
            }
        }
    }

    /// When to call [`handle_timeout`](Self::handle_timeout).
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.due.first().map(|&(look, _)| look)
    }

    /// The next peer that has died. It is no longer watched.
    pub fn poll_dead(&mut self) -> Option<JausId> {
        self.dead.pop_front()
    }

    /// The next peer that is not the one that was watched: it has restarted since.
    pub fn poll_restarted(&mut self) -> Option<JausId> {
        self.restarted.pop_front()
    }
}

impl Rank {
    /// How long a peer may be silent before it is probed.
    const fn patience(self) -> Duration {
        match self {
            Self::MovingController => Life::MOVING,
            Self::ReadyController | Self::Controller | Self::EmergencySetter | Self::Subscriber => {
                Life::SILENCE
            }
        }
    }

    /// Whether a restart of the peer must be noticed at once.
    const fn is_checked(self) -> bool {
        matches!(self, Self::ReadyController | Self::MovingController)
    }
}

impl Peer {
    /// Whether its silence counts: it can answer, and was probed at least twice. A component that
    /// was itself held up has not probed.
    const fn is_probed(&self) -> bool {
        (self.answers || self.acknowledges) && self.probes >= 2
    }

    /// When it is to be asked whether it is still the same, although it may not be silent.
    fn next_check(&self, now: Instant, rank: Rank) -> Option<Instant> {
        if !rank.is_checked() {
            return None;
        }
        if self.watch.incarnation().is_some() {
            let age = self.freshness.age(now);
            let is_doubtful = age.is_some_and(|age| age > Freshness::OLDEST / 2);
            let pause = match is_doubtful {
                true => Life::NUMBER_CHECK,
                false => Life::CHECK,
            };
            return Some(self.asked.map_or(now, |asked| asked + pause));
        }
        // Whatever it sends has a number.
        let last = self.asked.map_or(self.alive, |asked| asked.max(self.alive));
        let is_asked = self.watch.is_counting() && self.unanswered < Life::UNANSWERED;
        is_asked.then(|| match self.is_doubtful {
            true => now,
            false => last + Life::NUMBER_CHECK,
        })
    }

    fn is_to_be_checked(&self, now: Instant, rank: Rank) -> bool {
        self.next_check(now, rank).is_some_and(|check| check <= now)
    }

    /// The next probe or check, or the time of death if that is earlier.
    fn next_look(&self, now: Instant, rank: Rank) -> Instant {
        let probe = if self.probes == 0 {
            (self.alive + rank.patience()).max(now + rank.patience() / 5)
        } else {
            now + rank.patience()
        };
        let probe = self
            .next_check(now, rank)
            .map_or(probe, |check| probe.min(check));
        match self.alive + Life::DEATH {
            death if death > now => probe.min(death),
            _ => probe,
        }
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use bytes::Bytes;

    use super::*;
    use crate::messages::core::QueryStatus;
    use crate::wire::Broadcast;

    const US: JausId = JausId::new(101, 1, 1);
    const CLIENT: JausId = JausId::new(102, 1, 2);
    const STEP: Duration = Duration::from_millis(50);

    /// A message without fields from the client.
    fn head(code: u16) -> Received {
        Received {
            source: CLIENT,
            destination: US,
            to: US,
            priority: Priority::Standard,
            broadcast: Broadcast::None,
            sequence: None,
            payload: Bytes::copy_from_slice(&code.to_le_bytes()),
            path: None,
            acknowledged: false,
        }
    }

    /// What the client does; its node acknowledges in any case.
    #[derive(Clone, Copy, PartialEq)]
    enum Client {
        /// Sends, and answers probes.
        Lively,
        /// Sends, but does not answer.
        Mute,
        Suspended,
    }

    /// Advances the time for a client that a motion depends on; counts the probes.
    fn pass(life: &mut Life, now: &mut Instant, time: Duration, client: Client) -> usize {
        let mut out = Outbox::new(US);
        let mut probes = 0;
        let end = *now + time;
        while *now < end {
            *now += STEP;
            life.watch(*now, CLIENT, Rank::MovingController);
            if client != Client::Suspended {
                life.hear(*now, &head(QueryStatus::CODE));
            }
            life.handle_timeout(*now, |_| Some(Rank::MovingController), &mut out);
            while out.pop().is_some() {
                probes += 1;
                life.acknowledged(*now, CLIENT);
                if client == Client::Lively {
                    life.hear(*now, &head(ReportHeartbeatPulse::CODE));
                }
            }
        }
        probes
    }

    #[test]
    fn a_client_that_is_not_silent_is_probed_once() {
        let mut now = Instant::now();
        let time = Duration::from_secs(3);
        assert_eq!(
            pass(&mut Life::default(), &mut now, time, Client::Lively),
            1
        );
        assert_eq!(pass(&mut Life::default(), &mut now, time, Client::Mute), 1);
    }

    #[test]
    fn a_node_does_not_vouch_for_a_suspended_client_that_was_never_silent_before() {
        let (mut life, mut now) = (Life::default(), Instant::now());
        pass(&mut life, &mut now, Life::SILENCE, Client::Lively);
        let last = now;
        assert_ne!(
            pass(&mut life, &mut now, Life::SILENCE, Client::Suspended),
            0
        );
        assert_eq!(life.last_sign(CLIENT), Some(last));
    }

    const MOMENT: Duration = Duration::from_nanos(1);

    fn millis(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    /// The number of probes at this time if all peers have this rank.
    fn probes(life: &mut Life, now: Instant, rank: Rank) -> usize {
        let mut out = Outbox::new(US);
        life.handle_timeout(now, |_| Some(rank), &mut out);
        std::iter::from_fn(|| out.pop()).count()
    }

    #[test]
    fn a_silent_peer_is_probed_after_the_time_of_its_rank() {
        for (rank, patience) in [
            (Rank::Subscriber, Life::SILENCE),
            (Rank::EmergencySetter, Life::SILENCE),
            (Rank::Controller, Life::SILENCE),
            (Rank::MovingController, Life::MOVING),
        ] {
            let (mut life, start) = (Life::default(), Instant::now());
            life.watch(start, CLIENT, rank);
            for silence in [patience, 2 * patience] {
                let due = start + silence;
                assert_eq!(life.poll_timeout(), Some(due), "{rank:?}");
                assert_eq!(probes(&mut life, due - MOMENT, rank), 0);
                assert_eq!(probes(&mut life, due, rank), 1);
            }
        }
    }

    #[test]
    fn a_higher_rank_brings_the_next_probe_forward_unless_probes_are_under_way() {
        let (mut life, start) = (Life::default(), Instant::now());
        life.watch(start, CLIENT, Rank::Controller);
        life.watch(start + millis(100), CLIENT, Rank::MovingController);
        assert_eq!(life.poll_timeout(), Some(start + Life::MOVING));
        life.watch(start + millis(100), CLIENT, Rank::Controller);
        assert_eq!(life.poll_timeout(), Some(start + Life::MOVING));
        probes(&mut life, start + Life::MOVING, Rank::Controller);
        probes(&mut life, start + Life::SILENCE, Rank::Controller);
        life.watch(start + Life::SILENCE, CLIENT, Rank::MovingController);
        assert_eq!(life.poll_timeout(), Some(start + 2 * Life::SILENCE));
        assert_eq!(life.due.len(), 1, "one entry per peer");
    }

    #[test]
    fn after_a_sign_of_life_the_next_check_waits_for_a_new_silence_or_a_fifth_of_it() {
        for (heard, next) in [(900, 1900), (100, 1200)] {
            let (mut life, start) = (Life::default(), Instant::now());
            life.watch(start, CLIENT, Rank::Controller);
            life.hear(start + millis(heard), &head(QueryStatus::CODE));
            let due = start + Life::SILENCE;
            assert_eq!(
                probes(&mut life, due, Rank::Controller),
                1,
                "its first probe"
            );
            assert_eq!(life.poll_timeout(), Some(start + millis(next)));
        }
    }

    #[test]
    fn a_peer_that_has_answered_or_acknowledged_dies_after_4_s_of_silence_and_others_never() {
        type Sign = fn(&mut Life, Instant);
        let signs: [(Sign, bool); 3] = [
            (
                |life, now| life.hear(now, &head(ReportHeartbeatPulse::CODE)),
                true,
            ),
            (|life, now| life.acknowledged(now, CLIENT), true),
            (|life, now| life.hear(now, &head(QueryStatus::CODE)), false),
        ];
        for (sign, can_die) in signs {
            let (mut life, start) = (Life::default(), Instant::now());
            life.watch(start, CLIENT, Rank::Controller);
            let sign_at = start + millis(900);
            sign(&mut life, sign_at);
            assert_eq!(life.last_sign(CLIENT), Some(sign_at));
            let death = sign_at + Life::DEATH;
            // One call is late, so that no regular probe is due at the time of death.
            for ms in [1000, 2100, 3100, 4100] {
                probes(&mut life, start + millis(ms), Rank::Controller);
            }
            assert_eq!(life.poll_timeout(), Some(death));
            assert!(life.is_alive(death - MOMENT, CLIENT));
            assert!(!life.is_mute(death - MOMENT, CLIENT));
            assert!(!life.is_alive(death, CLIENT));
            assert_eq!(life.is_mute(death, CLIENT), !can_die);
            probes(&mut life, death, Rank::Controller);
            assert_eq!(life.poll_dead(), can_die.then_some(CLIENT));
            assert_eq!(life.poll_dead(), None);
            let next = death + Life::SILENCE;
            assert_eq!(life.poll_timeout(), (!can_die).then_some(next));
        }
    }

    #[test]
    fn a_component_that_was_itself_held_up_probes_twice_before_a_peer_dies() {
        let (mut life, start) = (Life::default(), Instant::now());
        life.watch(start, CLIENT, Rank::Controller);
        life.hear(start, &head(ReportHeartbeatPulse::CODE));
        for (at, sent) in [(60, 1), (61, 1), (62, 0)] {
            let now = start + at * Life::SILENCE;
            assert_eq!(life.poll_dead(), None);
            assert_eq!(probes(&mut life, now, Rank::Controller), sent);
        }
        assert_eq!(life.poll_dead(), Some(CLIENT));
    }

    #[test]
    fn a_peer_without_a_rank_is_no_longer_watched() {
        let (mut life, start) = (Life::default(), Instant::now());
        life.watch(start, CLIENT, Rank::Subscriber);
        let mut out = Outbox::new(US);
        life.handle_timeout(start + Life::SILENCE, |_| None, &mut out);
        assert!(out.pop().is_none() && life.poll_timeout().is_none());
        assert_eq!(life.last_sign(CLIENT), None);
        assert!(!life.is_alive(start, CLIENT) && !life.is_mute(start, CLIENT));
    }

    #[test]
    fn probes_to_subscribers_and_setters_have_budgets_and_those_to_controllers_do_not() {
        for (rank, first, later) in [
            (Rank::Subscriber, 32, 20),
            (Rank::EmergencySetter, 32, 20),
            (Rank::Controller, 100, 100),
        ] {
            let (mut life, start) = (Life::default(), Instant::now());
            for component in 1..=100 {
                life.watch(start, JausId::new(102, 1, component), rank);
            }
            let due = start + Life::SILENCE;
            assert_eq!(probes(&mut life, due, rank), first, "{rank:?}");
            assert_eq!(probes(&mut life, due + Life::SILENCE, rank), later);
        }
    }
}
