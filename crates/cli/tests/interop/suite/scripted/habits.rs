//! Differences between known peers, as seen in captures.

/// Protocol behaviour of a peer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Habits {
    /// Its name in discovery.
    pub(super) name: &'static str,
    /// Each datagram is at least as long as the longest one before it to that address; the rest is
    /// stale octets.
    pub(super) leaves_stale_octets: bool,
    /// Message octets per frame.
    pub(super) fragment: usize,
    /// Each fragment begins with the message code; other fragments are not understood.
    pub(super) repeats_code: bool,
    /// How frames are numbered.
    pub(super) numbering: Numbering,
    /// Requests an acknowledgement of messages that it multicasts because it does not know the
    /// peer's address.
    pub(super) insists: bool,
    /// Priorities of its messages, in turn.
    pub(super) priorities: &'static [u8],
    /// Registers its services with the peer that it discovers.
    pub(super) registers: bool,
    /// Queries its events every few seconds.
    pub(super) looks_after_events: bool,
}

/// Source of the sequence numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Numbering {
    /// One counter for all destinations, which starts at this number.
    From(u16),
    /// The same, but fragments are numbered one too high, so that the last fragment and the next
    /// message have the same number.
    OneTooHigh,
    /// One counter per destination.
    PerDestination,
}

/// JAUS++ as of 2012.
pub(super) const JAUSPP: Habits = Habits {
    name: "Scripted",
    leaves_stale_octets: true,
    fragment: 1571,
    repeats_code: true,
    numbering: Numbering::OneTooHigh,
    insists: false,
    priorities: &[1],
    registers: true,
    looks_after_events: true,
};

/// Junior: a transport without services.
pub(super) const JUNIOR: Habits = Habits {
    name: "Scripted",
    leaves_stale_octets: false,
    fragment: 4079,
    repeats_code: false,
    numbering: Numbering::From(1),
    insists: true,
    priorities: &[1, 2, 3],
    registers: false,
    looks_after_events: false,
};

/// The judging tool of a competition.
pub(super) const JUDGE: Habits = Habits {
    name: "Scripted",
    leaves_stale_octets: false,
    fragment: 1425,
    repeats_code: false,
    numbering: Numbering::PerDestination,
    insists: false,
    priorities: &[1],
    registers: false,
    looks_after_events: false,
};

impl Habits {
    /// The behaviour of a peer, by its name on the command line.
    pub(super) fn of(peer: &str) -> Option<Self> {
        match peer {
            "jauspp" => Some(JAUSPP),
            "junior" => Some(JUNIOR),
            "judge" => Some(JUDGE),
            _ => None,
        }
    }
}
