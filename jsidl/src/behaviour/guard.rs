//! Guards: the conditions under which transitions are taken, for example
//! `isSupported(msg) && ! eventExists(msg)`.
//!
//! Published guards consist of calls, `&&`, `||`, `!` and parentheses. Comparisons are supported
//! too, as in the reference tool set.

use std::fmt;

use nom::branch::alt;
use nom::bytes::complete::{tag, take_while, take_while_m_n};
use nom::character::complete::{char, digit1, multispace0, satisfy};
use nom::combinator::{all_consuming, cut, map, opt, recognize, value};
use nom::error::{Error, ErrorKind};
use nom::multi::{many0, separated_list0, separated_list1};
use nom::sequence::{delimited, pair, preceded};
use nom::{Finish, IResult, Parser};

use super::Name;

/// Maximum length, which bounds the depth of the tree; published guards have up to 162 characters.
const LONGEST: usize = 1_000;

/// Maximum nesting of parentheses and negations.
const DEEPEST: usize = 16;

/// The condition of a transition. Displayed with as few parentheses as possible, in a form that
/// parses to the same guard.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Guard {
    /// A bare name, for example a parameter in a comparison.
    Name(Name),
    /// A call of the service, for example `isControllingClient(transportData)`.
    Call(Call),
    /// A quoted text or an integer, as written without quotes; only useful in a comparison.
    Literal(Argument),
    /// `!`
    Not(Box<Self>),
    /// `&&`
    And(Box<Self>, Box<Self>),
    /// `||`
    Or(Box<Self>, Box<Self>),
    /// `==`, `!=`, `<` or `>`
    Compare(Comparison, Box<Self>, Box<Self>),
}

/// A guard's call of the service.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Call {
    /// Qualified by the aliases of the services up to the one that implements it.
    pub name: Name,
    /// Arguments of the call.
    pub arguments: Vec<Argument>,
}

/// An argument of an action or of a guard's call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Argument {
    /// A parameter of the transition, for example `msg` or `transportData`.
    Variable(Name),
    /// A quoted text, without the quotes and surrounding blanks.
    Text(String),
    /// A decimal integer, as written.
    Integer(String),
}

/// The comparisons.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    /// `==`
    Equal,
    /// `!=`
    Unequal,
    /// `<`
    Less,
    /// `>`
    Greater,
}

impl Guard {
    /// Parses a whole text.
    ///
    /// # Errors
    /// A phrase that describes the mistake, to follow a colon.
    pub fn parse(text: &str) -> Result<Self, String> {
        whole(text, |input| disjunction(input, 0))
    }

    /// Whether the guard holds; `ask` evaluates names, calls, literals and comparisons. Evaluation
    /// short-circuits.
    pub fn holds(&self, ask: &mut impl FnMut(&Self) -> bool) -> bool {
        match self {
            Self::Not(inner) => !inner.holds(ask),
            Self::And(left, right) => left.holds(ask) && right.holds(ask),
            Self::Or(left, right) => left.holds(ask) || right.holds(ask),
            question => ask(question),
        }
    }

    /// Precedence: an operand with a lower rank than its position requires gets parentheses.
    const fn rank(&self) -> u8 {
        match self {
            Self::Or(..) => 0,
            Self::And(..) => 1,
            Self::Compare(..) => 2,
            Self::Not(_) => 3,
            Self::Name(_) | Self::Call(_) | Self::Literal(_) => 4,
        }
    }

    fn show(&self, least: u8, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.rank() < least {
            write!(f, "({self})")
        } else {
            write!(f, "{self}")
        }
    }
}

impl Argument {
    /// Parses a whole text.
    ///
    /// # Errors
    /// A phrase that describes the mistake, to follow a colon.
    pub fn parse(text: &str) -> Result<Self, String> {
        whole(text, argument)
    }

    /// The text between the quotes, if it is a text.
    pub fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            Self::Variable(_) | Self::Integer(_) => None,
        }
    }
}

