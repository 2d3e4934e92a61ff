//! One vehicle of the station: what is known of it, the subscriptions to its reports, control of it,
//! and its emergency.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use tokio::sync::mpsc;

use super::alarm::Alarm;
use super::client::Client;
use super::following::{Following, Sighting};
use super::handover::{Content, Handover};
use super::lease::{Lease, Wanted};
use super::maps::Maps;
use crate::missing::Absence;
use crate::picture::{Depth, Picture};
use crate::report::Report;
use crate::role::Role;
use crate::state;
use jaus::address::JausId;
use jaus::component::{Component, Session};
use jaus::service::{Directory, State};

/// A vehicle.
pub(super) struct Vehicle {
    pub(super) picture: Picture,
    pub(super) lease: Lease,
    pub(super) alarm: Alarm,
    pub(super) maps: Maps,
    pub(super) handover: Handover,
    following: Following,
    /// The missing parts that have been logged.
    missing: BTreeMap<JausId, Absence>,
}

impl Vehicle {
    pub(super) fn new(component: &Component, number: u16, sighted: mpsc::Sender<Sighting>) -> Self {
        Self {
            picture: Picture::new(component.id(), number, Depth::Brief),
            following: Following::new(component.clone(), sighted),
            lease: Lease::default(),
            alarm: Alarm::default(),
            maps: Maps::default(),
            handover: Handover::default(),
            missing: BTreeMap::new(),
        }
    }

    pub(super) const fn number(&self) -> u16 {
        self.picture.vehicle()
    }

    /// Whether this station controls it or is about to.
    pub(super) fn is_wanted(&self) -> bool {
        self.lease.wanted() != Wanted::Nothing
    }

    pub(super) fn set_depth(&mut self, depth: Depth) {
        self.picture.set_depth(depth);
        self.following.follow(&self.picture);
    }

    pub(super) fn handle_directory(&mut self, now: Instant, directory: &Arc<Directory>) {
        self.picture.handle_directory(now, directory);
        self.following.follow(&self.picture);
    }

    pub(super) fn handle_report(&mut self, now: Instant, by: JausId, report: Report) {
        self.picture.handle_report(now, by, report);
    }

    /// Handles the time: emergency, control, and a lost planner.
    pub(super) fn handle_time(&mut self, now: Instant, client: &mut Client) {
        self.picture.handle_time(now);
        if self.picture.depth() == Depth::Full {
            self.log_missing(now);
        }
        if self.is_stopped() {
            // Whatever the source of the emergency: nothing resumes on its own afterwards.
            self.lease.set_ready(false);
        }
        self.alarm.handle_time(now, &self.picture, client);
        self.stop_after_lost_planner(now);
        self.yield_to_other();
        self.handover
            .handle_time(now, client.authority(), client.component());
        self.lease.handle_time(&self.picture, client);
    }

    /// Gives up what is left of control after another operator has taken it. The station does not
    /// take it again by itself.
    fn yield_to_other(&mut self) {
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

    /// Handles a message about a handover.
    pub(super) fn handle_handover(
        &mut self,
        now: Instant,
        part: JausId,
        content: &Content,
        client: &mut Client,
    ) {
        match content {
            Content::Requests(requests) if self.is_wanted() && self.knows(part) => {
                self.handover.handle_requests(now, part, requests);
            }
            Content::Requests(_) => {}
            Content::Answer(answer) => {
                if self.handover.handle_answer(now, part, answer) {
                    let nobody = Box::new(|_| {});
                    self.lease
                        .take(Wanted::Everything, nobody, &self.picture, client);
                }
            }
        }
    }

    /// Logs parts that disappear, fall silent or return.
    fn log_missing(&mut self, now: Instant) {
        let mut missing = BTreeMap::new();
        for (id, name, how) in self.picture.missing(now) {
            missing.insert(id, how);
            if self.missing.get(&id) != Some(&how) {
                tracing::warn!("{name} {id} {}", how.words());
            }
        }
        for id in self.missing.keys().filter(|id| !missing.contains_key(id)) {
            if self.picture.parts().contains_key(id) {
                tracing::info!("{id} is back");
            }
        }
        self.missing = missing;
    }

    /// Stops the vehicle after the planner was lost while driving for this operator. Its drivers
    /// have no supervising client left, so the station takes control and sends them to standby.
    fn stop_after_lost_planner(&mut self, now: Instant) {
        if let Some(planner) = self.picture.find(Role::Planner)
            && self.lease.has_restarted(planner)
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

    /// Whether it is in emergency, or is to be.
    pub(super) fn is_stopped(&self) -> bool {
        self.alarm.is_wanted() || self.picture.in_emergency().next().is_some()
    }

    /// Whether its planner drives it.
    pub(super) fn is_driven_by_planner(&self) -> bool {
        let mission = self.picture.mission();
        mission.is_some_and(|it| it.stage.is_driven())
    }

    /// Whether it is on a mission of this station, which goes on while another vehicle is selected.
    /// A planner that was lost counts: the station keeps the vehicle stopped.
    pub(super) fn is_on_mission(&self, now: Instant) -> bool {
        let mission = self.picture.mission();
        let goes_on = mission.is_some_and(|it| !it.stage.is_over());
        match self.lease.wanted() {
            Wanted::Nothing => false,
            Wanted::Planner => goes_on,
            Wanted::Everything => self.picture.lost_planner(now).is_some(),
        }
    }

    /// Releases control. Returns the sessions to release.
    pub(super) fn release(&mut self) -> Vec<Arc<Session>> {
        self.lease.release(&self.picture)
    }

    /// The session with the primitive driver, if held.
    pub(super) fn driver(&self) -> Option<Arc<Session>> {
        self.lease.held(self.picture.find(Role::PrimitiveDriver)?)
    }

    /// The session with the planner, if held.
    pub(super) fn planner(&self) -> Option<Arc<Session>> {
        self.lease.held(self.picture.find(Role::Planner)?)
    }

    /// Whether a component is a part of the vehicle.
    fn knows(&self, part: JausId) -> bool {
        self.picture.parts().contains_key(&part)
    }

    /// Whether a part has reported this state.
    pub(super) fn is(&self, part: JausId, state: State) -> bool {
        let part = self.picture.parts().get(&part);
        part.is_some_and(|part| part.is(state))
    }

    pub(super) fn fleet_state(&self, now: Instant, selected: bool) -> state::FleetVehicle {
        let held = !self.lease.all_held().is_empty();
        let requested = self.handover.is_requested();
        self.picture.fleet_state(now, selected, (held, requested))
    }

    pub(super) fn state(&self, now: Instant) -> Option<state::VehicleState> {
        let obstacle = |part| self.lease.obstacle(part);
        self.picture
            .vehicle_state(now, self.alarm.is_wanted(), obstacle)
    }

    pub(super) fn control_state(&self) -> state::Control {
        state::Control {
            asking: self.handover.holder().map(|it| it.to_string()),
            requests: self.handover.requests(),
            handover: self.handover.ending.clone().unwrap_or_default(),
            ..self.lease.state(&self.picture)
        }
    }

    pub(super) fn mission_state(&self, now: Instant) -> Option<state::Mission> {
        let is_stopped = self.lease.is_stopped(&self.picture);
        self.picture.mission_state(now, is_stopped)
    }
}
