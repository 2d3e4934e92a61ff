//! The vehicle shared by all mobility services of a component, and the constructors of these
//! services.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::acceleration_state_sensor::AccelerationStateSensor;
use super::behaviour::Behaviour;
use super::clock::SampleClock;
use super::controls::Controls;
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
use crate::motion::{Frame, GlobalPose, Motion, Pilot};
use jaus::address::JausId;
use jaus::codec::ServiceId;
use jaus::endpoint::Received;
use jaus::service::{
    Context, Elements, Handled, Hazards, ListManager, MotionPolicy, Service, Standing, StopCause,
    TimeOfDay, code_of,
};

/// A vehicle as used by the mobility services. Cheap to clone; all clones share one state.
///
/// ```no_run
/// # use jaus::component::{AttachError, Component, Kind, Management};
/// # use jaus::node::Node;
/// # use jaus_vehicle::mobility::Vehicle;
/// # use jaus_vehicle::motion::{Frame, Pilot, SkidSteer, SkidSteerConfig};
/// # fn example(node: &Node) -> Result<(), AttachError> {
/// let platform = SkidSteer::new(SkidSteerConfig::default());
/// let vehicle = Vehicle::new(Pilot::new(platform, Frame::default()));
/// let driver = Component::builder(Kind::Vehicle, "Rover")
///     .management(Management::default())
///     .offer(vehicle.primitive_driver())
///     .offer(vehicle.velocity_state_sensor())
///     .attach(node, 33)?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone)]
pub struct Vehicle {
    controls: Arc<Mutex<Controls>>,
}

impl Vehicle {
    /// Creates a vehicle without a command and without a clock. Its reports carry no time stamps.
    #[must_use]
    pub fn new(pilot: Pilot) -> Self {
        Self {
            controls: Arc::new(Mutex::new(Controls::new(pilot))),
        }
    }

    /// Stamps reports with their sample times. Share the clock with the component's
    /// [`Time`](jaus::service::Time) service, so that Set Time also affects the stamps.
    #[must_use]
    pub fn with_clock(self, time: TimeOfDay) -> Self {
        self.lock().clock = Some(SampleClock::new(time));
        self
    }

    /// Sets the policy for efforts and velocities that their client does not repeat.
    #[must_use]
    pub fn motion_policy(self, policy: MotionPolicy) -> Self {
        self.lock().guard.set_policy(policy);
        self
    }

    /// Advances to `now`, for readers outside the component, but not beyond the end of the command
    /// in force. Only the component handles that end.
    pub fn handle_time(&self, now: Instant) {
        self.lock().advance_within(now);
    }

    /// Stops, whatever the current command.
    pub fn stop(&self) {
        self.lock().halt(&StopCause::Requested);
    }

    /// Whether a command is still being executed.
    #[must_use]
    pub fn is_under_way(&self) -> bool {
        self.lock().pilot.is_under_way()
    }

    /// Whether the last command is complete.
    #[must_use]
    pub fn has_arrived(&self) -> bool {
        let controls = self.lock();
        controls.pilot.is_there() && controls.travel.active().is_none()
    }

    /// Completed part of the list being executed, in percent.
    #[must_use]
    pub fn progress(&self) -> u8 {
        self.lock().progress()
    }

    /// The cause of the last stop, unless a command followed it.
    #[must_use]
    pub fn last_stop(&self) -> Option<StopCause> {
        self.lock().guard.last_stop().cloned()
    }

    /// Why the command in force moves nothing, if a limit set by the client in control is the
    /// reason.
    #[must_use]
    pub fn held(&self) -> Option<String> {
        self.lock().held()
    }

    /// Whether the command in force expires within this time unless it is repeated or its owner shows
    /// life.
    #[must_use]
    pub fn expires_within(&self, now: Instant, time: Duration) -> bool {
        let end = self.lock().guard.expires_at();
        end.is_some_and(|end| end.saturating_duration_since(now) < time)
    }

    /// The latest pose and velocity.
    #[must_use]
    pub fn motion(&self) -> Motion {
        self.lock().pilot.motion()
    }

    /// The latest pose on the globe.
    #[must_use]
    pub fn global_pose(&self) -> GlobalPose {
        self.lock().pilot.global_pose()
    }

    /// The local frame.
    #[must_use]
    pub fn frame(&self) -> Frame {
        *self.lock().pilot.frame()
    }

    /// Moves the local frame, and with it the destination on the globe.
    pub fn set_frame(&self, frame: Frame) {
        let mut controls = self.lock();
        controls.pilot.set_frame(frame);
        controls.handle_new_frame();
    }

    /// Velocity State Sensor: reports the velocity.
    #[must_use]
    pub fn velocity_state_sensor(&self) -> OnVehicle {
        self.service(VelocityStateSensor)
    }

    /// Acceleration State Sensor: reports the acceleration.
    #[must_use]
    pub fn acceleration_state_sensor(&self) -> OnVehicle {
        self.service(AccelerationStateSensor)
    }

    /// Local Pose Sensor: reports the pose in the local frame. The client in control may set it.
    #[must_use]
    pub fn local_pose_sensor(&self) -> OnVehicle {
        self.service(LocalPoseSensor)
    }

    /// Global Pose Sensor: reports the pose on the globe. The client in control may set it.
    #[must_use]
    pub fn global_pose_sensor(&self) -> OnVehicle {
        self.service(GlobalPoseSensor)
    }

    /// Primitive Driver: controls drives and brakes without feedback.
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

