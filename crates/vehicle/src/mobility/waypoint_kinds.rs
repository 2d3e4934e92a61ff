//! Waypoints in the local frame and on the globe, as kinds of places for the drivers.

use super::exchange::Exchange;
use super::kind::{Kind, Waypoints};
use super::place::Place;
use jaus::codec::{Message, ServiceId};
use jaus::messages::mobility::{
    QueryGlobalWaypoint, QueryGlobalWaypointExt, QueryLocalWaypoint, QueryLocalWaypointExt,
    SetGlobalWaypoint, SetGlobalWaypointExt, SetLocalWaypoint, SetLocalWaypointExt,
    global_waypoint_driver, global_waypoint_list_driver, local_waypoint_driver,
    local_waypoint_list_driver,
};
use jaus::service::{Elements, Handled};

/// Waypoints on the globe.
pub(super) struct Global;

impl Waypoints for Global {
    const DRIVER: ServiceId = global_waypoint_driver::V1_1;
    type Set = SetGlobalWaypoint;
    type SetExt = SetGlobalWaypointExt;
}

impl Kind for Global {
    const LIST_DRIVER: ServiceId = global_waypoint_list_driver::V1_1;

    fn accept(elements: &Elements) {
        accept::<SetGlobalWaypoint>(elements);
        accept::<SetGlobalWaypointExt>(elements);
    }

    fn handle_query(code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        let Some(Place::Global(waypoint)) = exchange.controls.place() else {
            return Handled::No;
        };
        match code {
            QueryGlobalWaypoint::CODE => {
                exchange.answer_if(|_: &QueryGlobalWaypoint, _| waypoint.report());
            }
            QueryGlobalWaypointExt::CODE => {
                exchange.answer_if(|_: &QueryGlobalWaypointExt, _| waypoint.report_ext());
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }
}

/// Waypoints in the local frame.
pub(super) struct Local;

impl Waypoints for Local {
    const DRIVER: ServiceId = local_waypoint_driver::V1_1;
    type Set = SetLocalWaypoint;
    type SetExt = SetLocalWaypointExt;
}

impl Kind for Local {
    const LIST_DRIVER: ServiceId = local_waypoint_list_driver::V1_1;

    fn accept(elements: &Elements) {
        accept::<SetLocalWaypoint>(elements);
        accept::<SetLocalWaypointExt>(elements);
    }

    fn handle_query(code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        let Some(Place::Local(waypoint)) = exchange.controls.place() else {
            return Handled::No;
        };
        match code {
            QueryLocalWaypoint::CODE => {
                exchange.answer_if(|_: &QueryLocalWaypoint, _| waypoint.report());
            }
            QueryLocalWaypointExt::CODE => {
                exchange.answer_if(|_: &QueryLocalWaypointExt, _| waypoint.report_ext());
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }
}

/// Registers a waypoint message with a list, accepting waypoints within reach.
fn accept<M: Message + Clone + Into<Place>>(elements: &Elements) {
    elements.accept_if(|message: &M| message.clone().into().is_in_reach());
}
