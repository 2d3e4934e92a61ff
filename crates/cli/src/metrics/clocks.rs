//! The metrics of the peers' clocks.

use jaus::address::JausId;
use jaus::service::ClockOffset;

use super::exposition::{Exposition, Unit};

/// Adds the estimates for all peers that have answered.
pub(super) fn add(exposition: &mut Exposition, offsets: &[(JausId, ClockOffset)]) {
    let help = "How far the clock of a peer is ahead of this host's; negative if it is behind.";
    let mut ahead = exposition.gauge("jaus_clock_offset", Unit::Seconds, help);
    for (peer, offset) in offsets {
        ahead.add(&[("peer", peer)], offset.seconds);
    }
    let help = "How far the true offset may differ from jaus_clock_offset_seconds.";
    let mut uncertainty = exposition.gauge("jaus_clock_uncertainty", Unit::Seconds, help);
    for (peer, offset) in offsets {
        uncertainty.add(&[("peer", peer)], offset.uncertainty);
    }
    let help = "Seconds that the clock of a peer gains on this host's per second.";
    let mut drift = exposition.gauge("jaus_clock_drift", Unit::Ratio, help);
    for (peer, offset) in offsets {
        if let Some(value) = offset.drift {
            drift.add(&[("peer", peer)], value.ratio);
        }
    }
    let help = "Steps of the clock of a peer, or of this host's, that its time revealed.";
    let mut steps = exposition.counter("jaus_clock_steps", Unit::None, help);
    for (peer, offset) in offsets {
        steps.add(&[("peer", peer)], offset.steps);
    }
}