impl fmt::Display for Guard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (left, sign, right) = match self {
            Self::Name(name) => return write!(f, "{name}"),
            Self::Call(call) => return write!(f, "{call}"),
            Self::Literal(literal) => return write!(f, "{literal}"),
            Self::Not(inner) => {
                f.write_str("!")?;
                return inner.show(self.rank(), f);
            }
            Self::And(left, right) => (left, "&&", right),
            Self::Or(left, right) => (left, "||", right),
            Self::Compare(comparison, left, right) => (left, comparison.sign(), right),
        };
        // Chains are parsed from left to right; comparisons cannot be chained.
        let chain = !matches!(self, Self::Compare(..));
        left.show(self.rank() + u8::from(!chain), f)?;
        write!(f, " {sign} ")?;
        right.show(self.rank() + 1, f)
    }
}

impl fmt::Display for Call {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}(", self.name)?;
        for (position, argument) in self.arguments.iter().enumerate() {
            let separator = if position == 0 { "" } else { ", " };
            write!(f, "{separator}{argument}")?;
        }
        f.write_str(")")
    }
}

impl fmt::Display for Argument {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Variable(name) => write!(f, "{name}"),
            Self::Text(text) => write!(f, "'{text}'"),
            Self::Integer(digits) => f.write_str(digits),
        }
    }
}

impl Comparison {
    /// The operator as written.
    pub const fn sign(self) -> &'static str {
        match self {
            Self::Equal => "==",
            Self::Unequal => "!=",
            Self::Less => "<",
            Self::Greater => ">",
        }
    }

    /// Whether it holds for two values in this order.
    pub const fn holds(self, order: std::cmp::Ordering) -> bool {
        match self {
            Self::Equal => order.is_eq(),
            Self::Unequal => order.is_ne(),
            Self::Less => order.is_lt(),
            Self::Greater => order.is_gt(),
        }
    }
}

/// Parses a whole text with one rule of the grammar.
fn whole<'a, T>(text: &'a str, rule: impl Fn(&'a str) -> IResult<&'a str, T>) -> Result<T, String> {
    if text.len() > LONGEST {
        return Err(format!("it is longer than {LONGEST} characters"));
    }
    let read = all_consuming(delimited(multispace0, rule, multispace0)).parse(text);
    match read.finish() {
        Ok((_, read)) => Ok(read),
        Err(error) if error.input.is_empty() => Err("it is incomplete".into()),
        Err(error) => {
            let rest: String = error.input.chars().take(40).collect();
            Err(format!("`{rest}` is not recognised"))
        }
    }
}

fn disjunction(input: &str, depth: usize) -> IResult<&str, Guard> {
    chain(input, depth, "||", conjunction, Guard::Or)
}

fn conjunction(input: &str, depth: usize) -> IResult<&str, Guard> {
    chain(input, depth, "&&", comparison, Guard::And)
}

/// Parses operands joined by one operator, from left to right.
fn chain<'a>(
    input: &'a str,
    depth: usize,
    sign: &str,
    operand: fn(&'a str, usize) -> IResult<&'a str, Guard>,
    join: fn(Box<Guard>, Box<Guard>) -> Guard,
) -> IResult<&'a str, Guard> {
    let (input, first) = operand(input, depth)?;
    let next = preceded(
        (multispace0, tag(sign), multispace0),
        cut(|i| operand(i, depth)),
    );
    let (input, rest) = many0(next).parse(input)?;
    let joined = rest
        .into_iter()
        .fold(first, |left, right| join(Box::new(left), Box::new(right)));
    Ok((input, joined))
}

fn comparison(input: &str, depth: usize) -> IResult<&str, Guard> {
    let sign = alt((
        value(Comparison::Equal, tag("==")),
        value(Comparison::Unequal, tag("!=")),
        value(Comparison::Less, tag("<")),
        value(Comparison::Greater, tag(">")),
    ));
    let (input, left) = operand(input, depth)?;
    let right = pair(
        delimited(multispace0, sign, multispace0),
        cut(|i| operand(i, depth)),
    );
    let (input, compared) = opt(right).parse(input)?;
    let guard = match compared {
        Some((comparison, right)) => Guard::Compare(comparison, Box::new(left), Box::new(right)),
        None => left,
    };
    Ok((input, guard))
}

