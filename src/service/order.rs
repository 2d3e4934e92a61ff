//! The order in which a client has sent its setpoints, by the sequence numbers of its messages.
//!
//! A network delivers late what it has delayed, and a client that requests acknowledgements
//! retransmits what was lost, for seconds. So a setpoint may arrive after newer ones, or after the
//! stop that its client has sent since. It must not move anything any more: a service does not
//! [admit](super::Context::admits_setpoint) a setpoint that is older than the client's newest one of
//! the same [series](series_of), or than the client's last turn: a stop (release, standby, reset,
//! shutdown, emergency), or what gave it control, or made the component ready for it. The latter
//! matters where the component has restarted, and knows nothing of what was before. A command of an
//! application's own service is compared with the turns alone, because it may concern something else
//! than the one before.
//!
//! Stops are never checked: an old stop stops as well as a new one. What ends an emergency is: it may arrive
//! after its client has set the next one, and must not end that. Neither are messages from
//! components of the same node, which have no numbers and arrive in order, nor broadcasts, which are
//! not retransmitted and which some peers count separately.
//!
//! # How clients count
//!
//! Our own nodes have one counter for all components and destinations, and begin at the time of
//! day. Junior and JAUS++ have one for each component, and begin at 1 and 0 each time they start.
//! OpenJAUS always sends 0. So:
//!
//! * Numbers are compared on the circle of 16 bits. Equal numbers are in order.
//! * A number up to [`REACH`] behind the newest is late, as long as the newest arrived within
//!   [`MEMORY`]. A client that counts anew within that reach is refused for that time at most.
//! * A number further behind is no retransmission. The client has restarted, or it sends so much
//!   that the counter has wrapped. A setpoint is admitted when the one before was in agreement with
//!   the new numbers: a single stray one moves nothing, and a client in earnest sends the next one
//!   within its validity. A goal is sent once, so it is admitted at once.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::{Validity, code_of};
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::Received;
use crate::messages::core::{ReleaseControl, Reset, SetEmergency, Shutdown, Standby};

/// The series of a setpoint: its code, and the joint or the kind of velocity that it concerns. A
/// newer setpoint supersedes the older ones of its series. `None` for other messages.
pub(crate) fn series_of(payload: &[u8]) -> Option<(u16, u8)> {
    let code = code_of(payload)?;
    let octet = |at: usize| payload.get(at).copied().unwrap_or_default();
    let subject = match code {
        // Set Velocity Command and its Ext form: the command type follows the presence vector.
        0x0415 | 0x04B5 => octet(3),
        // Efforts and velocities of joints, of a manipulator or of a pan and tilt unit: the number
        // of the joint, or how many there are.
        0x0601 | 0x0603 | 0x0621 | 0x0623 => octet(2),
        // Efforts of the drive, vectors, travel speeds, waypoints, path segments and lists with
        // their Ext forms, loiters.
        0x0405 | 0x0407 | 0x0408 | 0x04A7 | 0x04A8 | 0x040A | 0x040C | 0x040D | 0x040F | 0x0410
        | 0x041E | 0x04AA | 0x04AC | 0x04AD | 0x04AE | 0x04AF | 0x04B0 | 0x0425 | 0x0426
        | 0x0501 => 0,
        // Positions of joints; pose, velocity and effort of the end effector.
        0x0602 | 0x0610 | 0x0612 | 0x0613 | 0x0622 | 0x0633 => 0,
        // Set Destination of the mission planner.
        0xD110 => 0,
        _ => return None,
    };
    Some((code, subject))
}

/// Whether a message stops what its sender has set in motion.
pub(crate) fn is_stop(payload: &[u8]) -> bool {
    matches!(
        code_of(payload),
        Some(
            ReleaseControl::CODE
                | Standby::CODE
                | Reset::CODE
                | Shutdown::CODE
                | SetEmergency::CODE
        )
    )
}

/// How far behind the newest number a late one may be: a client that sends 1000 messages a second
/// and retransmits for 4 s uses this many.
pub(super) const REACH: u16 = 4096;
/// How long a number counts. Our own nodes retransmit for 3 s, Junior for 0.4 s; a network adds its
/// delay.
pub(super) const MEMORY: Duration = Duration::from_secs(4);
/// Limit of clients. In a component with Access Control one client at a time sends setpoints.
const CLIENTS: usize = 64;

