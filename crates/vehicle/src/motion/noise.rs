//! Reproducible noise of simulated sensors.

use jaus::random::Random;

/// Normally distributed noise.
#[derive(Debug, Clone)]
pub(crate) struct Noise(Random);

impl Noise {
    pub(crate) const fn new(seed: u64) -> Self {
        Self(Random::new(seed))
    }

    /// An approximately normal number with standard deviation 1, within ±6: the sum of twelve
    /// uniform ones.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.0.unit()).sum::<f64>() - 6.0
    }
}
