//! The vehicle that all mobility services of a component share, and each of them as a component
//! offers it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use super::acceleration_state_sensor::AccelerationStateSensor;
use super::behaviour::Behaviour;
use super::clock::SampleClock;
use super::cockpit::Cockpit;
use super::exchange::Exchange;
use super::global_pose_sensor::GlobalPoseSensor;
use super::list_driver::ListDriver;
use super::local_pose_sensor::LocalPoseSensor;
use super::path_kinds::{GlobalPath, LocalPath};
use super::primitive_driver::PrimitiveDriver;
use super::vector_driver::{GlobalVectorDriver, LocalVectorDriver};
use super::velocity_state_driver::VelocityStateDriver;
use super::velocity_state_sensor::VelocityStateSensor;
use super::waypoint_driver::WaypointDriver;
use super::waypoint_kinds::{Global, Local};
use crate::codec::ServiceId;
use crate::endpoint::Received;
use crate::service::{
    Context, Elements, Handled, ListManager, Service, Standing, TimeOfDay, code_of,
};
use crate::vehicle::{GlobalPose, Motion, Pilot};

/// A vehicle as the mobility services see it. Cheap to clone; the clones are one vehicle.
#[derive(Clone)]
pub struct Vehicle {
    cockpit: Arc<Mutex<Cockpit>>,
}

impl Vehicle {
    /// A vehicle that nobody drives yet, and that does not know what time it is: its reports carry
    /// no time stamps.
    #[must_use]
    pub fn new(pilot: Pilot) -> Self {
        Self {
            cockpit: Arc::new(Mutex::new(Cockpit::new(pilot))),
        }
    }

    /// Stamps its reports with the times at which their samples were taken. Share the time with the
    /// component's [`Time`](crate::service::Time) service, so that Set Time sets the stamps, too.
    #[must_use]
    pub fn with_clock(self, time: TimeOfDay) -> Self {
        self.lock().clock = Some(SampleClock::new(time));
        self
    }

    /// Has it move on to `now`, for who reads it without a message.
    pub fn handle_time(&self, now: Instant) {
        drop(self.at(now));
    }

    /// Gives up whatever it is driven to, and stops.
    pub fn stop(&self) {
        self.lock().pilot.stop();
    }

    /// Whether it has something to do that is not done.
    #[must_use]
    pub fn is_under_way(&self) -> bool {
        self.lock().pilot.is_under_way()
    }

    /// Whether it has done what it was driven to do.
    #[must_use]
    pub fn has_arrived(&self) -> bool {
        let cockpit = self.lock();
        cockpit.pilot.is_there() && cockpit.travel.active().is_none()
    }

    /// How much of the list that it works off lies behind it, in percent.
    #[must_use]
    pub fn progress(&self) -> u8 {
        self.lock().progress()
    }

    /// Whether it has stopped because its [pilot](Pilot::give_up_after) was left alone.
    #[must_use]
    pub fn was_left_alone(&self) -> bool {
        self.lock().pilot.was_left_alone()
    }

    /// Where it was last and how it moved.
    #[must_use]
    pub fn motion(&self) -> Motion {
        self.lock().pilot.motion()
    }

    /// Where on the globe it was last.
    #[must_use]
    pub fn global_pose(&self) -> GlobalPose {
        self.lock().pilot.global_pose()
    }

    /// Velocity State Sensor: tells how fast it moves.
    #[must_use]
    pub fn velocity_state_sensor(&self) -> OnVehicle {
        self.service(VelocityStateSensor)
    }

    /// Acceleration State Sensor: tells how its velocity changes.
    #[must_use]
    pub fn acceleration_state_sensor(&self) -> OnVehicle {
        self.service(AccelerationStateSensor)
    }

    /// Local Pose Sensor: tells where it is in its local frame, and lets the client in control
    /// say where that is.
    #[must_use]
    pub fn local_pose_sensor(&self) -> OnVehicle {
        self.service(LocalPoseSensor)
    }

    /// Global Pose Sensor: tells where it is on the globe, and lets the client in control say
    /// where that is.
    #[must_use]
    pub fn global_pose_sensor(&self) -> OnVehicle {
        self.service(GlobalPoseSensor)
    }

    /// Primitive Driver: uses its drives and brakes without feedback.
    #[must_use]
    pub fn primitive_driver(&self) -> OnVehicle {
        self.service(PrimitiveDriver::default())
    }

    /// Local Waypoint Driver: drives to one waypoint in the local frame.
    #[must_use]
    pub fn local_waypoint_driver(&self) -> OnVehicle {
        self.service(WaypointDriver::<Local>::new())
    }

    /// Global Waypoint Driver: drives to one waypoint on the globe.
    #[must_use]
    pub fn global_waypoint_driver(&self) -> OnVehicle {
        self.service(WaypointDriver::<Global>::new())
    }