fn operand(input: &str, depth: usize) -> IResult<&str, Guard> {
    if depth >= DEEPEST {
        return Err(nom::Err::Failure(Error::new(input, ErrorKind::TooLarge)));
    }
    alt((
        map(
            preceded((char('!'), multispace0), cut(|i| operand(i, depth + 1))),
            |inner| Guard::Not(Box::new(inner)),
        ),
        delimited(
            (char('('), multispace0),
            cut(|i| disjunction(i, depth + 1)),
            cut((multispace0, char(')'))),
        ),
        named,
        map(argument, Guard::Literal),
    ))
    .parse(input)
}

/// Parses a name, or a call if parentheses follow.
fn named(input: &str) -> IResult<&str, Guard> {
    let arguments = delimited(
        (multispace0, char('('), multispace0),
        separated_list0(delimited(multispace0, char(','), multispace0), argument),
        cut((multispace0, char(')'))),
    );
    map(
        pair(name, opt(arguments)),
        |(name, arguments)| match arguments {
            Some(arguments) => Guard::Call(Call { name, arguments }),
            None => Guard::Name(name),
        },
    )
    .parse(input)
}

fn argument(input: &str) -> IResult<&str, Argument> {
    let text = delimited(
        char('\''),
        take_while(|c: char| c != '\'' && !c.is_control()),
        char('\''),
    );
    alt((
        map(name, Argument::Variable),
        map(text, |text: &str| Argument::Text(text.trim().to_owned())),
        map(recognize(pair(opt(char('-')), digit1)), |digits: &str| {
            Argument::Integer(digits.to_owned())
        }),
    ))
    .parse(input)
}

/// Parses identifiers joined by dots.
pub(super) fn name(input: &str) -> IResult<&str, Name> {
    let identifier = || {
        recognize(pair(
            satisfy(|c| c.is_ascii_alphabetic() || c == '_'),
            take_while_m_n(0, LONGEST, |c: char| c.is_ascii_alphanumeric() || c == '_'),
        ))
    };
    map(
        separated_list1(char('.'), identifier()),
        |parts: Vec<&str>| Name::of(parts),
    )
    .parse(input)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(text: &str) -> Result<String, String> {
        Guard::parse(text).map(|guard| guard.to_string())
    }

    #[test]
    fn negation_binds_before_comparison_before_and_before_or() {
        let same = |text: &str, shown_as: &str| assert_eq!(shown(text).as_deref(), Ok(shown_as));
        same(
            " a( )||b(msg) &&! c( 'X ',d) ",
            "a() || b(msg) && !c('X', d)",
        );
        same("(a() || b()) && c()", "(a() || b()) && c()");
        same("((a() && b())) && c()", "a() && b() && c()");
        same("a() && (b() && c())", "a() && (b() && c())");
        same("!(a() && b())", "!(a() && b())");
        same("!(msg.x == -3)", "!(msg.x == -3)");
        same("(a < 'b') != !c", "(a < 'b') != !c");
    }

    #[test]
    fn questions_are_asked_until_the_answer_is_known() {
        let guard = Guard::parse("a() && (b() || !c())").expect("a guard");
        let mut asked = Vec::new();
        let holds = guard.holds(&mut |question| {
            asked.push(question.to_string());
            question.to_string() == "a()"
        });
        assert!(holds);
        assert_eq!(asked, ["a()", "b()", "c()"]);
    }

    #[test]
    fn what_is_no_guard_is_refused_with_the_place() {
        assert_eq!(shown("a() &&"), Err("it is incomplete".into()));
        assert_eq!(shown("a() & b()"), Err("`& b()` is not recognised".into()));
        assert_eq!(shown("a(!b)"), Err("`!b)` is not recognised".into()));
        assert!(shown(&"(".repeat(500)).is_err());
        assert!(shown(&"!".repeat(500)).is_err());
        assert!(shown(&"a()&&".repeat(500)).is_err());
    }
}
