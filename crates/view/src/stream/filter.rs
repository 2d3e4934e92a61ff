//! Message filters: one grammar for the terminal, the URL of the debug view and the operator's
//! page.
//!
//! A filter is a sequence of terms separated by spaces. A message must match all of them:
//!
//! | term | matches |
//! |---|---|
//! | `component=101.2.33` | messages from or to a component; `101.2` is a node, `101` a subsystem |
//! | `from=101`, `to=42.*.1` | messages only from, or only to, such a place |
//! | `service=VelocityState` | messages whose service URN contains it |
//! | `message=Velocity`, `message=Set*,Query*` | messages whose name contains or matches it |
//! | `message=4404` | messages with this code |
//! | `direction=received` | `received`, `sent`, `local` or `passing` |
//! | `velocity_x>1.0`, `Pose.X!=0`, `state=ready` | messages with such a field: `=`, `!=`, `<`, … |
//! | `text=Rover`, `Rover`, `"two words"` | messages whose JSON contains it |
//!
//! The comparisons are `=`, `!=`, `<`, `<=`, `>`, `>=` and `~` (contains). Case and underscores in
//! names are ignored. A field is found at any depth; dots select a field inside another. Values
//! separated by commas are alternatives. An event matches as itself and as the report inside it.

use std::fmt;
use std::str::FromStr;

use serde_json::Value as Json;

use super::Entry;
use super::fields::Field;
use jaus::address::JausId;

/// A set of terms that a message must all match. The empty filter matches everything.
///
/// ```
/// use jaus_view::Filter;
///
/// let filter: Filter = "component=101 message=ReportVelocityState velocity_x>1.0".parse()?;
/// assert_eq!(filter.to_string(), "component=101 message=ReportVelocityState velocity_x>1.0");
/// # Ok::<(), jaus_view::FilterError>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Filter(Vec<Term>);

/// Error in a filter, with a correction.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct FilterError(String);

/// Limits on the number and total length of terms, far beyond practical use.
const MOST_TERMS: usize = 64;
const LONGEST: usize = 4096;

#[derive(Debug, Clone, PartialEq)]
struct Term {
    /// The text of the term, without quotes.
    written: String,
    test: Test,
}

#[derive(Debug, Clone, PartialEq)]
enum Test {
    Component(End, Vec<Place>),
    Service(Vec<String>),
    Message(Vec<String>),
    Direction(Vec<String>),
    Field(Field),
    Text(String),
}

/// An end of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    Either,
    From,
    To,
}

/// A subsystem, node or component; `None` matches any number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Place([Option<u16>; 3]);

impl Filter {
    /// Adds a term given as key and value, as in a URL: `component`, `from`, `to`, `service`,
    /// `message`, `direction` and `text` as in the grammar, `field` for a field comparison, and
    /// `filter` for terms of the grammar. An empty value adds nothing.
    ///
    /// # Errors
    /// If the key or the value is invalid.
    pub fn add(&mut self, key: &str, value: &str) -> Result<(), FilterError> {
        if value.trim().is_empty() {
            return Ok(());
        }
        let mut terms = match key {
            "filter" => value.parse::<Self>()?.0,
            "field" => vec![Term::of_field(value.trim())?],
            "text" => vec![Term::of_text(value)],
            _ => vec![Term::of_key(key, value.trim())?],
        };
        self.0.append(&mut terms);
        let length: usize = self.0.iter().map(|term| term.written.len()).sum();
        if self.0.len() > MOST_TERMS || length > LONGEST {
            return Err(FilterError(format!(
                "a filter has at most {MOST_TERMS} terms and {LONGEST} characters"
            )));
        }
        Ok(())
    }

    /// Whether the filter matches everything.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether a message matches.
    #[must_use]
    pub fn passes(&self, entry: &Entry) -> bool {
        self.0.iter().all(|term| term.test.holds(entry))
    }

    /// Whether a message between these ids can match, judged without decoding it.
    pub(super) fn may_pass(&self, source: JausId, destination: JausId) -> bool {
        self.0.iter().all(|term| match &term.test {
            Test::Component(end, places) => end.is_at(places, Some(source), Some(destination)),
            _ => true,
        })
    }
}

impl FromStr for Filter {
    type Err = FilterError;

    fn from_str(text: &str) -> Result<Self, FilterError> {
        let mut filter = Self::default();
        for word in words(text)? {
            filter.0.push(Term::of_word(&word)?);
        }
        filter.add("", "")?;
        Ok(filter)
    }
}

impl fmt::Display for Filter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, term) in self.0.iter().enumerate() {
            if index > 0 {
                f.write_str(" ")?;
            }
            if term.written.contains(char::is_whitespace) {
                write!(f, "\"{}\"", term.written)?;
            } else {
                f.write_str(&term.written)?;
            }
        }
        Ok(())
    }
}

/// Splits at spaces outside double quotes, and removes the quotes.
fn words(text: &str) -> Result<Vec<String>, FilterError> {
    let (mut words, mut word, mut quoted) = (Vec::new(), String::new(), false);
    for character in text.chars() {
        match character {
            '"' => quoted = !quoted,
            blank if blank.is_whitespace() && !quoted => words.push(std::mem::take(&mut word)),
            other => word.push(other),
        }
    }
    if quoted {
        return Err(FilterError(format!(
            "`{text}` lacks a closing double quote"
        )));
    }
    words.push(word);
    words.retain(|word| !word.is_empty());
    Ok(words)
}

