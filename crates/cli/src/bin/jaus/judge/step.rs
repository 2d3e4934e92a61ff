//! Types for the steps of the script.
//!
//! A step is data: the sender and content of a message, the required answers, and the wording of a
//! failure. Nothing here sends or waits; the [runner](super::runner) does.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use bytes::Bytes;
use jaus::codec::Message;

use super::memory::Memory;
pub(super) use super::memory::{Speaker, Stream};

/// The code at the start of a message.
pub(super) fn code_of(octets: &Bytes) -> Option<u16> {
    octets.first_chunk().map(|&code| u16::from_le_bytes(code))
}

/// Origin of steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    /// The six tasks of the challenges of 2010 to 2013.
    A,
    /// The interface tasks of the challenges since 2014.
    B,
    /// Safety, which the judges check besides answers.
    C,
    /// A service's definition.
    S,
}

/// A step's name, such as `B16`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Name {
    pub(super) part: Part,
    pub(super) number: u16,
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let part = match self.part {
            Part::A => 'A',
            Part::B => 'B',
            Part::C => 'C',
            Part::S => 'S',
        };
        f.pad(&format!("{part}{}", self.number))
    }
}

impl FromStr for Name {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is not a step: write A1 to A6, B1 to B36 or C1 to C5");
        let (part, number) = text.split_at_checked(1).ok_or_else(wrong)?;
        let part = match part {
            "A" | "a" => Part::A,
            "B" | "b" => Part::B,
            "C" | "c" => Part::C,
            _ => return Err(wrong()),
        };
        let number = number.parse().map_err(|_| wrong())?;
        Ok(Self { part, number })
    }
}

/// Addressing of requests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// As a global broadcast to all components of the subject's node, as the contests' tool does.
    Multicast,
    /// To the subject alone.
    Unicast,
}

impl Form {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Multicast => "multicast",
            Self::Unicast => "unicast",
        }
    }
}

/// Result of a check: success, or an explanation of the failure.
pub(super) type Check = Result<(), String>;

/// One step of the script.
pub(super) struct Step {
    pub(super) name: Name,
    pub(super) title: Cow<'static, str>,
    /// URNs of the services that the step requires.
    pub(super) needs: Vec<Cow<'static, str>>,
    /// The steps of the same part that must run before, because they set the state that this one
    /// expects.
    pub(super) rests_on: &'static [u16],
    /// Whether the contests' tool sends this by unicast only.
    pub(super) by_unicast_only: bool,
    pub(super) acts: Vec<Act>,
    /// Messages sent at the end, whatever the result; answers to them are not judged.
    pub(super) afterwards: Vec<Exchange>,
}

/// A part of a step. The first failure ends the step.
pub(super) enum Act {
    /// A message with its answers.
    Exchange(Exchange),
    /// A query that the subject must send to the judge.
    Asked {
        code: u16,
        name: &'static str,
        within: Duration,
    },
    /// Event streams must run at their rate.
    Watch(Watch),
    /// Event streams have ended: no event may arrive for this time.
    Silence { streams: Streams, lasting: Duration },
    /// A message that must be ignored: for this time nothing but events may arrive.
    Ignored {
        exchange: Exchange,
        lasting: Duration,
    },
    /// Waits for the subject.
    Pause(Duration),
    /// Repeats the exchanges until the check reports the end.
    Until(Until),
    /// Repeats the exchanges for a time, during which the check must never fail.
    Throughout(Throughout),
}

/// A message with its receiver and the required answers.
pub(super) struct Exchange {
    pub(super) from: Speaker,
    /// Code of the message; `None` if it is too short for one.
    pub(super) code: Option<u16>,
    pub(super) content: Content,
    pub(super) reach: Reach,
    pub(super) expects: Vec<Expectation>,
}

/// Creates a message; an error fails the step.
pub(super) type Content = Box<dyn Fn(&Memory) -> Result<Bytes, String>>;

/// Checks the octets of a message, and stores values for later steps.
pub(super) type Look = Box<dyn Fn(&Bytes, &mut Memory) -> Check>;

