//! Control of vehicles: which page has which vehicle, taking and releasing control, Resume and
//! Standby, and handovers to other operators' stations.

use std::sync::Arc;
use std::time::Instant;

use super::Session;
use super::client::{Client, release_all};
use super::lease::Wanted;
use super::vehicle::Vehicle;
use crate::orders::{OpenedPage, Order, Reply};
use crate::ownership::{Owner, PageId};
use crate::request::OperatorRequest;
use crate::role::Role;
use jaus::address::JausId;
use jaus::component::Session as PartSession;

/// Success, or the reason for failure.
pub(super) type Outcome = Result<(), String>;

impl Session {
    pub(super) fn handle_order(&mut self, now: Instant, order: Order) {
        match order {
            Order::Opened(opened) => self.open(now, opened),
            Order::OperatorRequest {
                page,
                vehicle,
                request,
                known,
                may_drive,
                reply,
            } => match request {
                OperatorRequest::Select { subsystem } => {
                    reply(self.select(now, page, subsystem, may_drive));
                }
                OperatorRequest::Emergency { on: false }
                | OperatorRequest::EmergencyAll { on: false }
                | OperatorRequest::ClearAnyEmergency => {
                    if self.pages.operator(page).is_none() {
                        // Its operator may have stopped the vehicle again over a newer connection.
                        return reply(Err("the page has connected anew".to_owned()));
                    }
                    let vehicle = vehicle.or(self.pages.vehicle(page));
                    self.clear(now, (vehicle, known), request, &self.user(page), reply);
                }
                OperatorRequest::Handover {
                    part,
                    operator,
                    grant,
                } => self.decide_handover(now, page, (part, operator), grant, reply),
                _ => self.handle_request(now, page, vehicle, request, reply),
            },
            Order::Drive(order) => {
                let operator = self.pages.operator(order.page);
                let shown = self.pages.vehicle(order.page);
                // The picture may still be that of the vehicle before.
                let shown = shown.filter(|shown| order.vehicle == Some(*shown));
                let vehicle = shown.and_then(|it| self.fleet.get_mut(it));
                let driven = match (operator, vehicle) {
                    (Some(operator), Some(vehicle)) => {
                        vehicle.drive(now, operator, &order, &mut self.client)
                    }
                    _ => Err("the page does not show the vehicle yet".to_owned()),
                };
                (order.reply)(driven);
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
            // Sending fails only if the page does not wait any more.
            Order::Overlay {
                vehicle,
                zones,
                reply,
            } => {
                let vehicle = self.fleet.get(vehicle);
                let _ = reply.send(vehicle.map(|it| it.picture.overlay_state(zones)));
            }
            Order::Events { after, reply } => {
                let _ = reply.send(self.events.state(now, after));
            }
            Order::Gone(page) => self.close(now, page),
        }
    }

    fn open(&mut self, now: Instant, opened: OpenedPage) {
        if let Some(before) = &opened.replaces
            && self.pages.is_replaced(before)
        {
            self.close(now, before.page);
        }
        self.pages.open(opened);
        self.show();
    }

    /// The operator of a page is gone: its vehicles stop, unless they are on a mission, and are free
    /// for other pages.
    fn close(&mut self, now: Instant, page: PageId) {
        self.pages.close(page);
        for vehicle in self.fleet.iter_mut() {
            if vehicle.ownership.is_owned_by(page) {
                vehicle.stop_driving(now, &mut self.client);
                vehicle.manual.forget();
                vehicle.ownership.release();
            }
        }
        self.show();
    }

    fn handle_request(
        &mut self,
        now: Instant,
        page: PageId,
        meant: Option<u16>,
        request: OperatorRequest,
        reply: Reply,
    ) {
        let shown = self.pages.vehicle(page);
        if let Some(meant) = meant.filter(|meant| shown != Some(*meant)) {
            return reply(Err(format!("vehicle {meant} is not selected any more")));
        }
        let vehicle = shown.and_then(|shown| self.fleet.get_mut(shown));
        match (self.pages.operator(page), vehicle) {
            (Some(operator), Some(vehicle)) => {
                vehicle.handle_request(now, operator, &request, &mut self.client, reply);
            }
            _ => reply(Err(NO_VEHICLE.to_owned())),
        }
        self.show();
    }

    /// Selects a vehicle for a page. The one before is left, if no other operator has it.
    fn select(&mut self, now: Instant, page: PageId, number: u16, may_drive: bool) -> Outcome {
        let shown = self.pages.vehicle(page);
        if shown == Some(number) {
            return Ok(());
        }
        if !self.fleet.contains(number) {
            return Err(format!(
                "subsystem {number} is not a known vehicle; choose one from the list"
            ));
        }
        if let Some(shown) = shown
            && let Some(vehicle) = self.fleet.get_mut(shown)
        {
            let is_free = vehicle.ownership.owner().is_none();
            let is_alone = may_drive && is_free && !self.pages.others_show(page, shown);
            if is_alone || vehicle.ownership.is_owned_by(page) {
                vehicle.leave(now, &mut self.client);
            }
        }
        self.pages.select(page, number);
        if let Some(vehicle) = self.fleet.get_mut(number)
            && vehicle.ownership.check(number, page).is_ok()
        {
            vehicle.is_left = false;
        }
        self.show();
        Ok(())
    }

    /// Grants or refuses another operator's request for control, which a part of a vehicle has
    /// passed on. A grant stops manual drive and releases the vehicle.
    fn decide_handover(
        &mut self,
        now: Instant,
        page: PageId,
        (part, operator): (JausId, JausId),
        grant: bool,
        reply: Reply,
    ) {
        let number = part.subsystem();
        let Some(vehicle) = self.fleet.get_mut(number) else {
            return reply(Err(NO_VEHICLE.to_owned()));
        };
        if let Err(other) = vehicle.ownership.check(number, page) {
            return reply(Err(other.to_string()));
        }
        let Some(decision) = vehicle.handover.decide(part, operator, grant) else {
            return reply(Err("the request for control is over".to_owned()));
        };
        let mut sessions = Vec::new();
        if grant {
            vehicle.stop_driving(now, &mut self.client);
            vehicle.handover.ending = Some(format!("control was handed over to {operator}"));
            sessions = vehicle.release();
        }
        let component = self.client.component().clone();
        self.client.tell(reply, async move {
            // The vehicle hands over control before it is released.
            let delivered = component.deliver(part, &decision).await;
            release_all(sessions).await;
            delivered.map_err(|error| error.to_string())
        });
    }
}

impl Vehicle {
    /// Handles a request of an operator for this vehicle.
    fn handle_request(
        &mut self,
        now: Instant,
        operator: &Owner,
        request: &OperatorRequest,
        client: &mut Client,
        reply: Reply,
    ) {
        if matches!(request, OperatorRequest::DriveEnd) {
            // Who does not drive has nothing to end.
            if self.ownership.is_owned_by(operator.page) {
                self.stop_driving(now, client);
            }
            return reply(Ok(()));
        }
        let is_taken = self.is_wanted() || matches!(request, OperatorRequest::Control { on: true });
        let owned = match is_taken {
            true => self.claim(operator),
            false => self
                .ownership
                .check(self.number(), operator.page)
                .map_err(|it| it.to_string()),
        };
        if let Err(why) = owned {
            return reply(Err(why));
        }
        match *request {
            OperatorRequest::Control { on: true } => self.take_control(now, client, reply),
            OperatorRequest::Control { on: false } => self.release_control(now, client, reply),
            OperatorRequest::Resume => self.set_ready(now, true, client, reply),
            OperatorRequest::Standby => self.set_ready(now, false, client, reply),
            OperatorRequest::TakeOver => self.take_over(client, reply),
            OperatorRequest::Destination { x, y, speed } => {
                self.go_to((x, y), speed, client, reply);
            }
            OperatorRequest::Approve { mission } => self.approve(now, mission, client, reply),
            OperatorRequest::Continue { mission } => {
                self.continue_mission(now, mission, client, reply);
            }
            OperatorRequest::Stop => self.stop_mission(client, reply),
            // These have ways of their own.
            OperatorRequest::Select { .. }
            | OperatorRequest::Handover { .. }
            | OperatorRequest::Emergency { .. }
            | OperatorRequest::EmergencyAll { .. }
            | OperatorRequest::ClearAnyEmergency
            | OperatorRequest::Drive { .. }
            | OperatorRequest::DriveEnd => reply(Err("not a request for a vehicle".to_owned())),
        }
    }

