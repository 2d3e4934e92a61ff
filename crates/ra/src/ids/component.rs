//! Component types of the Reference Architecture: the component number is the type.

use std::fmt;

/// The type of an RA component, which is its component number.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RaComponent(pub u8);

/// Defines the constants and display names.
macro_rules! components {
    ($($(#[$doc:meta])* $name:ident = $number:literal, $text:literal;)*) => {
        impl RaComponent {
            $($(#[$doc])* pub const $name: Self = Self($number);)*

            /// Name of the type, if it is one of the RA 3.3 types listed here.
            #[must_use]
            pub const fn name(self) -> Option<&'static str> {
                match self.0 {
                    $($number => Some($text),)*
                    _ => None,
                }
            }
        }
    };
}

components! {
    /// Represents a node.
    NODE_MANAGER = 1, "Node Manager";
    /// Client of an operator or planner for a whole subsystem.
    SUBSYSTEM_COMMANDER = 32, "Subsystem Commander";
    /// Drives by effort.
    PRIMITIVE_DRIVER = 33, "Primitive Driver";
    /// Drives by heading and speed on the globe.
    GLOBAL_VECTOR_DRIVER = 34, "Global Vector Driver";
    /// Represents a subsystem.
    COMMUNICATOR = 35, "Communicator";
    /// Position and attitude on the globe.
    GLOBAL_POSE_SENSOR = 38, "Global Pose Sensor";
    /// A client that tasks a subsystem.
    SYSTEM_COMMANDER = 40, "System Commander";
    /// Position and attitude in a local frame.
    LOCAL_POSE_SENSOR = 41, "Local Pose Sensor";
    /// Velocities.
    VELOCITY_STATE_SENSOR = 42, "Velocity State Sensor";
    /// Filters driver commands to avoid harm.
    REFLEXIVE_DRIVER = 43, "Reflexive Driver";
    /// Drives by heading and speed in a local frame.
    LOCAL_VECTOR_DRIVER = 44, "Local Vector Driver";
    /// Drives to places on the globe.
    GLOBAL_WAYPOINT_DRIVER = 45, "Global Waypoint Driver";
    /// Drives to places in a local frame.
    LOCAL_WAYPOINT_DRIVER = 46, "Local Waypoint Driver";
    /// Drives along paths on the globe.
    GLOBAL_PATH_SEGMENT_DRIVER = 47, "Global Path Segment Driver";
    /// Drives along paths in a local frame.
    LOCAL_PATH_SEGMENT_DRIVER = 48, "Local Path Segment Driver";
    /// Stores objects of the world.
    VECTOR_KNOWLEDGE_STORE = 61, "Vector Knowledge Store";
}

impl RaComponent {
    /// Whether it moves a vehicle: a driver, from the primitive to the path segment driver.
    #[must_use]
    pub const fn is_driver(self) -> bool {
        matches!(self.0, 33 | 34 | 43..=48)
    }

    /// Whether it represents its node or subsystem rather than a service: node manager and
    /// communicator.
    #[must_use]
    pub const fn is_infrastructure(self) -> bool {
        matches!(self, Self::NODE_MANAGER | Self::COMMUNICATOR)
    }
}

impl fmt::Display for RaComponent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => f.pad(name),
            None => write!(f, "component type {}", self.0),
        }
    }
}

impl fmt::Debug for RaComponent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({self})", self.0)
    }
}
