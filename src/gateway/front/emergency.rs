//! Emergencies of RA components. Components over OpenJAUS's library say that they are in one, and
//! obey as before: the library keeps the state that it tells apart from the one that it acts upon.
//! So whoever sets an emergency has the component stop by a command that it does obey, and nobody
//! drives it until it says that the emergency is over. Who keeps to the standard stops anyway.

use std::time::Instant;

use bytes::Bytes;

use super::Front;
use super::codes::{STATUS, is_management, needs_control};
use crate::codec::{Message, OutOfRange};
use crate::messages::ra33::{SetTravelSpeed, SetWrenchEffort};
use crate::ra::ids::RaComponent;

/// The primary status code for an emergency.
const EMERGENCY: u8 = 5;

impl Front {
    /// A status has come.
    pub(super) fn heed_status(&mut self, status: &[u8]) {
        self.in_emergency = status.first() == Some(&EMERGENCY);
    }

    /// Whether a command must wait until the emergency is over. If it may be by now, the RA component
    /// is asked.
    pub(super) fn holds_back(&mut self, now: Instant, code: u16) -> bool {
        let held_back = self.in_emergency && needs_control(code) && !is_management(code);
        let known = self.mirror.age(now, STATUS);
        if held_back && known.is_none_or(|age| age >= Self::ASK_AGAIN) {
            self.ask(STATUS);
        }
        held_back
    }

    /// What stops the RA component, besides the emergency.
    pub(super) fn stop(&self) -> Option<(u16, Bytes)> {
        match RaComponent(self.ra.component) {
            RaComponent::PRIMITIVE_DRIVER => said(&no_effort().ok()?),
            RaComponent::GLOBAL_WAYPOINT_DRIVER
            | RaComponent::LOCAL_WAYPOINT_DRIVER
            | RaComponent::GLOBAL_PATH_SEGMENT_DRIVER
            | RaComponent::LOCAL_PATH_SEGMENT_DRIVER => said(&SetTravelSpeed::default()),
            _ => None,
        }
    }
}

/// Nothing that drives, and full brakes.
fn no_effort() -> Result<SetWrenchEffort, OutOfRange> {
    let mut effort = SetWrenchEffort::default();
    effort.set_propulsive_linear_effort_x_percent(0.0)?;
    effort.set_propulsive_linear_effort_y_percent(0.0)?;
    effort.set_propulsive_linear_effort_z_percent(0.0)?;
    effort.set_propulsive_rotational_effort_x_percent(0.0)?;
    effort.set_propulsive_rotational_effort_y_percent(0.0)?;
    effort.set_propulsive_rotational_effort_z_percent(0.0)?;
    effort.set_resistive_linear_effort_x_percent(100.0)?;
    Ok(effort)
}

/// Code and data of a message.
fn said<M: Message>(message: &M) -> Option<(u16, Bytes)> {
    let payload = message.encode().ok()?;
    Some((M::CODE, payload.slice(2..)))
}
