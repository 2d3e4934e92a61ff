//! From octets of a terminal to a push of the stick, with the dead-man rule.

use std::time::{Duration, Instant};

use jaus_ocu::stick::Push;

/// A key of the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Key {
    Ahead,
    Back,
    Left,
    Right,
    Stop,
    Emergency,
    Clear,
    Resume,
    Quit,
}

/// Reads keys from the octets of a terminal. An arrow has three octets, which may come in parts.
#[derive(Debug, Default)]
pub(super) struct Decoder {
    /// Octets of an arrow so far.
    sequence: u8,
}

impl Decoder {
    pub(super) fn key(&mut self, octet: u8) -> Option<Key> {
        let sequence = std::mem::take(&mut self.sequence);
        match (sequence, octet) {
            (_, 0x1B) => self.sequence = 1,
            (1, b'[' | b'O') => self.sequence = 2,
            (2, b'A') => return Some(Key::Ahead),
            (2, b'B') => return Some(Key::Back),
            (2, b'C') => return Some(Key::Right),
            (2, b'D') => return Some(Key::Left),
            // The rest of another key's sequence, such as `5~`.
            (2, b'0'..=b'9' | b';') => self.sequence = 2,
            (2, _) => {}
            (_, b' ') => return Some(Key::Stop),
            (_, b'e') => return Some(Key::Emergency),
            (_, b'c') => return Some(Key::Clear),
            (_, b'r') => return Some(Key::Resume),
            // Ctrl-C and Ctrl-D, where the terminal passes them on.
            (_, b'q' | 0x03 | 0x04) => return Some(Key::Quit),
            _ => {}
        }
        None
    }
}

/// The pressed arrows. Each holds until the dead-man time has passed since it last came.
#[derive(Debug)]
pub(super) struct Arrows {
    /// The shares of the full effort, from 0 to 1.
    forward: f64,
    turn: f64,
    /// The last arrow of each axis: its sign, and when it came.
    ahead: Option<(f64, Instant)>,
    right: Option<(f64, Instant)>,
}

impl Arrows {
    /// Without a key for this time, the vehicle stops.
    pub(super) const DEAD_MAN: Duration = Duration::from_millis(500);

    pub(super) const fn new(forward: f64, turn: f64) -> Self {
        Self {
            forward,
            turn,
            ahead: None,
            right: None,
        }
    }

    /// Handles a key. Those that are no arrows release all arrows.
    pub(super) fn handle_key(&mut self, now: Instant, key: Key) {
        match key {
            Key::Ahead => self.ahead = Some((1.0, now)),
            Key::Back => self.ahead = Some((-1.0, now)),
            Key::Right => self.right = Some((1.0, now)),
            Key::Left => self.right = Some((-1.0, now)),
            _ => (self.ahead, self.right) = (None, None),
        }
    }

    /// The push at this time.
    pub(super) fn push(&self, now: Instant) -> Push {
        let sign = |arrow: Option<(f64, Instant)>| match arrow {
            Some((sign, since)) if now < since + Self::DEAD_MAN => sign,
            _ => 0.0,
        };
        let push = Push::new(
            sign(self.ahead) * self.forward,
            sign(self.right) * self.turn,
        );
        push.unwrap_or(Push::NONE)
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    fn keys(octets: &[u8]) -> Vec<Key> {
        let mut decoder = Decoder::default();
        octets.iter().filter_map(|&it| decoder.key(it)).collect()
    }

    #[test]
    fn arrows_and_letters_are_read_and_other_keys_do_nothing() {
        let read = keys(b"\x1b[A\x1bOB\x1b[C\x1b[D ecrq");
        let arrows = [Key::Ahead, Key::Back, Key::Right, Key::Left];
        let others = [
            Key::Stop,
            Key::Emergency,
            Key::Clear,
            Key::Resume,
            Key::Quit,
        ];
        assert_eq!(read, [&arrows[..], &others].concat());
        // Page up, F5, Ctrl-right, letters without a meaning; then an escape before an arrow.
        assert_eq!(keys(b"\x1b[5~\x1b[15~xyz"), []);
        assert_eq!(keys(b"\x1b\x1b[A"), [Key::Ahead]);
    }

    #[test]
    fn an_arrow_holds_for_half_a_second_and_each_axis_on_its_own() {
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        let mut arrows = Arrows::new(0.5, 0.25);
        assert_eq!(arrows.push(start), Push::NONE);
        arrows.handle_key(start, Key::Ahead);
        arrows.handle_key(at(300), Key::Left);
        assert_eq!(Some(arrows.push(at(499))), Push::new(0.5, -0.25));
        assert_eq!(Some(arrows.push(at(500))), Push::new(0.0, -0.25));
        assert_eq!(arrows.push(at(800)), Push::NONE);
    }

    #[test]
    fn every_other_key_stops() {
        let start = Instant::now();
        for key in [
            Key::Stop,
            Key::Emergency,
            Key::Clear,
            Key::Resume,
            Key::Quit,
        ] {
            let mut arrows = Arrows::new(1.0, 1.0);
            arrows.handle_key(start, Key::Ahead);
            arrows.handle_key(start, key);
            assert_eq!(arrows.push(start), Push::NONE, "{key:?}");
        }
    }
}
