//! The links between browser and station, and the limits that hold over them.

use std::time::Duration;

use super::bed::{BothWays, CLEAR};
use super::relay::Conditions;

/// Motion ends within this after the last sign of life, plus the one-way delay.
pub(crate) const DEAD_MAN: Duration = Duration::from_millis(500);
/// An emergency stop acts within this, plus the one-way delay and the time of its octets on the link.
const EMERGENCY: Duration = Duration::from_millis(300);
/// Octets of an emergency stop on the link, with all headers.
const EMERGENCY_OCTETS: f64 = 200.0;

/// A link between browser and station.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Link {
    pub(crate) name: &'static str,
    pub(crate) conditions: BothWays,
    /// When the link becomes so.
    pub(crate) begins: Begins,
    /// Whether nobody may drive over it.
    pub(crate) is_refused: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Begins {
    /// Before the page is opened.
    First,
    /// Before something is held.
    BeforeHolding,
    /// While the vehicle is driven.
    WhileDriving,
    /// With the event.
    WithEvent,
}

const fn delayed(millis: u64) -> BothWays {
    let delay = Duration::from_millis(millis);
    [Conditions {
        delay,
        ..Conditions::CLEAR
    }; 2]
}

const fn lossy(loss: u32, jitter: u64) -> BothWays {
    let jitter = Duration::from_millis(jitter);
    [Conditions {
        loss,
        jitter,
        ..Conditions::CLEAR
    }; 2]
}

const SLOW: Conditions = Conditions {
    rate: Some(400.0),
    ..Conditions::CLEAR
};

impl Link {
    pub(crate) const DIRECT: Self = Self::new("0", CLEAR, Begins::First);
    pub(crate) const DELAYED: Self = Self::new("0.3 s", delayed(300), Begins::First);
    pub(crate) const SLOW: Self = Self::new("400 octets/s", [SLOW; 2], Begins::WhileDriving);
    /// The way back is free: the picture stays fresh.
    pub(crate) const SLOW_UP: Self = Self::new(
        "400 octets/s up",
        [SLOW, Conditions::CLEAR],
        Begins::WhileDriving,
    );
    pub(crate) const LOSSY: Self = Self::new("5 % loss", lossy(50, 30), Begins::BeforeHolding);
    pub(crate) const VERY_LOSSY: Self =
        Self::new("30 % loss", lossy(300, 50), Begins::BeforeHolding);
    pub(crate) const CUT: Self = Self::new("cut", [Conditions::CUT; 2], Begins::WithEvent);
    pub(crate) const ALL: [Self; 7] = [
        Self::DIRECT,
        Self::DELAYED,
        Self::SLOW_UP,
        Self::SLOW,
        Self::LOSSY,
        Self::VERY_LOSSY,
        Self::CUT,
    ];
    /// Links that are too slow to drive over.
    pub(crate) const REFUSED: [Self; 4] = [
        Self::new("0.8 s", delayed(800), Begins::BeforeHolding).refused(),
        Self::new("1.5 s", delayed(1500), Begins::BeforeHolding).refused(),
        Self::new("0.8 s later", delayed(800), Begins::WhileDriving).refused(),
        Self::new("1.5 s later", delayed(1500), Begins::WhileDriving).refused(),
    ];

    const fn new(name: &'static str, conditions: BothWays, begins: Begins) -> Self {
        Self {
            name,
            conditions,
            begins,
            is_refused: false,
        }
    }

    const fn refused(self) -> Self {
        Self {
            is_refused: true,
            ..self
        }
    }

    /// Whether it loses packets while something is driven over it: that may end a drive at any time.
    pub(crate) fn is_lossy(&self) -> bool {
        self.conditions_before_event().iter().any(|it| it.loss > 0)
    }

    /// Whether a vehicle must be drivable over it all the time.
    pub(crate) fn is_free(&self) -> bool {
        let is_slow = self
            .conditions_before_event()
            .iter()
            .any(|it| it.rate.is_some());
        !self.is_refused && !is_slow && !self.is_lossy()
    }

    /// The longest time that a packet is under way when the link is free.
    pub(crate) fn one_way(&self) -> Duration {
        self.conditions[0].delay + self.conditions[0].jitter
    }

    pub(crate) fn round_trip(&self) -> Duration {
        self.conditions.iter().map(|it| it.delay + it.jitter).sum()
    }

    /// The longest time of 99 in 100 emergency stops over a link that loses packets: they may be sent twice.
    pub(crate) fn repeated_limit(&self) -> Duration {
        self.one_way() + 2 * (self.round_trip() + Duration::from_millis(200))
    }

    /// The conditions between the start of the drive and the event.
    pub(crate) fn conditions_before_event(&self) -> BothWays {
        if self.begins == Begins::WithEvent {
            CLEAR
        } else {
            self.conditions
        }
    }

    /// The longest time in which a drive ends after the last sign of life.
    pub(crate) fn dead_man_limit(&self) -> Duration {
        DEAD_MAN + self.one_way()
    }

    /// The longest time in which an emergency stop acts. Over a link that loses packets or is cut, the dead-man is sooner
    /// than its repetition.
    pub(crate) fn emergency_limit(&self) -> Duration {
        if self.is_lossy() || self.begins == Begins::WithEvent {
            return self.dead_man_limit();
        }
        let rate = self.conditions[0].rate;
        let sent = rate.map_or(0.0, |it| EMERGENCY_OCTETS / it);
        self.one_way() + Duration::from_secs_f64(sent) + EMERGENCY
    }
}