    /// List Manager: keeps the list of the list drivers, one for all of them. It takes what they
    /// can drive to.
    #[must_use]
    pub fn list_manager(&self) -> ListManager {
        ListManager::new(self.elements())
    }

    /// Local Waypoint List Driver: drives to waypoints in the local frame, one after the other.
    /// Needs the [`list_manager`](Self::list_manager) beside it.
    #[must_use]
    pub fn local_waypoint_list_driver(&self) -> OnVehicle {
        self.service(ListDriver::<Local>::on(&self.elements()))
    }

    /// Global Waypoint List Driver: drives to waypoints on the globe, one after the other. Needs
    /// the [`list_manager`](Self::list_manager) beside it.
    #[must_use]
    pub fn global_waypoint_list_driver(&self) -> OnVehicle {
        self.service(ListDriver::<Global>::on(&self.elements()))
    }

    /// Velocity State Driver: keeps a velocity.
    #[must_use]
    pub fn velocity_state_driver(&self) -> OnVehicle {
        self.service(VelocityStateDriver::default())
    }

    /// Local Vector Driver: keeps a speed and a heading in the local frame.
    #[must_use]
    pub fn local_vector_driver(&self) -> OnVehicle {
        self.service(LocalVectorDriver::default())
    }

    /// Global Vector Driver: keeps a speed and a heading on the globe.
    #[must_use]
    pub fn global_vector_driver(&self) -> OnVehicle {
        self.service(GlobalVectorDriver::default())
    }

    /// Local Path Segment Driver: drives along curves in the local frame, one after the other.
    /// Needs the [`list_manager`](Self::list_manager) beside it.
    #[must_use]
    pub fn local_path_segment_driver(&self) -> OnVehicle {
        self.service(ListDriver::<LocalPath>::on(&self.elements()))
    }

    /// Global Path Segment Driver: drives along curves on the globe, one after the other. Needs
    /// the [`list_manager`](Self::list_manager) beside it.
    #[must_use]
    pub fn global_path_segment_driver(&self) -> OnVehicle {
        self.service(ListDriver::<GlobalPath>::on(&self.elements()))
    }

    fn elements(&self) -> Elements {
        self.lock().elements.clone()
    }

    fn service(&self, behaviour: impl Behaviour + 'static) -> OnVehicle {
        OnVehicle {
            vehicle: self.clone(),
            behaviour: Box::new(behaviour),
            only_newest: false,
            steps: 0,
        }
    }

    fn lock(&self) -> MutexGuard<'_, Cockpit> {
        self.cockpit.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The cockpit, its vehicle having moved on to `now`.
    fn at(&self, now: Instant) -> MutexGuard<'_, Cockpit> {
        let mut cockpit = self.lock();
        cockpit.pilot.handle_time(now);
        cockpit
    }
}

impl std::fmt::Debug for Vehicle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Vehicle")
            .field("motion", &self.motion())
            .finish()
    }
}

/// A mobility service of a [`Vehicle`], to be offered by a component.
pub struct OnVehicle {
    vehicle: Vehicle,
    behaviour: Box<dyn Behaviour>,
    only_newest: bool,
    /// The step of the vehicle that was told last.
    steps: u64,
}

impl OnVehicle {
    /// Lists only the newest version, whose messages include those of the older ones.
    ///
    /// What a component tells about its services should fit into one packet, because some peers
    /// (JAUS++) cannot read longer messages of others. A component with many services saves room
    /// like this.
    #[must_use]
    pub const fn only_newest(mut self) -> Self {
        self.only_newest = true;
        self
    }
}

impl std::fmt::Debug for OnVehicle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OnVehicle")
            .field("offers", &self.offers())
            .finish()
    }
}

impl Service for OnVehicle {
    fn offers(&self) -> Vec<ServiceId> {
        let mut offers = self.behaviour.offers();
        if self.only_newest {
            offers.truncate(1);
        }
        offers
    }

    fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        let Some(code) = code_of(&message.payload) else {
            return Handled::No;
        };
        let mut exchange = Exchange {
            now,
            cockpit: &mut self.vehicle.at(now),
            message,
            context,
        };
        self.behaviour.handle(code, &mut exchange)
    }

    fn handle_timeout(&mut self, now: Instant, context: &mut Context<'_>) {
        let mut cockpit = self.vehicle.at(now);
        let steps = cockpit.pilot.steps();
        if self.steps != steps {
            self.steps = steps;
            self.behaviour.handle_motion(&mut cockpit, context);
        }
    }

    fn handle_standing(&mut self, now: Instant, before: &Standing, context: &mut Context<'_>) {
        if context.standing().stops(before) {
            let mut cockpit = self.vehicle.at(now);
            cockpit.pilot.stop();
            self.behaviour.handle_stop(&mut cockpit, context);
        }
    }

    fn tells_end_of(&self, command: u16) -> bool {
        self.behaviour.tells_end_of(command)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.vehicle.lock().pilot.poll_timeout()
    }
}
