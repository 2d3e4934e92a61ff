//! Handling of requests: preconditions, actions, and reasons for refusal.

use std::sync::Arc;
use std::time::Instant;

use super::client::deliver;
use super::lease::{Wanted, release_all};
use super::{Order, Reply, Session};
use crate::PageId;
use crate::request::OperatorRequest;
use crate::role::Role;
use crate::stick::Push;
use jaus::address::JausId;
use jaus::component::Session as PartSession;
use jaus::service::State;
use jaus_vehicle::messages::ground::set_destination::Approved;
use jaus_vehicle::messages::ground::{ApproveMission, SetDestination, StopMission};

/// Success, or the reason for failure.
type Outcome = Result<(), String>;

impl Session {
    pub(super) fn handle_order(&mut self, now: Instant, order: Order) {
        match order {
            Order::OperatorRequest {
                page,
                request,
                reply,
            } => self.handle_wish(now, page, request, reply),
            Order::Cells { map, reply } => {
                let (store, map) = (self.picture.store(), self.picture.map(map));
                self.maps.want(store, map, &mut self.client, reply);
            }
            Order::Gone(page) => self.stick.handle_release(now, page),
        }
    }

    fn handle_wish(&mut self, now: Instant, page: PageId, request: OperatorRequest, reply: Reply) {
        match request {
            OperatorRequest::Select { subsystem } => reply(self.select(now, subsystem)),
            OperatorRequest::Control { on: true } => self.take_control(reply),
            OperatorRequest::Control { on: false } => self.release_control(now, reply),
            OperatorRequest::Resume => self.set_ready(now, true, reply),
            OperatorRequest::Standby => self.set_ready(now, false, reply),
            OperatorRequest::Emergency { on: true } => self.set_emergency(now, reply),
            OperatorRequest::Emergency { on: false } => {
                self.alarm
                    .clear(now, &self.picture, &mut self.client, reply);
            }
            OperatorRequest::Drive { forward, turn } => reply(self.drive(now, page, forward, turn)),
            OperatorRequest::DriveEnd => {
                self.stick.handle_release(now, page);
                self.steer(now);
                reply(Ok(()));
            }
            OperatorRequest::Destination { x, y, speed } => self.go_to(x, y, speed, reply),
            OperatorRequest::Approve { mission } => self.approve(now, mission, reply),
            OperatorRequest::Stop => self.stop(reply),
        }
    }

    fn select(&mut self, now: Instant, subsystem: u16) -> Outcome {
        if self.picture.vehicle() == Some(subsystem) {
            return Ok(());
        }
        if self.alarm.is_wanted() {
            return Err("clear this vehicle's emergency before choosing another".to_owned());
        }
        self.picture.select(now, subsystem)?;
        self.stick.stop(now);
        // The held controls belong to the previous vehicle. Dropping them releases them.
        drop(self.lease.release(&self.picture));
        self.following.follow(&self.picture);
        Ok(())
    }

    fn take_control(&mut self, reply: Reply) {
        if self.picture.parts().is_empty() {
            return reply(Err(NO_VEHICLE.to_owned()));
        }
        // Keep a mission that this operator has in progress.
        let own = self.client.component().id();
        let planner = self.picture.find(Role::Planner);
        let planner = planner.and_then(|id| self.picture.parts().get(&id));
        let ours = planner.is_some_and(|it| it.controller() == Some(own));
        let wanted = if ours && self.is_driven_by_planner() {
            Wanted::Planner
        } else {
            Wanted::Everything
        };
        self.lease
            .take(wanted, reply, &self.picture, &mut self.client);
    }

    fn release_control(&mut self, now: Instant, reply: Reply) {
        self.stick.stop(now);
        self.steer(now);
        let sessions = self.lease.release(&self.picture);
        self.client.tell(reply, async move {
            release_all(sessions).await;
            Ok(())
        });
    }

    /// Resumes all held parts or sends them to standby.
    fn set_ready(&mut self, now: Instant, ready: bool, reply: Reply) {
        let sessions = self.lease.all_held();
        if sessions.is_empty() {
            return reply(Err(NO_CONTROL.to_owned()));
        }
        if ready && self.picture.in_emergency().next().is_some() {
            return reply(Err("clear the emergency first".to_owned()));
        }
        self.lease.set_ready(ready);
        if ready && self.lease.wanted() == Wanted::Planner && !self.is_driven_by_planner() {
            // The planner's mission is over, so the operator continues with all parts.
            drop(self.lease.want(Wanted::Everything, &self.picture));
        }
        if !ready {
            self.stick.stop(now);
            self.steer(now);
        }
        self.client.tell(reply, manage(sessions, ready));
    }