/// The latest numbers of the clients of one component.
#[derive(Debug, Default)]
pub(super) struct SendOrder {
    clients: BTreeMap<JausId, Client>,
    refused: u64,
}

#[derive(Debug, Default)]
struct Client {
    /// Its last stop or start.
    turn: Option<Mark>,
    /// Its newest setpoints, by series.
    setpoints: BTreeMap<(u16, u8), Mark>,
    /// Its last setpoint, if that was refused because its number is out of reach.
    stray: Option<Mark>,
}

/// A number, and when it arrived.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mark {
    pub(super) number: u16,
    pub(super) at: Instant,
}

impl Mark {
    pub(super) fn is_recent(self, now: Instant) -> bool {
        now.saturating_duration_since(self.at) < MEMORY
    }

    /// Whether the sender has sent `other` before this, and a network or a retransmission has delayed it.
    pub(super) fn is_after(self, other: Self) -> bool {
        (1..=REACH).contains(&self.lead(other.at, other.number))
    }

    /// How far `number` is ahead, on the circle.
    pub(super) const fn ahead(self, number: u16) -> u16 {
        number.wrapping_sub(self.number)
    }

    /// How far `number` is behind, 0 if it is not or if this mark is too old to count.
    fn lead(self, now: Instant, number: u16) -> u16 {
        match self.number.wrapping_sub(number) {
            lead if lead < 1 << 15 && self.is_recent(now) => lead,
            _ => 0,
        }
    }
}

/// A number that was passed a while ago.
#[derive(Debug)]
pub(super) struct Settled {
    after: Duration,
    pub(super) number: Option<u16>,
    /// What `number` will be next.
    next: Option<Mark>,
}

impl Settled {
    /// A number is settled when it was passed so long ago.
    pub(super) const fn after(after: Duration) -> Self {
        Self {
            after,
            number: None,
            next: None,
        }
    }

    /// Notes a number that was just sent. One behind those before is of another counter: that of another way to
    /// the client.
    pub(super) fn note(&mut self, mark: Mark) {
        let Some(next) = self.next else {
            self.next = Some(mark);
            return;
        };
        if next.ahead(mark.number) >= 1 << 15 {
            (self.number, self.next) = (None, Some(mark));
        } else if mark.at.saturating_duration_since(next.at) >= self.after {
            (self.number, self.next) = (Some(next.number), Some(mark));
        }
    }

    /// Whether a number was sent before the settled one.
    pub(super) fn is_behind(&self, number: u16) -> bool {
        let lead = self.number.map_or(0, |it| it.wrapping_sub(number));
        (1..1 << 15).contains(&lead)
    }
}

impl Client {
    fn is_recent(&self, now: Instant) -> bool {
        let marks = self.setpoints.values().chain(&self.turn);
        marks.chain(&self.stray).any(|mark| mark.is_recent(now))
    }

    /// How far a setpoint is behind those that supersede it.
    fn lead(&self, now: Instant, series: Option<(u16, u8)>, number: u16) -> u16 {
        let setpoint = series.and_then(|series| self.setpoints.get(&series));
        let marks = setpoint.into_iter().chain(&self.turn);
        marks.map(|mark| mark.lead(now, number)).max().unwrap_or(0)
    }

    /// Whether the last stray setpoint was shortly before this number.
    fn agrees(&self, now: Instant, number: u16) -> bool {
        self.stray
            .is_some_and(|stray| stray.is_recent(now) && (1..=REACH).contains(&stray.ahead(number)))
    }
}

impl SendOrder {
    /// Whether a setpoint is in order. If so it is the newest one from now on; if not it is counted
    /// and traced.
    pub(super) fn admits(&mut self, now: Instant, message: &Received, validity: Validity) -> bool {
        let Some(number) = number_of(message) else {
            return true;
        };
        let Some(client) = self.client(now, message.source) else {
            return true;
        };
        let series = series_of(&message.payload);
        let lead = client.lead(now, series, number);
        let mark = Mark { number, at: now };
        if lead > REACH && (validity == Validity::UntilDone || client.agrees(now, number)) {
            *client = Client::default();
        } else if lead > 0 {
            client.stray = (lead > REACH).then_some(mark);
            self.refuse(message, "its sender has superseded it");
            return false;
        }
        client.stray = None;
        client.setpoints.extend(series.map(|series| (series, mark)));
        true
    }

