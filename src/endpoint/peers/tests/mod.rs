//! The peer table on its own: when a peer moves, and what its numbers show.

mod challenges;
mod places;

use std::net::SocketAddr;
use std::time::Duration;

use bytes::Bytes;

use super::*;
use crate::endpoint::Limits;
use crate::wire::{Acknowledgement, Flags};
use route::Finding;

const US: JausId = JausId::new(101, 1, 1);
const PEER: JausId = JausId::new(42, 1, 1);
const SECOND: Duration = Duration::from_secs(1);
const MILLISECOND: Duration = Duration::from_millis(1);

fn path(host: u8, port: u16) -> Path {
    Path {
        link: LinkId(0),
        peer: SocketAddr::from(([10, 0, 0, host], port)).into(),
    }
}

fn here() -> Path {
    path(1, 3794)
}

/// The same host, with another port.
fn near() -> Path {
    path(1, 40_000)
}

fn far() -> Path {
    path(2, 3794)
}

fn frame(source: JausId, sequence: u16) -> Frame {
    Frame {
        sequence,
        ..Frame::new(source, US, Bytes::from_static(b"\x00\x2B\x02"))
    }
}

fn probe(path: Path, number: u16, answered: bool) -> Probe {
    Probe {
        path,
        number,
        answered,
    }
}

/// A table of peers and a clock.
struct Rig {
    peers: Peers,
    now: Instant,
}

impl Rig {
    fn new() -> Self {
        Self::with(Config::default())
    }

    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn with(config: Config) -> Self {
        Self {
            peers: Peers::new(Arc::new(config)),
            now: Instant::now(),
        }
    }

    /// A table of at most `max_peers`.
    fn bounded(max_peers: usize) -> Self {
        let limits = Limits {
            max_peers,
            ..Limits::default()
        };
        Self::with(Config {
            limits,
            ..Config::default()
        })
    }

    fn arrival<'a>(&self, frame: &'a Frame, path: Path) -> Arrival<'a> {
        Arrival {
            frame,
            now: self.now,
            path,
            to_all: false,
            held: 0,
        }
    }

    fn hear_frame(&mut self, frame: &Frame, path: Path) -> Heard {
        let arrival = self.arrival(frame, path);
        self.peers.hear(arrival, false, true).unwrap()
    }

    /// Hears a new peer on a host, and gives it a standing.
    fn add(&mut self, id: JausId, host: u8, standing: Standing) {
        self.hear_frame(&frame(id, 1), path(host, 3794));
        self.peers.raise(id, standing);
    }

    fn peer(&self) -> &PeerState {
        self.peers.get(PEER).unwrap()
    }

    fn challenge(&mut self, incumbent: Probe, rival: Option<Probe>) {
        let was_verified = self.peer().peer.route == RouteState::Verified;
        let incumbent = (incumbent, was_verified);
        self.peers
            .begin_challenge(self.now, PEER, US, incumbent, rival);
    }

    /// Receives an acknowledgement; returns whether a challenge awaits it, and the peer's path if
    /// that decides it.
    fn answer(&mut self, path: Path, number: u16) -> Option<Option<Path>> {
        let flags = Flags::default().with_acknowledgement(Acknowledgement::Positive);
        let frame = Frame {
            flags,
            ..frame(PEER, number)
        };
        let decision = self.peers.answer_challenge(self.arrival(&frame, path))?;
        Some(decision.map(|it| it.to))
    }

    /// Lets a challenge run out; returns the decision.
    fn run_out(&mut self) -> Decision {
        loop {
            self.now = self.peers.next_deadline().unwrap();
            if let Some((_, Some(decision))) = self.peers.next_due(self.now) {
                return decision;
            }
        }
    }
}

