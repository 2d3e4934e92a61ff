//! A message to be encoded, given as name or code with a JSON body.

use std::fmt;

use serde_json::{Map, Value as Json};

use super::definition::{ServiceName, Unreadable, parse_version};

/// Ignored keys, which `jaus decode` and `jaus watch` add to a line.
const PASSED_OVER: [&str; 13] = [
    "time",
    "direction",
    "link",
    "peer",
    "source",
    "destination",
    "transport",
    "priority",
    "broadcast",
    "ack",
    "data",
    "sequence",
    "carries",
];

/// Specification of a message and its content.
///
/// ```
/// use jaus_view::{Dictionary, Request};
///
/// let request = Request::from_json(r#"{"message": "QueryIdentification", "body": {"QueryType": 2}}"#)?;
/// let octets = Dictionary::new().write(&request)?;
/// assert_eq!(octets[..], [0x00, 0x2B, 0x02]);
/// # Ok::<(), jaus_view::Unreadable>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Name of the message in its definition.
    pub message: Option<String>,
    /// Code of the message. At least one of name and code is present.
    pub code: Option<u16>,
    /// The service whose definition applies.
    pub service: Option<ServiceName>,
    /// The fields; `{}` for an empty body.
    pub body: Json,
}

impl Request {
    /// Creates a request by message name, with the fields of `body`.
    pub fn new(message: impl Into<String>, body: Json) -> Self {
        Self {
            message: Some(message.into()),
            code: None,
            service: None,
            body,
        }
    }

    /// Reads a line in the output format of `jaus decode`: `message` or `code` (or both), `body`,
    /// and optionally `service` and `version`. Transport keys are ignored.
    ///
    /// # Errors
    /// If the line is not such an object.
    pub fn from_json(line: &str) -> Result<Self, Unreadable> {
        let mut object: Map<String, Json> = serde_json::from_str(line).map_err(|error| {
            // serde_json appends the position to its message. It is reported separately here.
            let column = error.column().saturating_sub(1);
            let sentence = error.to_string();
            let sentence = sentence.split(" at line ").next().unwrap_or(&sentence);
            Unreadable::new(format!("not a JSON object: {sentence}"), column)
        })?;
        if let Some(error) = object.get("error") {
            let problem = format!("this line is an error, not a message: {error}");
            return Err(Unreadable::new(problem, 0));
        }
        let version = match object.remove("version") {
            Some(version) => Some(parse_version(&text("version", version)?)?),
            None => None,
        };
        let service = match object.remove("service") {
            Some(service) => {
                let service: ServiceName = text("service", service)?.parse()?;
                let version = version.or(service.version);
                Some(ServiceName { version, ..service })
            }
            None => None,
        };
        let request = Self {
            message: object
                .remove("message")
                .map(|name| text("message", name))
                .transpose()?,
            code: object.remove("code").as_ref().map(code).transpose()?,
            service,
            body: object
                .remove("body")
                .unwrap_or_else(|| Json::Object(Map::new())),
        };
        if let Some(key) = object
            .keys()
            .find(|key| !PASSED_OVER.contains(&key.as_str()))
        {
            let problem = format!(
                "unknown key \"{key}\"; a line has message or code, body, and optionally service \
                 and version"
            );
            return Err(Unreadable::new(problem, 0));
        }
        if request.message.is_none() && request.code.is_none() {
            let problem = "no message named: give \"message\" or \"code\"";
            return Err(Unreadable::new(problem, 0));
        }
        Ok(request)
    }
}

impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.message, self.code) {
            (Some(message), Some(code)) => write!(f, "{message} ({code:04X}h)"),
            (Some(message), None) => f.write_str(message),
            (None, Some(code)) => write!(f, "the message code {code:04X}h"),
            (None, None) => f.write_str("a message"),
        }
    }
}

fn text(key: &str, value: Json) -> Result<String, Unreadable> {
    match value {
        Json::String(text) => Ok(text),
        other => Err(Unreadable::new(
            format!("\"{key}\" must be text, not {other}"),
            0,
        )),
    }
}

/// Parses `"4B00"`, `"0x4B00"`, `"4B00h"` or a number.
fn code(value: &Json) -> Result<u16, Unreadable> {
    let code = match value {
        Json::String(text) => {
            let digits = text.strip_prefix("0x").unwrap_or(text);
            let digits = digits.strip_suffix(['h', 'H']).unwrap_or(digits);
            u16::from_str_radix(digits, 16).ok()
        }
        other => other.as_u64().and_then(|code| u16::try_from(code).ok()),
    };
    code.ok_or_else(|| {
        let problem = format!("{value} is not a message code; write it like \"4B00\"");
        Unreadable::new(problem, 0)
    })
}