    /// Counts and traces a setpoint that must not move anything.
    pub(super) fn refuse(&mut self, message: &Received, why: &str) {
        self.refused += 1;
        let (source, number) = (message.source, message.sequence);
        tracing::debug!(%source, ?number, why, "setpoint refused");
    }

    /// Notes a stop or a start, which supersedes all setpoints before it.
    pub(super) fn note_turn(&mut self, now: Instant, message: &Received) {
        if let Some(number) = number_of(message)
            && let Some(client) = self.client(now, message.source)
            && client.turn.is_none_or(|turn| turn.lead(now, number) == 0)
        {
            client.turn = Some(Mark { number, at: now });
        }
    }

    /// Forgets the numbers of a client that has restarted: it may count anew.
    pub(super) fn forget(&mut self, client: JausId) {
        self.clients.remove(&client);
    }

    /// How many setpoints were refused.
    pub(super) const fn refused(&self) -> u64 {
        self.refused
    }

    /// What is known of a client; `None` if there are too many.
    fn client(&mut self, now: Instant, id: JausId) -> Option<&mut Client> {
        if !self.clients.contains_key(&id) {
            self.clients.retain(|_, client| client.is_recent(now));
            if self.clients.len() >= CLIENTS {
                return None;
            }
        }
        Some(self.clients.entry(id).or_default())
    }
}

/// The mark of a message; `None` if it says nothing about the order.
pub(super) fn mark_of(now: Instant, message: &Received) -> Option<Mark> {
    Some(Mark {
        number: number_of(message)?,
        at: now,
    })
}

