//! Who uses a page.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};

use jaus_limits::Place;

use super::logins::LoginId;
use crate::users::UserRole;

/// Who uses a page or sends a request, and with which role.
#[derive(Debug)]
pub(super) struct Visitor {
    pub(super) user: Arc<str>,
    pub(super) address: SocketAddr,
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
        address: SocketAddr,
        login: Option<LoginId>,
        role: Option<UserRole>,
    ) -> Self {
        Self {
            user: Arc::from(user),
            address,
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
