//! The vehicles of the station: those of the settings, or all that Discovery finds.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Instant;

use tokio::sync::mpsc;

use super::vehicle::Vehicle;
use crate::following::Sighting;
use crate::picture::{Depth, PRESENT};
use crate::role;
use crate::state;
use crate::tree::{self, LostComponents};
use jaus::component::Component;
use jaus::service::{Directory, Kind, SubsystemEntry};

/// The vehicles of the station.
pub(super) struct Fleet {
    component: Component,
    sighted: mpsc::Sender<Sighting>,
    /// The vehicles of the settings; empty for all that are discovered.
    chosen: Vec<u16>,
    directory: Arc<Directory>,
    lost: LostComponents,
    vehicles: BTreeMap<u16, Vehicle>,
}

impl Fleet {
    /// Limit of vehicles. Further ones are not shown.
    const MOST: usize = 256;

    pub(super) fn new(
        component: Component,
        chosen: Vec<u16>,
        sighted: mpsc::Sender<Sighting>,
    ) -> Self {
        let mut fleet = Self {
            component,
            sighted,
            directory: Arc::default(),
            lost: LostComponents::default(),
            vehicles: BTreeMap::new(),
            chosen,
        };
        for number in fleet.chosen.clone() {
            fleet.add(number);
        }
        fleet
    }

    pub(super) fn get(&self, number: u16) -> Option<&Vehicle> {
        self.vehicles.get(&number)
    }

    pub(super) fn get_mut(&mut self, number: u16) -> Option<&mut Vehicle> {
        self.vehicles.get_mut(&number)
    }

    pub(super) fn contains(&self, number: u16) -> bool {
        self.vehicles.contains_key(&number)
    }

    /// Whether a vehicle is known or may be discovered.
    pub(super) fn may_come(&self, number: u16) -> bool {
        self.chosen.is_empty() || self.chosen.contains(&number)
    }

    /// The numbers of all vehicles.
    pub(super) fn numbers(&self) -> impl Iterator<Item = u16> {
        self.vehicles.keys().copied()
    }

    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Vehicle> {
        self.vehicles.values_mut()
    }

    /// Follows all reports of the vehicles that pages show and of those under control, and few of
    /// others.
    pub(super) fn set_depths(&mut self, shown: &BTreeSet<u16>) {
        for (number, vehicle) in &mut self.vehicles {
            let is_full = shown.contains(number) || vehicle.is_wanted();
            vehicle.set_depth(if is_full { Depth::Full } else { Depth::Brief });
        }
    }

    /// Handles a change of the discovered components. Returns the vehicles that have joined.
    pub(super) fn handle_directory(&mut self, now: Instant) -> Vec<u16> {
        let directory = self.component.directory();
        if Arc::ptr_eq(&directory, &self.directory) {
            return Vec::new();
        }
        self.lost.handle_directory(now, &self.directory, &directory);
        self.directory = Arc::clone(&directory);
        let own = self.component.id().subsystem();
        let others = directory.subsystems().filter(|(number, _)| *number != own);
        let members = others.filter(|(number, known)| self.may_join(*number, known));
        let joined: Vec<u16> = members.map(|(number, _)| number).collect();
        let joined = joined.into_iter().filter(|&number| self.add(number));
        let joined = joined.collect();
        for vehicle in self.vehicles.values_mut() {
            vehicle.handle_directory(now, &directory);
        }
        joined
    }

    fn may_join(&self, number: u16, known: &SubsystemEntry) -> bool {
        self.chosen.is_empty() && !self.contains(number) && role::is_vehicle(known)
    }

    /// Adds a vehicle; false if it is known or the list is full.
    fn add(&mut self, number: u16) -> bool {
        if self.contains(number) {
            return false;
        }
        if self.vehicles.len() >= Self::MOST {
            tracing::warn!(
                "vehicle {number} is not shown: the list has {} already",
                Self::MOST
            );
            return false;
        }
        let vehicle = Vehicle::new(&self.component, number, self.sighted.clone());
        self.vehicles.insert(number, vehicle);
        true
    }

    /// The vehicle to begin with: the first of the settings, or one that preferably calls itself a
    /// vehicle.
    pub(super) fn first(&self) -> Option<u16> {
        if let Some(&first) = self.chosen.first() {
            return Some(first);
        }
        let is_named = |number: &&u16| {
            let known = self.directory.subsystem(**number);
            let identification = known.and_then(SubsystemEntry::identification);
            identification.is_some_and(|it| it.kind == Kind::Vehicle)
        };
        let named = self.vehicles.keys().find(is_named);
        named.or_else(|| self.vehicles.keys().next()).copied()
    }

    /// Drops vehicles that have stayed away, and those that turned out to be none; not those that an
    /// operator has stopped, which the station stops again when they come back.
    pub(super) fn drop_absent(&mut self, shown: &BTreeSet<u16>) {
        let Self {
            chosen, directory, ..
        } = self;
        self.vehicles.retain(|number, vehicle| {
            let known = directory.subsystem(*number);
            let is_other = known.is_some_and(|it| !role::is_vehicle(it));
            let is_absent = vehicle.picture.is_empty() || is_other;
            let is_kept = shown.contains(number) || chosen.contains(number);
            !is_absent || is_kept || vehicle.alarm.is_wanted()
        });
    }

    /// The list of vehicles, with whether all are to be stopped, and the number of stops taken.
    pub(super) fn state(&self, now: Instant, all_stopped: bool, stops: u64) -> state::Fleet {
        let vehicles = self.vehicles.values();
        state::Fleet {
            vehicles: vehicles.map(|it| it.fleet_state(now)).collect(),
            all_stopped,
            stops,
        }
    }

    /// The tree of all known components, and of those that were lost recently.
    pub(super) fn tree(&mut self, now: Instant) -> state::Tree {
        self.lost.handle_time(now);
        tree::of(&self.directory, &self.lost, |id| {
            let vehicle = self.vehicles.get(&id.subsystem());
            vehicle.map_or(PRESENT, |it| it.picture.condition(now, id))
        })
    }
}