/// The number that the sender gave a message; `None` if it says nothing about the order.
pub(super) fn number_of(message: &Received) -> Option<u16> {
    let number = message.sequence?;
    message.destination.is_unicast().then_some(number)
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;
    use crate::messages::mobility::{SetLocalWaypoint, SetVelocityCommand, SetWrenchEffort};
    use crate::wire::{Broadcast, Priority};

    const CLIENT: JausId = JausId::new(42, 1, 1);
    const OWN: JausId = JausId::new(101, 1, 33);

    struct Rig {
        order: SendOrder,
        now: Instant,
    }

    impl Rig {
        fn new() -> Self {
            Self {
                order: SendOrder::default(),
                now: Instant::now(),
            }
        }

        fn pass(&mut self, milliseconds: u64) {
            self.now += Duration::from_millis(milliseconds);
        }

        fn admits<M: Message>(&mut self, setpoint: &M, number: u16) -> bool {
            let message = message(setpoint, Some(number));
            let validity = Validity::of(M::CODE);
            self.order.admits(self.now, &message, validity)
        }

        /// The numbers of the efforts that are admitted, one every 20 ms.
        fn admitted(&mut self, numbers: impl IntoIterator<Item = u16>) -> Vec<u16> {
            let efforts = numbers.into_iter().filter(|&number| {
                self.pass(20);
                self.admits(&SetWrenchEffort::default(), number)
            });
            efforts.collect()
        }

        fn stop(&mut self, number: u16) {
            self.order
                .note_turn(self.now, &message(&Standby {}, Some(number)));
        }
    }

    fn message<M: Message>(message: &M, sequence: Option<u16>) -> Received {
        Received {
            source: CLIENT,
            destination: OWN,
            to: OWN,
            priority: Priority::Standard,
            broadcast: Broadcast::None,
            sequence,
            payload: message.encode().unwrap(),
            path: None,
            acknowledged: false,
        }
    }

    #[test]
    fn a_setpoint_that_was_overtaken_is_refused_and_counted() {
        let mut rig = Rig::new();
        let admitted = rig.admitted([10, 12, 11, 14, 13, 12, 15]);
        assert_eq!(admitted, [10, 12, 14, 15]);
        assert_eq!(rig.order.refused(), 3);
    }

    #[test]
    fn the_numbers_go_round_in_a_circle() {
        let mut rig = Rig::new();
        let admitted = rig.admitted([65_530, 65_535, 65_533, 2, 65_534, 0, 5]);
        assert_eq!(admitted, [65_530, 65_535, 2, 5]);
    }

    #[test]
    fn a_client_that_does_not_count_is_in_order() {
        let mut rig = Rig::new();
        assert_eq!(rig.admitted([0, 0, 0]), [0, 0, 0]);
        for _ in 0..3 {
            let local = message(&SetWrenchEffort::default(), None);
            assert!(rig.order.admits(rig.now, &local, Validity::Brief));
        }
    }

    #[test]
    fn a_stop_supersedes_the_setpoints_before_it_and_none_after_it() {
        let mut rig = Rig::new();
        assert_eq!(rig.admitted([10]), [10]);
        rig.stop(14);
        assert_eq!(rig.admitted([11, 12, 13, 15]), [15]);
        assert!(rig.admits(&SetLocalWaypoint::default(), 16));
        // A stop that arrives late, though it stops, supersedes nothing that is newer.
        rig.stop(12);
        assert_eq!(rig.admitted([17]), [17]);
    }

    #[test]
    fn a_setpoint_supersedes_only_those_of_its_series() {
        let mut rig = Rig::new();
        assert_eq!(rig.admitted([20]), [20]);
        assert!(rig.admits(&SetLocalWaypoint::default(), 19), "another code");
        assert!(!rig.admits(&SetLocalWaypoint::default(), 18));
        let velocity = |kind: u8| SetVelocityCommand {
            command_type: kind.into(),
            ..SetVelocityCommand::default()
        };
        assert!(rig.admits(&velocity(0), 20));
        assert!(rig.admits(&velocity(1), 19), "a limit");
        assert!(!rig.admits(&velocity(0), 19));
    }

    #[test]
    fn a_command_of_an_own_service_is_superseded_by_stops_alone() {
        let mut rig = Rig::new();
        let own = |number| Received {
            payload: vec![0x01, 0xD0].into(),
            ..message(&Standby {}, Some(number))
        };
        let mut admits = |number| rig.order.admits(rig.now, &own(number), Validity::Brief);
        assert!(admits(20) && admits(18));
        rig.stop(21);
        assert!(!rig.order.admits(rig.now, &own(19), Validity::Brief));
    }

    #[test]
    fn late_retransmissions_move_nothing_however_many_ascend() {
        let mut rig = Rig::new();
        rig.admitted([500]);
        rig.stop(501);
        // 3 s of retransmissions: 150 of 20 ms.
        assert!(rig.admitted(300..450).is_empty());
    }

    #[test]
    fn a_client_that_counts_anew_within_reach_is_admitted_after_4_s() {
        let mut rig = Rig::new();
        rig.admitted([500]);
        assert!(rig.admitted([1]).is_empty());
        rig.pass(3950);
        assert_eq!(rig.admitted([2, 3, 4]), [3, 4], "4 s after the last one");
    }

    #[test]
    fn a_client_that_counts_anew_out_of_reach_is_admitted_when_two_agree() {
        for first in [1, 0, 20_000] {
            let mut rig = Rig::new();
            rig.admitted([30_000]);
            rig.stop(30_001);
            let next = [first, first + 2, first + 3];
            assert_eq!(rig.admitted(next), next[1..]);
        }
    }

    #[test]
    fn a_client_that_is_known_to_have_restarted_is_admitted_at_once() {
        let mut rig = Rig::new();
        rig.admitted([500]);
        rig.order.forget(CLIENT);
        assert_eq!(rig.admitted([1, 2]), [1, 2]);
    }

    #[test]
    fn single_strays_out_of_reach_move_nothing() {
        let mut rig = Rig::new();
        let admitted = rig.admitted([30_000, 9_000, 30_001, 9_001, 30_002, 20_000, 9_002]);
        assert_eq!(admitted, [30_000, 30_001, 30_002]);
    }

    #[test]
    fn a_goal_out_of_reach_is_admitted_at_once_because_it_is_sent_once() {
        let mut rig = Rig::new();
        let goal = SetLocalWaypoint::default();
        assert!(rig.admits(&goal, 30_000));
        assert!(!rig.admits(&goal, 29_999));
        assert!(rig.admits(&goal, 3));
    }

    #[test]
    fn the_table_of_clients_is_bounded_and_forgets() {
        let mut rig = Rig::new();
        for node in 1..=200 {
            let effort = Received {
                source: JausId::new(7, node, 1),
                ..message(&SetWrenchEffort::default(), Some(9))
            };
            assert!(rig.order.admits(rig.now, &effort, Validity::Brief));
        }
        assert_eq!(rig.order.clients.len(), CLIENTS);
        rig.pass(4000);
        assert_eq!(rig.admitted([1]), [1]);
        assert_eq!(rig.order.clients.len(), 1);
    }
}
