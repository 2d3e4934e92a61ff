//! How many packets may be on their way to one destination: slow start, then additive increase and
//! multiplicative decrease, counted in packets.
//!
//! What a receiver can take is nowhere stated and so found by loss: Junior takes ten datagrams a
//! millisecond from a buffer that holds some twenty of its full ones, a node on a slow line less, a
//! node on the same host some hundreds.

/// Fewer are never allowed: a window of one would wait for the timer after each loss.
const LEAST: usize = 2;

/// The window of one destination.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    packets: usize,
    initial: usize,
    most: usize,
    /// Above this growth is slow.
    threshold: usize,
    /// Answers since the last step of slow growth.
    answered: usize,
    /// What was sent before this belongs to a loss that has been reacted to.
    recovery: u64,
}

impl Window {
    /// A window that begins with `initial` packets and never has more than `most`.
    pub(super) fn new(initial: usize, most: usize) -> Self {
        let most = most.max(LEAST);
        let initial = initial.clamp(LEAST, most);
        Self {
            packets: initial,
            initial,
            most,
            threshold: most,
            answered: 0,
            recovery: 0,
        }
    }

    /// How many packets may be on their way.
    pub(super) fn packets(&self) -> usize {
        self.packets
    }

    /// A packet that was the `order`th sent was answered while `in_flight` were on their way.
    pub(super) fn grow(&mut self, order: u64, in_flight: usize) {
        // A window that is not made use of proves nothing.
        if order < self.recovery || in_flight * 2 < self.packets {
            return;
        }
        self.answered += 1;
        if self.packets < self.threshold || self.answered >= self.packets {
            self.answered = 0;
            self.packets = (self.packets + 1).min(self.most);
        }
    }

    /// The packet that was the `order`th sent was lost, and `sent` were sent so far. Losses in one
    /// round trip count once.
    pub(super) fn shrink(&mut self, order: u64, sent: u64) {
        if order < self.recovery {
            return;
        }
        self.recovery = sent;
        self.packets = (self.packets * 7 / 10).max(LEAST);
        self.threshold = self.packets;
        self.answered = 0;
    }

    /// Nothing was answered in time: begins anew, and grows fast to half of what it was.
    pub(super) fn collapse(&mut self, sent: u64) {
        if self.packets > LEAST {
            self.threshold = (self.packets / 2).max(LEAST);
        }
        self.recovery = sent;
        self.packets = LEAST;
        self.answered = 0;
    }

    /// Nothing was sent for a while, so what was found out is stale.
    pub(super) fn rest(&mut self) {
        self.threshold = self.threshold.max(self.packets);
        self.packets = self.packets.min(self.initial);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_window_doubles_each_round_until_a_loss_and_then_grows_by_one_each_round() {
        let mut window = Window::new(16, 1000);
        (0..16).for_each(|order| window.grow(order, 16));
        assert_eq!(window.packets(), 32);
        window.shrink(20, 48);
        window.shrink(30, 48);
        assert_eq!(window.packets(), 22, "losses of one round count once");
        window.grow(47, 22);
        assert_eq!(window.packets(), 22, "sent before the loss was known");
        (48..48 + 22).for_each(|order| window.grow(order, 22));
        assert_eq!(window.packets(), 23);
        window.collapse(80);
        assert_eq!(window.packets(), LEAST);
        (80..89).for_each(|order| window.grow(order, 20));
        assert_eq!(window.packets(), 11, "fast up to half of what it was");
    }

    #[test]
    fn the_window_has_bounds_and_does_not_grow_unused() {
        let mut window = Window::new(16, 20);
        (0..10).for_each(|order| window.grow(order, 3));
        assert_eq!(window.packets(), 16);
        (0..100).for_each(|order| window.grow(order, 20));
        assert_eq!(window.packets(), 20);
        (0..100).for_each(|order| window.shrink(order * 100, order * 100 + 1));
        assert_eq!(window.packets(), LEAST);
    }
}
