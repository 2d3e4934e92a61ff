//! Which page of the station has a vehicle. One operator drives a vehicle at a time, and the others
//! see who that is.

use std::fmt;
use std::sync::Arc;

/// Identifies one page connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PageId(pub u64);

/// An operator at a page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Owner {
    /// The page.
    pub page: PageId,
    /// The user of the page.
    pub user: Arc<str>,
}

/// The owner of one vehicle.
#[derive(Debug, Default)]
pub struct Ownership {
    owner: Option<Owner>,
    /// The user who was the owner last.
    user: Option<Arc<str>>,
}

/// Error: another page has the vehicle.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{owner} controls vehicle {vehicle}")]
pub struct OwnedByOther {
    owner: Owner,
    vehicle: u16,
}

impl fmt::Display for Owner {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} (page {})", self.user, self.page.0)
    }
}

impl Ownership {
    /// Makes the operator the owner of `vehicle`, or confirms that.
    ///
    /// # Errors
    /// If another page is the owner.
    pub fn claim(&mut self, vehicle: u16, operator: &Owner) -> Result<(), OwnedByOther> {
        self.check(vehicle, operator.page)?;
        self.user = Some(Arc::clone(&operator.user));
        self.owner = Some(operator.clone());
        Ok(())
    }

    /// Checks that no other page is the owner of `vehicle`.
    ///
    /// # Errors
    /// If one is.
    pub fn check(&self, vehicle: u16, page: PageId) -> Result<(), OwnedByOther> {
        match &self.owner {
            Some(owner) if owner.page != page => Err(OwnedByOther {
                owner: owner.clone(),
                vehicle,
            }),
            _ => Ok(()),
        }
    }

    /// Whether the page is the owner.
    #[must_use]
    pub fn is_owned_by(&self, page: PageId) -> bool {
        self.owner.as_ref().is_some_and(|it| it.page == page)
    }

    /// The owner.
    #[must_use]
    pub const fn owner(&self) -> Option<&Owner> {
        self.owner.as_ref()
    }

    /// The user who is the owner, or was the last one.
    #[must_use]
    pub const fn user(&self) -> Option<&Arc<str>> {
        self.user.as_ref()
    }

    /// Frees the vehicle for all pages.
    pub fn release(&mut self) {
        self.owner = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn operator(page: u64, user: &str) -> Owner {
        Owner {
            page: PageId(page),
            user: Arc::from(user),
        }
    }

    #[test]
    fn the_first_operator_has_the_vehicle_and_the_next_is_told_the_name() {
        let (anna, ben) = (operator(3, "Anna"), operator(4, "Ben"));
        let mut ownership = Ownership::default();
        ownership.claim(101, &anna).unwrap();
        ownership.claim(101, &anna).unwrap();
        let refused = ownership.claim(101, &ben).unwrap_err();
        assert_eq!(refused.to_string(), "Anna (page 3) controls vehicle 101");
        assert!(ownership.is_owned_by(anna.page) && !ownership.is_owned_by(ben.page));
        ownership.release();
        assert_eq!(ownership.user().map(|it| &**it), Some("Anna"));
        ownership.claim(101, &ben).unwrap();
    }

    #[test]
    fn two_pages_of_one_user_are_two_operators() {
        let mut ownership = Ownership::default();
        ownership.claim(101, &operator(3, "Anna")).unwrap();
        ownership.claim(101, &operator(4, "Anna")).unwrap_err();
    }
}
