//! The audience of a message: a part of the network, the providers of a service, or such providers
//! within a part.

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
    service: Option<Wanted>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum Wanted {
    AnyVersion(String),
    Version(ServiceId),
}

impl Audience {
    /// All components of all subsystems.
    pub const EVERYBODY: Self = Self::scope(JausId::EVERYONE);

    const fn scope(scope: JausId) -> Self {
        Self {
            scope,
            service: None,
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
            service: Some(Wanted::AnyVersion(urn.into())),
            ..Self::EVERYBODY
        }
    }

    /// All components anywhere that offer a service in a version that a client made for `wanted`
    /// can use: the same major version, and at least the same minor one.
    #[must_use]
    pub const fn providers_of(wanted: ServiceId) -> Self {
        Self {
            scope: JausId::EVERYONE,
            service: Some(Wanted::Version(wanted)),
        }
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
    pub fn includes(&self, component: &service::Component) -> bool {
        let offers = match &self.service {
            None => true,
            Some(Wanted::AnyVersion(urn)) => component.offers(urn),
            Some(Wanted::Version(wanted)) => component.offered().any(|it| it.serves(*wanted)),
        };
        offers && self.scope.matches(component.id)
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
        match self.service {
            None => Some(self.scope),
            Some(_) => None,
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

    fn component(id: JausId, minor: u8) -> service::Component {
        let offer = Offer::from(ServiceId { minor, ..SPEED });
        service::Component {
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
