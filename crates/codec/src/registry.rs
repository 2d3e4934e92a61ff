//! Tables of generated types: services by identity, messages by code and by name.

use alloc::boxed::Box;
use core::fmt;

use bytes::Bytes;

use super::error::DecodeError;
use super::message::{AnyMessage, Message, ServiceId};
use super::query::{Echo, Query, report_code};

/// Definition of a service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ServiceInfo {
    /// For example `Discovery`.
    pub name: &'static str,
    /// URN and version.
    pub id: ServiceId,
    /// The service that this one extends.
    pub inherits_from: Option<ServiceId>,
    /// Codes of the messages that it receives, without inherited ones.
    pub inputs: &'static [u16],
    /// Codes of the messages that it sends, without inherited ones.
    pub outputs: &'static [u16],
}

/// Metadata of a message type, with constructors from octets and views.
#[derive(Clone, Copy)]
#[non_exhaustive]
pub struct MessageInfo {
    /// [`Message::CODE`]
    pub code: u16,
    /// [`Message::NAME`]
    pub name: &'static str,
    /// [`Message::IS_COMMAND`]
    pub is_command: bool,
    /// The services that declare exactly this layout, newest version first.
    pub services: &'static [ServiceId],
    /// The code of the report that answers it, if it is a query.
    pub report: Option<u16>,
    /// [`Query::ECHOES`](super::Query::ECHOES), if it is a query.
    pub echoes: &'static [Echo],
    /// [`Message::decode`]
    pub decode: fn(&Bytes) -> Result<Box<dyn AnyMessage>, DecodeError>,
    /// Creates the message from its human-readable view.
    #[cfg(feature = "serde")]
    pub from_view: fn(&super::view::Value) -> Result<Box<dyn AnyMessage>, super::view::Error>,
    /// Creates a valid message from random octets.
    #[cfg(feature = "arbitrary")]
    pub arbitrary: fn(&mut arbitrary::Unstructured<'_>) -> arbitrary::Result<Box<dyn AnyMessage>>,
}

impl MessageInfo {
    /// The entry for a query.
    #[doc(hidden)]
    #[must_use]
    pub const fn of_query<Q: Query + RandomMessage>(services: &'static [ServiceId]) -> Self {
        Self {
            report: Some(<Q::Report as Message>::CODE),
            echoes: Q::ECHOES,
            ..Self::of::<Q>(services)
        }
    }

    /// Creates the entry for a message type.
    #[doc(hidden)]
    pub const fn of<M: Message + RandomMessage>(services: &'static [ServiceId]) -> Self {
        Self {
            code: M::CODE,
            name: M::NAME,
            is_command: M::IS_COMMAND,
            services,
            report: None,
            echoes: &[],
            decode: |octets| Ok(Box::new(M::decode(octets)?)),
            #[cfg(feature = "serde")]
            from_view: |value| Ok(Box::new(M::from_view(value)?)),
            #[cfg(feature = "arbitrary")]
            arbitrary: |random| {
                Ok(Box::new(<M as arbitrary::Arbitrary<'_>>::arbitrary(
                    random,
                )?))
            },
        }
    }
}

impl fmt::Debug for MessageInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({:04X}h)", self.name, self.code)
    }
}

/// Replaces `arbitrary::Arbitrary` for any lifetime when the feature `arbitrary` is enabled.
#[cfg(feature = "arbitrary")]
#[doc(hidden)]
pub trait RandomMessage: for<'a> arbitrary::Arbitrary<'a> {}

#[cfg(feature = "arbitrary")]
impl<T: for<'a> arbitrary::Arbitrary<'a>> RandomMessage for T {}

/// Replaces `arbitrary::Arbitrary` when the feature `arbitrary` is disabled.
#[cfg(not(feature = "arbitrary"))]
#[doc(hidden)]
pub trait RandomMessage {}

#[cfg(not(feature = "arbitrary"))]
impl<T> RandomMessage for T {}

