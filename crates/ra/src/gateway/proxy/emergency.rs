//! Emergency and standby of RA components. Components over OpenJAUS's library report both, and obey
//! as before: the library keeps the state that it reports apart from the one that it acts upon. So
//! the gateway stops the component by a command that it does obey, and gives it no driving command
//! until it reports that the emergency is over, or its client has sent Resume. A component that keeps
//! to the standard stops anyway. As a JAUS component with Management, a driver is in standby after
//! control was granted: a client that merely renews what an earlier gateway granted does not drive.

use std::time::Instant;

use bytes::Bytes;

use super::Proxy;
use super::codes::{
    CLEAR_EMERGENCY, RESET, RESUME, SET_EMERGENCY, SHUTDOWN, STANDBY, STATUS, is_management,
    needs_control,
};
use super::ready::status;
use crate::gateway::counters::Counter;

/// The primary status code for an emergency.
const EMERGENCY: u8 = 5;
/// Those for ready and standby.
const READY: u8 = 1;
const STANDBY_STATE: u8 = 2;

impl Proxy {
    /// A status as JAUS clients are told it: a component that is being reclaimed initializes, and one
    /// that reports ready to a client that has not sent Resume is in standby.
    pub(super) fn shown_status(&mut self, report: u16, data: Bytes) -> Bytes {
        if report != STATUS {
            return data;
        }
        self.in_emergency = data.first() == Some(&EMERGENCY);
        self.in_standby |= self.in_emergency && self.lease.controller().is_some();
        if self.lease.is_reclaiming() {
            return status(false);
        }
        let mut shown = data.to_vec();
        if let Some(state) = shown.first_mut().filter(|state| **state == READY)
            && self.in_standby
        {
            *state = STANDBY_STATE;
        }
        shown.into()
    }

    /// Why a command may not be given to the RA component now, if so. If an emergency may be over by
    /// now, the RA component is asked.
    pub(super) fn holds_back(&mut self, now: Instant, code: u16) -> Option<Counter> {
        if !needs_control(code) || is_management(code) {
            return None;
        }
        if self.in_emergency {
            let known = self.mirror.age(now, STATUS);
            if known.is_none_or(|age| age >= Self::ASK_AGAIN) {
                self.ask(STATUS);
            }
            return Some(Counter::InEmergency);
        }
        self.in_standby.then_some(Counter::InStandby)
    }

    /// Stops the RA component when its client sends it to another state.
    pub(super) fn heed_management(&mut self, code: u16) {
        match code {
            // Whether it is over, the next status tells.
            CLEAR_EMERGENCY => return self.in_emergency = false,
            RESUME => return self.in_standby &= self.in_emergency,
            SHUTDOWN | STANDBY | RESET | SET_EMERGENCY => {}
            _ => return,
        }
        self.in_standby = self.lease.controller().is_some();
        self.stop();
    }
}
