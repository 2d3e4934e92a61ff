//! What one mobility service has to say for itself; all else is the same for all of them.

use super::controls::Controls;
use super::exchange::Exchange;
use jaus::codec::ServiceId;
use jaus::service::{Context, Handled};

/// What is particular to one mobility service.
pub(super) trait Behaviour: Send {
    /// What is offered, the newest version first.
    fn offers(&self) -> Vec<ServiceId>;

    /// Deals with a message that has this code.
    fn handle(&mut self, code: u16, exchange: &mut Exchange<'_, '_>) -> Handled;

    /// The name of a command that moves the vehicle, if this service takes one.
    fn acts_on(&self) -> Option<&'static str> {
        None
    }

    /// The name of a command that sets something up, if this service takes one.
    fn set_up_by(&self) -> Option<&'static str> {
        None
    }

    /// Whether this service tells the end of commands with this code.
    fn tells_end_of(&self, command: u16) -> bool {
        let _ = command;
        false
    }

    /// The vehicle has moved: says which answers are others now.
    fn handle_motion(&mut self, controls: &mut Controls, context: &mut Context<'_>) {
        let _ = (controls, context);
    }

    /// The vehicle has been stopped: what was commanded, or kept in standby, counts no more.
    fn handle_stop(&mut self, controls: &mut Controls, context: &mut Context<'_>) {
        let _ = (controls, context);
    }
}
