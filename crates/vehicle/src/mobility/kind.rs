//! Traits for the kinds of places that drivers accept: their services and messages.

use super::exchange::Exchange;
use super::place::Place;
use jaus::codec::{Message, ServiceId};
use jaus::service::{Elements, Handled};

/// A kind of place that a list may hold.
pub(super) trait Kind: Send + 'static {
    /// The list driver service for this kind.
    const LIST_DRIVER: ServiceId;

    /// Registers this kind with a list.
    fn accept(elements: &Elements);

    /// Answers queries for the place. Until one is set, the first place of the list is reported.
    /// There is no reply if that is of another kind or the list is empty.
    fn handle_query(code: u16, exchange: &mut Exchange<'_, '_>) -> Handled;
}

/// A kind of waypoint, which can also be set without a list.
pub(super) trait Waypoints: Kind {
    /// The service that drives to a single waypoint of this kind.
    const DRIVER: ServiceId;
    /// The message that sets a waypoint, version 1.0.
    type Set: Message + Clone + Into<Place>;
    /// The message that sets a waypoint, version 1.1.
    type SetExt: Message + Clone + Into<Place>;
}
