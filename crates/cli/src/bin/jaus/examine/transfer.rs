//! A large message in transfer to the peer, fragment by fragment.

use std::time::Duration;

use jaus::wire::Frame;

/// Maximum fragments in transit: the capacity of the smallest known receive buffers.
const WINDOW: usize = 8;
/// Retransmission timeout of a fragment.
const AGAIN: Duration = Duration::from_millis(250);

/// A large message in transfer to the peer.
#[derive(Debug)]
pub(super) struct Transfer {
    pub(super) parts: Vec<Part>,
    /// Number of messages received before its start.
    pub(super) since: usize,
}

/// One of its fragments.
#[derive(Debug)]
pub(super) struct Part {
    pub(super) frame: Frame,
    pub(super) sent: Option<Duration>,
    pub(super) acknowledged: bool,
}

impl Transfer {
    pub(super) fn new(frames: Vec<Frame>, since: usize) -> Self {
        let part = |frame| Part {
            frame,
            sent: None,
            acknowledged: false,
        };
        Self {
            parts: frames.into_iter().map(part).collect(),
            since,
        }
    }

    /// Number of acknowledged fragments.
    pub(super) fn done(&self) -> usize {
        self.parts.iter().filter(|part| part.acknowledged).count()
    }

    pub(super) fn take(&mut self, sequence: u16) {
        let part = self
            .parts
            .iter_mut()
            .find(|part| part.frame.sequence == sequence);
        if let Some(part) = part {
            part.acknowledged = true;
        }
    }

    /// The fragments to send now: new ones, and retransmissions.
    pub(super) fn due(&mut self, now: Duration) -> Vec<Frame> {
        let open = self.parts.iter_mut().filter(|part| !part.acknowledged);
        let mut due = Vec::new();
        for part in open.take(WINDOW) {
            if part.sent.is_none_or(|sent| now >= sent + AGAIN) {
                part.sent = Some(now);
                due.push(part.frame.clone());
            }
        }
        due
    }
}
