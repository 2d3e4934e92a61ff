//! Snapshots of a vehicle for the pages.

use std::time::Instant;

use super::{Part, Picture, state_name};
use crate::missing::Absence;
use crate::report::MissionStage;
use crate::role::Role;
use crate::state::{self, age};
use jaus::address::JausId;

impl Picture {
    /// The overlay of the map for a page that has the zones of a revision.
    pub(crate) fn overlay_state(&self, known_zones: u32) -> state::Overlay {
        self.overlay.state(known_zones)
    }

    /// Snapshot of the vehicle. `obstacle` returns why a part is not under control.
    pub(crate) fn vehicle_state(
        &self,
        now: Instant,
        (emergency_wanted, emergency_clearing): (bool, bool),
        obstacle: impl Fn(JausId) -> Option<String>,
    ) -> Option<state::VehicleState> {
        let is_known = self.directory.subsystem(self.vehicle).is_some();
        if !is_known && self.is_empty() {
            return None;
        }
        let mut parts: Vec<_> = self.parts.iter().collect();
        parts.sort_by_key(|(id, part)| (part.role, **id));
        let describe = |(id, part): (&JausId, &Part)| self.part_state(*id, part, obstacle(*id));
        let any = self.in_emergency().next().is_some();
        let driver = self.find(Role::PrimitiveDriver);
        let status = driver.and_then(|id| self.parts.get(&id)?.status);
        Some(state::VehicleState {
            subsystem: self.vehicle,
            name: self.name.clone(),
            pose: self.pose.map(|known| state::Pose {
                age_ms: age(now, known.at),
                ..known.what
            }),
            place: self.georeference.state(now),
            velocity: self.velocity.map(|known| state::Velocity {
                age_ms: age(now, known.at),
                ..known.what
            }),
            parts: parts.into_iter().map(describe).collect(),
            missing: self.missing_state(now),
            stale: self.stale(now),
            status_age_ms: status.map(|known| age(now, known.at)),
            emergency: self.is_in_emergency(now, emergency_wanted),
            emergency_of_others: any && !emergency_wanted && !emergency_clearing,
            stop_set: emergency_wanted,
            at_rest: self.at_rest(now),
            runaway: self.is_runaway(now),
            held: self.hold_reason(now),
            overlay: self.overlay.revision(now),
        })
    }

    /// The vehicle in the list of vehicles, with the operator of this station who has it. The flags
    /// state whether the station controls it, is requested to hand it over, and has put it in emergency.
    pub(crate) fn fleet_state(
        &self,
        now: Instant,
        driver: String,
        (held, requested, stop_set): (bool, bool, bool),
    ) -> state::FleetVehicle {
        let principal = self.principal().and_then(|id| self.parts.get(&id));
        let status = principal.and_then(|part| part.status);
        let presence = match principal {
            None if self.is_empty() => "unknown",
            None => "gone",
            Some(part) if part.is_silent(now, self.depth.silent()) => "silent",
            Some(_) => "present",
        };
        let holder = self.holder();
        let mission = self.mission().map(|it| it.stage);
        let heard = self.parts.values().filter_map(|part| part.heard);
        let heard = heard.chain(self.gone.iter().filter_map(|(_, part)| part.heard));
        let heard = heard.max();
        state::FleetVehicle {
            subsystem: self.vehicle,
            name: self.name.clone(),
            driver,
            presence,
            state: status.map(|known| state_name(known.what)),
            emergency: self.is_in_emergency(now, stop_set),
            stop_set,
            speed: self.fresh_velocity(now).and_then(|it| it.x),
            at_rest: self.at_rest(now),
            runaway: self.is_runaway(now),
            controller: holder.map(|(id, _)| id.to_string()),
            authority: holder.map(|(_, authority)| authority),
            held,
            requested,
            mission: mission.filter(|it| !it.is_over()).map(MissionStage::name),
            age_ms: heard.map(|at| age(now, at)),
        }
    }

    fn part_state(&self, id: JausId, part: &Part, obstacle: Option<String>) -> state::Part {
        let controller = part.controller.and_then(|known| known.what);
        state::Part {
            id: id.to_string(),
            role: part.role.name(),
            managed: part.managed,
            state: part.status.map(|known| state_name(known.what)),
            controller: controller.map(|(id, _)| id.to_string()),
            authority: controller.map(|(_, authority)| authority),
            ours: controller.is_some_and(|(id, _)| id == self.own),
            obstacle,
            stage: part.stage.clone(),
        }
    }

    /// Snapshot of the mission with its path, also of a planner lost while driving. `told_to_stop`
    /// states whether the drivers were stopped for that reason.
    pub(crate) fn mission_state(&self, now: Instant, told_to_stop: bool) -> Option<state::Mission> {
        let known = self.mission.as_ref()?;
        let lost = self.lost_planner(now).map(|(id, how)| state::LostPlanner {
            id: id.to_string(),
            how: how.name(),
            told_to_stop,
        });
        let is_known = lost.is_some() || self.parts.contains_key(&known.by);
        is_known.then(|| state::Mission {
            path: self.path.clone(),
            age_ms: age(now, known.at),
            lost,
            ..known.what.state()
        })
    }

    /// The map to show: the planner's map, or the first.
    pub(crate) fn map_state(&self) -> Option<state::Map> {
        let traversability = |map: &&state::Map| map.name == "traversability";
        let map = self.maps.iter().find(traversability);
        map.or_else(|| self.maps.first()).cloned()
    }

    pub(super) fn missing_state(&self, now: Instant) -> Vec<state::Missing> {
        let describe = |(id, name, how): (JausId, &str, Absence)| {
            let part = self.parts.get(&id).map(|it| (it.role, it.heard));
            let gone = || self.gone.get(id).map(|it| (it.role, it.heard));
            let (role, heard) = part.or_else(gone).unwrap_or((Role::Other, None));
            state::Missing {
                id: id.to_string(),
                role: role.name(),
                name: name.to_owned(),
                how: how.name(),
                age_ms: heard.map(|at| age(now, at)),
            }
        };
        self.missing(now).map(describe).collect()
    }
}
