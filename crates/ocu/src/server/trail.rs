//! Entries of the audit log: logins, and requests that change vehicles. They contain no password,
//! token or cookie.

use std::net::SocketAddr;

use jaus::address::JausId;
use jaus_audit::{Action, AuditLog, Entry, Outcome};

use super::logins::{Ending, Login};
use crate::request::OperatorRequest;

/// The audit log of a station, if it has one.
#[derive(Clone, Debug)]
pub(crate) struct Trail {
    log: Option<AuditLog>,
    /// The station's own id.
    operator: JausId,
}

impl Trail {
    pub(crate) const fn new(log: Option<AuditLog>, operator: JausId) -> Self {
        Self { log, operator }
    }

    /// Whether what changes something is to be refused, because it could not be recorded.
    pub(super) fn refuses_commands(&self) -> bool {
        self.log.as_ref().is_some_and(AuditLog::refuses_commands)
    }

    fn write(&self, entry: impl FnOnce() -> Entry) {
        if let Some(log) = &self.log {
            log.write(entry().id(self.operator));
        }
    }

    /// A login by password or token; `None` for success.
    pub(super) fn login(&self, who: &str, address: SocketAddr, refusal: Option<&str>) {
        self.write(|| {
            let entry = |outcome| Entry::new(who, Action::Login, outcome).address(address.ip());
            match refusal {
                None => entry(Outcome::Allowed),
                Some(why) => entry(Outcome::Refused).because(why),
            }
        });
    }

    /// The end of a session.
    pub(super) fn ended(&self, login: &Login, why: &Ending) {
        tracing::info!("the session of {} has ended: {why}", login.user.name);
        self.write(|| {
            let what = match why {
                Ending::LoggedOut => Action::Logout,
                _ => Action::SessionEnded,
            };
            let entry = Entry::new(&login.user.name, what, Outcome::Allowed);
            entry.address(login.address.ip()).because(why)
        });
    }

    /// The result of a request. Granted commands of manual drive are too many for a log.
    pub(super) fn request(
        &self,
        (user, address): (&str, SocketAddr),
        vehicle: Option<u16>,
        request: &OperatorRequest,
        result: &Result<(), String>,
    ) {
        let is_drive = matches!(
            request,
            OperatorRequest::Drive { .. } | OperatorRequest::DriveEnd
        );
        if is_drive && result.is_ok() {
            return;
        }
        self.write(|| {
            let outcome = if result.is_ok() {
                Outcome::Allowed
            } else {
                Outcome::Refused
            };
            let entry = Entry::new(user, request.action(), outcome);
            let entry = entry.address(address.ip());
            let entry = match request.vehicle(vehicle) {
                Some(subsystem) => entry.to(subsystem),
                None => entry,
            };
            match (result, request.details()) {
                (Err(why), _) => entry.because(why),
                (Ok(()), Some(details)) => entry.because(details),
                (Ok(()), None) => entry,
            }
        });
    }
}