#[test]
fn where_a_peer_is_heard_and_what_was_known_decide_whether_it_moves() {
    use RouteState::{Stale, Unverified, Verified};
    // Its route; is it the same host, a stream, may it be challenged, was it silent for 10 s:
    // does it move, is that contested, and its route then.
    for (route, is_near, is_stream, can, is_silent, expected) in [
        (
            Unverified,
            true,
            true,
            true,
            false,
            Some((true, false, Verified)),
        ),
        (
            Unverified,
            false,
            true,
            true,
            true,
            Some((true, false, Verified)),
        ),
        (
            Unverified,
            false,
            true,
            true,
            false,
            Some((false, true, Unverified)),
        ),
        (
            Unverified,
            false,
            true,
            false,
            false,
            Some((true, false, Unverified)),
        ),
        (
            Unverified,
            true,
            false,
            true,
            false,
            Some((true, true, Unverified)),
        ),
        (
            Unverified,
            true,
            false,
            false,
            false,
            Some((true, false, Unverified)),
        ),
        (
            Unverified,
            false,
            false,
            true,
            true,
            Some((true, true, Unverified)),
        ),
        (
            Unverified,
            false,
            false,
            true,
            false,
            Some((false, true, Unverified)),
        ),
        (
            Unverified,
            false,
            false,
            false,
            false,
            Some((true, false, Unverified)),
        ),
        (
            Stale,
            false,
            false,
            true,
            false,
            Some((true, false, Unverified)),
        ),
        (
            Stale,
            false,
            true,
            true,
            false,
            Some((true, false, Verified)),
        ),
        (
            Verified,
            true,
            true,
            false,
            false,
            Some((true, false, Verified)),
        ),
        (
            Verified,
            true,
            true,
            true,
            false,
            Some((true, false, Verified)),
        ),
        (
            Verified,
            true,
            false,
            true,
            false,
            Some((true, true, Unverified)),
        ),
        (Verified, true, false, false, false, None),
        (
            Verified,
            false,
            true,
            true,
            true,
            Some((false, true, Verified)),
        ),
        (Verified, false, true, false, true, None),
        (
            Verified,
            false,
            false,
            true,
            true,
            Some((false, true, Verified)),
        ),
    ] {
        let mut rig = Rig::new();
        rig.hear_frame(&frame(PEER, 900), here());
        rig.peers.set_route(PEER, here(), route);
        rig.now += 10 * SECOND;
        if !is_silent {
            rig.now -= MILLISECOND;
        }
        let path = if is_near { near() } else { far() };
        let heard = frame(PEER, 901);
        let heard = rig.peers.hear(rig.arrival(&heard, path), is_stream, can);
        let row = (route, is_near, is_stream, can, is_silent);
        let Some((moves, contests, then)) = expected else {
            assert_eq!(heard, Ok(Heard::Known), "{row:?}");
            continue;
        };
        let elsewhere = Heard::Elsewhere {
            incumbent: here(),
            was_verified: route == Verified,
            moved: moves,
            contested: contests,
        };
        assert_eq!(heard, Ok(elsewhere), "{row:?}");
        let at = if moves { path } else { here() };
        let peer = &rig.peer().peer;
        assert_eq!((peer.path, peer.route), (at, then), "{row:?}");
    }
}

#[test]
fn a_stale_route_on_which_the_peer_is_heard_again_is_unverified() {
    let mut rig = Rig::new();
    rig.hear_frame(&frame(PEER, 1), here());
    rig.peers.set_route(PEER, here(), RouteState::Stale);
    assert_eq!(rig.peers.route(PEER), None);
    assert_eq!(rig.hear_frame(&frame(PEER, 2), here()), Heard::Known);
    assert_eq!(rig.peers.route(PEER), Some((here(), Version::As5669a)));
    assert_eq!(rig.peer().peer.route, RouteState::Unverified);
}

#[test]
fn an_acknowledgement_verifies_the_route_on_which_it_came_unless_there_is_a_rival() {
    for (from, has_rival, expected) in [
        (here(), false, RouteState::Verified),
        (far(), false, RouteState::Unverified),
        (here(), true, RouteState::Unverified),
    ] {
        let mut rig = Rig::new();
        rig.hear_frame(&frame(PEER, 1), here());
        let rival = has_rival.then(|| probe(far(), 8, false));
        rig.challenge(probe(here(), 7, false), rival);
        rig.peers.verify(PEER, from);
        let state = rig.peer();
        assert_eq!(state.peer.route, expected);
        let is_verified = expected == RouteState::Verified;
        assert_eq!(state.challenge.is_none(), is_verified, "it is over");
        assert_eq!(rig.peers.is_proven(here()), is_verified);
        assert!(
            !rig.peers.is_stranger(PEER),
            "it has acknowledged something"
        );
    }
}

#[test]
fn a_route_is_stale_only_if_the_peer_was_silent_all_the_time() {
    for (since, expected) in [
        (MILLISECOND, RouteState::Stale),
        (Duration::ZERO, RouteState::Unverified),
    ] {
        let mut rig = Rig::new();
        rig.hear_frame(&frame(PEER, 1), here());
        rig.peers.lose(PEER, rig.now + since);
        assert_eq!(rig.peer().peer.route, expected, "since {since:?}");
    }
}

