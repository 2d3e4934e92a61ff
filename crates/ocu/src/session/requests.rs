//! Handling of requests: preconditions, actions, and reasons for refusal.

use std::sync::Arc;
use std::time::Instant;

use tokio::sync::oneshot;

use super::client::{Client, Finished, deliver, release_all};
use super::lease::Wanted;
use super::vehicle::Vehicle;
use super::{Order, Reply, Session};
use crate::request::OperatorRequest;
use crate::role::Role;
use crate::stick::PageId;
use crate::stick::Push;
use jaus::address::JausId;
use jaus::component::Session as PartSession;
use jaus::service::State;
use jaus_vehicle::messages::ground::set_destination::Approved;
use jaus_vehicle::messages::ground::{
    ApproveMission, ContinueMission, SetDestination, StopMission,
};

/// Success, or the reason for failure.
type Outcome = Result<(), String>;

impl Session {
    pub(super) fn handle_order(&mut self, now: Instant, order: Order) {
        match order {
            Order::OperatorRequest {
                page,
                user,
                vehicle,
                request,
                reply,
            } => {
                self.note_driver(page, user, &request);
                self.handle_request(now, page, vehicle, request, reply);
            }
            Order::Cells {
                vehicle,
                map,
                reply,
            } => match self.fleet.get_mut(vehicle) {
                Some(vehicle) => {
                    let (store, map) = (vehicle.picture.store(), vehicle.picture.map(map));
                    vehicle.maps.want(store, map, &mut self.client, reply);
                }
                None => reply(Err("unknown vehicle".to_owned())),
            },
            Order::Gone(page) => self.stick.handle_release(now, page),
        }
    }

    /// Notes the user who drives from now on, if the request makes that change.
    fn note_driver(&mut self, page: PageId, user: Arc<str>, request: &OperatorRequest) {
        let is_wanted = self.fleet.selected().is_some_and(Vehicle::is_wanted);
        let takes_over = match request {
            OperatorRequest::Control { on } => *on && !is_wanted,
            OperatorRequest::Drive { .. } => self.stick.driver().is_none_or(|it| it == page),
            OperatorRequest::Approve { .. } | OperatorRequest::Continue { .. } => true,
            _ => false,
        };
        if takes_over {
            self.driver = Some(user);
        }
    }

    /// Handles a request for the selected vehicle, for an emergency of any one, or of all.
    fn handle_request(
        &mut self,
        now: Instant,
        page: PageId,
        meant: Option<u16>,
        request: OperatorRequest,
        reply: Reply,
    ) {
        match request {
            OperatorRequest::Select { subsystem } => {
                return reply(self.select(now, page, subsystem));
            }
            OperatorRequest::Emergency { on } => return self.emergency(now, meant, on, reply),
            OperatorRequest::EmergencyAll { on } => return self.emergency_of_all(now, on, reply),
            OperatorRequest::Handover {
                part,
                operator,
                grant,
            } => return self.decide_handover(now, (part, operator), grant, reply),
            OperatorRequest::DriveEnd => {
                self.stick.handle_release(now, page);
                self.steer(now);
                return reply(Ok(()));
            }
            _ => {}
        }
        let selected = self.fleet.selected_number();
        if let Some(meant) = meant.filter(|meant| selected != Some(*meant)) {
            return reply(Err(format!("vehicle {meant} is not selected any more")));
        }
        match request {
            OperatorRequest::Control { on: true } => self.take_control(now, reply),
            OperatorRequest::Control { on: false } => self.release_control(now, reply),
            OperatorRequest::Resume => self.set_ready(now, true, reply),
            OperatorRequest::Standby => self.set_ready(now, false, reply),
            OperatorRequest::Drive { forward, turn } => reply(self.drive(now, page, forward, turn)),
            OperatorRequest::Approve { mission } => self.approve(now, mission, reply),
            _ => match self.fleet.selected_mut() {
                Some(vehicle) => vehicle.handle_request(&request, &mut self.client, reply),
                None => reply(Err(NO_VEHICLE.to_owned())),
            },
        }
    }

