//! Chooses the definition that explains given octets.

use std::cmp::Reverse;
use std::fmt;
use std::str::FromStr;

use super::rows::joined;
use super::{Explanation, Kind, Row, explain_as};
use crate::library::Library;
use crate::model::{Id, Message, Service, Version};

/// Maximum depth of nested messages that are explained.
const DEEPEST: usize = 4;

/// A service name given by a user: the URN or its last part, with or without a version, as in
/// `urn:jaus:jss:core:Events`, `urn:jaus:jss:core:Events@1.0` and `Events@1.0`. A space may stand for
/// the `@`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ServiceName {
    /// The URN, or the part after its last colon.
    pub urn: String,
    /// The version; `None` for any.
    pub version: Option<Version>,
}

impl ServiceName {
    /// Whether the name matches a service.
    pub fn matches(&self, id: &Id) -> bool {
        let last = id.urn.rsplit(':').next().unwrap_or_default();
        let named = self.urn.eq_ignore_ascii_case(&id.urn) || self.urn.eq_ignore_ascii_case(last);
        named && self.version.is_none_or(|version| version == id.version)
    }
}

impl FromStr for ServiceName {
    type Err = Unexplained;

    fn from_str(text: &str) -> Result<Self, Unexplained> {
        let text = text.trim();
        let (urn, version) = match text.split_once([' ', '@']) {
            Some((urn, version)) => (urn, Some(version.trim())),
            None => (text, None),
        };
        let parsed = |text: &str| {
            let (major, minor) = text.split_once('.')?;
            Some(Version {
                major: major.parse().ok()?,
                minor: minor.parse().ok()?,
            })
        };
        let version = version.map(|version| {
            parsed(version).ok_or_else(|| Unexplained::Version {
                text: version.to_owned(),
            })
        });
        Ok(Self {
            urn: urn.to_owned(),
            version: version.transpose()?,
        })
    }
}

impl fmt::Display for ServiceName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.urn)?;
        self.version
            .map_or(Ok(()), |version| write!(f, "@{version}"))
    }
}

/// Reason why octets cannot be explained.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Unexplained {
    /// Fewer octets than a message code.
    #[error("a message starts with the two octets of its code, but there are only {length}")]
    TooShort {
        /// Number of octets.
        length: usize,
    },
    /// No definition has this code.
    #[error("no loaded definition has the message code {code:04X}h; name the file that has it")]
    UnknownCode {
        /// The code.
        code: u16,
    },
    /// No service has this name.
    #[error("there is no service {name}{}", .similar.as_ref().map_or_else(String::new, |id| format!("; did you mean {}@{}?", id.urn, id.version)))]
    UnknownService {
        /// The requested name.
        name: ServiceName,
        /// A service with a similar name.
        similar: Option<Id>,
    },
    /// The service has no message with this code.
    #[error("{name} has no message {code:04X}h; it is defined in {}", listed(.services))]
    NotInService {
        /// The requested name.
        name: ServiceName,
        /// The code.
        code: u16,
        /// The services that have it.
        services: Vec<Id>,
    },
    /// An invalid version.
    #[error("`{text}` is not a version; write MAJOR.MINOR such as 1.0")]
    Version {
        /// The given text.
        text: String,
    },
}

fn listed(ids: &[Id]) -> String {
    let in_words = |id: &Id| format!("{}@{}", id.urn, id.version);
    let ids: Vec<_> = ids.iter().map(in_words).collect();
    ids.join(", ")
}

/// Explains a whole message, beginning with its code.
///
/// If several definitions have the code, newer versions are tried first, and the first one that
/// decodes completely is chosen; otherwise the one that decodes the most. A service name restricts
/// the choice to what that service declares or inherits.
///
/// # Errors
/// If there is no code or no such definition. Mistakes within the message are no error here:
/// [`Explanation::stop`] describes them.
pub fn explain(
    library: &Library,
    octets: &[u8],
    service: Option<&ServiceName>,
) -> Result<Explanation, Unexplained> {
    let mut explanation = outermost(library, octets, service)?;
    explanation.rows = opened(library, explanation.rows, DEEPEST);
    Ok(explanation)
}

