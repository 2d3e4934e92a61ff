//! What a step is made of: the vocabulary in which the script is written.
//!
//! A step is data: who says what, what must come back, and in which words a wrong answer is told.
//! Nothing here sends or waits; the [runner](super::runner) does.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use bytes::Bytes;
use jaus::codec::Message;

use super::memory::Memory;
pub(super) use super::memory::{Speaker, Stream};

/// Where the steps come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    /// The six tasks of the challenges of 2010 to 2013.
    A,
    /// The interface tasks of the challenges since 2014.
    B,
    /// What the judges look at besides answers: safety.
    C,
    /// One service's definition.
    S,
}

/// A step's name, such as `B16`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Name {
    pub(super) part: Part,
    pub(super) number: u8,
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
        let wrong = || format!("`{text}` is no step: write A1 to A6, B1 to B36 or C1 to C5");
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

/// How a request travels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// As a global broadcast to all components of the subject's node, as the contests' tool asks.
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

/// What a check says: all is well, or what is wrong, in words.
pub(super) type Check = Result<(), String>;

/// One step of the script.
pub(super) struct Step {
    pub(super) name: Name,
    pub(super) title: Cow<'static, str>,
    /// URNs of the services without which the step says nothing.
    pub(super) needs: Vec<&'static str>,
    /// The steps of the same part that must have run before, because they leave the subject as
    /// this one expects it.
    pub(super) rests_on: &'static [u8],
    /// Whether the contests' tool asks this by unicast only.
    pub(super) by_unicast_only: bool,
    pub(super) acts: Vec<Act>,
    /// What is said at the end, however the step went; answers to it are not judged.
    pub(super) afterwards: Vec<Exchange>,
}

/// A part of a step. The first that goes wrong ends the step.
pub(super) enum Act {
    /// Something is said, and answered.
    Exchange(Exchange),
    /// The subject puts a question to the judge by itself.
    Asked {
        code: u16,
        name: &'static str,
        within: Duration,
    },
    /// Event streams run at their rate.
    Watch(Watch),
    /// Event streams have ended: nothing comes for this time.
    Silence { streams: Streams, lasting: Duration },
    /// Something is said that must be ignored: for this time nothing comes but events.
    Ignored {
        exchange: Exchange,
        lasting: Duration,
    },
    /// Time for the subject.
    Pause(Duration),
    /// The exchanges are repeated until the check says that the end is reached.
    Until(Until),
    /// The exchanges are repeated for a time, in which the check must never fail.
    Throughout(Throughout),
}

/// What is said, to whom it is up to answer, and how.
pub(super) struct Exchange {
    pub(super) from: Speaker,
    pub(super) content: Content,
    pub(super) reach: Reach,
    pub(super) expects: Vec<Expectation>,
}

/// Makes a message; the reason why it cannot be made is one to fail the step.
pub(super) type Content = Box<dyn Fn(&Memory) -> Result<Bytes, String>>;

/// Looks at the octets of a message, and notes what later steps need.
pub(super) type Look = Box<dyn Fn(&Bytes, &mut Memory) -> Check>;

/// Whom a message is for, in the multicast form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reach {
    /// All components of the subject's node.
    Node,
    /// Everybody.
    Everyone,
    /// The subject's component alone, in both forms.
    Component,
}

/// A message that must come.
pub(super) struct Expectation {
    pub(super) to: Speaker,
    pub(super) code: u16,
    pub(super) name: &'static str,
    /// What it must say, in words.
    pub(super) words: Cow<'static, str>,
    pub(super) check: Look,
    /// Whether the step goes on if it does not come, which then is waited for less long.
    pub(super) is_optional: bool,
    /// Whether the answer may come in several messages, of which one must be right.
    pub(super) in_parts: bool,
}

/// Which event streams are meant: their ids and the codes of the reports in them, as remembered.
pub(super) type Streams = fn(&Memory) -> Result<Vec<Stream>, String>;

/// Periodic events to the main speaker, watched for a while.
pub(super) struct Watch {
    pub(super) streams: Streams,
    pub(super) period: Duration,
    /// How many events of each stream are to be seen.
    pub(super) events: usize,
}

