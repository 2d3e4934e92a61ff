//! Observes the controller's messages at the vehicle, and the end of its control.

use std::time::Instant;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::Received;
use jaus::messages::core::RequestControl;

use crate::cell::Driver;
use crate::commands;
use crate::world::SUPERVISOR;

/// Observes the vehicle's messages and its controller.
#[derive(Clone, Debug)]
pub(crate) struct Witness {
    controller: JausId,
    /// Message code of a setpoint: its first two octets.
    setpoint: [u8; 2],
    /// Whether the controller's messages still count. Those after the end of a fault do not.
    counts: bool,
    /// When the vehicle received the controller's last message.
    pub(crate) last_message: Option<Instant>,
    /// When the vehicle received its last setpoint.
    pub(crate) last_setpoint: Option<Instant>,
    /// [The effort that stops the vehicle](commands::stop) next.
    pub(crate) stop: Bytes,
    /// When the vehicle first received it.
    pub(crate) last_stop: Option<Instant>,
    /// When the vehicle received its last Request Control.
    pub(crate) last_request: Option<Instant>,
    /// Whether the controller was in control at the last observation.
    pub(crate) is_held: bool,
    /// When it first lost control.
    pub(crate) freed: Option<Instant>,
    /// When the supervisor got control.
    pub(crate) taken_over: Option<Instant>,
}

impl Witness {
    pub(crate) fn new(driver: Driver, controller: JausId) -> Self {
        let last = commands::motion(driver).pop().expect("at least one");
        Self {
            controller,
            setpoint: [last[0], last[1]],
            counts: true,
            last_message: None,
            last_setpoint: None,
            stop: commands::stop(0),
            last_stop: None,
            last_request: None,
            is_held: false,
            freed: None,
            taken_over: None,
        }
    }

    /// From now on the controller's messages change no deadline.
    pub(crate) fn stop_counting(&mut self) {
        self.counts = false;
    }

    pub(crate) fn note_message(&mut self, now: Instant, message: &Received) {
        if !self.counts || message.source != self.controller {
            return;
        }
        self.last_message = Some(now);
        if message.payload == self.stop {
            self.last_stop.get_or_insert(now);
            return;
        }
        let code = message.payload.get(..2);
        if code == Some(&self.setpoint) {
            self.last_setpoint = Some(now);
        }
        if code == Some(&RequestControl::CODE.to_le_bytes()) {
            self.last_request = Some(now);
        }
    }

    pub(crate) fn note_controller(&mut self, now: Instant, controller: Option<JausId>) {
        let holds = controller == Some(self.controller);
        if self.is_held && !holds {
            self.freed.get_or_insert(now);
        }
        self.is_held = holds;
        if controller == Some(SUPERVISOR) {
            self.taken_over.get_or_insert(now);
        }
    }
}
