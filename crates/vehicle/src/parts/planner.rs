//! The planner (component 36): carries out what an operator wants of a mission.
//!
//! It offers the Mission Planner, asks the knowledge store for the map and the pose sensor for the
//! pose, plans, takes the path segment driver under control, hands it the segments, and watches all
//! drivers of the chain until the vehicle has arrived. Whom it needs it finds in its own subsystem,
//! again and again if need be.
#![expect(clippy::disallowed_methods, reason = "here patience is counted")]

pub(super) mod chain;
mod hand_over;
pub(super) mod map;
mod task;

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{Notify, mpsc};

use super::drivers::{Sense, shut_down};
use super::{Part, PartError, Slot};
use crate::ground::Missions;
use crate::mission::{Link, Settings, Vehicle};
use jaus::address::JausId;
use jaus::component::{AccessControl, Component, Management};
use task::PlannerTask;

/// The settings of a planner.
#[derive(Debug, Clone, PartialEq)]
pub struct Planner {
    /// How much room the vehicle needs.
    pub vehicle: Vehicle,
    /// How patient missions are, and how fast.
    pub mission: Settings,
    /// What the map is called that is planned on; if there is only one, it is taken whatever it is
    /// called.
    pub map: String,
    /// With which authority, from 0 to 255, the path segment driver is controlled.
    pub authority: u8,
    /// The least authority that a client needs to control the planner.
    pub least_authority: u8,
    /// How far from the straight line of a segment the vehicle may be, in metres.
    pub tolerance: f64,
}

impl Default for Planner {
    fn default() -> Self {
        Self {
            vehicle: Vehicle::default(),
            mission: Settings::default(),
            map: "traversability".to_owned(),
            authority: 100,
            least_authority: 1,
            tolerance: 0.3,
        }
    }
}

impl Part for Planner {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let wake = Arc::new(Notify::new());
        let waker = Arc::clone(&wake);
        let missions = Missions::new(self.mission, move || waker.notify_one());
        let control = AccessControl::new().authority(self.least_authority);
        let component = slot
            .component("Planner")
            .management(Management::new().access_control(control))
            .offer(missions.service())
            .live_on(slot.port)?;
        let (tell, news) = mpsc::channel(PlannerTask::NEWS);
        let task = PlannerTask::new(&self, &component, missions, &wake);
        let watch = |link| chain::watch(&component, link, &tell);
        let poses = Sense::pose(&component, POSES)?;
        // They go on until one of them can not.
        tokio::select! {
            () = task.work(news) => {}
            () = watch(Link::Path) => {}
            () = watch(Link::Vector) => {}
            () = watch(Link::Primitive) => {}
            end = chain::follow(poses, &tell) => end?,
            end = shut_down(&component) => return end,
        }
        Err(PartError::NodeStopped)
    }
}

/// How often the pose is asked for, in hertz: for the way back.
const POSES: f64 = 2.0;

/// Waits until another component of the subsystem is known that offers all of these services;
/// `None` when the component has stopped.
async fn find(component: &Component, services: &[&str]) -> Option<JausId> {
    let mut changes = component.watch();
    loop {
        let directory = component.directory();
        let own = component.id();
        let offers = |other: &jaus::service::Component| {
            other.id != own
                && other.id.subsystem() == own.subsystem()
                && services
                    .iter()
                    .all(|urn| other.offered().any(|offer| offer.urn == *urn))
        };
        if let Some(found) = directory.components().find(|other| offers(other)) {
            return Some(found.id);
        }
        changes.next().await?;
    }
}

/// The same for at most [`PATIENCE`], with an error for people.
async fn find_soon(component: &Component, services: &[&str], what: &str) -> Result<JausId, String> {
    match tokio::time::timeout(PATIENCE, find(component, services)).await {
        Ok(Some(found)) => Ok(found),
        Ok(None) => Err("the node has stopped".to_owned()),
        Err(_) => Err(format!(
            "no {what} was found in subsystem {} within {} s: start one",
            component.id().subsystem(),
            PATIENCE.as_secs()
        )),
    }
}

const PATIENCE: Duration = Duration::from_secs(5);
