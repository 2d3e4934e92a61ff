//! Cells of the table: each kind of driver with each fault.

use std::fmt;
use std::time::Duration;

/// The driver service by which the controller moves the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Driver {
    /// Primitive Driver, with ten setpoints per second.
    Effort,
    /// Velocity State Driver, with ten setpoints per second.
    Velocity,
    /// Primitive Driver with the policy `hold`: one setpoint.
    HeldEffort,
    /// Velocity State Driver with the policy `hold`: one setpoint.
    HeldVelocity,
    /// Local Vector Driver: one vector.
    Vector,
    /// Local Waypoint Driver: one waypoint.
    Waypoint,
    /// Local Waypoint List Driver: a list, executed once.
    List,
    /// Local Path Segment Driver: a list, executed once.
    Path,
    /// A service defined by the application, with ten setpoints per second.
    Own,
    /// Global Vector Driver: one vector.
    GlobalVector,
    /// Global Waypoint Driver: one waypoint.
    GlobalWaypoint,
}

/// The fault that occurs while the vehicle moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Fault {
    /// The controller's process is killed.
    Killed,
    /// The controller's process is suspended.
    Suspended,
    /// No datagrams pass between controller and vehicle.
    CutOff,
    /// No datagrams pass from the controller to the vehicle.
    CutToVehicle,
    /// No datagrams pass from the vehicle to the controller.
    CutToController,
    /// The controller's process is killed, and another one with the same id sends its setpoints.
    Restarted,
    /// The same with a controller of another product, which numbers its messages from 1 on each time
    /// it starts, and tells no incarnation.
    ForeignRestarted,
    /// A client with higher authority takes control.
    TakenOver,
    /// The controller releases control, but no release message arrives; then it is killed.
    ReleaseLost,
    /// The gateway between the vehicle and an RA controller is killed and restarted.
    Gateway,
    /// The controller is killed while 1000 dead ids are known.
    DeadIdsBefore,
    /// The controller is killed while 1000 ids appear and die.
    DeadIdsDuring,
    /// The component shuts down gracefully.
    Stopped,
    /// The component's process is suspended.
    Hung,
    /// The component is dropped.
    Dropped,
    /// A motor reports a fault.
    MotorFailed,
    /// The pose becomes NaN.
    NanPose,
    /// The measured pose jumps by three metres and a quarter turn.
    PoseJumps,
    /// The pose is no longer measured.
    FrozenPose,
    /// The pose is not measured for five seconds.
    DiskStall,
    /// The wall clock of the vehicle's host is stepped by an hour, and the controller is killed.
    VehicleClock,
    /// The wall clock of the controller's host is stepped by an hour, and the controller is killed.
    ControllerClock,
    /// The GNSS receiver sends nothing.
    ReceiverSilent,
    /// The GNSS receiver repeats its last sentences.
    ReceiverFrozen,
    /// The sentences of the GNSS receiver are cut, damaged, or noise.
    ReceiverGarbled,
    /// The GNSS receiver reports that it has no fix.
    FixLost,
    /// The position is wrong by 100 m.
    PositionJumps,
    /// The position is very uncertain.
    PositionVague,
    /// A keep-out zone is set on top of the vehicle; later the controller is killed.
    ZoneSet,
}

/// A kind of driver and a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Cell {
    pub(crate) driver: Driver,
    pub(crate) fault: Fault,
}

impl Driver {
    pub(crate) const ALL: [Self; 11] = [
        Self::Effort,
        Self::Velocity,
        Self::HeldEffort,
        Self::HeldVelocity,
        Self::Vector,
        Self::Waypoint,
        Self::List,
        Self::Path,
        Self::Own,
        Self::GlobalVector,
        Self::GlobalWaypoint,
    ];

    /// Whether the controller repeats the setpoint.
    pub(crate) const fn is_streamed(self) -> bool {
        matches!(self, Self::Effort | Self::Velocity | Self::Own)
    }

    /// Whether the setpoints are velocities.
    const fn is_velocity(self) -> bool {
        matches!(self, Self::Velocity | Self::HeldVelocity)
    }

    /// Whether effort and velocity stay in force without repetition.
    pub(crate) const fn is_held(self) -> bool {
        matches!(self, Self::HeldEffort | Self::HeldVelocity)
    }

    /// Whether the vehicle is driven by its pose on the globe.
    pub(crate) const fn is_global(self) -> bool {
        matches!(self, Self::GlobalVector | Self::GlobalWaypoint)
    }

    /// Whether the vehicle needs its pose.
    pub(crate) const fn needs_pose(self) -> bool {
        self.is_global()
            || matches!(
                self,
                Self::Vector | Self::Waypoint | Self::List | Self::Path
            )
    }

    /// How long the vehicle may continue to move: after the last setpoint if setpoints are
    /// repeated, otherwise after the controller's last message.
    pub(crate) const fn limit(self) -> Duration {
        Duration::from_secs(match self {
            Self::Effort | Self::Velocity | Self::Own => 1,
            Self::HeldEffort | Self::HeldVelocity | Self::Vector | Self::GlobalVector => 2,
            Self::Waypoint | Self::List | Self::Path | Self::GlobalWaypoint => 5,
        })
    }
}

