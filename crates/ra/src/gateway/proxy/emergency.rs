//! Emergency and standby of RA components. Components based on OpenJAUS's library report both
//! states but keep obeying commands: the library separates the reported state from the effective
//! one. The gateway therefore stops the component with a command that it does obey, and sends no
//! driving command until it reports the end of the emergency or its client has sent Resume. A
//! component that follows the standard stops anyway. Like a JAUS component with Management, a
//! driver is in standby after a grant of control: a client that merely renews control from an
//! earlier gateway does not drive.

use std::time::Instant;

use bytes::Bytes;

use super::Proxy;
use super::codes::{
    CLEAR_EMERGENCY, RESET, RESUME, SET_EMERGENCY, SHUTDOWN, STANDBY, STATUS, is_management,
    needs_control,
};
use super::ready::status;
use crate::gateway::counters::Counter;

/// Primary status code of the emergency state.
const EMERGENCY: u8 = 5;
/// Primary status codes of the ready and standby states.
const READY: u8 = 1;
const STANDBY_STATE: u8 = 2;

impl Proxy {
    /// The status reported to JAUS clients: initialize while the component is being reclaimed, and
    /// standby instead of ready until its client has sent Resume.
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

    /// The reason to refuse a command to the RA component now, if any. If the emergency may be
    /// over, the RA component's status is queried.
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

    /// Stops the RA component when its client changes its state.
    pub(super) fn heed_management(&mut self, code: u16) {
        match code {
            // The next status report shows whether the emergency is over.
            CLEAR_EMERGENCY => return self.in_emergency = false,
            RESUME => return self.in_standby &= self.in_emergency,
            SHUTDOWN | STANDBY | RESET | SET_EMERGENCY => {}
            _ => return,
        }
        self.in_standby = self.lease.controller().is_some();
        self.stop();
    }
}
