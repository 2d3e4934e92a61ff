//! Seeded pseudorandom choices.

use std::ops::Range;
use std::time::Duration;

/// A generator of pseudorandom choices.
pub struct Random(jaus::random::Random);

impl Random {
    /// A generator with this seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(jaus::random::Random::new(seed))
    }

    /// The next 64-bit number.
    pub fn number(&mut self) -> u64 {
        self.0.number()
    }

    /// A number below `end`, which is not 0.
    pub fn below(&mut self, end: usize) -> usize {
        (self.number() % end as u64) as usize
    }

    /// One of the choices.
    pub fn choose<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    /// True with a probability of `of_1000` in 1000.
    pub fn happens(&mut self, of_1000: u32) -> bool {
        self.number() % 1000 < u64::from(of_1000)
    }

    /// A duration within the range.
    pub fn between(&mut self, range: &Range<Duration>) -> Duration {
        let spread = (range.end - range.start).as_nanos().max(1) as u64;
        range.start + Duration::from_nanos(self.number() % spread)
    }

    /// A duration of up to `millis` milliseconds.
    pub fn up_to_millis(&mut self, millis: u64) -> Duration {
        self.between(&(Duration::ZERO..Duration::from_millis(millis.max(1))))
    }
}