#[test]
fn a_number_belongs_to_the_round_in_which_it_is_nearest_to_the_latest() {
    let mut rig = Rig::new();
    for (sequence, round) in [
        (65_000, 1),
        (10, 2),
        (65_001, 1),
        (32_000, 2),
        (60_000, 2),
        (27_232, 2),
        (27_231, 3),
    ] {
        let frame = frame(PEER, sequence);
        assert_eq!(rig.peers.round(&frame), round, "{sequence}");
        rig.hear_frame(&frame, here());
    }
    let flags = Flags::default().with_acknowledgement(Acknowledgement::Positive);
    let answer = Frame {
        flags,
        ..frame(PEER, 27_232)
    };
    assert_eq!(rig.peers.round(&answer), 0, "the number of another");
    let query = Bytes::from_static(CHALLENGE);
    let challenge = Frame {
        flags: CHALLENGE_FLAGS,
        ..Frame::new(PEER, US, query)
    };
    assert_eq!(rig.peers.round(&challenge), 0, "an old number");
}

#[test]
fn a_restart_is_a_first_number_after_a_much_higher_one_or_a_long_silence() {
    for (latest, next, silence, restarts) in [
        (900, 1, 0, true),
        (900, 15, 0, true),
        (900, 16, 0, false),
        (257, 1, 0, true),
        (256, 1, 0, false),
        (59_999, 1, 0, true),
        (60_000, 1, 0, false),
        (900, 901, 599, false),
        (900, 901, 600, true),
    ] {
        let mut rig = Rig::new();
        rig.hear_frame(&frame(PEER, latest), here());
        rig.peers.change(PEER, |state| state.also_at.push(far()));
        rig.now += silence * SECOND;
        rig.hear_frame(&frame(PEER, next), here());
        let is_anew = rig.peer().also_at.is_empty();
        assert_eq!(is_anew, restarts, "{latest}, {next} after {silence} s");
        assert_eq!(rig.peer().heard_on_route, rig.now);
    }
    // An acknowledgement repeats a number of ours, which shows nothing.
    let mut rig = Rig::new();
    rig.hear_frame(&frame(PEER, 900), here());
    rig.peers.change(PEER, |state| state.also_at.push(far()));
    let flags = Flags::default().with_acknowledgement(Acknowledgement::Positive);
    let answer = Frame {
        flags,
        ..frame(PEER, 1)
    };
    rig.hear_frame(&answer, here());
    assert_eq!(rig.peer().also_at, [far()]);
}

#[test]
fn a_number_that_comes_late_is_not_the_latest() {
    let mut rig = Rig::new();
    for (sequence, latest) in [(900, 900), (902, 902), (901, 902), (903, 903)] {
        rig.hear_frame(&frame(PEER, sequence), here());
        assert_eq!(rig.peer().latest, Some(1 << 16 | latest));
    }
}

#[test]
fn an_own_entry_comes_before_a_pattern_and_each_address_of_a_pattern_is_accepted() {
    let pin = |id, path, gets_broadcasts| StaticPeer {
        id,
        path,
        gets_broadcasts,
    };
    let all = PEER.whole_subsystem();
    let rig = Rig::with(Config {
        static_peers: vec![
            pin(all, far(), true),
            pin(PEER, here(), false),
            pin(JausId::new(7, 1, 1), path(7, 3794), true),
        ],
        ..Config::default()
    });
    let route = |id| rig.peers.route(id).map(|(path, _)| path);
    let sibling = JausId::new(42, 1, 2);
    let stranger = JausId::new(43, 1, 1);
    assert_eq!(
        [PEER, sibling, stranger].map(route),
        [Some(here()), Some(far()), None]
    );
    let is_elsewhere = |id, path| rig.peers.is_pinned_elsewhere(id, path);
    assert!(!is_elsewhere(PEER, near()) && !is_elsewhere(PEER, far()));
    assert!(is_elsewhere(PEER, path(3, 3794)) && is_elsewhere(sibling, here()));
    assert!(!is_elsewhere(stranger, here()), "it has no address");
    assert!(rig.peers.is_proven(far()) && !rig.peers.is_proven(near()));
    assert_eq!(rig.peers.broadcast_copies(PEER), [far()]);
    let everyone = rig.peers.broadcast_copies(JausId::EVERYONE);
    assert_eq!(everyone, [far(), path(7, 3794)]);
}
