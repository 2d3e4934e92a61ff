//! The drivers that execute a list: Local and Global Waypoint List Driver, Local and Global Path
//! Segment Driver.

use std::marker::PhantomData;

use super::behaviour::Behaviour;
use super::both_versions;
use super::controls::Controls;
use super::exchange::Exchange;
use super::kind::Kind;
use super::travel;
use jaus::codec::{Message, ServiceId};
use jaus::messages::mobility::ExecuteList;
use jaus::service::{Context, Elements, Handled};

/// Drives to the places of one kind in a list, in sequence.
pub(super) struct ListDriver<K>(PhantomData<K>);

impl<K: Kind> ListDriver<K> {
    /// Creates a driver for the vehicle's list and registers its kind of place with the list.
    pub(super) fn on(elements: &Elements) -> Self {
        K::accept(elements);
        Self(PhantomData)
    }
}

impl<K: Kind> Behaviour for ListDriver<K> {
    fn offers(&self) -> Vec<ServiceId> {
        both_versions(K::LIST_DRIVER).into()
    }

    fn handle(&mut self, code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        match K::handle_query(code, exchange) {
            Handled::Yes => Handled::Yes,
            Handled::No => travel::handle_list(code, exchange),
        }
    }

    fn acts_on(&self) -> Option<&'static str> {
        Some(ExecuteList::NAME)
    }

    fn tells_end_of(&self, command: u16) -> bool {
        travel::tells_end_of(command)
    }

    fn handle_motion(&mut self, controls: &mut Controls, context: &mut Context<'_>) {
        controls.work_off(context);
    }

    fn handle_stop(&mut self, controls: &mut Controls, context: &mut Context<'_>) {
        controls.abandon(context);
    }
}