/// Destination of a message in the multicast form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reach {
    /// All components of the subject's node.
    Node,
    /// All components.
    Everyone,
    /// Only the subject's component, in both forms.
    Component,
}

/// A required message.
pub(super) struct Expectation {
    pub(super) to: Speaker,
    pub(super) code: u16,
    pub(super) name: Cow<'static, str>,
    /// Its required content, as text.
    pub(super) words: Cow<'static, str>,
    pub(super) check: Look,
    /// Whether the step continues without it; the timeout is then shorter.
    pub(super) is_optional: bool,
    /// Whether the answer may span several messages, of which one must be right.
    pub(super) in_parts: bool,
}

/// Selects event streams: their ids and report codes, from the memory.
pub(super) type Streams = fn(&Memory) -> Result<Vec<Stream>, String>;

/// Periodic events to the main speaker, observed for a while.
pub(super) struct Watch {
    pub(super) streams: Streams,
    pub(super) period: Duration,
    /// Number of events to observe in each stream.
    pub(super) events: usize,
}

/// An action that takes time, such as a drive.
pub(super) struct Until {
    /// The end condition, as text.
    pub(super) words: &'static str,
    pub(super) exchanges: Vec<Exchange>,
    /// Checked after each round: success, or what is missing, as text.
    pub(super) reached: fn(&Memory) -> Check,
    pub(super) every: Duration,
    pub(super) at_most: Duration,
}

/// A condition that must hold despite provocation.
pub(super) struct Throughout {
    /// The condition, as text.
    pub(super) words: &'static str,
    pub(super) exchanges: Vec<Exchange>,
    /// Checked after each round.
    pub(super) holds: fn(&Memory) -> Check,
    pub(super) every: Duration,
    pub(super) lasting: Duration,
}

/// Creates a step.
pub(super) fn step(part: Part, number: u16, title: impl Into<Cow<'static, str>>) -> Step {
    Step {
        name: Name { part, number },
        title: title.into(),
        needs: Vec::new(),
        rests_on: &[],
        by_unicast_only: false,
        acts: Vec::new(),
        afterwards: Vec::new(),
    }
}

impl Step {
    pub(super) fn needs(mut self, urns: &[&'static str]) -> Self {
        self.needs = urns.iter().copied().map(Cow::Borrowed).collect();
        self
    }

    pub(super) fn rests_on(mut self, numbers: &'static [u16]) -> Self {
        self.rests_on = numbers;
        self
    }

    pub(super) fn by_unicast_only(mut self) -> Self {
        self.by_unicast_only = true;
        self
    }

    /// Adds a message without an answer.
    pub(super) fn tell(self, from: Speaker, message: impl Message) -> Self {
        self.act(Act::Exchange(Exchange::new(from, message)))
    }

    /// Adds a message with a required answer.
    pub(super) fn ask<R: Message>(
        self,
        from: Speaker,
        message: impl Message,
        words: &'static str,
        check: fn(&R, &mut Memory) -> Check,
    ) -> Self {
        self.act(Act::Exchange(
            Exchange::new(from, message).expect(from, words, check),
        ))
    }

    /// Requires an additional message to another speaker from the last exchange.
    pub(super) fn also<R: Message>(
        mut self,
        to: Speaker,
        words: &'static str,
        check: fn(&R, &mut Memory) -> Check,
    ) -> Self {
        if let Some(Act::Exchange(exchange)) = self.acts.last_mut() {
            let expectation = Expectation::new(to, words, check);
            exchange.expects.push(expectation);
        }
        self
    }

    /// The codes of its messages.
    pub(super) fn codes(&self) -> impl Iterator<Item = u16> {
        let of_acts = self.acts.iter().flat_map(Act::exchanges);
        let all = of_acts.chain(&self.afterwards);
        all.filter_map(|exchange| exchange.code)
    }

    pub(super) fn act(mut self, act: Act) -> Self {
        self.acts.push(act);
        self
    }

    /// Adds a message without an answer, sent at the end in any case, before all others of that
    /// kind.
    pub(super) fn finally(mut self, exchange: Exchange) -> Self {
        self.afterwards.insert(0, exchange);
        self
    }

    /// Adds a message with an answer, sent at the end in any case.
    pub(super) fn afterwards<R: Message>(mut self, from: Speaker, message: impl Message) -> Self {
        let exchange = Exchange::new(from, message);
        let exchange = exchange.expect(from, "", |_: &R, _| Ok(()));
        self.afterwards.push(exchange);
        self
    }
}

impl Exchange {
    /// A fixed message.
    pub(super) fn new(from: Speaker, message: impl Message) -> Self {
        Self::with(from, move |_| Ok(message.clone()))
    }

