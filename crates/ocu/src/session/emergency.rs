//! Emergencies of one vehicle and of all. Every page may set one at any time, also if another page
//! owns the vehicle.

use std::sync::Arc;
use std::time::Instant;

use tokio::sync::oneshot;

use super::Session;
use super::client::{Cleared, Client, Finished};
use super::control::{NO_VEHICLE, in_words};
use super::vehicle::Vehicle;
use crate::orders::{Reply, StopOrder, StopReply, StopTarget};
use crate::press::{KnownStops, Press};
use crate::request::OperatorRequest;

/// Nothing that can be stopped has shown itself.
const NO_PARTS: &str =
    "no part of a vehicle that can be stopped is known yet; each is stopped as soon as it is";

impl Session {
    /// Sends an emergency at once.
    pub(super) fn handle_stop(&mut self, now: Instant, order: StopOrder) {
        let (press, reply) = (order.press, order.reply);
        let target = match order.target {
            StopTarget::All => None,
            StopTarget::Vehicle(number) => Some(number),
            StopTarget::OfPage(page) => match self.pages.vehicle(page) {
                None => return reply.refused(NO_VEHICLE),
                shown => shown,
            },
        };
        let Some(count) = self.presses.take(press, target) else {
            return reply.ignored();
        };
        self.note_emergency(now, target, &order.user, true);
        let Some(number) = target else {
            return self.stop_all(now, (press, count), reply);
        };
        let Some(vehicle) = self.fleet.get_mut(number) else {
            return reply.refused(NO_VEHICLE);
        };
        let is_new = vehicle.set_emergency(now, &mut self.client);
        if !vehicle.has_managed() {
            return reply.refused(NO_PARTS);
        }
        if let Some(confirmed) = reply.taken(is_new, count) {
            vehicle.await_emergency(now, true, confirmed);
        }
    }

    /// Stops all vehicles, also those that appear later, and those of which no part is known yet.
    fn stop_all(&mut self, now: Instant, (press, count): (Option<Press>, u64), reply: StopReply) {
        let is_new = !self.all_stopped;
        self.all_stopped = true;
        let mut stopped = Vec::new();
        for vehicle in self.fleet.iter_mut() {
            let number = Some(vehicle.number());
            // The press was cleared for this vehicle, and this is a late copy of it.
            if press.is_some_and(|press| self.presses.is_cleared(press, number)) {
                continue;
            }
            vehicle.set_emergency(now, &mut self.client);
            if vehicle.has_managed() {
                stopped.push(vehicle);
            }
        }
        match reply.taken(is_new, count) {
            Some(confirmed) if stopped.is_empty() => confirmed(Err(NO_PARTS.to_owned())),
            Some(confirmed) => await_all(now, true, stopped, &mut self.client, confirmed),
            None => {}
        }
        if is_new {
            self.publish_fleet(now);
        }
    }

    /// Clears emergencies of a vehicle or of all, for an operator who knows of the stops `known`.
    pub(super) fn clear(
        &mut self,
        now: Instant,
        (vehicle, known): (Option<u16>, Option<KnownStops>),
        request: OperatorRequest,
        user: &Arc<str>,
        reply: Reply,
    ) {
        let is_of_all = matches!(request, OperatorRequest::EmergencyAll { .. });
        let target = vehicle.filter(|_| !is_of_all);
        if !is_of_all && target.is_none() {
            return reply(Err(NO_VEHICLE.to_owned()));
        }
        if let Some(known) = known
            && let Err(pressed) = self.presses.clear(known, target)
        {
            return reply(Err(pressed.to_string()));
        }
        self.note_emergency(now, target, user, false);
        if is_of_all {
            return self.clear_all_emergencies(now, reply);
        }
        let whose = match request {
            OperatorRequest::ClearAnyEmergency => Cleared::Any,
            _ => Cleared::Own,
        };
        self.clear_emergency(now, vehicle, whose, reply);
    }

    /// Clears the emergency of a vehicle. If it was the last one after a stop of all, vehicles that
    /// appear later are not stopped either: nothing would show why.
    fn clear_emergency(&mut self, now: Instant, number: Option<u16>, whose: Cleared, reply: Reply) {
        let Some(vehicle) = number.and_then(|number| self.fleet.get_mut(number)) else {
            return reply(Err(NO_VEHICLE.to_owned()));
        };
        vehicle.clear_emergency(now, whose, &mut self.client);
        vehicle.await_emergency(now, false, reply);
        if !self.fleet.iter_mut().any(|it| it.alarm.is_wanted()) {
            self.all_stopped = false;
            self.presses.clear_stops_of_all();
            self.publish_fleet(now);
        }
    }

    /// Clears the emergencies of all vehicles, and ends the stop of those that appear later.
    fn clear_all_emergencies(&mut self, now: Instant, reply: Reply) {
        self.all_stopped = false;
        let mut cleared: Vec<&mut Vehicle> = Vec::new();
        for vehicle in self.fleet.iter_mut().filter(|it| it.is_stopped()) {
            vehicle.clear_emergency(now, Cleared::Own, &mut self.client);
            cleared.push(vehicle);
        }
        await_all(now, false, cleared, &mut self.client, reply);
        self.publish_fleet(now);
    }

    /// Stops a vehicle that has appeared after all were stopped.
    pub(super) fn stop_latecomer(&mut self, now: Instant, number: u16) {
        if self.all_stopped
            && let Some(vehicle) = self.fleet.get_mut(number)
        {
            vehicle.set_emergency(now, &mut self.client);
        }
    }
}

/// Replies when all parts of the vehicles have confirmed the start or the end of the emergency.
fn await_all(
    now: Instant,
    on: bool,
    vehicles: Vec<&mut Vehicle>,
    client: &mut Client,
    reply: Reply,
) {
    let mut results = Vec::new();
    for vehicle in vehicles {
        let (sender, result) = oneshot::channel();
        let confirmed = Box::new(move |result| {
            // Fails only if the requests are dropped at the end of the session.
            let _ = sender.send(result);
        });
        vehicle.await_emergency(now, on, confirmed);
        results.push((vehicle.number(), result));
    }
    client.start(async move {
        let mut failures = Vec::new();
        for (number, result) in results {
            if let Ok(Err(why)) = result.await {
                failures.push(format!("vehicle {number}: {why}"));
            }
        }
        Finished::Requested {
            reply,
            result: in_words(&failures),
        }
    });
}

impl Vehicle {
    pub(super) fn has_managed(&self) -> bool {
        self.picture.parts().values().any(|part| part.managed)
    }

    /// Sets the emergency, and ends manual drive. Returns whether it is new.
    fn set_emergency(&mut self, now: Instant, client: &mut Client) -> bool {
        let is_new = self.alarm.set(now, &mut self.picture, client);
        self.stop_driving(now, client);
        self.lease.set_ready(false);
        is_new
    }

    fn clear_emergency(&mut self, now: Instant, whose: Cleared, client: &mut Client) {
        self.alarm.clear(now, whose, &self.picture, client);
    }

    fn await_emergency(&mut self, now: Instant, on: bool, reply: Reply) {
        self.alarm.await_end(now, on, &self.picture, reply);
    }

    /// Whether it is in emergency, or is to be.
    pub(super) fn is_stopped(&self) -> bool {
        self.alarm.is_wanted() || self.picture.in_emergency().next().is_some()
    }
}
