//! The reassembly buffer on its own: which fragments form one message, and what is kept for how long.

use std::time::Duration;

use super::*;
use crate::endpoint::{LinkId, Path, Remote};
use crate::wire::Flags;

const US: JausId = JausId::new(101, 1, 1);
const PEER: JausId = JausId::new(42, 1, 1);
const SECOND: Duration = Duration::from_secs(1);

const LINE: Path = Path {
    link: LinkId(0),
    peer: Remote::Line,
};

/// A secure session of the same link.
const fn session(number: u64) -> Path {
    Path {
        link: LinkId(0),
        peer: Remote::Session(SessionId(number)),
    }
}

use DataControl::{First, Last, Middle};

fn flags(data: DataControl) -> Flags {
    Flags::default().with_data(data)
}

fn asks(data: DataControl) -> Flags {
    flags(data).with_acknowledgement(Acknowledgement::Request)
}

fn fragment(flags: Flags, sequence: u16, octets: &[u8]) -> Frame {
    Frame {
        flags,
        sequence,
        ..Frame::new(PEER, US, Bytes::copy_from_slice(octets))
    }
}

/// A buffer with a clock.
struct Rig {
    reassembly: Reassembly,
    counters: Counters,
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
            reassembly: Reassembly::new(Arc::new(config)),
            counters: Counters::default(),
            now: Instant::now(),
        }
    }

    /// Adds a fragment; returns the payload of the message if it is complete.
    fn insert(&mut self, frame: &Frame) -> Result<Option<Bytes>, Counter> {
        self.insert_by(LINE, frame)
    }

    fn insert_by(&mut self, path: Path, frame: &Frame) -> Result<Option<Bytes>, Counter> {
        let arrival = Arrival {
            frame,
            now: self.now,
            path,
            to_all: false,
            held: 0,
        };
        let whole = self.reassembly.insert(arrival, None, &mut self.counters)?;
        Ok(whole.map(|whole| whole.payload))
    }

    fn forgotten(&self) -> u64 {
        self.counters.get(Counter::FragmentsForgotten)
    }

    fn pass(&mut self, time: Duration) {
        self.now += time;
        self.reassembly.expire(self.now, &mut self.counters);
    }
}

#[test]
fn fragments_of_one_session_complete_no_message_of_another() {
    let paths = [session(1), session(2), LINE];
    for (one, other) in paths
        .iter()
        .flat_map(|one| paths.map(|other| (*one, other)))
    {
        let mut rig = Rig::new();
        let parts = [(First, 1), (Middle, 2), (Last, 3)];
        let [first, middle, last] =
            parts.map(|(data, number)| fragment(flags(data), number, &[number as u8; 3]));
        assert_eq!(rig.insert_by(one, &first), Ok(None));
        let joins = one == other;
        assert_eq!(rig.reassembly.awaits(&middle, other), joins);
        assert_eq!(rig.insert_by(other, &middle), Ok(None));
        let whole = rig.insert_by(other, &last).unwrap();
        assert_eq!(whole.is_some(), joins, "{one:?} {other:?}");
        // The message of the first session is still complete with its own fragments.
        if !joins {
            assert_eq!(rig.insert_by(one, &last), Ok(None));
            let whole = rig.insert_by(one, &middle).unwrap();
            assert_eq!(whole.as_deref(), Some(&[1, 1, 1, 2, 2, 2, 3, 3, 3][..]));
        }
    }
}

#[test]
fn a_small_piece_does_not_keep_a_large_datagram_alive() {
    let datagram = Bytes::from(vec![7; 60_000]);
    let frame = |length| {
        let (source, destination) = (JausId::new(1, 1, 1), JausId::new(2, 1, 1));
        Frame::new(source, destination, datagram.slice(..length))
    };
    let is_shared = |length: usize, held| {
        let piece = part_of_message(&frame(length), held);
        assert_eq!(piece.len(), length);
        datagram.as_ptr_range().contains(&piece.as_ptr())
    };
    assert!(!is_shared(100, datagram.len()));
    assert!(is_shared(15_000, datagram.len()));
    assert!(is_shared(1425, 1440));
    assert!(!is_shared(1425, usize::MAX), "of a stream nothing is known");
}

#[test]
fn each_run_and_each_piece_has_an_overhead() {
    let mut rig = Rig::new();
    for (data, sequence, cost) in [
        (First, 1, 256 + 64 + 10),
        (Middle, 3, 2 * (256 + 64 + 10)),
        (Middle, 2, 256 + 3 * (64 + 10)),
    ] {
        assert_eq!(
            rig.insert(&fragment(flags(data), sequence, &[7; 10])),
            Ok(None)
        );
        assert_eq!(rig.reassembly.cost(), cost);
    }
    let last = fragment(flags(Last), 4, &[7; 10]);
    assert_eq!(rig.insert(&last), Ok(Some(vec![7; 40].into())));
    assert_eq!(
        (rig.reassembly.cost(), rig.reassembly.next_expiry()),
        (0, None)
    );
    assert!(rig.reassembly.senders.is_empty());
}

