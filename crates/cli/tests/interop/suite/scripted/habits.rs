//! Differences between known peers, as seen in captures.

/// How a peer speaks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Habits {
    /// What it is called in the network.
    pub(super) name: &'static str,
    /// Each datagram is as long as the longest before it, filled with what that had.
    pub(super) leaves_stale_octets: bool,
    /// Octets of a message in one frame.
    pub(super) fragment: usize,
    /// Each fragment begins with the message code, and others are not understood.
    pub(super) repeats_code: bool,
    /// How frames are numbered.
    pub(super) numbering: Numbering,
    /// Whom it does not know it reaches by multicast, and wants an acknowledgement for that.
    pub(super) insists: bool,
    /// Priorities that its messages have in turn.
    pub(super) priorities: &'static [u8],
    /// Tells its services to everybody who tells who they are.
    pub(super) registers: bool,
    /// Asks every few seconds what has become of its events.
    pub(super) looks_after_events: bool,
}

/// Where the numbers of frames come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Numbering {
    /// One counter for all, which begins with this at each start.
    From(u16),
    /// The same, but fragments are numbered one too high, so that the last of them and the next
    /// message have the same number.
    OneTooHigh,
    /// A counter for each destination.
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
    /// Those of a peer, by its name on the command line.
    pub(super) fn of(peer: &str) -> Option<Self> {
        match peer {
            "jauspp" => Some(JAUSPP),
            "junior" => Some(JUNIOR),
            "judge" => Some(JUDGE),
            _ => None,
        }
    }
}