/// The tables of a generated module.
#[derive(Debug, Clone, Copy)]
pub struct ServiceSet {
    /// Its `SERVICES`.
    pub services: &'static [ServiceInfo],
    /// Its `MESSAGES`, sorted by code.
    pub messages: &'static [MessageInfo],
}

/// Services and message types of several service sets, searchable by code and by name.
///
/// A crate with services of its own extends the registry of the crate below it:
///
/// ```
/// use jaus_codec::{Registry, ServiceSet};
///
/// # mod stack { pub(super) const fn registry() -> jaus_codec::Registry { jaus_codec::Registry::new(&[]) } }
/// # mod arm { pub(super) const SERVICES: &[jaus_codec::ServiceInfo] = &[]; pub(super) const MESSAGES: &[jaus_codec::MessageInfo] = &[]; }
/// pub const fn registry() -> Registry {
///     static STACK: Registry = stack::registry();
///     static OWN: &[ServiceSet] = &[ServiceSet {
///         services: arm::SERVICES,
///         messages: arm::MESSAGES,
///     }];
///     Registry::extending(&STACK, OWN)
/// }
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Registry {
    base: Option<&'static Self>,
    sets: &'static [ServiceSet],
}

impl Registry {
    /// Creates a registry of these sets.
    pub const fn new(sets: &'static [ServiceSet]) -> Self {
        Self { base: None, sets }
    }

    /// Creates a registry of these sets and everything in `base`. Searches find the types of these
    /// sets first.
    pub const fn extending(base: &'static Self, sets: &'static [ServiceSet]) -> Self {
        let base = Some(base);
        Self { base, sets }
    }

    fn sets(&self) -> impl Iterator<Item = &'static ServiceSet> + use<> {
        core::iter::successors(Some(*self), |registry| registry.base.copied())
            .flat_map(|registry| registry.sets)
    }

    /// All services.
    pub fn services(&self) -> impl Iterator<Item = &'static ServiceInfo> + use<> {
        self.sets().flat_map(|set| set.services)
    }

    /// All message types.
    pub fn iter(&self) -> impl Iterator<Item = &'static MessageInfo> + use<> {
        self.sets().flat_map(|set| set.messages)
    }

    /// The types with this code, usually one. If versions differ on the wire, the newest comes
    /// first.
    pub fn by_code(&self, code: u16) -> impl Iterator<Item = &'static MessageInfo> + use<> {
        self.sets().flat_map(move |set| {
            let start = set.messages.partition_point(|info| info.code < code);
            set.messages[start..]
                .iter()
                .take_while(move |info| info.code == code)
        })
    }

    /// The code of the report that answers a query: as a definition says, or else by the standard's
    /// [arithmetic](report_code). `None` if the code is not a query.
    pub fn report_of(&self, query: u16) -> Option<u16> {
        let mut known = self.by_code(query).peekable();
        match known.peek() {
            Some(_) => known.find_map(|it| it.report),
            None => report_code(query),
        }
    }

    /// The types with this name in their definition, newest first.
    pub fn by_name<'n>(
        &self,
        name: &'n str,
    ) -> impl Iterator<Item = &'static MessageInfo> + use<'n> {
        self.iter().filter(move |info| info.name == name)
    }

    /// The type that a service declares for this code.
    pub fn in_service(&self, service: ServiceId, code: u16) -> Option<&'static MessageInfo> {
        self.by_code(code)
            .find(|info| info.services.contains(&service))
    }

    /// Decodes a message by its code as the first type that accepts the octets. `None` if the code
    /// is unknown or missing.
    ///
    /// # Errors
    /// The error of the first type, if no type accepts the octets.
    pub fn decode(&self, octets: &Bytes) -> Option<Result<Box<dyn AnyMessage>, DecodeError>> {
        let code = u16::from_le_bytes(*octets.first_chunk()?);
        let mut first_error = None;
        for info in self.by_code(code) {
            match (info.decode)(octets) {
                Ok(message) => return Some(Ok(message)),
                Err(error) => _ = first_error.get_or_insert(error),
            }
        }
        first_error.map(Err)
    }
}