impl Term {
    fn of_word(word: &str) -> Result<Self, FilterError> {
        let key = word.split_once('=');
        if let Some((key, value)) = key
            && KEYS.contains(&key)
        {
            return Self::of_key(key, value);
        }
        match Field::parse(word) {
            Some(_) => Self::of_field(word),
            None => Ok(Self::of_text(word)),
        }
    }

    fn of_key(key: &str, value: &str) -> Result<Self, FilterError> {
        let alternatives = || value.split(',').map(|one| one.trim().to_lowercase());
        let places = |end| {
            let places = alternatives().map(|one| Place::parse(&one));
            Ok::<_, FilterError>(Test::Component(end, places.collect::<Result<_, _>>()?))
        };
        let test = match key {
            "component" => places(End::Either)?,
            "from" => places(End::From)?,
            "to" => places(End::To)?,
            "service" => Test::Service(alternatives().collect()),
            "message" => Test::Message(alternatives().collect()),
            "direction" => Test::Direction(directions(alternatives().collect())?),
            "text" => return Ok(Self::of_text(value)),
            other => {
                return Err(FilterError(format!(
                    "there is no filter `{other}`; choose from {}, field and filter",
                    KEYS.join(", ")
                )));
            }
        };
        Ok(Self {
            written: format!("{key}={value}"),
            test,
        })
    }

    fn of_field(written: &str) -> Result<Self, FilterError> {
        let field = Field::parse(written).ok_or_else(|| {
            FilterError(format!(
                "`{written}` is not a comparison: write for example velocity_x>1.0, with one of = \
                 != < <= > >= ~"
            ))
        })?;
        if field.needs_number() {
            return Err(FilterError(format!(
                "`{written}`: < <= > >= need a number after them"
            )));
        }
        Ok(Self {
            written: written.to_owned(),
            test: Test::Field(field),
        })
    }

    fn of_text(text: &str) -> Self {
        Self {
            written: format!("text={text}"),
            test: Test::Text(text.to_lowercase()),
        }
    }
}

/// Keys before `=` that are not field names.
const KEYS: [&str; 7] = [
    "component",
    "from",
    "to",
    "service",
    "message",
    "direction",
    "text",
];

fn directions(names: Vec<String>) -> Result<Vec<String>, FilterError> {
    const ALL: [&str; 4] = ["received", "sent", "local", "passing"];
    match names.iter().find(|name| !ALL.contains(&name.as_str())) {
        Some(unknown) => Err(FilterError(format!(
            "`direction={unknown}`: choose from {}",
            ALL.join(", ")
        ))),
        None => Ok(names),
    }
}

impl Place {
    fn parse(text: &str) -> Result<Self, FilterError> {
        let wrong = || {
            FilterError(format!(
                "`{text}` is not a component: write 101.2.33, 101.2 for a node, 101 for a \
                 subsystem, or * for any number"
            ))
        };
        let mut place = [None; 3];
        let parts: Vec<_> = text.split('.').collect();
        if parts.len() > place.len() {
            return Err(wrong());
        }
        for (number, part) in place.iter_mut().zip(parts) {
            *number = match part {
                "*" => None,
                part => Some(part.parse().map_err(|_| wrong())?),
            };
        }
        Ok(Self(place))
    }

    fn holds(self, id: JausId) -> bool {
        let parts = [id.subsystem(), id.node().into(), id.component().into()];
        let mut both = self.0.iter().zip(parts);
        both.all(|(wanted, part)| wanted.is_none_or(|wanted| wanted == part))
    }
}

impl End {
    fn is_at(self, places: &[Place], source: Option<JausId>, destination: Option<JausId>) -> bool {
        let at =
            |id: Option<JausId>| id.is_some_and(|id| places.iter().any(|place| place.holds(id)));
        match self {
            Self::Either => at(source) || at(destination),
            Self::From => at(source),
            Self::To => at(destination),
        }
    }
}

impl Test {
    fn holds(&self, entry: &Entry) -> bool {
        let text = |key| entry.text(key).unwrap_or_default().to_lowercase();
        let carried = |key| {
            let value = entry.carried().and_then(|carried| carried.get(key));
            value.and_then(Json::as_str).map(str::to_lowercase)
        };
        // An event matches by itself, and by the report inside.
        let is_either = |key, wanted: &dyn Fn(&str) -> bool| {
            wanted(&text(key)) || carried(key).is_some_and(|text| wanted(&text))
        };
        match self {
            Self::Component(end, places) => end.is_at(places, entry.source, entry.destination),
            Self::Service(names) => names
                .iter()
                .any(|name| is_either("service", &|service| is_like(service, name))),
            Self::Message(names) => names.iter().any(|name| {
                let code = name.strip_suffix('h').unwrap_or(name);
                is_either("message", &|message| is_like(message, name))
                    || is_either("code", &|it| it == code)
            }),
            Self::Direction(names) => names.contains(&text("direction")),
            Self::Field(field) => field.holds(entry.json()),
            Self::Text(text) => entry.to_json().to_lowercase().contains(text),
        }
    }
}

/// Whether `text` contains `wanted`, or matches it entirely if it contains stars.
fn is_like(text: &str, wanted: &str) -> bool {
    let Some((first, rest)) = wanted.split_once('*') else {
        return text.contains(wanted);
    };
    let Some(mut text) = text.strip_prefix(first) else {
        return false;
    };
    let mut rest = rest;
    while let Some((part, behind)) = rest.split_once('*') {
        let Some((_, left)) = text.split_once(part) else {
            return false;
        };
        (text, rest) = (left, behind);
    }
    text.ends_with(rest)
}
