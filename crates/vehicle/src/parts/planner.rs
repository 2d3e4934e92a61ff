//! The planner (component 36): carries out the missions of an operator.
//!
//! It offers Mission Planner, gets the map from the knowledge store and the pose from the pose
//! sensor, plans, takes control of the path segment driver, hands over the segments, and monitors
//! all drivers of the chain until the vehicle has arrived. It discovers these components in its own
//! subsystem, repeatedly if necessary.

pub(super) mod chain;
mod hand_over;
pub(super) mod map;
mod survey;
mod task;

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{Notify, mpsc};

use super::drivers::{Sense, shut_down};
use super::{Part, PartError, Slot};
use crate::ground::Missions;
use crate::handoff::Handoff;
use crate::mission::{Footprint, Link, Settings};
use jaus::address::JausId;
use jaus::component::{AccessControl, Audience, Component, FindError, Management};
use task::PlannerTask;

/// Settings of a planner.
#[derive(Debug, Clone, PartialEq)]
pub struct Planner {
    /// Dimensions of the vehicle.
    pub vehicle: Footprint,
    /// Timeouts, retries and speed of missions.
    pub mission: Settings,
    /// Name of the map to plan on. A single map is used whatever its name.
    pub map: String,
    /// The authority used to control the path segment driver, from 0 to 255, where the client has no less.
    pub authority: u8,
    /// The minimum authority of a client to control the planner.
    pub least_authority: u8,
    /// Maximum distance of the vehicle from the line of a segment, in metres.
    pub tolerance: f64,
}

impl Default for Planner {
    fn default() -> Self {
        Self {
            vehicle: Footprint::default(),
            mission: Settings::default(),
            map: "traversability".to_owned(),
            authority: 100,
            least_authority: 1,
            tolerance: 0.3,
        }
    }
}

impl Planner {
    /// Sets the vehicle's least turning radius in metres; 0 if it turns on the spot.
    #[must_use]
    pub const fn turning_radius(mut self, radius: f64) -> Self {
        self.vehicle.turning_radius = radius;
        self
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
            .offer(Handoff::new())
            .live_on(slot.port)?;
        slot.telemetry.attach(&component);
        let (tell, news) = mpsc::channel(PlannerTask::NEWS);
        let task = PlannerTask::new(&self, &component, missions, &wake, slot.telemetry);
        let watch = |link| chain::watch(&component, link, &tell);
        let poses = Sense::pose(&component, POSES)?;
        let scans = Sense::scans(&component, SCANS)?;
        // Each of these runs until it cannot continue.
        tokio::select! {
            () = task.work(news) => {}
            () = watch(Link::Path) => {}
            () = watch(Link::Vector) => {}
            () = watch(Link::Primitive) => {}
            end = chain::follow(poses, &tell) => end?,
            end = chain::look_around(scans, &tell) => end?,
            end = shut_down(&component) => return end,
        }
        Err(PartError::NodeStopped)
    }
}

/// Report rate requested for the pose, in hertz. The pose is recorded for the return path, and places
/// what the range sensor sees.
const POSES: f64 = 10.0;
/// Scan rate requested from the range sensor, in hertz.
const SCANS: f64 = 5.0;

/// Finds a component, with an error for the operator. `what` says what it is.
async fn find_soon(
    component: &Component,
    audience: Audience,
    what: &str,
) -> Result<JausId, String> {
    let found = component.find_within(audience, PATIENCE).await;
    found.map_err(|error| match error {
        FindError::NotFound { .. } => format!(
            "no {what} found in subsystem {} within {} s: start one",
            component.id().subsystem(),
            PATIENCE.as_secs()
        ),
        stopped => stopped.to_string(),
    })
}

/// The components of this one's subsystem that offer a service.
fn on_board(component: &Component, urn: &str) -> Audience {
    Audience::providers(urn).in_subsystem(component.id().subsystem())
}

const PATIENCE: Duration = Duration::from_secs(5);
