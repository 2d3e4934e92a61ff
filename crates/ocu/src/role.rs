//! Roles of components in a vehicle, derived from the services that they offer.

use jaus::messages::core::management;
use jaus::messages::mobility::{
    global_pose_sensor, local_operating_zone, local_path_segment_driver, local_pose_sensor,
    local_vector_driver, primitive_driver, velocity_state_sensor,
};
use jaus::service::{ComponentEntry, Kind, SubsystemEntry};
use jaus_vehicle::messages::environment_sensing::range_sensor;
use jaus_vehicle::messages::ground::{mission_planner, raster_maps, stage};

/// Role of a component. A component with several roles has the first of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    PrimitiveDriver,
    VectorDriver,
    PathDriver,
    Planner,
    VelocitySensor,
    PoseSensor,
    GlobalPoseSensor,
    Store,
    RangeSensor,
    /// A store of operating zones without maps.
    ZoneStore,
    /// Another component with Management.
    Other,
}

impl Role {
    /// In the order of the chain of command.
    const ALL: [(Self, &'static str); 10] = [
        (Self::PrimitiveDriver, primitive_driver::URN),
        (Self::VectorDriver, local_vector_driver::URN),
        (Self::PathDriver, local_path_segment_driver::URN),
        (Self::Planner, mission_planner::URN),
        (Self::VelocitySensor, velocity_state_sensor::URN),
        (Self::PoseSensor, local_pose_sensor::URN),
        (Self::GlobalPoseSensor, global_pose_sensor::URN),
        (Self::Store, raster_maps::URN),
        (Self::RangeSensor, range_sensor::URN),
        (Self::ZoneStore, local_operating_zone::URN),
    ];

    /// The role of a component; `None` if it is irrelevant to an operator.
    pub(super) fn of(component: &ComponentEntry) -> Option<Self> {
        let known = Self::ALL.iter().find(|(_, urn)| component.offers(urn));
        let other = || is_managed(component).then_some(Self::Other);
        known.map(|(role, _)| *role).or_else(other)
    }

    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::PrimitiveDriver => "primitive_driver",
            Self::VectorDriver => "vector_driver",
            Self::PathDriver => "path_driver",
            Self::Planner => "planner",
            Self::VelocitySensor => "velocity_sensor",
            Self::PoseSensor => "pose_sensor",
            Self::GlobalPoseSensor => "global_pose_sensor",
            Self::Store => "knowledge_store",
            Self::RangeSensor => "range_sensor",
            Self::ZoneStore => "zone_store",
            Self::Other => "other",
        }
    }

    /// Description for reasons.
    pub(super) const fn words(self) -> &'static str {
        match self {
            Self::PrimitiveDriver => "the primitive driver",
            Self::VectorDriver => "the vector driver",
            Self::PathDriver => "the path segment driver",
            Self::Planner => "the planner",
            Self::VelocitySensor => "the velocity sensor",
            Self::PoseSensor => "the pose sensor",
            Self::GlobalPoseSensor => "the global pose sensor",
            Self::Store => "the knowledge store",
            Self::RangeSensor => "the range sensor",
            Self::ZoneStore => "the store of operating zones",
            Self::Other => "the component",
        }
    }

    /// Title for notices; `None` for a component with a more specific name of its own.
    pub(super) const fn title(self) -> Option<&'static str> {
        match self {
            Self::PrimitiveDriver => Some("Primitive Driver"),
            Self::VectorDriver => Some("Vector Driver"),
            Self::PathDriver => Some("Path Segment Driver"),
            Self::Planner => Some("Planner"),
            Self::VelocitySensor => Some("Velocity Sensor"),
            Self::PoseSensor => Some("Pose Sensor"),
            Self::GlobalPoseSensor => Some("Global Pose Sensor"),
            Self::Store => Some("Knowledge Store"),
            Self::RangeSensor => Some("Range Sensor"),
            Self::ZoneStore => Some("Zone Store"),
            Self::Other => None,
        }
    }

    /// Whether taking control includes this component.
    pub(super) const fn is_commanded(self) -> bool {
        matches!(
            self,
            Self::PrimitiveDriver | Self::VectorDriver | Self::PathDriver | Self::Planner
        )
    }

    /// Whether this component is a driver of the chain, which may hold the vehicle.
    pub(super) const fn is_driver(self) -> bool {
        matches!(
            self,
            Self::PrimitiveDriver | Self::VectorDriver | Self::PathDriver
        )
    }

    /// Whether a subsystem that has only such components is no vehicle.
    const fn is_accessory(self) -> bool {
        matches!(self, Self::RangeSensor | Self::ZoneStore)
    }
}

/// Whether a component offers Management, and so can enter emergency.
pub(super) fn is_managed(component: &ComponentEntry) -> bool {
    component.offers(management::URN)
}

/// Whether a component reports its stage.
pub(super) fn tells_stage(component: &ComponentEntry) -> bool {
    component.offers(stage::URN)
}

/// Whether a component reports the vehicle's pose.
pub(super) fn reports_pose(component: &ComponentEntry) -> bool {
    component.offers(local_pose_sensor::URN)
}

/// Whether a component reports the vehicle's pose on the globe.
pub(super) fn reports_global_pose(component: &ComponentEntry) -> bool {
    component.offers(global_pose_sensor::URN)
}

/// Whether a component reports the vehicle's velocity.
pub(super) fn reports_velocity(component: &ComponentEntry) -> bool {
    component.offers(velocity_state_sensor::URN)
}

/// Whether a subsystem has components that an operator can use, and is not another operator's.
pub(super) fn is_vehicle(subsystem: &SubsystemEntry) -> bool {
    let kind = subsystem.identification().map(|it| it.kind);
    let is_part = |it| Role::of(it).is_some_and(|role| !role.is_accessory());
    kind != Some(Kind::OperatorControlUnit) && subsystem.components().any(is_part)
}
