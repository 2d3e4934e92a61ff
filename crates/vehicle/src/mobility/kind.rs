//! What the drivers to places differ in: what they drive to, and the messages that speak of it.

use super::exchange::Exchange;
use super::place::Place;
use jaus::codec::{Message, ServiceId};
use jaus::service::{Elements, Handled};

/// One kind of places that a list may hold.
pub(super) trait Kind: Send + 'static {
    /// The service that drives to one after the other.
    const LIST_DRIVER: ServiceId;

    /// Has a list take such places.
    fn accept(elements: &Elements);

    /// Answers the queries for the place. As long as none is set, it is the first one of the list.
    /// If that is of another kind, or there is none at all, there is no answer.
    fn handle_query(code: u16, exchange: &mut Exchange<'_, '_>) -> Handled;
}

/// One kind of waypoints, which can be driven to without a list, too.
pub(super) trait Waypoints: Kind {
    /// The service that drives to one of them.
    const DRIVER: ServiceId;
    /// The message that sets one, in version 1.0.
    type Set: Message + Clone + Into<Place>;
    /// The message that sets one, in version 1.1.
    type SetExt: Message + Clone + Into<Place>;
}