impl Fault {
    pub(crate) const ALL: [Self; 29] = [
        Self::Killed,
        Self::Suspended,
        Self::CutOff,
        Self::CutToVehicle,
        Self::CutToController,
        Self::Restarted,
        Self::ForeignRestarted,
        Self::TakenOver,
        Self::ReleaseLost,
        Self::Gateway,
        Self::DeadIdsBefore,
        Self::DeadIdsDuring,
        Self::Stopped,
        Self::Hung,
        Self::Dropped,
        Self::MotorFailed,
        Self::NanPose,
        Self::FrozenPose,
        Self::DiskStall,
        Self::VehicleClock,
        Self::ControllerClock,
        Self::ReceiverSilent,
        Self::ReceiverFrozen,
        Self::ReceiverGarbled,
        Self::FixLost,
        Self::PositionJumps,
        Self::PositionVague,
        Self::ZoneSet,
        Self::PoseJumps,
    ];

    /// Whether the fault is one of the GNSS receiver.
    const fn is_of_receiver(self) -> bool {
        matches!(
            self,
            Self::ReceiverSilent
                | Self::ReceiverFrozen
                | Self::ReceiverGarbled
                | Self::FixLost
                | Self::PositionJumps
                | Self::PositionVague
        )
    }

    /// Whether the component ends or hangs.
    pub(crate) const fn ends_component(self) -> bool {
        matches!(self, Self::Stopped | Self::Hung | Self::Dropped)
    }
}

impl Cell {
    /// The drivers by hand and in the local frame, with the faults that concern them all. The RA has
    /// no velocity command for the gateway to pass on.
    pub(crate) fn of_local_drivers() -> impl Iterator<Item = Self> {
        Self::all().filter(|cell| {
            let is_special = matches!(
                cell.fault,
                Fault::ZoneSet | Fault::PoseJumps | Fault::ForeignRestarted
            );
            let is_general = !cell.fault.is_of_receiver() && !is_special;
            let is_possible = cell.fault != Fault::Gateway || !cell.driver.is_velocity();
            is_general && is_possible && !cell.driver.is_global()
        })
    }

    /// The drivers on the globe with all faults but those of the gateway, which the RA addresses
    /// differently, all drivers of the library with zones, and all that drive by a pose with jumps.
    pub(crate) fn of_the_globe_and_zones() -> impl Iterator<Item = Self> {
        Self::all().filter(|cell| match cell.fault {
            Fault::ZoneSet => cell.driver != Driver::Own,
            Fault::PoseJumps => cell.driver.needs_pose(),
            Fault::ForeignRestarted => false,
            fault => fault != Fault::Gateway && cell.driver.is_global(),
        })
    }

    /// All drivers with the restart of a controller of another product.
    pub(crate) fn of_foreign_restarts() -> impl Iterator<Item = Self> {
        Self::all().filter(|cell| cell.fault == Fault::ForeignRestarted)
    }

    fn all() -> impl Iterator<Item = Self> {
        Fault::ALL.iter().flat_map(|&fault| {
            let cell = move |driver| Self { driver, fault };
            Driver::ALL.into_iter().map(cell)
        })
    }

    /// Whether the fault itself must stop this driver. Otherwise the controller is killed a moment
    /// later.
    pub(crate) const fn stops_by_itself(self) -> bool {
        match self.fault {
            Fault::NanPose | Fault::PoseJumps | Fault::FrozenPose | Fault::DiskStall => {
                self.driver.needs_pose()
            }
            Fault::VehicleClock | Fault::ControllerClock | Fault::ZoneSet => false,
            _ => true,
        }
    }
}

impl fmt::Display for Driver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Effort => "effort",
            Self::Velocity => "velocity",
            Self::HeldEffort => "effort, hold",
            Self::HeldVelocity => "velocity, hold",
            Self::Vector => "vector",
            Self::Waypoint => "waypoint",
            Self::List => "list",
            Self::Path => "path segment",
            Self::Own => "own service",
            Self::GlobalVector => "global vector",
            Self::GlobalWaypoint => "global waypoint",
        })
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Killed => "controller killed",
            Self::Suspended => "controller suspended",
            Self::CutOff => "cut off",
            Self::CutToVehicle => "cut off to the vehicle",
            Self::CutToController => "cut off to the controller",
            Self::Restarted => "controller restarted",
            Self::ForeignRestarted => "foreign one restarted",
            Self::TakenOver => "taken over",
            Self::ReleaseLost => "release lost",
            Self::Gateway => "gateway restarted",
            Self::DeadIdsBefore => "1000 dead ids before",
            Self::DeadIdsDuring => "1000 dead ids during",
            Self::Stopped => "component stopped",
            Self::Hung => "component hung",
            Self::Dropped => "component dropped",
            Self::MotorFailed => "motor fault",
            Self::NanPose => "NaN pose",
            Self::PoseJumps => "pose jumps",
            Self::FrozenPose => "frozen pose",
            Self::DiskStall => "5 s disk stall",
            Self::VehicleClock => "vehicle's clock stepped",
            Self::ControllerClock => "controller's clock stepped",
            Self::ReceiverSilent => "receiver silent",
            Self::ReceiverFrozen => "receiver frozen",
            Self::ReceiverGarbled => "receiver garbled",
            Self::FixLost => "fix lost",
            Self::PositionJumps => "position jumps",
            Self::PositionVague => "position vague",
            Self::ZoneSet => "zone set",
        })
    }
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} × {}", self.driver, self.fault)
    }
}
