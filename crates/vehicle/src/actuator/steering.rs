//! Steering of the front wheels: the trait [`Steering`] and a simulated servo.

use std::time::{Duration, Instant};

use super::FaultSwitch;

/// Turns the front wheels to an angle.
///
/// It needs no deadline of its own: wheels that keep their angle move nothing. The drive stops.
pub trait Steering: Send {
    /// Advances to time `now`: a simulation integrates, real hardware is read back.
    fn handle_time(&mut self, now: Instant);

    /// Sets the angle to turn to, in radians, right positive.
    fn steer(&mut self, angle: f64);

    /// The current angle in radians, measured or estimated.
    fn angle(&self) -> f64;

    /// The fault that prevents steering, as text for the operator; `None` without a fault. A fault
    /// is reported until it is cleared.
    fn fault(&self) -> Option<String> {
        None
    }
}

impl<S: Steering + ?Sized> Steering for Box<S> {
    fn handle_time(&mut self, now: Instant) {
        (**self).handle_time(now);
    }

    fn steer(&mut self, angle: f64) {
        (**self).steer(angle);
    }

    fn angle(&self) -> f64 {
        (**self).angle()
    }

    fn fault(&self) -> Option<String> {
        (**self).fault()
    }
}

/// A simulated steering servo that turns at a constant rate.
#[derive(Debug, Clone)]
pub struct SimulatedServo {
    /// In radians per second.
    rate: f64,
    setpoint: f64,
    angle: f64,
    switch: FaultSwitch,
    time: Option<Instant>,
}

impl SimulatedServo {
    /// Rate of a small servo in radians per second.
    pub const RATE: f64 = 2.0;
    /// The longest time simulated in one call. Longer gaps are truncated.
    const LONGEST_GAP: Duration = Duration::from_millis(100);

    /// Creates a servo that points straight ahead and turns at `rate` radians per second.
    #[must_use]
    pub fn new(rate: f64) -> Self {
        Self {
            rate,
            setpoint: 0.0,
            angle: 0.0,
            switch: FaultSwitch::default(),
            time: None,
        }
    }

    /// The switch that injects faults into this servo.
    #[must_use]
    pub fn fault_switch(&self) -> FaultSwitch {
        self.switch.clone()
    }
}

impl Steering for SimulatedServo {
    fn handle_time(&mut self, now: Instant) {
        let before = self.time.replace(now).unwrap_or(now);
        let gap = now.saturating_duration_since(before);
        if self.fault().is_none() {
            let most = self.rate * gap.min(Self::LONGEST_GAP).as_secs_f64();
            self.angle += (self.setpoint - self.angle).clamp(-most, most);
        }
    }

    fn steer(&mut self, angle: f64) {
        if angle.is_finite() {
            self.setpoint = angle;
        }
    }

    fn angle(&self) -> f64 {
        self.angle
    }

    fn fault(&self) -> Option<String> {
        self.switch.fault()
    }
}