    /// Makes the operator the vehicle's owner.
    pub(super) fn claim(&mut self, operator: &Owner) -> Outcome {
        let number = self.number();
        self.ownership
            .claim(number, operator)
            .map_err(|other| other.to_string())?;
        self.is_left = false;
        Ok(())
    }

    /// Its operator shows another vehicle: it is stopped and released, unless it is on a mission,
    /// which goes on.
    fn leave(&mut self, now: Instant, client: &mut Client) {
        self.manual.stop(now);
        self.handover.withdraw(client.component());
        if !self.is_wanted() || self.is_on_mission(now) {
            self.is_left = true;
            return self.stop_driving(now, client);
        }
        let driver = self.driver();
        let sessions = self.release();
        client.leave(self.number(), driver, sessions);
        self.is_leaving = true;
        self.manual.forget();
        self.ownership.release();
    }

    /// Releases a vehicle whose mission is over if its operator has left it, and frees one that is
    /// not under control.
    pub(super) fn handle_ownership(&mut self, now: Instant) {
        if self.is_left && self.is_wanted() && !self.is_on_mission(now) {
            tracing::info!("vehicle {}: the mission is over", self.number());
            drop(self.release());
        }
        if !self.is_wanted() && self.handover.holder().is_none() {
            self.is_left = false;
            self.ownership.release();
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
        let is_ours = planner.is_some_and(|it| it.controller() == Some(own));
        let drives = self
            .picture
            .mission()
            .is_some_and(|it| it.stage.is_driven());
        // A station that controls the drivers has taken over from the planner, or has lost it. The planner's own
        // report is no reason to hand them back.
        let wanted = if is_ours && drives && self.lease.wanted() != Wanted::Everything {
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

    fn release_control(&mut self, now: Instant, client: &mut Client, reply: Reply) {
        if self.handover.withdraw(client.component()) {
            return reply(Ok(()));
        }
        self.stop_driving(now, client);
        self.manual.forget();
        let sessions = self.release();
        self.ownership.release();
        client.tell(reply, async move {
            release_all(sessions).await;
            Ok(())
        });
    }

    /// Resumes all held parts or sends them to standby.
    fn set_ready(&mut self, now: Instant, ready: bool, client: &mut Client, reply: Reply) {
        let sessions = self.lease.all_held();
        if sessions.is_empty() {
            return reply(Err(NO_CONTROL.to_owned()));
        }
        if ready && self.picture.in_emergency().next().is_some() {
            return reply(Err("clear the emergency first".to_owned()));
        }
        self.lease.set_ready(ready);
        if ready && !self.is_driven_by_planner() {
            // The planner's mission is over, so the operator continues with all parts.
            self.control_drivers(client);
        }
        if !ready {
            self.stop_driving(now, client);
        }
        client.tell(reply, manage(sessions, ready));
    }

    /// Gives up what is left of control after another operator has taken it. The station does not
    /// take it again by itself.
    pub(super) fn yield_to_other(&mut self) {
        let own = self.picture.own();
        let Some((other, authority)) = self.picture.holder().filter(|(id, _)| *id != own) else {
            return;
        };
        if self.is_wanted() && self.lease.is_taken(&self.picture) {
            let ending = format!(
                "{other} has taken control with authority {authority}; the vehicle was stopped"
            );
            tracing::warn!("vehicle {}: {ending}", self.number());
            self.handover.ending = Some(ending);
            drop(self.release());
        }
    }
}

pub(super) const NO_VEHICLE: &str = "no vehicle is known yet";
pub(super) const NO_CONTROL: &str = "take control first";

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
pub(super) fn in_words(failures: &[String]) -> Outcome {
    if failures.is_empty() {
        Ok(())
    } else {
        Err(failures.join("; "))
    }
}