    /// Selects a vehicle. The one before is stopped and released, unless it is on a mission, which
    /// goes on.
    fn select(&mut self, now: Instant, page: PageId, number: u16) -> Outcome {
        if self.fleet.selected_number() == Some(number) {
            return Ok(());
        }
        if !self.fleet.contains(number) {
            return Err(format!(
                "subsystem {number} is not a known vehicle; choose one from the list"
            ));
        }
        if self.stick.driver().is_some_and(|driver| driver != page) {
            return Err("another page is driving; it must let go first".to_owned());
        }
        self.stick.stop(now);
        self.steer(now);
        if let Some(before) = self.fleet.selected_mut() {
            before.handover.withdraw(self.client.component());
            if before.is_wanted() && !before.is_on_mission(now) {
                let vehicle = before.number();
                let driver = before.driver();
                self.client.leave(vehicle, driver, before.release());
                self.leaving.insert(vehicle);
            }
        }
        // The vehicle that was left is stopped as above, and by itself without commands.
        self.stick.handle_stopped();
        self.halted = None;
        self.fleet.select(number);
        Ok(())
    }

    fn take_control(&mut self, now: Instant, reply: Reply) {
        match self.fleet.selected_mut() {
            Some(vehicle) => vehicle.take_control(now, &mut self.client, reply),
            None => reply(Err(NO_VEHICLE.to_owned())),
        }
    }

    /// Grants or refuses another operator's request for control, which a part of a vehicle has
    /// passed on. A grant stops manual drive and releases the vehicle.
    fn decide_handover(
        &mut self,
        now: Instant,
        (part, operator): (JausId, JausId),
        grant: bool,
        reply: Reply,
    ) {
        let number = part.subsystem();
        let vehicle = self.fleet.get_mut(number);
        let decided = vehicle.and_then(|it| it.handover.decide(part, operator, grant));
        let Some(decision) = decided else {
            return reply(Err("the request for control is over".to_owned()));
        };
        let mut sessions = Vec::new();
        if grant {
            if self.fleet.selected_number() == Some(number) {
                self.stick.stop(now);
                self.steer(now);
            }
            if let Some(vehicle) = self.fleet.get_mut(number) {
                vehicle.handover.ending = Some(format!("control was handed over to {operator}"));
                sessions = vehicle.release();
            }
        }
        let component = self.client.component().clone();
        self.client.tell(reply, async move {
            // The vehicle hands over control before it is released.
            let delivered = component.deliver(part, &decision).await;
            release_all(sessions).await;
            delivered.map_err(|error| error.to_string())
        });
    }

    fn release_control(&mut self, now: Instant, reply: Reply) {
        if let Some(vehicle) = self.fleet.selected_mut()
            && vehicle.handover.withdraw(self.client.component())
        {
            return reply(Ok(()));
        }
        self.stick.stop(now);
        self.steer(now);
        let sessions = self.fleet.selected_mut().map(Vehicle::release);
        let sessions = sessions.unwrap_or_default();
        self.client.tell(reply, async move {
            release_all(sessions).await;
            Ok(())
        });
    }

    /// Resumes all held parts or sends them to standby.
    fn set_ready(&mut self, now: Instant, ready: bool, reply: Reply) {
        let Some(vehicle) = self.fleet.selected_mut() else {
            return reply(Err(NO_CONTROL.to_owned()));
        };
        let sessions = vehicle.lease.all_held();
        if sessions.is_empty() {
            return reply(Err(NO_CONTROL.to_owned()));
        }
        if ready && vehicle.picture.in_emergency().next().is_some() {
            return reply(Err("clear the emergency first".to_owned()));
        }
        vehicle.lease.set_ready(ready);
        if ready && vehicle.lease.wanted() == Wanted::Planner && !vehicle.is_driven_by_planner() {
            // The planner's mission is over, so the operator continues with all parts.
            drop(vehicle.lease.want(Wanted::Everything, &vehicle.picture));
        }
        if !ready {
            self.stick.stop(now);
            self.steer(now);
        }
        self.client.tell(reply, manage(sessions, ready));
    }

