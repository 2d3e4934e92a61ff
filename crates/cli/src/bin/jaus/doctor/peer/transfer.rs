//! A large message on its way to the peer, fragment by fragment.

use std::time::Duration;

use jaus::wire::Frame;

/// Fragments that may be on their way: what the smallest known receive buffers hold.
const WINDOW: usize = 8;
/// When a fragment that was not acknowledged is sent again.
const AGAIN: Duration = Duration::from_millis(250);

/// A large message on its way to the peer.
#[derive(Debug)]
pub(super) struct Transfer {
    pub(super) parts: Vec<Part>,
    /// How much had been heard when it began.
    pub(super) since: usize,
}

/// One fragment of it.
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

    /// How many parts have been acknowledged.
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

    /// What is to be sent now: the next ones, and those that were not acknowledged in time.
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
