//! One vehicle of the station: what is known of it, the subscriptions to its reports, control of it,
//! and its emergency.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use tokio::sync::mpsc;

use super::alarm::Alarm;
use super::client::Client;
use super::lease::{Lease, Wanted};
use super::manual_drive::ManualDrive;
use super::maps::Maps;
use crate::following::{Following, Sighting};
use crate::handover::{Content, Handover};
use crate::missing::Absence;
use crate::ownership::Ownership;
use crate::picture::{Depth, Picture};
use crate::report::Report;
use crate::role::Role;
use crate::state;
use crate::vehicle_link::VehicleLink;
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
    pub(super) ownership: Ownership,
    pub(super) manual: ManualDrive,
    pub(super) link: VehicleLink,
    /// Whether its operator has gone to another vehicle while it is on a mission. It is released at
    /// the end.
    pub(super) is_left: bool,
    /// Whether it is being stopped and released. Until then it is not driven.
    pub(super) is_leaving: bool,
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
            ownership: Ownership::default(),
            manual: ManualDrive::default(),
            link: VehicleLink::default(),
            is_left: false,
            is_leaving: false,
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
        if self.picture.depth() != depth {
            self.picture.set_depth(depth);
            self.following.follow(&self.picture);
        }
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
        self.handle_driving(now, client);
        self.handle_ownership(now);
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

    pub(super) fn fleet_state(&self, now: Instant) -> state::FleetVehicle {
        let held = !self.lease.all_held().is_empty();
        let requested = self.handover.is_requested();
        let owner = self.ownership.owner();
        let driver = owner.map_or_else(String::new, ToString::to_string);
        let flags = (held, requested, self.alarm.is_wanted());
        self.picture.fleet_state(now, driver, flags)
    }

    /// Asks a part for the round trip.
    pub(super) fn probe(&self, client: &mut Client) {
        if let Some(part) = self.picture.principal() {
            client.probe(part);
        }
    }

    pub(super) fn state(&self, now: Instant) -> Option<state::VehicleState> {
        let obstacle = |part| self.lease.obstacle(part);
        let emergency = (self.alarm.is_wanted(), self.alarm.is_clearing());
        self.picture.vehicle_state(now, emergency, obstacle)
    }

    pub(super) fn control_state(&self) -> state::Control {
        let owner = self.ownership.owner();
        let user = self.ownership.user().filter(|_| self.is_wanted());
        state::Control {
            user: user.map(ToString::to_string),
            page: owner.map(|it| it.page.0),
            resumed: self.lease.is_ready(),
            planner_drives: self.is_driven_by_planner(),
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