    /// Sets or clears the emergency of a vehicle, by default of the selected one.
    fn emergency(&mut self, now: Instant, meant: Option<u16>, on: bool, reply: Reply) {
        let selected = self.fleet.selected_number();
        let number = meant.or(selected);
        if on && number == selected {
            self.stick.stop(now);
            self.steer(now);
        }
        match number.and_then(|number| self.fleet.get_mut(number)) {
            Some(vehicle) => vehicle.set_emergency(now, on, &mut self.client, reply),
            None => reply(Err(NO_VEHICLE.to_owned())),
        }
    }

    /// Sets or clears the emergency of all vehicles, also of those that appear later.
    fn emergency_of_all(&mut self, now: Instant, on: bool, reply: Reply) {
        self.all_stopped = on;
        if on {
            self.stick.stop(now);
            self.steer(now);
        }
        let mut results = Vec::new();
        for (_, vehicle) in self.fleet.iter_mut() {
            let is_meant = if on {
                vehicle.has_managed()
            } else {
                vehicle.is_stopped()
            };
            if is_meant {
                let (sender, result) = oneshot::channel();
                let reply = Box::new(move |result| {
                    // Fails only if the requests are dropped at the end of the session.
                    let _ = sender.send(result);
                });
                vehicle.set_emergency(now, on, &mut self.client, reply);
                results.push((vehicle.number(), result));
            }
        }
        if on && results.is_empty() {
            return reply(Err(NO_VEHICLE.to_owned()));
        }
        self.client.start(async move {
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

    /// Stops a vehicle that has appeared after all were stopped.
    pub(super) fn stop_latecomer(&mut self, now: Instant, number: u16) {
        if self.all_stopped
            && let Some(vehicle) = self.fleet.get_mut(number)
        {
            vehicle.set_emergency(now, true, &mut self.client, Box::new(|_| {}));
        }
    }

    fn drive(&mut self, now: Instant, page: PageId, forward: f64, turn: f64) -> Outcome {
        let push = Push::new(forward, turn)
            .ok_or("forward and turn range from -1 to 1; the command is ignored")?;
        if let Some(leaving) = self.leaving.first() {
            return Err(format!("vehicle {leaving} is being stopped first"));
        }
        let vehicle = self.fleet.selected_mut().ok_or(NO_CONTROL)?;
        let refusal = vehicle.refuses_to_be_driven();
        if let Some(why) = refusal {
            return Err(why);
        }
        if let Some(why) = vehicle.picture.stale(now) {
            self.stick.handle_release(now, page);
            self.steer(now);
            return Err(why);
        }
        self.stick
            .handle_push(now, page, push)
            .map_err(|busy| busy.to_string())?;
        self.halted = None;
        vehicle.take_over_from_planner(&mut self.client);
        if let Some(why) = vehicle.driving_obstacle() {
            self.stick.handle_release(now, page);
            return Err(why);
        }
        self.steer(now);
        Ok(())
    }

    /// Lets the planner drive. The drivers are released first, so that the planner can control
    /// them.
    fn approve(&mut self, now: Instant, number: u32, reply: Reply) {
        let Some(vehicle) = self.fleet.selected_mut() else {
            return reply(Err(NO_VEHICLE.to_owned()));
        };
        let planner = match vehicle.may_approve(now, number) {
            Ok(planner) => planner,
            Err(why) => return reply(Err(why)),
        };
        self.stick.stop(now);
        let drivers = vehicle.lease.want(Wanted::Planner, &vehicle.picture);
        self.client.tell(reply, async move {
            release_all(drivers).await;
            deliver(&planner, &ApproveMission { mission: number }).await
        });
    }
}

impl Vehicle {
    /// Handles a request that concerns nothing but the vehicle.
    fn handle_request(&mut self, request: &OperatorRequest, client: &mut Client, reply: Reply) {
        match *request {
            OperatorRequest::Destination { x, y, speed } => self.go_to(x, y, speed, client, reply),
            OperatorRequest::Continue { mission } => self.continue_mission(mission, client, reply),
            _ => self.stop_mission(client, reply),
        }
    }

    /// Takes control, or requests it from an operator of equal or higher authority who has it.
    fn take_control(&mut self, now: Instant, client: &mut Client, reply: Reply) {
        if self.picture.parts().is_empty() {
            return reply(Err(NO_VEHICLE.to_owned()));
        }
        let own = client.component().id();
        let holder = self.picture.holder();
        if let Some((holder, authority)) = holder.filter(|(id, _)| *id != own) {
            if authority >= client.authority() {
                return reply(self.ask_holder(now, holder, authority));
            }
            self.lease.stand_by();
        }
        self.handover.ending = None;
        // Keep a mission that this operator has in progress.
        let planner = self.picture.find(Role::Planner);
        let planner = planner.and_then(|id| self.picture.parts().get(&id));
        let ours = planner.is_some_and(|it| it.controller() == Some(own));
        let wanted = if ours && self.is_driven_by_planner() {
            Wanted::Planner
        } else {
            Wanted::Everything
        };
        self.lease.take(wanted, reply, &self.picture, client);
    }

    fn ask_holder(&mut self, now: Instant, holder: JausId, authority: u8) -> Outcome {
        let Some(part) = self.picture.handoff_part(holder) else {
            return Err(format!(
                "{holder} is in control with authority {authority}, and the vehicle does not pass \
                 on requests for control: {holder} must release it first"
            ));
        };
        self.handover.ask(now, part, holder);
        Ok(())
    }

    fn has_managed(&self) -> bool {
        self.picture.parts().values().any(|part| part.managed)
    }

    fn set_emergency(&mut self, now: Instant, on: bool, client: &mut Client, reply: Reply) {
        if !on {
            return self.alarm.clear(now, &self.picture, client, reply);
        }
        if !self.has_managed() {
            return reply(Err(NO_VEHICLE.to_owned()));
        }
        self.lease.set_ready(false);
        self.alarm.set(now, &self.picture, client, reply);
    }

    /// Why it cannot be driven by hand, whatever its parts report.
    fn refuses_to_be_driven(&self) -> Option<String> {
        if !self.is_wanted() {
            return Some(NO_CONTROL.to_owned());
        }
        let Some(driver) = self.picture.find(Role::PrimitiveDriver) else {
            return Some("the vehicle has no primitive driver".to_owned());
        };
        if self.alarm.is_wanted() || self.is(driver, State::Emergency) {
            return Some("the vehicle is in emergency; clear it first".to_owned());
        }
        let is_ready = self.lease.is_ready();
        (!is_ready).then(|| "the vehicle is in standby; resume first".to_owned())
    }

    /// Why the primitive driver is not under control or not ready.
    fn driving_obstacle(&self) -> Option<String> {
        let driver = self.picture.find(Role::PrimitiveDriver)?;
        self.lease.obstacle(driver)
    }

    /// Takes over from the planner if it drives.
    fn take_over_from_planner(&mut self, client: &mut Client) {
        if self.lease.wanted() != Wanted::Planner {
            return;
        }
        tracing::info!("the operator takes over from the planner");
        if let Some(planner) = self.planner() {
            let nobody = Box::new(|_: Outcome| {});
            client.tell(
                nobody,
                async move { deliver(&planner, &StopMission {}).await },
            );
        }
        drop(self.lease.want(Wanted::Everything, &self.picture));
        self.lease.handle_time(&self.picture, client);
    }

    fn go_to(&self, x: f64, y: f64, speed: Option<f64>, client: &mut Client, reply: Reply) {
        let planner = match self.ready_planner() {
            Ok(planner) => planner,
            Err(why) => return reply(Err(why)),
        };
        if !x.is_finite() || !y.is_finite() || speed.is_some_and(|it| !(it > 0.0 && it <= 100.0)) {
            let why =
                "a destination has metres north and east, and a speed above 0 and up to 100 m/s";
            return reply(Err(why.to_owned()));
        }
        let mut destination = SetDestination {
            x,
            y,
            approved: Approved::NO,
            ..SetDestination::default()
        };
        destination.speed = speed.map(|it| it as f32);
        client.tell(reply, async move { deliver(&planner, &destination).await });
    }

    /// The planner's session, if it can be given this mission's approval.
    fn may_approve(&self, now: Instant, number: u32) -> Result<Arc<PartSession>, String> {
        let planner = self.ready_planner()?;
        match self.picture.mission() {
            Some(it) if it.number == number && it.stage.awaits_approval() => {}
            Some(it) => {
                let (known, stage) = (it.number, it.stage.name().replace('_', " "));
                return Err(format!(
                    "mission {number} is not awaiting approval: the planner has mission {known}, \
                     which is {stage}"
                ));
            }
            None => return Err("the planner has not reported a mission yet".to_owned()),
        }
        if let Some(why) = self.picture.stale(now) {
            return Err(why);
        }
        if !self.picture.is_position_known() {
            return Err("the vehicle's pose is unknown".to_owned());
        }
        Ok(planner)
    }

    /// Lets the planner drive on after a fault. The drivers are released first, so that the planner
    /// can control them.
    fn continue_mission(&mut self, mission: u32, client: &mut Client, reply: Reply) {
        let planner = match self.ready_planner() {
            Ok(planner) => planner,
            Err(why) => return reply(Err(why)),
        };
        let drivers = self.lease.want(Wanted::Planner, &self.picture);
        client.tell(reply, async move {
            release_all(drivers).await;
            deliver(&planner, &ContinueMission { mission }).await
        });
    }

    fn stop_mission(&self, client: &mut Client, reply: Reply) {
        match self.planner() {
            Some(planner) => client.tell(
                reply,
                async move { deliver(&planner, &StopMission {}).await },
            ),
            None => reply(Err(NO_CONTROL.to_owned())),
        }
    }

    /// The session with the planner, if it is held and ready.
    fn ready_planner(&self) -> Result<Arc<PartSession>, String> {
        let planner = self.picture.find(Role::Planner);
        let planner = planner.ok_or("the vehicle has no planner")?;
        if self.alarm.is_wanted() || self.is(planner, State::Emergency) {
            return Err("the vehicle is in emergency; clear it first".to_owned());
        }
        let session = self.lease.held(planner);
        let session = session.ok_or_else(|| {
            let why = self.lease.obstacle(planner);
            why.unwrap_or_else(|| NO_CONTROL.to_owned())
        })?;
        if self.lease.is_ready() {
            Ok(session)
        } else {
            Err("the planner is in standby; resume first".to_owned())
        }
    }
}

const NO_VEHICLE: &str = "no vehicle is known yet";
const NO_CONTROL: &str = "take control first";

/// Resumes these parts or sends them to standby. Errors are combined as text.
async fn manage(sessions: Vec<Arc<PartSession>>, ready: bool) -> Outcome {
    let mut wrong = Vec::new();
    for session in sessions {
        let managed = if ready {
            session.resume().await
        } else {
            session.standby().await
        };
        if let Err(error) = managed {
            wrong.push(error.to_string());
        }
    }
    in_words(&wrong)
}

/// Success without failures, or all of them.
fn in_words(failures: &[String]) -> Outcome {
    if failures.is_empty() {
        Ok(())
    } else {
        Err(failures.join("; "))
    }
}