    /// A message that depends on earlier answers.
    pub(super) fn with<M: Message>(
        from: Speaker,
        message: impl Fn(&Memory) -> Result<M, String> + 'static,
    ) -> Self {
        let encode =
            move |memory: &Memory| message(memory)?.encode().map_err(|error| error.to_string());
        Self {
            from,
            code: Some(M::CODE),
            content: Box::new(encode),
            reach: Reach::Node,
            expects: Vec::new(),
        }
    }

    /// A message of these octets.
    pub(super) fn octets(from: Speaker, octets: Bytes) -> Self {
        Self {
            from,
            code: code_of(&octets),
            content: Box::new(move |_| Ok(octets.clone())),
            reach: Reach::Node,
            expects: Vec::new(),
        }
    }

    pub(super) fn to(mut self, reach: Reach) -> Self {
        self.reach = reach;
        self
    }

    pub(super) fn expect<R: Message>(
        mut self,
        to: Speaker,
        words: &'static str,
        check: impl Fn(&R, &mut Memory) -> Check + 'static,
    ) -> Self {
        self.expects.push(Expectation::new(to, words, check));
        self
    }

    /// The answer may span several messages: lists can be long.
    pub(super) fn in_parts(mut self) -> Self {
        if let Some(expectation) = self.expects.last_mut() {
            expectation.in_parts = true;
        }
        self
    }
}

impl Act {
    /// The messages that it sends.
    fn exchanges(&self) -> &[Exchange] {
        match self {
            Self::Exchange(exchange) | Self::Ignored { exchange, .. } => {
                std::slice::from_ref(exchange)
            }
            Self::Until(until) => &until.exchanges,
            Self::Throughout(throughout) => &throughout.exchanges,
            Self::Asked { .. } | Self::Watch(_) | Self::Silence { .. } | Self::Pause(_) => &[],
        }
    }
}

impl From<Exchange> for Act {
    fn from(exchange: Exchange) -> Self {
        Self::Exchange(exchange)
    }
}

impl Expectation {
    fn new<R: Message>(
        to: Speaker,
        words: &'static str,
        check: impl Fn(&R, &mut Memory) -> Check + 'static,
    ) -> Self {
        let check = move |octets: &Bytes, memory: &mut Memory| {
            let report = R::decode(octets).map_err(|error| error.to_string())?;
            check(&report, memory)
        };
        Self {
            to,
            code: R::CODE,
            name: R::NAME.into(),
            words: words.into(),
            check: Box::new(check),
            is_optional: false,
            in_parts: false,
        }
    }

    /// Checks a message; the reason of a failure begins with the message's name.
    pub(super) fn look_at(&self, octets: &Bytes, memory: &mut Memory) -> Check {
        (self.check)(octets, memory).map_err(|reason| format!("{}: {reason}", self.name))
    }
}

/// Requires a value.
#[expect(
    clippy::needless_pass_by_value,
    reason = "called with values made for the comparison"
)]
pub(super) fn equal<T: PartialEq + fmt::Display>(what: &str, is: T, must_be: T) -> Check {
    if is == must_be {
        Ok(())
    } else {
        Err(format!("{what} is {is}, not {must_be}"))
    }
}

/// Requires a measured value within `slack`.
pub(super) fn near(what: &str, is: f64, must_be: f64, slack: f64) -> Check {
    if (is - must_be).abs() <= slack {
        Ok(())
    } else {
        Err(format!("{what} is {is}, not {must_be}"))
    }
}

/// Requires a value to be present.
pub(super) fn present<T>(what: &str, value: Option<T>) -> Result<T, String> {
    value.ok_or_else(|| format!("{what} is missing"))
}