#[test]
fn only_neighbours_of_one_message_are_joined() {
    let base = fragment(flags(Middle), 2, b"bb");
    let urgent = flags(Middle).with_priority(Priority::High);
    for (next, joins) in [
        (base.clone(), true),
        (
            Frame {
                sequence: 3,
                ..base.clone()
            },
            false,
        ),
        (
            Frame {
                flags: flags(First),
                ..base.clone()
            },
            false,
        ),
        (
            Frame {
                flags: urgent,
                ..base.clone()
            },
            false,
        ),
        (
            Frame {
                version: Version::As5669,
                ..base.clone()
            },
            false,
        ),
        (
            Frame {
                destination: JausId::new(101, 1, 2),
                ..base
            },
            false,
        ),
    ] {
        for backwards in [false, true] {
            let mut both = [fragment(flags(First), 1, b"aa"), next.clone()];
            if backwards {
                both.reverse();
            }
            let mut rig = Rig::new();
            both.iter().for_each(|it| drop(rig.insert(it)));
            let runs = &rig.reassembly.senders[&PEER].runs;
            assert_eq!(runs.len() == 1, joins, "{next:?} {backwards}");
        }
    }
    for backwards in [false, true] {
        let mut both = [
            fragment(flags(Last), 1, b"aa"),
            fragment(flags(Middle), 2, b"bb"),
        ];
        if backwards {
            both.reverse();
        }
        let mut rig = Rig::new();
        both.iter().for_each(|it| drop(rig.insert(it)));
        assert_eq!(
            rig.reassembly.senders[&PEER].runs.len(),
            2,
            "a last one ends it"
        );
    }
}

#[test]
fn a_run_is_stale_when_its_sender_has_used_16384_numbers() {
    for (ahead, joins) in [((1 << 14) - 1, true), (1 << 14, false)] {
        let mut rig = Rig::new();
        rig.insert(&fragment(flags(First), 1, b"aa")).unwrap();
        // The sender's position counts all of its numbers, to whichever component.
        let other = Frame {
            destination: JausId::new(101, 1, 2),
            ..fragment(flags(Middle), 1 + ahead, b"xx")
        };
        rig.insert(&other).unwrap();
        rig.reassembly.change(PEER, |sender| sender.latest = 2);
        let next = fragment(flags(Middle), 2, b"bb");
        assert_eq!(rig.reassembly.awaits(&next, LINE), joins, "{ahead}");
        rig.insert(&next).unwrap();
        let runs = &rig.reassembly.senders[&PEER].runs;
        assert_eq!(runs.len(), if joins { 2 } else { 3 }, "{ahead}");
    }
}

#[test]
fn a_fragment_that_is_there_is_a_duplicate_unless_its_sender_begins_anew() {
    for (again, is_duplicate) in [
        (fragment(asks(First), 1, b"aa"), true),
        (fragment(flags(First), 1, b"aa"), false),
        (fragment(asks(First), 1, b"xx"), false),
        (fragment(asks(First), 2, b"bb"), false),
        (fragment(asks(Middle), 1, b"aa"), true),
        (fragment(flags(Last), 2, b"bb"), true),
    ] {
        let mut rig = Rig::new();
        rig.insert(&fragment(flags(First), 1, b"aa")).unwrap();
        rig.insert(&fragment(flags(Middle), 2, b"bb")).unwrap();
        let inserted = rig.insert(&again);
        assert_eq!(
            inserted == Err(Counter::Duplicate),
            is_duplicate,
            "{again:?}"
        );
        assert_eq!(rig.forgotten(), u64::from(!is_duplicate));
    }
}

#[test]
fn a_fragment_is_awaited_next_after_a_beginning() {
    for (known, next, expected) in [
        (flags(First), fragment(flags(Middle), 8, b"bb"), true),
        (flags(First), fragment(flags(Last), 8, b"bb"), true),
        (flags(First), fragment(flags(First), 8, b"bb"), false),
        (flags(First), fragment(flags(Middle), 9, b"bb"), false),
        (flags(First), fragment(flags(Middle), 7, b"bb"), false),
        (flags(Middle), fragment(flags(Middle), 8, b"bb"), false),
        (flags(Last), fragment(flags(Middle), 8, b"bb"), false),
    ] {
        let mut rig = Rig::new();
        rig.insert(&fragment(known, 7, b"aa")).unwrap();
        assert_eq!(
            rig.reassembly.awaits(&next, LINE),
            expected,
            "{known:?} {next:?}"
        );
        let stranger = Frame {
            source: JausId::new(42, 1, 2),
            ..next
        };
        assert!(!rig.reassembly.awaits(&stranger, LINE));
    }
}

