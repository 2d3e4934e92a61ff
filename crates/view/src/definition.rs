//! One layout of a message: its name, the services that define it, and the conversion between
//! octets and JSON.

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use bytes::Bytes;
use jsidl::dynamic;
use jsidl::model::{Id, Message, Version};
use serde::{Deserialize, Serialize, Serializer};
use serde_json::Value as Json;

use jaus::codec::view::Value;
use jaus::codec::{AnyMessage, DecodeError, MessageInfo, ServiceId};

use super::named::{ByName, name_values};

/// Why octets cannot be decoded, or JSON cannot be encoded, as a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unreadable {
    /// The problem, as a sentence.
    pub problem: String,
    /// The position: the octet, counted from the message code, or the column of a line.
    pub offset: usize,
}

impl Unreadable {
    pub(super) fn new(problem: impl Into<String>, offset: usize) -> Self {
        Self {
            problem: problem.into(),
            offset,
        }
    }
}

impl fmt::Display for Unreadable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.problem)
    }
}

impl std::error::Error for Unreadable {}

/// Decodes a message of a generated type.
pub type Decode = fn(&MessageInfo, &Bytes) -> Result<Box<dyn AnyMessage>, DecodeError>;

/// One layout of a message, and the services that define it so, the newest first.
#[derive(Debug)]
pub(super) struct Definition {
    pub(super) services: Vec<Id>,
    codec: Codec,
}

#[derive(Debug)]
enum Codec {
    Generated(&'static MessageInfo, Decode),
    Dynamic(Arc<Message>),
}

/// The fields of a message. They serialize with units; enumerated values by name, if they have one.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Body {
    /// Decoded by a generated type.
    Generated(Value),
    /// Decoded by a definition loaded at run time.
    Dynamic(Json),
}

impl Serialize for Body {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Generated(value) => ByName(value).serialize(serializer),
            Self::Dynamic(json) => json.serialize(serializer),
        }
    }
}

/// The name of a service in flags and requests: `urn:jaus:jss:core:Events`, or with its version
/// `urn:jaus:jss:core:Events@1.0`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ServiceName {
    /// The URN.
    pub urn: String,
    /// The version; `None` for any.
    pub version: Option<Version>,
}

impl ServiceName {
    /// Whether a service has this name, and the version if one is given.
    #[must_use]
    pub fn matches(&self, service: &Id) -> bool {
        *self.urn == *service.urn
            && self
                .version
                .is_none_or(|version| version == service.version)
    }
}

impl fmt::Display for ServiceName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.urn)?;
        self.version
            .map_or(Ok(()), |version| write!(f, "@{version}"))
    }
}

impl FromStr for ServiceName {
    type Err = Unreadable;

    fn from_str(text: &str) -> Result<Self, Unreadable> {
        let (urn, version) = match text.split_once('@') {
            Some((urn, version)) => (urn, Some(parse_version(version)?)),
            None => (text, None),
        };
        Ok(Self {
            urn: urn.to_owned(),
            version,
        })
    }
}

/// `1.0`
pub(super) fn parse_version(text: &str) -> Result<Version, Unreadable> {
    let parsed = text.split_once('.').and_then(|(major, minor)| {
        Some(Version {
            major: major.parse().ok()?,
            minor: minor.parse().ok()?,
        })
    });
    parsed.ok_or_else(|| {
        Unreadable::new(
            format!("\"{text}\" is not a version; write MAJOR.MINOR such as 1.0"),
            0,
        )
    })
}

impl Definition {
    /// A generated type, whose messages `decode` reads.
    pub(super) fn generated(info: &'static MessageInfo, decode: Decode) -> Self {
        let id = |id: &ServiceId| Id {
            urn: id.urn.into(),
            version: Version {
                major: id.major,
                minor: id.minor,
            },
        };
        Self {
            services: info.services.iter().map(id).collect(),
            codec: Codec::Generated(info, decode),
        }
    }

    /// A message of a service that was loaded at run time.
    pub(super) fn dynamic(service: &Id, message: &Arc<Message>) -> Self {
        Self {
            services: vec![service.clone()],
            codec: Codec::Dynamic(Arc::clone(message)),
        }
    }

    /// Whether this is tried before a definition that was loaded with a service of this version.
    pub(super) fn comes_before(&self, version: Version) -> bool {
        let newest = self.services.iter().map(|service| service.version).max();
        matches!(self.codec, Codec::Dynamic(_)) && newest >= Some(version)
    }

    /// The generated type, or the definition that was loaded.
    fn info(&self) -> Result<&'static MessageInfo, &Message> {
        match &self.codec {
            Codec::Generated(info, _) => Ok(info),
            Codec::Dynamic(message) => Err(message),
        }
    }

    pub(super) fn belongs_to(&self, service: &ServiceName) -> bool {
        self.services.iter().any(|known| service.matches(known))
    }

    pub(super) fn name(&self) -> &str {
        match self.info() {
            Ok(info) => info.name,
            Err(message) => &message.name,
        }
    }

    pub(super) fn code(&self) -> u16 {
        match self.info() {
            Ok(info) => info.code,
            Err(message) => message.code,
        }
    }

    pub(super) fn is_command(&self) -> bool {
        match self.info() {
            Ok(info) => info.is_command,
            Err(message) => message.is_command,
        }
    }

    pub(super) fn decode(&self, octets: &Bytes) -> Result<Body, Unreadable> {
        match &self.codec {
            Codec::Generated(info, decode) => decode(info, octets)
                .map(|message| Body::Generated(message.view()))
                .map_err(|error| Unreadable::new(error.to_string(), error.offset())),
            Codec::Dynamic(message) => {
                let value = dynamic::decode(message, octets)
                    .map_err(|error| Unreadable::new(error.to_string(), error.offset))?;
                let mut view = dynamic::to_json(message, &value)
                    .map_err(|error| Unreadable::new(error.to_string(), 0))?;
                name_values(message, &mut view);
                Ok(Body::Dynamic(view))
            }
        }
    }

    pub(super) fn encode(&self, body: &Json) -> Result<Bytes, String> {
        match self.info() {
            Ok(info) => {
                let named = |problem: String| format!("{}: {problem}", info.name);
                let body = Value::deserialize(body).map_err(|error| named(error.to_string()))?;
                let message = (info.from_view)(&body).map_err(|error| named(error.to_string()))?;
                message.encode().map_err(|error| error.to_string())
            }
            Err(message) => {
                let value = dynamic::from_json(message, body).map_err(|error| error.to_string())?;
                let octets = dynamic::encode(message, &value).map_err(|error| error.to_string())?;
                Ok(octets.into())
            }
        }
    }
}
