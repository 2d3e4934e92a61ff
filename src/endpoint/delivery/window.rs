//! The congestion window of one destination, counted in packets: slow start, then additive increase
//! and multiplicative decrease.
//!
//! No receiver announces its capacity, so the window probes it by loss: Junior reads ten datagrams
//! per millisecond from a buffer that holds some twenty of its full ones, a node on a slow line
//! less, a node on the same host some hundreds.
//!
//! A radio loses packets at random, and a smaller window does not help. So a loss shrinks the
//! window only if the round trip has grown, because packets are queueing somewhere, or if a large
//! share of a window was lost.

/// The smallest window: with one packet, every loss would wait for the timeout.
const LEAST: usize = 2;

/// A higher loss rate, in percent, is not random.
const MOST_LOST: usize = 20;
/// Losses are counted over one window, but over at least this many packets.
const LEAST_COUNT: usize = 64;

/// The window of one destination.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Window {
    packets: usize,
    initial: usize,
    most: usize,
    /// Growth is slow above this.
    threshold: usize,
    /// Acknowledgements since the last step of slow growth.
    answered: usize,
    /// Packets sent before this one belong to a loss already handled.
    recovery: u64,
    /// The packet with which the next loss count begins.
    next_count: u64,
    losses: usize,
}

impl Window {
    /// Creates a window of `initial` packets that never exceeds `most`.
    pub(super) fn new(initial: usize, most: usize) -> Self {
        let most = most.max(LEAST);
        let initial = initial.clamp(LEAST, most);
        Self {
            packets: initial,
            initial,
            most,
            threshold: most,
            ..Self::default()
        }
    }

    /// How many packets may be in flight.
    pub(super) fn packets(&self) -> usize {
        self.packets
    }

    /// Handles the acknowledgement of the `order`th packet sent, while `in_flight` were in flight.
    pub(super) fn grow(&mut self, order: u64, in_flight: usize) {
        self.begin_count(order);
        // An unused window proves nothing.
        if order < self.recovery || in_flight * 2 < self.packets {
            return;
        }
        self.answered += 1;
        if self.packets < self.threshold || self.answered >= self.packets {
            self.answered = 0;
            self.packets = (self.packets + 1).min(self.most);
        }
    }

    /// Handles the loss of the `order`th packet sent, after `sent` packets in total; `is_queued`
    /// says whether packets are queueing. Losses within one round trip count once.
    pub(super) fn lose(&mut self, order: u64, sent: u64, is_queued: bool) {
        self.begin_count(order);
        self.losses += 1;
        let is_chance = self.losses * 100 <= self.count() * MOST_LOST;
        if order < self.recovery || (is_chance && !is_queued) {
            return;
        }
        self.recovery = sent;
        self.packets = (self.packets * 7 / 10).max(LEAST);
        self.threshold = self.packets;
        self.answered = 0;
    }

    fn begin_count(&mut self, order: u64) {
        if order >= self.next_count {
            self.next_count = order + self.count() as u64;
            self.losses = 0;
        }
    }

    /// Over how many packets losses are counted.
    fn count(&self) -> usize {
        self.packets.max(LEAST_COUNT)
    }

    /// Restarts from the smallest window after a timeout. If `has_proven`, because acknowledgements
    /// have arrived before, growth is fast up to half the former size.
    pub(super) fn collapse(&mut self, sent: u64, has_proven: bool) {
        if has_proven && self.packets > LEAST {
            self.threshold = (self.packets / 2).max(LEAST);
        }
        self.recovery = sent;
        self.packets = LEAST;
        self.answered = 0;
    }

    /// Falls back to the initial window after a pause: the measured size is out of date.
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
        window.lose(20, 48, true);
        window.lose(30, 48, true);
        assert_eq!(window.packets(), 22, "losses of one round count once");
        window.grow(47, 22);
        assert_eq!(window.packets(), 22, "sent before the loss was known");
        (48..48 + 22).for_each(|order| window.grow(order, 22));
        assert_eq!(window.packets(), 23);
        window.collapse(80, true);
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
        (0..100).for_each(|order| window.lose(order * 100, order * 100 + 1, true));
        assert_eq!(window.packets(), LEAST);
    }

    #[test]
    fn a_loss_now_and_then_shrinks_nothing_unless_packets_queue_up() {
        let mut window = Window::new(100, 100);
        for order in 0..1000 {
            match order % 10 {
                0 => window.lose(order, order + 100, false),
                _ => window.grow(order, 100),
            }
        }
        assert_eq!(window.packets(), 100);
        window.lose(1000, 1100, true);
        assert_eq!(window.packets(), 70);
    }

    #[test]
    fn many_losses_shrink_the_window_once_each_round() {
        let mut window = Window::new(100, 100);
        for order in 0..100 {
            match order % 3 {
                0 => window.lose(order, 100, false),
                _ => window.grow(order, 100),
            }
        }
        assert_eq!(window.packets(), 70);
    }

    #[test]
    fn a_window_of_which_half_is_used_grows() {
        let mut window = Window::new(16, 100);
        window.grow(0, 7);
        assert_eq!(window.packets(), 16);
        window.grow(1, 8);
        assert_eq!(window.packets(), 17);
    }

    #[test]
    fn losses_shrink_the_window_from_a_fifth_of_the_packets_over_which_they_are_counted() {
        let mut window = Window::new(16, 100);
        let lose = |window: &mut Window, orders: std::ops::Range<u64>| {
            orders.for_each(|order| window.lose(order, 200, false));
            window.packets()
        };
        assert_eq!(lose(&mut window, 0..12), 16, "of 64");
        assert_eq!(lose(&mut window, 64..76), 16, "a new count");
        assert_eq!(lose(&mut window, 76..77), 11);
    }

    #[test]
    fn after_a_timeout_growth_is_fast_to_half_the_proven_size_or_to_the_most() {
        for (has_proven, expected) in [(true, 8), (false, 12)] {
            let mut window = Window::new(16, 100);
            window.collapse(5, has_proven);
            (0..5).for_each(|order| window.grow(order, 100));
            assert_eq!(window.packets(), LEAST, "sent before the timeout");
            (5..15).for_each(|order| window.grow(order, 100));
            assert_eq!(window.packets(), expected);
        }
    }

    #[test]
    fn after_a_pause_growth_is_fast_to_the_former_size() {
        let mut window = Window::new(16, 100);
        (0..16).for_each(|order| window.grow(order, 32));
        window.lose(20, 20, true);
        (20..42).for_each(|order| window.grow(order, 32));
        assert_eq!(window.packets(), 23);
        window.rest();
        assert_eq!(window.packets(), 16);
        (42..49).for_each(|order| window.grow(order, 32));
        assert_eq!(window.packets(), 23);
        window.grow(49, 32);
        assert_eq!(window.packets(), 23);
    }
}
