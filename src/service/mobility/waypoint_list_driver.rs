//! Local and Global Waypoint List Driver: drive to waypoints one after the other.

use std::marker::PhantomData;

use super::both_versions;
use super::exchange::Exchange;
use super::place::Kind;
use super::travel;
use super::vehicle::{Behaviour, Cockpit};
use crate::codec::ServiceId;
use crate::service::{Context, Elements, Handled};

/// A driver along lists of waypoints of one kind.
pub(super) struct WaypointListDriver<K>(PhantomData<K>);

impl<K: Kind> WaypointListDriver<K> {
    /// A driver that works the vehicle's list off, which takes its waypoints from now on.
    pub(super) fn on(elements: &Elements) -> Self {
        elements.accept_if(|message: &K::Set| message.clone().into().is_in_reach());
        elements.accept_if(|message: &K::SetExt| message.clone().into().is_in_reach());
        Self(PhantomData)
    }
}

impl<K: Kind> Behaviour for WaypointListDriver<K> {
    fn offers(&self) -> Vec<ServiceId> {
        both_versions(K::LIST_DRIVER).into()
    }

    fn handle(&mut self, code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        match K::handle_query(code, exchange) {
            Handled::Yes => Handled::Yes,
            Handled::No => travel::handle_list(code, exchange),
        }
    }

    fn tells_end_of(&self, command: u16) -> bool {
        travel::tells_end_of(command)
    }

    fn handle_motion(&mut self, cockpit: &mut Cockpit, context: &mut Context<'_>) {
        cockpit.work_off(context);
    }

    fn handle_stop(&mut self, cockpit: &mut Cockpit, context: &mut Context<'_>) {
        cockpit.abandon(context);
    }
}
