//! Who uses a page.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};

use jaus::rights::Refusal;
use jaus_limits::Place;

use super::Admission;
use super::logins::LoginId;
use crate::request::OperatorRequest;
use crate::users::{PageRights, UserRole};

/// Who uses a page or sends a request, and with which role.
#[derive(Debug)]
pub(super) struct Visitor {
    pub(super) user: Arc<str>,
    pub(super) address: SocketAddr,
    /// The host and port that the request names.
    pub(super) host: String,
    /// The session of a user.
    pub(super) login: Option<LoginId>,
    /// `None` without permission to see anything. The right token raises it.
    role: Mutex<Option<UserRole>>,
    /// The place of the visitor's page. That of a page without the token is taken from a share that
    /// such pages have of their own.
    place: Mutex<Option<Place>>,
}

impl Visitor {
    pub(super) fn new(
        user: &str,
        (address, host): (SocketAddr, &str),
        login: Option<LoginId>,
        role: Option<UserRole>,
    ) -> Self {
        Self {
            user: Arc::from(user),
            address,
            host: host.to_owned(),
            login,
            role: Mutex::new(role),
            place: Mutex::new(None),
        }
    }

    pub(super) fn may(&self, needed: UserRole) -> bool {
        self.role().is_some_and(|role| role >= needed)
    }

    pub(super) fn role(&self) -> Option<UserRole> {
        *self.role.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Checks a request by the role.
    ///
    /// # Errors
    /// Why it is refused.
    pub(super) fn check(
        &self,
        request: &OperatorRequest,
        admission: &Admission,
    ) -> Result<(), String> {
        let has_users = admission.gate.users().is_some();
        let needed = request.needs(PageRights {
            authority: admission.authority,
            has_users,
        });
        if !self.may(needed) {
            return Err(match has_users {
                true => format!(
                    "this requires the role {needed}; {} does not have it",
                    self.user
                ),
                false => {
                    "this requires the token that jaus-ocu printed or read from its file".to_owned()
                }
            });
        }
        let is_change = needed > UserRole::Observe && !request.is_end();
        if is_change && admission.trail.refuses_commands() {
            return Err(Refusal::Unrecorded.to_string());
        }
        Ok(())
    }

    /// The visitor has shown the token.
    pub(super) fn trust(&self) {
        let mut role = self.role.lock().unwrap_or_else(PoisonError::into_inner);
        *role = Some(UserRole::Drive);
    }

    /// The visitor's page has this place from now on; `None` when it is gone.
    pub(super) fn settle(&self, place: Option<Place>) {
        *self.place.lock().unwrap_or_else(PoisonError::into_inner) = place;
    }
}