/// Something that takes its time, such as a drive.
pub(super) struct Until {
    /// What is to be reached, in words.
    pub(super) words: &'static str,
    pub(super) exchanges: Vec<Exchange>,
    /// Looked at after each round: whether it is reached, or what is still wanting, in words.
    pub(super) reached: fn(&Memory) -> Check,
    pub(super) every: Duration,
    pub(super) at_most: Duration,
}

/// Something that must not happen, however long it is provoked.
pub(super) struct Throughout {
    /// What must hold, in words.
    pub(super) words: &'static str,
    pub(super) exchanges: Vec<Exchange>,
    /// Looked at after each round.
    pub(super) holds: fn(&Memory) -> Check,
    pub(super) every: Duration,
    pub(super) lasting: Duration,
}

/// Begins a step.
pub(super) fn step(part: Part, number: u8, title: impl Into<Cow<'static, str>>) -> Step {
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
        self.needs = urns.to_vec();
        self
    }

    pub(super) fn rests_on(mut self, numbers: &'static [u8]) -> Self {
        self.rests_on = numbers;
        self
    }

    pub(super) fn by_unicast_only(mut self) -> Self {
        self.by_unicast_only = true;
        self
    }

    /// Says something that is not answered.
    pub(super) fn tell(self, from: Speaker, message: impl Message) -> Self {
        self.act(Act::Exchange(Exchange::new(from, message)))
    }

    /// Says something that must be answered.
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

    /// The last exchange must also bring this, to another speaker.
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

    pub(super) fn act(mut self, act: Act) -> Self {
        self.acts.push(act);
        self
    }

    /// Adds something that is not answered, to be said at the end in any case, before everything
    /// else that is.
    pub(super) fn finally(mut self, exchange: Exchange) -> Self {
        self.afterwards.insert(0, exchange);
        self
    }

    /// Adds something that is answered, to be said at the end in any case.
    pub(super) fn afterwards<R: Message>(mut self, from: Speaker, message: impl Message) -> Self {
        let exchange = Exchange::new(from, message);
        let exchange = exchange.expect(from, "", |_: &R, _| Ok(()));
        self.afterwards.push(exchange);
        self
    }
}

impl Exchange {
    /// Says a message that is always the same.
    pub(super) fn new(from: Speaker, message: impl Message) -> Self {
        Self::with(from, move |_| Ok(message.clone()))
    }

    /// Says a message that depends on what came before.
    pub(super) fn with<M: Message>(
        from: Speaker,
        message: impl Fn(&Memory) -> Result<M, String> + 'static,
    ) -> Self {
        let encode =
            move |memory: &Memory| message(memory)?.encode().map_err(|error| error.to_string());
        Self {
            from,
            content: Box::new(encode),
            reach: Reach::Node,
            expects: Vec::new(),
        }
    }

    /// Says these octets.
    pub(super) fn octets(from: Speaker, octets: Bytes) -> Self {
        Self {
            from,
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

    /// The answer may come in several messages: lists can be long.
    pub(super) fn in_parts(mut self) -> Self {
        if let Some(expectation) = self.expects.last_mut() {
            expectation.in_parts = true;
        }
        self
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
            name: R::NAME,
            words: words.into(),
            check: Box::new(check),
            is_optional: false,
            in_parts: false,
        }
    }

    /// Whether a message is as it must be; the reason begins with the message's name.
    pub(super) fn look_at(&self, octets: &Bytes, memory: &mut Memory) -> Check {
        (self.check)(octets, memory).map_err(|reason| format!("{}: {reason}", self.name))
    }
}

/// Whether a value is as it must be.
#[expect(
    clippy::needless_pass_by_value,
    reason = "numbers and words made for the comparison"
)]
pub(super) fn equal<T: PartialEq + fmt::Display>(what: &str, is: T, must_be: T) -> Check {
    if is == must_be {
        Ok(())
    } else {
        Err(format!("{what} is {is}, not {must_be}"))
    }
}

/// Whether a measured value is as it must be, but for `slack`.
pub(super) fn near(what: &str, is: f64, must_be: f64, slack: f64) -> Check {
    if (is - must_be).abs() <= slack {
        Ok(())
    } else {
        Err(format!("{what} is {is}, not {must_be}"))
    }
}

/// Whether something is there.
pub(super) fn present<T>(what: &str, value: Option<T>) -> Result<T, String> {
    value.ok_or_else(|| format!("{what} is missing"))
}
