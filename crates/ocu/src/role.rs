//! What the components of a vehicle do in it, told by the services that they offer.

use jaus::messages::core::management;
use jaus::messages::mobility::{
    local_path_segment_driver, local_pose_sensor, local_vector_driver, primitive_driver,
    velocity_state_sensor,
};
use jaus::service::{Component, Directory};
use jaus_vehicle::messages::ground::{mission_planner, raster_maps, stage};

/// What a component does. One that does several things is known by the first of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    PrimitiveDriver,
    VectorDriver,
    PathDriver,
    Planner,
    VelocitySensor,
    PoseSensor,
    Store,
    /// Another component that can be managed.
    Other,
}

impl Role {
    /// In the order of the chain of command.
    const ALL: [(Self, &'static str); 7] = [
        (Self::PrimitiveDriver, primitive_driver::URN),
        (Self::VectorDriver, local_vector_driver::URN),
        (Self::PathDriver, local_path_segment_driver::URN),
        (Self::Planner, mission_planner::URN),
        (Self::VelocitySensor, velocity_state_sensor::URN),
        (Self::PoseSensor, local_pose_sensor::URN),
        (Self::Store, raster_maps::URN),
    ];

    /// What a component does; `None` if an operator has nothing to do with it.
    pub(super) fn of(component: &Component) -> Option<Self> {
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
            Self::Store => "knowledge_store",
            Self::Other => "other",
        }
    }

    /// In words, for reasons.
    pub(super) const fn words(self) -> &'static str {
        match self {
            Self::PrimitiveDriver => "the primitive driver",
            Self::VectorDriver => "the vector driver",
            Self::PathDriver => "the path segment driver",
            Self::Planner => "the planner",
            Self::VelocitySensor => "the velocity sensor",
            Self::PoseSensor => "the pose sensor",
            Self::Store => "the knowledge store",
            Self::Other => "the component",
        }
    }

    /// As a title, for notices; `None` for a component whose own name says more.
    pub(super) const fn title(self) -> Option<&'static str> {
        match self {
            Self::PrimitiveDriver => Some("Primitive Driver"),
            Self::VectorDriver => Some("Vector Driver"),
            Self::PathDriver => Some("Path Segment Driver"),
            Self::Planner => Some("Planner"),
            Self::VelocitySensor => Some("Velocity Sensor"),
            Self::PoseSensor => Some("Pose Sensor"),
            Self::Store => Some("Knowledge Store"),
            Self::Other => None,
        }
    }

    /// Whether an operator who takes control takes it of this component, too.
    pub(super) const fn is_commanded(self) -> bool {
        matches!(
            self,
            Self::PrimitiveDriver | Self::VectorDriver | Self::PathDriver | Self::Planner
        )
    }
}

/// Whether a component has a state that can be changed, an emergency among them.
pub(super) fn is_managed(component: &Component) -> bool {
    component.offers(management::URN)
}

/// Whether a component tells how far its stage is.
pub(super) fn tells_stage(component: &Component) -> bool {
    component.offers(stage::URN)
}

/// Whether a component reports where the vehicle is.
pub(super) fn reports_pose(component: &Component) -> bool {
    component.offers(local_pose_sensor::URN)
}

/// Whether a component reports how the vehicle moves.
pub(super) fn reports_velocity(component: &Component) -> bool {
    component.offers(velocity_state_sensor::URN)
}

/// Whether a subsystem has something that an operator can work with.
pub(super) fn is_vehicle(directory: &Directory, subsystem: u16) -> bool {
    let known = directory.subsystem(subsystem);
    known.is_some_and(|it| it.components().any(|it| Role::of(it).is_some()))
}