    fn set_emergency(&mut self, now: Instant, reply: Reply) {
        if !self.picture.parts().values().any(|part| part.managed) {
            return reply(Err(NO_VEHICLE.to_owned()));
        }
        self.stick.stop(now);
        self.lease.set_ready(false);
        self.steer(now);
        self.alarm.set(now, &self.picture, &mut self.client, reply);
    }

    fn drive(&mut self, now: Instant, page: PageId, forward: f64, turn: f64) -> Outcome {
        let push = Push::new(forward, turn)
            .ok_or("forward and turn range from -1 to 1; the command is ignored")?;
        if self.lease.wanted() == Wanted::Nothing {
            return Err(NO_CONTROL.to_owned());
        }
        let driver = self.picture.find(Role::PrimitiveDriver);
        let driver = driver.ok_or("the vehicle has no primitive driver")?;
        if self.alarm.is_wanted() || self.is(driver, State::Emergency) {
            return Err("the vehicle is in emergency; clear it first".to_owned());
        }
        if !self.lease.is_ready() {
            return Err("the vehicle is in standby; resume first".to_owned());
        }
        if let Some(why) = self.picture.stale(now) {
            self.stick.handle_release(now, page);
            self.steer(now);
            return Err(why);
        }
        self.stick
            .handle_push(now, page, push)
            .map_err(|busy| busy.to_string())?;
        self.halted = None;
        self.take_over();
        if let Some(why) = self.lease.obstacle(driver) {
            self.stick.handle_release(now, page);
            return Err(why);
        }
        self.steer(now);
        Ok(())
    }

    /// Takes over from the planner if it drives.
    fn take_over(&mut self) {
        if self.lease.wanted() != Wanted::Planner {
            return;
        }
        tracing::info!("the operator takes over from the planner");
        if let Some(planner) = self.planner() {
            let nobody = Box::new(|_: Outcome| {});
            self.client.tell(
                nobody,
                async move { deliver(&planner, &StopMission {}).await },
            );
        }
        drop(self.lease.want(Wanted::Everything, &self.picture));
        self.lease.handle_time(&self.picture, &mut self.client);
    }

    fn go_to(&mut self, x: f64, y: f64, speed: Option<f64>, reply: Reply) {
        let planner = match self.ready_planner() {
            Ok(planner) => planner,
            Err(why) => return reply(Err(why)),
        };
        if !x.is_finite() || !y.is_finite() || speed.is_some_and(|it| !(it > 0.0 && it <= 100.0)) {
            let why = "a destination has x and y in metres, and a speed above 0 and up to 100 m/s";
            return reply(Err(why.to_owned()));
        }
        let mut destination = SetDestination {
            x,
            y,
            approved: Approved::NO,
            ..SetDestination::default()
        };
        destination.speed = speed.map(|it| it as f32);
        self.client
            .tell(reply, async move { deliver(&planner, &destination).await });
    }

    /// Lets the planner drive. The drivers are released first, so that the planner can control
    /// them.
    fn approve(&mut self, now: Instant, number: u32, reply: Reply) {
        let planner = match self.ready_planner() {
            Ok(planner) => planner,
            Err(why) => return reply(Err(why)),
        };
        match self.picture.mission() {
            Some(it) if it.number == number && it.stage.awaits_approval() => {}
            Some(it) => {
                let (known, stage) = (it.number, it.stage.name().replace('_', " "));
                return reply(Err(format!(
                    "mission {number} is not awaiting approval: the planner has mission {known}, \
                     which is {stage}"
                )));
            }
            None => return reply(Err("the planner has not reported a mission yet".to_owned())),
        }
        if let Some(why) = self.picture.stale(now) {
            return reply(Err(why));
        }
        if !self.picture.is_position_known() {
            return reply(Err("the vehicle's pose is unknown".to_owned()));
        }
        self.stick.stop(now);
        let drivers = self.lease.want(Wanted::Planner, &self.picture);
        self.client.tell(reply, async move {
            release_all(drivers).await;
            deliver(&planner, &ApproveMission { mission: number }).await
        });
    }

    fn stop(&mut self, reply: Reply) {
        let Some(planner) = self.planner() else {
            return reply(Err(NO_CONTROL.to_owned()));
        };
        self.client.tell(
            reply,
            async move { deliver(&planner, &StopMission {}).await },
        );
    }

    /// The session with the planner, if held.
    fn planner(&self) -> Option<Arc<PartSession>> {
        self.lease.held(self.picture.find(Role::Planner)?)
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

    fn is_driven_by_planner(&self) -> bool {
        self.picture
            .mission()
            .is_some_and(|it| it.stage.is_driven())
    }

    fn is(&self, part: JausId, state: State) -> bool {
        let part = self.picture.parts().get(&part);
        part.is_some_and(|part| part.is(state))
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
    if wrong.is_empty() {
        Ok(())
    } else {
        Err(wrong.join("; "))
    }
}
