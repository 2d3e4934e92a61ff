//! The trait that each mobility service implements. Everything else is common to all of them.

use super::controls::Controls;
use super::exchange::Exchange;
use jaus::codec::ServiceId;
use jaus::service::{Context, Handled};

/// The specific part of a mobility service.
pub(super) trait Behaviour: Send {
    /// The services offered, newest version first.
    fn offers(&self) -> Vec<ServiceId>;

    /// Handles a message with this code.
    fn handle(&mut self, code: u16, exchange: &mut Exchange<'_, '_>) -> Handled;

    /// Name of a command that moves the vehicle, if this service accepts one.
    fn acts_on(&self) -> Option<&'static str> {
        None
    }

    /// Name of a configuration command, if this service accepts one.
    fn set_up_by(&self) -> Option<&'static str> {
        None
    }

    /// Whether this service reports the completion of commands with this code.
    fn tells_end_of(&self, command: u16) -> bool {
        let _ = command;
        false
    }

    /// Handles a motion update by announcing the changed reports.
    fn handle_motion(&mut self, controls: &mut Controls, context: &mut Context<'_>) {
        let _ = (controls, context);
    }

    /// Handles the end of a client's control, which is a stop as well: what it has set for its own commands is
    /// void.
    fn handle_control_end(&mut self, controls: &mut Controls) {
        let _ = controls;
    }

    /// Handles a stop of the vehicle: active and standby commands become void.
    fn handle_stop(&mut self, controls: &mut Controls, context: &mut Context<'_>) {
        let _ = (controls, context);
    }
}
