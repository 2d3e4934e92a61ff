//! Maps RA component types to services: the services shown to JAUS clients, and the messages shown
//! to RA systems.

use super::pairs;
use crate::convert::Places;
use crate::ids::RaComponent;
use crate::node;
use jaus::codec::ServiceId;
use jaus::messages::mobility;
use jaus_vehicle::messages::ground;

/// A component type and its counterpart service.
#[derive(Debug, Clone, Copy)]
pub(super) struct Role {
    /// The type.
    pub(super) part: RaComponent,
    /// The service, in the version that RA components offer.
    pub(super) service: ServiceId,
    /// The service that executes a list of places, if it is a separate one.
    pub(super) list: Option<ServiceId>,
    /// Commands and queries that it receives.
    inputs: &'static [u16],
    /// Reports that it sends.
    outputs: &'static [u16],
}

/// The first version of a service: later ones add messages without RA counterpart.
const fn first(service: ServiceId) -> ServiceId {
    ServiceId {
        minor: 0,
        ..service
    }
}

const fn role(
    part: RaComponent,
    service: ServiceId,
    inputs: &'static [u16],
    outputs: &'static [u16],
) -> Role {
    Role {
        part,
        service,
        list: None,
        inputs,
        outputs,
    }
}

/// The same role with a list service.
const fn with_list(role: Role, list: ServiceId) -> Role {
    Role {
        list: Some(first(list)),
        ..role
    }
}

#[rustfmt::skip]
const ROLES: &[Role] = &[
    role(RaComponent::PRIMITIVE_DRIVER, first(mobility::primitive_driver::LATEST), &[0x0405, 0x2405], &[0x4405]),
    role(RaComponent::GLOBAL_POSE_SENSOR, first(mobility::global_pose_sensor::LATEST), &[0x2402], &[0x4402]),
    role(RaComponent::LOCAL_POSE_SENSOR, first(mobility::local_pose_sensor::LATEST), &[0x2403], &[0x4403]),
    role(RaComponent::VELOCITY_STATE_SENSOR, first(mobility::velocity_state_sensor::LATEST), &[0x2404], &[0x4404]),
    role(RaComponent::GLOBAL_VECTOR_DRIVER, mobility::global_vector_driver::LATEST, &[0x0407, 0x2407], &[0x4407]),
    role(RaComponent::LOCAL_VECTOR_DRIVER, mobility::local_vector_driver::LATEST, &[0x0408, 0x2408], &[0x4408]),
    with_list(
        role(RaComponent::GLOBAL_WAYPOINT_DRIVER, first(mobility::global_waypoint_driver::LATEST), &[0x040A, 0x040C, 0x240A, 0x240B, 0x240C], &[0x440A, 0x440B, 0x440C]),
        mobility::global_waypoint_list_driver::LATEST,
    ),
    with_list(
        role(RaComponent::LOCAL_WAYPOINT_DRIVER, first(mobility::local_waypoint_driver::LATEST), &[0x040A, 0x040D, 0x240A, 0x240B, 0x240D], &[0x440A, 0x440B, 0x440D]),
        mobility::local_waypoint_list_driver::LATEST,
    ),
    role(RaComponent::GLOBAL_PATH_SEGMENT_DRIVER, first(mobility::global_path_segment_driver::LATEST), &[0x040A, 0x040F, 0x240A, 0x240E, 0x240F], &[0x440A, 0x440E, 0x440F]),
    role(RaComponent::LOCAL_PATH_SEGMENT_DRIVER, first(mobility::local_path_segment_driver::LATEST), &[0x040A, 0x0410, 0x240A, 0x240E, 0x2410], &[0x440A, 0x440E, 0x4410]),
    role(RaComponent::VECTOR_KNOWLEDGE_STORE, ground::vector_knowledge_store::LATEST,
        &[0x0A20, 0x0A21, 0x0A24, 0x0A25, 0x2A21, 0x2A22, 0x2A23], &[0x4A20, 0x4A21, 0x4A22, 0x4A23, 0x4A24]),
];

/// Messages that every component receives, whatever its type: authority and control, states,
/// service connections, events.
const CORE_INPUTS: &[u16] = &[
    0x0002, 0x0003, 0x0004, 0x0005, 0x0006, 0x0007, 0x0008, 0x0009, 0x000A, 0x000B, 0x000C, 0x000D,
    0x000E, 0x000F, 0x0010, 0x01F0, 0x01F1, 0x01F2, 0x2002, 0x21F0, 0x2202, 0x2B00, 0x2B03,
];
/// Messages that every component sends.
const CORE_OUTPUTS: &[u16] = &[
    0x0008, 0x0009, 0x000A, 0x000B, 0x000C, 0x000D, 0x000E, 0x000F, 0x0010, 0x01F3, 0x01F4, 0x4002,
    0x41F0, 0x41F1, 0x4202, 0x4B00, 0x4B03,
];

/// The role of a component type, if it has a service.
pub(super) fn of_part(part: RaComponent) -> Option<&'static Role> {
    ROLES.iter().find(|role| role.part == part)
}

/// The role of a service, if it has a component type.
pub(super) fn of_service(urn: &str) -> Option<&'static Role> {
    let is_it = |role: &&Role| role.service.urn == urn || role.works_off(urn);
    ROLES.iter().find(is_it)
}

/// The component types that send a report with this code.
pub(super) fn reporting(report: u16) -> impl Iterator<Item = RaComponent> {
    let tells = move |role: &&Role| role.outputs.contains(&report);
    ROLES.iter().filter(tells).map(|role| role.part)
}

impl Role {
    /// Whether this service executes a list of places for the role.
    pub(super) fn works_off(&self, urn: &str) -> bool {
        let is_path = Places::of(self.part).is_some_and(|places| places.is_path);
        self.list.is_some_and(|list| list.urn == urn) || (is_path && self.service.urn == urn)
    }

    /// The RA services of a component in this role.
    pub(super) fn services(&self) -> Vec<node::RaServiceEntry> {
        let own = node::RaServiceEntry {
            kind: u16::from(self.part.0),
            inputs: commands(self.inputs),
            outputs: commands(self.outputs),
        };
        vec![core_service(), own]
    }
}

/// The RA service of a component with core messages only.
pub(super) fn core_service() -> node::RaServiceEntry {
    node::RaServiceEntry {
        kind: 0,
        inputs: commands(CORE_INPUTS),
        outputs: commands(CORE_OUTPUTS),
    }
}

fn commands(codes: &[u16]) -> Vec<node::Command> {
    let presence = |code| {
        let report = pairs::report_of(code).unwrap_or(code);
        pairs::state(report).map_or(0, pairs::State::all)
    };
    let command = |&code: &u16| node::Command {
        code,
        presence: presence(code),
    };
    codes.iter().map(command).collect()
}
