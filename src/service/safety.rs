//! What a service must have beside it before a component may offer it.
//!
//! A service that moves something needs Management, so that it acts only for a client in control of
//! a ready component, and a stop action. One that lets clients set it up needs Access Control.

use super::{Service, Standing};
use crate::codec::ServiceId;

/// The commands that a service takes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Hazards {
    /// A command that makes something act, such as Set Wrench Effort.
    pub acts_on: Option<&'static str>,
    /// A command that sets something up, such as Set Local Pose.
    pub set_up_by: Option<&'static str>,
    /// Whether [`Service::handle_stop`] stops what the commands move.
    pub stops: bool,
}

/// Why a service cannot be offered by a component.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum UnsafeService {
    /// It moves something, and the component has no states in which it must not.
    #[error(
        "{service} acts on {command}, and the component has no Management, without which it would \
         obey anyone and could not be stopped: add `.management(Management::new())` to its builder"
    )]
    NoManagement {
        /// The service.
        service: ServiceId,
        /// The command.
        command: &'static str,
    },
    /// It moves something, and nothing would stop it.
    #[error(
        "{service} acts on {command} and has no stop action: add `.on_stop(…)`, which stops what \
         the command moves"
    )]
    NoStop {
        /// The service.
        service: ServiceId,
        /// The command.
        command: &'static str,
    },
    /// Anyone could set it up.
    #[error(
        "{service} is set up by {command}, and the component has no Access Control, without which \
         it would obey anyone: add `.access_control(AccessControl::new())` or \
         `.management(Management::new())` to its builder"
    )]
    NoAccessControl {
        /// The service.
        service: ServiceId,
        /// The command.
        command: &'static str,
    },
}

/// Whether a component with or without Management and in this standing may offer a service.
pub(super) fn check(
    service: &dyn Service,
    managed: bool,
    standing: &Standing,
) -> Result<(), UnsafeService> {
    let Some(id) = service.offers().first().copied() else {
        return Ok(());
    };
    let hazards = service.hazards();
    match (hazards.acts_on, hazards.set_up_by) {
        (Some(command), _) if !managed => Err(UnsafeService::NoManagement {
            service: id,
            command,
        }),
        (Some(command), _) if !hazards.stops => Err(UnsafeService::NoStop {
            service: id,
            command,
        }),
        (_, Some(command)) if !standing.exclusive => Err(UnsafeService::NoAccessControl {
            service: id,
            command,
        }),
        _ => Ok(()),
    }
}