#[test]
fn the_longest_message_is_as_long_as_configured() {
    for (length, is_whole) in [(10, true), (11, false)] {
        let mut rig = Rig::with(Config {
            max_message: 20,
            ..Config::default()
        });
        rig.insert(&fragment(flags(First), 1, &[7; 10])).unwrap();
        let whole = rig.insert(&fragment(flags(Last), 2, &vec![7; length]));
        assert_eq!(whole.is_ok_and(|it| it.is_some()), is_whole);
        assert_eq!(rig.reassembly.cost(), 0);
    }
}

#[test]
fn a_sender_has_at_most_1024_runs() {
    let mut rig = Rig::new();
    for number in 0..1025 {
        assert_eq!(rig.forgotten(), 0);
        rig.insert(&fragment(flags(Middle), 3 * number, b"aa"))
            .unwrap();
        rig.now += Duration::from_millis(1);
    }
    assert_eq!(
        (rig.forgotten(), rig.reassembly.senders[&PEER].runs.len()),
        (1, 1024)
    );
    assert!(
        !rig.reassembly.senders[&PEER]
            .runs
            .contains_key(&((US, None), 0)),
        "the oldest"
    );
}

#[test]
fn fragments_are_kept_while_their_sender_repeats_one() {
    let timeout = Config::default().reassembly_timeout;
    for (repeated, kept) in [(flags(Middle), true), (Flags::default(), false)] {
        let mut rig = Rig::new();
        rig.insert(&fragment(flags(First), 1, b"aa")).unwrap();
        rig.pass(timeout - SECOND);
        rig.reassembly.keep(rig.now, &fragment(repeated, 1, b"aa"));
        rig.pass(SECOND);
        assert_eq!(rig.reassembly.cost() > 0, kept);
        rig.pass(timeout - SECOND);
        assert_eq!((rig.reassembly.cost(), rig.forgotten()), (0, 1));
        assert_eq!(rig.reassembly.next_expiry(), None);
    }
}

#[test]
fn acknowledged_fragments_are_kept_while_their_address_has_something_acknowledged() {
    let timeout = Config::default().reassembly_timeout;
    for (flags, kept) in [(asks(First), true), (flags(First), false)] {
        let mut rig = Rig::new();
        rig.insert(&fragment(flags, 1, b"aa")).unwrap();
        rig.pass(timeout - SECOND);
        rig.reassembly.hear(rig.now, Origin::Line(LinkId(0)));
        rig.pass(SECOND);
        assert_eq!(rig.reassembly.cost() > 0, kept);
        rig.pass(timeout - SECOND);
        assert_eq!(rig.reassembly.cost(), 0);
        assert!(rig.reassembly.heard.is_empty(), "it has no sender any more");
    }
}

#[test]
fn beyond_the_bound_for_all_the_sender_idle_for_longest_goes_first() {
    const COST: usize = 256 + 64 + 2;
    let mut rig = Rig::with(Config {
        max_reassembly: 2 * COST,
        ..Config::default()
    });
    let sources = [1, 2, 3].map(|component| JausId::new(42, 1, component));
    let insert = |rig: &mut Rig, source, sequence| {
        let frame = fragment(flags(First), sequence, b"aa");
        rig.insert(&Frame { source, ..frame }).unwrap();
        rig.now += SECOND;
    };
    insert(&mut rig, sources[0], 1);
    insert(&mut rig, sources[1], 1);
    // The first one is active again.
    let again = Frame {
        source: sources[0],
        ..fragment(flags(First), 1, b"aa")
    };
    rig.reassembly.keep(rig.now, &again);
    insert(&mut rig, sources[2], 1);
    let left = sources.map(|source| rig.reassembly.senders.contains_key(&source));
    assert_eq!((left, rig.forgotten()), ([true, false, true], 1));
    assert_eq!(rig.reassembly.cost(), 2 * COST);
}

#[test]
fn the_next_whole_message_ends_one_of_full_fragments_whose_last_has_its_number() {
    let full = [&[0x01, 0x4B][..], &[7; crate::peer::JAUSPP_FRAGMENT - 2]].concat();
    let short = &full[..100];
    for (data, number, second, ends) in [
        (First, 2, &full[..], true),
        (First, 1, &full, false),
        (First, 3, &full, false),
        (Middle, 2, &full, false),
        (First, 2, short, false),
    ] {
        let mut rig = Rig::new();
        rig.insert(&fragment(flags(data), 1, &full)).unwrap();
        rig.insert(&fragment(flags(Middle), 2, second)).unwrap();
        let next = fragment(flags(DataControl::Single), number, short);
        let whole = rig.reassembly.finish(&next, LINE);
        assert_eq!(whole.is_some(), ends, "{data:?} {number}");
        assert_eq!(rig.reassembly.cost() == 0, ends);
    }
}
