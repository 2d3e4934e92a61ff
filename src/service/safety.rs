//! Checks whether a component may offer a service.
//!
//! A service that moves something needs a stop action, and Management, so that it acts only for the
//! client in control of a ready component. A service that clients can configure needs Access
//! Control. A service must understand every version that it offers, and answer or decline each of its
//! queries.

use super::{Service, Standing};
use crate::codec::ServiceId;

/// Why a component cannot offer a service.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum UnsafeService {
    /// It moves something, and the component has no states that forbid motion.
    #[error(
        "{service} acts on {command}, but without Management the component would obey any client \
         and could not be stopped: add `.management(Management::new())` to its builder"
    )]
    NoManagement {
        /// The service.
        service: ServiceId,
        /// The command.
        command: &'static str,
    },
    /// It moves something, and nothing would stop it.
    #[error(
        "{service} acts on {command} but has no stop action: add `.on_stop(…)`, which stops the \
         motion"
    )]
    NoStop {
        /// The service.
        service: ServiceId,
        /// The command.
        command: &'static str,
    },
    /// Anyone could configure it.
    #[error(
        "{command} configures {service}, but without Access Control the component would obey any \
         client: add `.access_control(AccessControl::new())` or `.management(Management::new())` \
         to its builder"
    )]
    NoAccessControl {
        /// The service.
        service: ServiceId,
        /// The command.
        command: &'static str,
    },
    /// It offers a version of which it understands no layout of a message.
    #[error(
        "{service} is offered, but nothing handles its layout of {message}: handle that layout, \
         too, or do not offer this version"
    )]
    VersionNotHandled {
        /// The service and its version.
        service: ServiceId,
        /// The message.
        message: &'static str,
    },
    /// It would not answer a query that it defines.
    #[error(
        "{service} is offered, but nothing answers {query}: answer it, too, or add \
         `.declines::<{query}>()`, which leaves it without an answer"
    )]
    QueryNotAnswered {
        /// The service and its version.
        service: ServiceId,
        /// The query.
        query: &'static str,
    },
}

/// Checks whether a component with or without Management, and with this standing, may offer a
/// service.
pub(super) fn check(
    service: &dyn Service,
    managed: bool,
    standing: &Standing,
) -> Result<(), UnsafeService> {
    let Some(id) = service.offers().first().copied() else {
        return Ok(());
    };
    if let Some((service, message)) = service.unhandled_version() {
        return Err(UnsafeService::VersionNotHandled { service, message });
    }
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
        _ => match service.unanswered_query() {
            Some((service, query)) => Err(UnsafeService::QueryNotAnswered { service, query }),
            None => Ok(()),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::Message;
    use crate::messages::core::{QueryTime, ReportTime, Reset, SetTime, time, transport};
    use crate::service::{AccessControl, Handlers, Management, Stack};

    const SERVICE: ServiceId = transport::LATEST;

    /// The error for a component with these settings and these handlers.
    fn refused(
        handlers: Handlers,
        settings: impl FnOnce(Stack) -> Stack,
    ) -> Result<(), UnsafeService> {
        let rig = crate::service::stack_rig::StackRig::new(vec![Box::new(handlers)], settings);
        rig.stack.check()
    }

    #[test]
    fn a_command_needs_management_and_a_stop_action() {
        let command = Reset::NAME;
        let service = SERVICE;
        let handlers = || Handlers::new(SERVICE).command(|_: Reset, _, _| {});
        let managed = |stack: Stack| stack.management(Management::new());
        let controlled = |stack: Stack| stack.access_control(AccessControl::new());
        assert_eq!(
            refused(handlers().on_stop(|_| {}), |stack| stack),
            Err(UnsafeService::NoManagement { service, command })
        );
        assert_eq!(
            refused(handlers().on_stop(|_| {}), controlled),
            Err(UnsafeService::NoManagement { service, command })
        );
        assert_eq!(
            refused(handlers(), managed),
            Err(UnsafeService::NoStop { service, command })
        );
        assert_eq!(refused(handlers().on_stop(|_| {}), managed), Ok(()));
    }

    #[test]
    fn each_query_is_answered_or_declined() {
        let handlers = || Handlers::new(time::LATEST);
        let (service, query) = (time::LATEST, QueryTime::NAME);
        let error = refused(handlers(), |stack| stack).unwrap_err();
        assert_eq!(error, UnsafeService::QueryNotAnswered { service, query });
        assert!(
            error.to_string().contains(".declines::<QueryTime>()"),
            "{error}"
        );
        for complete in [
            handlers().answer(|_: QueryTime| ReportTime::default()),
            handlers().publishes::<QueryTime>(),
            handlers().receive(|_: QueryTime, _, _| {}),
            handlers().declines::<QueryTime>(),
        ] {
            assert_eq!(refused(complete, |stack| stack), Ok(()));
        }
    }

    #[test]
    fn what_clients_set_up_needs_access_control() {
        let handlers = || Handlers::new(SERVICE).configure(|_: SetTime, _, _| {});
        let (service, command) = (SERVICE, SetTime::NAME);
        assert_eq!(
            refused(handlers(), |stack| stack),
            Err(UnsafeService::NoAccessControl { service, command })
        );
        let controlled = |stack: Stack| stack.access_control(AccessControl::new());
        assert_eq!(refused(handlers(), controlled), Ok(()));
    }
}