    /// List Manager: maintains the list shared by all list drivers. It accepts the elements that
    /// they can drive to.
    #[must_use]
    pub fn list_manager(&self) -> ListManager {
        ListManager::new(self.elements())
    }

    /// Local Waypoint List Driver: drives to waypoints in the local frame in sequence. Requires the
    /// [`list_manager`](Self::list_manager) in the same component.
    #[must_use]
    pub fn local_waypoint_list_driver(&self) -> OnVehicle {
        self.service(ListDriver::<Local>::on(&self.elements()))
    }

    /// Global Waypoint List Driver: drives to waypoints on the globe in sequence. Requires the
    /// [`list_manager`](Self::list_manager) in the same component.
    #[must_use]
    pub fn global_waypoint_list_driver(&self) -> OnVehicle {
        self.service(ListDriver::<Global>::on(&self.elements()))
    }

    /// Velocity State Driver: holds a velocity.
    #[must_use]
    pub fn velocity_state_driver(&self) -> OnVehicle {
        self.service(VelocityStateDriver::default())
    }

    /// Local Vector Driver: holds a speed and a heading in the local frame.
    #[must_use]
    pub fn local_vector_driver(&self) -> OnVehicle {
        self.service(LocalVectorDriver::default())
    }

    /// Global Vector Driver: holds a speed and a heading on the globe.
    #[must_use]
    pub fn global_vector_driver(&self) -> OnVehicle {
        self.service(GlobalVectorDriver::default())
    }

    /// Local Path Segment Driver: drives along curves in the local frame in sequence. Requires the
    /// [`list_manager`](Self::list_manager) in the same component.
    #[must_use]
    pub fn local_path_segment_driver(&self) -> OnVehicle {
        self.service(ListDriver::<LocalPath>::on(&self.elements()))
    }

    /// Global Path Segment Driver: drives along curves on the globe in sequence. Requires the
    /// [`list_manager`](Self::list_manager) in the same component.
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
            stops: self.lock().stops,
        }
    }

    fn lock(&self) -> MutexGuard<'_, Controls> {
        self.controls.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl std::fmt::Debug for Vehicle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Vehicle")
            .field("motion", &self.motion())
            .finish()
    }
}

/// A mobility service of a [`Vehicle`], for use in a component.
pub struct OnVehicle {
    vehicle: Vehicle,
    behaviour: Box<dyn Behaviour>,
    only_newest: bool,
    /// The last vehicle step processed.
    steps: u64,
    /// The last vehicle stop processed.
    stops: u64,
}

impl OnVehicle {
    /// Offers only the newest version, whose messages include those of older ones.
    ///
    /// A component's list of services should fit into one packet, because some peers (JAUS++)
    /// cannot read longer messages. This saves space in components with many services.
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
        let mut controls = self.vehicle.lock();
        follow(
            now,
            &mut controls,
            &mut self.stops,
            self.behaviour.as_mut(),
            context,
        );
        let mut exchange = Exchange {
            now,
            controls: &mut controls,
            message,
            context,
        };
        self.behaviour.handle(code, &mut exchange)
    }

    fn handle_timeout(&mut self, now: Instant, context: &mut Context<'_>) {
        let mut controls = self.vehicle.lock();
        follow(
            now,
            &mut controls,
            &mut self.stops,
            self.behaviour.as_mut(),
            context,
        );
        let steps = controls.pilot.steps();
        if self.steps != steps {
            self.steps = steps;
            self.behaviour.handle_motion(&mut controls, context);
        }
    }

    fn handle_stop(&mut self, cause: &StopCause, context: &mut Context<'_>) {
        let mut controls = self.vehicle.lock();
        controls.halt(cause);
        self.stops = controls.stops;
        self.behaviour.handle_stop(&mut controls, context);
    }

    /// Discards commands stored in standby when the component becomes ready, and limits when the
    /// control of the client that set them ends.
    fn handle_standing(&mut self, _: Instant, before: &Standing, context: &mut Context<'_>) {
        let client = |standing: &Standing| standing.controller.map(|client| client.id);
        let had_control = client(before);
        if had_control.is_some() && had_control != client(context.standing()) {
            let mut controls = self.vehicle.lock();
            self.behaviour.handle_control_end(&mut controls);
        }
        if context.standing().may_act() && !before.may_act() {
            let mut controls = self.vehicle.lock();
            self.behaviour.handle_stop(&mut controls, context);
        }
    }

    fn depends_on(&self) -> Option<JausId> {
        self.vehicle.lock().guard.depends_on()
    }

    fn is_moving(&self) -> bool {
        self.vehicle.lock().guard.is_active()
    }

    fn hazards(&self) -> Hazards {
        Hazards {
            acts_on: self.behaviour.acts_on(),
            set_up_by: self.behaviour.set_up_by(),
            stops: true,
        }
    }

    fn tells_end_of(&self, command: u16) -> bool {
        self.behaviour.tells_end_of(command)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let controls = self.vehicle.lock();
        let ends = [controls.pilot.poll_timeout(), controls.guard.expires_at()];
        ends.into_iter().flatten().min().or(controls.next_look())
    }
}

/// Advances the vehicle to `now`, and notifies a service if the vehicle has stopped.
fn follow(
    now: Instant,
    controls: &mut Controls,
    stops: &mut u64,
    behaviour: &mut dyn Behaviour,
    context: &mut Context<'_>,
) {
    controls.advance(now, context);
    if std::mem::replace(stops, controls.stops) != controls.stops {
        behaviour.handle_stop(controls, context);
    }
}
