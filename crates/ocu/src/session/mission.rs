//! Missions of a vehicle's planner, and who drives: the planner or the operator.

use std::sync::Arc;
use std::time::Instant;

use super::client::{Client, deliver, release_all};
use super::control::NO_CONTROL;
use super::lease::Wanted;
use super::vehicle::Vehicle;
use crate::orders::Reply;
use crate::role::Role;
use jaus::codec::Message;
use jaus::component::Session;
use jaus::service::State;
use jaus_vehicle::messages::ground::set_destination::Approved;
use jaus_vehicle::messages::ground::{
    ApproveMission, ContinueMission, SetDestination, StopMission,
};

impl Vehicle {
    /// Whether a planner that this station has let drive has not ended its mission.
    pub(super) fn is_driven_by_planner(&self) -> bool {
        let mission = self.picture.mission();
        let is_over = mission.is_some_and(|it| it.stage.is_over());
        self.lease.wanted() == Wanted::Planner && !is_over
    }

    /// Controls the drivers for the operator, instead of the planner.
    pub(super) fn control_drivers(&mut self, client: &mut Client) {
        if self.lease.wanted() == Wanted::Planner {
            drop(self.lease.want(Wanted::Everything, &self.picture));
            self.lease.handle_time(&self.picture, client);
        }
    }

    /// Takes over from the planner: its mission ends, and the operator gets its drivers.
    pub(super) fn take_over(&mut self, client: &mut Client, reply: Reply) {
        if !self.is_wanted() {
            return reply(Err(NO_CONTROL.to_owned()));
        }
        if !self.is_driven_by_planner() {
            return reply(Ok(()));
        }
        tracing::info!("the operator takes over from the planner");
        let planner = self.planner();
        client.tell(reply, async move {
            match planner {
                Some(planner) => deliver(&planner, &StopMission {}).await,
                None => Ok(()),
            }
        });
        self.control_drivers(client);
    }

    /// Plans a mission.
    pub(super) fn go_to(
        &mut self,
        (x, y): (f64, f64),
        speed: Option<f64>,
        client: &mut Client,
        reply: Reply,
    ) {
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
        if !self.is_driven_by_planner() {
            // The operator may drive until this mission is approved.
            self.control_drivers(client);
        }
        client.tell(reply, async move { deliver(&planner, &destination).await });
    }

    /// Lets the planner drive the path of a mission.
    pub(super) fn approve(&mut self, now: Instant, number: u32, client: &mut Client, reply: Reply) {
        match self.may_approve(now, number) {
            Ok(planner) => {
                let approval = ApproveMission { mission: number };
                self.let_planner_drive(now, planner, approval, client, reply);
            }
            Err(why) => reply(Err(why)),
        }
    }

    /// Lets the planner drive on after a fault.
    pub(super) fn continue_mission(
        &mut self,
        now: Instant,
        number: u32,
        client: &mut Client,
        reply: Reply,
    ) {
        match self.ready_planner() {
            Ok(planner) => {
                let command = ContinueMission { mission: number };
                self.let_planner_drive(now, planner, command, client, reply);
            }
            Err(why) => reply(Err(why)),
        }
    }

    /// Releases the drivers, so that the planner can control them, and then gives it a command.
    fn let_planner_drive<M: Message + Send + Sync + 'static>(
        &mut self,
        now: Instant,
        planner: Arc<Session>,
        command: M,
        client: &mut Client,
        reply: Reply,
    ) {
        self.manual.stop(now);
        let drivers = self.lease.want(Wanted::Planner, &self.picture);
        client.tell(reply, async move {
            release_all(drivers).await;
            deliver(&planner, &command).await
        });
    }

    /// The planner's session, if it can be given this mission's approval.
    fn may_approve(&self, now: Instant, number: u32) -> Result<Arc<Session>, String> {
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

    pub(super) fn stop_mission(&self, client: &mut Client, reply: Reply) {
        match self.planner() {
            Some(planner) => client.tell(
                reply,
                async move { deliver(&planner, &StopMission {}).await },
            ),
            None => reply(Err(NO_CONTROL.to_owned())),
        }
    }

    /// The session with the planner, if it is held and ready.
    fn ready_planner(&self) -> Result<Arc<Session>, String> {
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

    /// Stops the vehicle after the planner was lost while driving for this operator. Its drivers
    /// have no supervising client left, so the station takes control and sends them to standby.
    pub(super) fn stop_after_lost_planner(&mut self, now: Instant) {
        if let Some(planner) = self.picture.find(Role::Planner)
            && self.lease.has_ended(planner)
        {
            self.picture.handle_planner_restart(planner);
        }
        let Some((planner, how)) = self.picture.lost_planner(now) else {
            return;
        };
        if self.lease.wanted() == Wanted::Planner {
            tracing::warn!(
                "the planner {planner} {} while it drives: stopping the vehicle",
                how.words()
            );
            self.lease.want_stopped(&self.picture);
        } else if self.lease.is_ready() {
            self.picture.forget_planner_restart();
        }
    }

    /// Whether it is on a mission of this station, which goes on while its operator shows another
    /// vehicle. A planner that was lost counts: the station keeps the vehicle stopped.
    pub(super) fn is_on_mission(&self, now: Instant) -> bool {
        let mission = self.picture.mission();
        let goes_on = mission.is_some_and(|it| !it.stage.is_over());
        match self.lease.wanted() {
            Wanted::Nothing => false,
            Wanted::Planner => goes_on,
            Wanted::Everything => self.picture.lost_planner(now).is_some(),
        }
    }
}
