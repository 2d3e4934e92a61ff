//! The audience of a message: a part of the network, the providers of a service, or such providers
//! within a part.

use std::fmt;

use crate::address::JausId;
use crate::codec::ServiceId;
use crate::service::{self, Directory};

/// A group of components, selected by position or service instead of by name.
///
/// ```
/// use jaus::address::JausId;
/// use jaus::component::Audience;
/// use jaus::messages::core::management;
///
/// let whole_vehicle = Audience::subsystem(101);
/// let one_board = Audience::node(101, 2);
/// let stoppable = Audience::providers(management::URN).in_subsystem(101);
/// let all_33s = Audience::from("101.255.33".parse::<JausId>()?);
/// # Ok::<(), jaus::address::ParseIdError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Audience {
    /// An id, usually with wildcards.
    scope: JausId,
    /// A member offers all of these.
    services: Vec<Wanted>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum Wanted {
    AnyVersion(String),
    Version(ServiceId),
}

impl Wanted {
    fn urn(&self) -> &str {
        match self {
            Self::AnyVersion(urn) => urn,
            Self::Version(version) => version.urn,
        }
    }
}

impl Audience {
    /// All components of all subsystems.
    pub const EVERYBODY: Self = Self::scope(JausId::EVERYONE);

    const fn scope(scope: JausId) -> Self {
        Self {
            scope,
            services: Vec::new(),
        }
    }

    /// All components of a subsystem.
    #[must_use]
    pub const fn subsystem(subsystem: u16) -> Self {
        Self::scope(JausId::new(subsystem, 1, 1).whole_subsystem())
    }

    /// All components of a node.
    #[must_use]
    pub const fn node(subsystem: u16, node: u8) -> Self {
        Self::scope(JausId::new(subsystem, node, 1).whole_node())
    }

    /// All components anywhere that offer a service, in any version.
    #[must_use]
    pub fn providers(urn: impl Into<String>) -> Self {
        Self {
            services: vec![Wanted::AnyVersion(urn.into())],
            ..Self::EVERYBODY
        }
    }

    /// All components anywhere that offer a service in a version that a client made for `wanted`
    /// can use: the same major version, and at least the same minor one.
    #[must_use]
    pub fn providers_of(wanted: ServiceId) -> Self {
        Self {
            services: vec![Wanted::Version(wanted)],
            ..Self::EVERYBODY
        }
    }

    /// Restricts the audience to components that also offer this service, in any version.
    #[must_use]
    pub fn that_offer(mut self, urn: impl Into<String>) -> Self {
        self.services.push(Wanted::AnyVersion(urn.into()));
        self
    }

    /// Restricts the audience to a subsystem.
    #[must_use]
    pub fn in_subsystem(self, subsystem: u16) -> Self {
        self.within(JausId::new(subsystem, 1, 1).whole_subsystem())
    }

    /// Restricts the audience to ids that match `scope`, in place of any earlier restriction.
    #[must_use]
    pub fn within(self, scope: JausId) -> Self {
        Self { scope, ..self }
    }

    /// Whether a component of the directory belongs to the audience.
    #[must_use]
    pub fn includes(&self, component: &service::ComponentEntry) -> bool {
        let offers = |wanted: &Wanted| match wanted {
            Wanted::AnyVersion(urn) => component.offers(urn),
            Wanted::Version(wanted) => component.offered().any(|it| it.serves(*wanted)),
        };
        self.scope.matches(component.id) && self.services.iter().all(offers)
    }

    /// Whether every member offers the service with this URN, in some version.
    #[must_use]
    pub fn requires(&self, urn: &str) -> bool {
        self.services.iter().any(|wanted| wanted.urn() == urn)
    }

    /// The ids of all members except `own`, in order.
    pub(crate) fn members(&self, directory: &Directory, own: JausId) -> Vec<JausId> {
        let others = directory.components().filter(|it| it.id != own);
        others
            .filter(|it| self.includes(it))
            .map(|it| it.id)
            .collect()
    }

    /// The destination that reaches all members at once, if there is one.
    pub(crate) const fn as_destination(&self) -> Option<JausId> {
        match self.services.is_empty() {
            true => Some(self.scope),
            false => None,
        }
    }
}

/// The services and the scope, such as `urn:jaus:jss:core:Events in 101.255.255`.
impl fmt::Display for Audience {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let services = self.services.iter().map(|wanted| match wanted {
            Wanted::AnyVersion(urn) => urn.clone(),
            Wanted::Version(version) => version.to_string(),
        });
        let services: Vec<_> = services.collect();
        f.write_str(&services.join(" and "))?;
        match (self.scope, services.is_empty()) {
            (JausId::EVERYONE, false) => Ok(()),
            (JausId::EVERYONE, true) => f.write_str("any service"),
            (scope, false) => write!(f, " in {scope}"),
            (scope, true) => write!(f, "any service in {scope}"),
        }
    }
}

/// All components whose ids match; one component if the id has no wildcards.
impl From<JausId> for Audience {
    fn from(scope: JausId) -> Self {
        Self::scope(scope)
    }
}

/// The providers of the service with this URN.
impl From<&str> for Audience {
    fn from(urn: &str) -> Self {
        Self::providers(urn)
    }
}

/// The providers of the service, in a suitable version.
impl From<ServiceId> for Audience {
    fn from(wanted: ServiceId) -> Self {
        Self::providers_of(wanted)
    }
}

/// A clone, so that an audience can be reused.
impl From<&Self> for Audience {
    fn from(audience: &Self) -> Self {
        audience.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::service::Offer;

    const SPEED: ServiceId = ServiceId {
        urn: "urn:speed",
        major: 1,
        minor: 1,
    };

    fn component(id: JausId, minor: u8) -> service::ComponentEntry {
        let offer = Offer::from(ServiceId { minor, ..SPEED });
        service::ComponentEntry {
            id,
            identification: None,
            services: Some([offer].into()),
        }
    }

    #[test]
    fn a_scope_and_a_service_must_both_fit() {
        let here = component(JausId::new(101, 2, 33), 1);
        for (audience, is_in) in [
            (Audience::EVERYBODY, true),
            (Audience::subsystem(101), true),
            (Audience::subsystem(102), false),
            (Audience::node(101, 2), true),
            (Audience::node(101, 1), false),
            (JausId::new(101, 255, 33).into(), true),
            (JausId::new(101, 255, 34).into(), false),
            ("urn:speed".into(), true),
            ("urn:pose".into(), false),
            (Audience::providers("urn:speed").in_subsystem(101), true),
            (Audience::providers("urn:speed").in_subsystem(102), false),
            (Audience::providers("urn:pose").in_subsystem(101), false),
            (Audience::from(SPEED).that_offer("urn:pose"), false),
            (Audience::from("urn:speed").that_offer("urn:speed"), true),
        ] {
            assert_eq!(audience.includes(&here), is_in, "{audience:?}");
        }
    }

    #[test]
    fn who_offers_too_old_a_version_is_not_meant() {
        let id = JausId::new(101, 2, 33);
        let new_enough = Audience::from(SPEED);
        assert!(new_enough.includes(&component(id, 1)));
        assert!(!new_enough.includes(&component(id, 0)));
        assert!(Audience::from(SPEED.urn).includes(&component(id, 0)));
    }

    #[test]
    fn who_has_not_told_its_services_is_in_no_service_s_audience_yet() {
        let mut silent = component(JausId::new(101, 2, 33), 1);
        silent.services = None;
        assert!(!Audience::from(SPEED).includes(&silent));
        assert!(Audience::EVERYBODY.includes(&silent));
    }
}
