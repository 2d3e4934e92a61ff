//! Local and Global Waypoint Driver: drive to a single waypoint.

use std::marker::PhantomData;

use super::behaviour::Behaviour;
use super::both_versions;
use super::controls::{Controls, changed};
use super::exchange::{Command, Exchange};
use super::kind::Waypoints;
use super::place::Place;
use super::travel;
use jaus::codec::{Message, ServiceId};
use jaus::service::{Context, Handled};

/// Drives to waypoints of one kind.
pub(super) struct WaypointDriver<K>(PhantomData<K>);

impl<K: Waypoints> WaypointDriver<K> {
    pub(super) const fn new() -> Self {
        Self(PhantomData)
    }
}

impl<K: Waypoints> Behaviour for WaypointDriver<K> {
    fn offers(&self) -> Vec<ServiceId> {
        both_versions(K::DRIVER).into()
    }

    fn handle(&mut self, code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        if code == K::Set::CODE {
            set(exchange.command::<K::Set>(), exchange);
        } else if code == K::SetExt::CODE {
            set(exchange.command::<K::SetExt>(), exchange);
        } else if K::handle_query(code, exchange) == Handled::No {
            return travel::handle_speed(code, exchange);
        }
        Handled::Yes
    }

    fn acts_on(&self) -> Option<&'static str> {
        Some(K::Set::NAME)
    }

    fn tells_end_of(&self, command: u16) -> bool {
        command == K::Set::CODE || command == K::SetExt::CODE
    }

    fn handle_motion(&mut self, controls: &mut Controls, context: &mut Context<'_>) {
        controls.work_off(context);
    }

    fn handle_stop(&mut self, controls: &mut Controls, context: &mut Context<'_>) {
        controls.abandon(context);
    }
}

/// Sets a waypoint. If a travel speed is set, the vehicle starts immediately.
fn set<M: Message + Into<Place>>(command: Option<Command<M>>, exchange: &mut Exchange<'_, '_>) {
    let Some(Command { message, acts }) = command else {
        return;
    };
    let place = message.into();
    let source = exchange.message.source;
    if !exchange.controls.can_reach(&place) {
        tracing::warn!(%source, ?place, "waypoint ignored: it is out of reach");
        return;
    }
    tracing::info!(%source, ?place, "waypoint set");
    let controls = &mut exchange.controls;
    controls.set_place(place, M::CODE, acts, exchange.context);
    travel::accept(exchange);
    changed(exchange.context);
}