/// Replaces the octets of embedded messages by their rows.
fn opened(library: &Library, rows: Vec<Row>, depth: usize) -> Vec<Row> {
    if depth == 0 {
        return rows;
    }
    let mut all = Vec::with_capacity(rows.len());
    for mut row in rows {
        if row.kind != Kind::Message {
            all.push(row);
            continue;
        }
        match outermost(library, &row.octets, None) {
            Ok(inner) if inner.stop.is_none() => {
                let inner = inner.shifted(row.offset);
                let rows = opened(library, inner.rows, depth - 1);
                all.extend(rows.into_iter().map(|mut inner| {
                    inner.field = joined(&row.field, &inner.field);
                    inner
                }));
            }
            Ok(inner) => {
                row.note = inner
                    .stop
                    .map(|stop| format!("an undecodable message: {stop}"));
                all.push(row);
            }
            Err(_) => all.push(row),
        }
    }
    all
}

fn outermost(
    library: &Library,
    octets: &[u8],
    service: Option<&ServiceName>,
) -> Result<Explanation, Unexplained> {
    let code = octets.first_chunk().map(|&code| u16::from_le_bytes(code));
    let length = octets.len();
    let code = code.ok_or(Unexplained::TooShort { length })?;
    let candidates = match service {
        Some(name) => of_service(library, name, code)?,
        None => newest_first(library, code),
    };
    let mut explained: Vec<_> = candidates
        .into_iter()
        .map(|(service, message)| explain_with(service, message, octets))
        .collect();
    // The sort is stable: of equal candidates the newest stays first.
    explained.sort_by_key(|e| {
        e.stop
            .as_ref()
            .map_or(0, |stop| octets.len() + 1 - stop.offset)
    });
    let mut explained = explained.into_iter();
    let mut best = explained.next().ok_or(Unexplained::UnknownCode { code })?;
    best.others = explained
        .filter(|other| other.rows != best.rows)
        .map(|other| other.service)
        .collect();
    best.others.dedup();
    Ok(best)
}

fn explain_with(service: &Service, message: &Message, octets: &[u8]) -> Explanation {
    let (rows, stop) = explain_as(message, octets);
    Explanation {
        message: message.name.clone(),
        code: message.code,
        service: service.id.clone(),
        rows,
        stop,
        others: Vec::new(),
    }
}

fn newest_first(library: &Library, code: u16) -> Vec<(&Service, &Message)> {
    let mut all: Vec<_> = library
        .by_code(code)
        .map(|(service, message)| (service, message.as_ref()))
        .collect();
    all.sort_by_key(|(service, _)| Reverse(service.id.version));
    all
}

fn of_service<'a>(
    library: &'a Library,
    name: &ServiceName,
    code: u16,
) -> Result<Vec<(&'a Service, &'a Message)>, Unexplained> {
    let mut services: Vec<_> = library
        .services()
        .filter(|service| name.matches(&service.id))
        .collect();
    if services.is_empty() {
        let name = name.clone();
        let similar = similar(library, &name);
        return Err(Unexplained::UnknownService { name, similar });
    }
    services.reverse();
    let messages: Vec<_> = services
        .into_iter()
        .flat_map(|service| library.vocabulary(service))
        .filter(|(_, message)| message.code == code)
        .map(|(service, message)| (service, message.as_ref()))
        .collect();
    if !messages.is_empty() {
        return Ok(messages);
    }
    let mut services: Vec<_> = library.by_code(code).map(|(s, _)| s.id.clone()).collect();
    services.dedup();
    Err(if services.is_empty() {
        Unexplained::UnknownCode { code }
    } else {
        Unexplained::NotInService {
            name: name.clone(),
            code,
            services,
        }
    })
}

/// A service with a similar name, in its newest version.
fn similar(library: &Library, name: &ServiceName) -> Option<Id> {
    let wanted = name.urn.to_lowercase();
    let wanted = wanted.rsplit(':').next().unwrap_or_default();
    let ids = library.services().map(|service| &service.id);
    ids.filter(|id| id.urn.to_lowercase().contains(wanted))
        .min_by_key(|id| (id.urn.len(), Reverse(id.version)))
        .cloned()
}
