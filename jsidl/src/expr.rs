//! Constant expressions in limits and counts: numbers (thousands commas allowed), `+ - * /`,
//! parentheses and dotted names of constants, for example `-10*basicConsts.PI`.

use nom::branch::alt;
use nom::bytes::complete::take_while;
use nom::character::complete::{char, multispace0, one_of, satisfy};
use nom::combinator::{all_consuming, cut, map, map_opt, opt, recognize};
use nom::error::{Error, ErrorKind};
use nom::multi::{many0, many1_count, separated_list1};
use nom::sequence::{delimited, pair, preceded};
use nom::{Finish, IResult, Parser};

/// Maximum length of a text: no limit needs more, and it bounds the depth of the tree.
const LONGEST: usize = 256;

/// Maximum nesting of parentheses and signs.
const DEEPEST: usize = 16;

/// Value of an expression. Integers stay exact as long as possible.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Value {
    Integer(i128),
    Real(f64),
}

impl Value {
    /// As a double; integers beyond 2^53 are rounded.
    pub(crate) fn real(self) -> f64 {
        match self {
            Self::Integer(i) => i as f64,
            Self::Real(r) => r,
        }
    }

    /// As an integer, if it is one: `5.00` is.
    pub(crate) fn integer(self) -> Option<i128> {
        match self {
            Self::Integer(i) => Some(i),
            Self::Real(r) if r.fract() == 0.0 && r.abs() < 1e30 => Some(r as i128),
            Self::Real(_) => None,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
}

/// A parsed expression.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Expression {
    Number(Value),
    /// The parts of a dotted name.
    Name(Vec<String>),
    Negated(Box<Self>),
    Binary(Operator, Box<Self>, Box<Self>),
}

impl Expression {
    /// Parses a whole text.
    ///
    /// # Errors
    /// A phrase that describes the mistake, to follow "because" or a colon.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        if text.len() > LONGEST {
            return Err(format!("it is longer than {LONGEST} characters"));
        }
        let whole = all_consuming(delimited(multispace0, |i| sum(i, 0), multispace0)).parse(text);
        match whole.finish() {
            Ok((_, expression)) => Ok(expression),
            Err(error) if error.input.is_empty() => Err("it is incomplete".into()),
            Err(error) => Err(format!("`{}` is not recognised", error.input)),
        }
    }

    /// Computes the value; `constant` looks names up and reports missing ones.
    ///
    /// # Errors
    /// `None` inside if a name has no value (already reported), a phrase if the arithmetic fails.
    pub(crate) fn evaluate(
        &self,
        constant: &mut impl FnMut(&[String]) -> Option<Value>,
    ) -> Result<Value, Option<&'static str>> {
        let value = match self {
            Self::Number(value) => *value,
            Self::Name(parts) => constant(parts).ok_or(None)?,
            Self::Negated(inner) => match inner.evaluate(constant)? {
                Value::Integer(i) => Value::Integer(-i),
                Value::Real(r) => Value::Real(-r),
            },
            Self::Binary(operator, left, right) => {
                let (left, right) = (left.evaluate(constant)?, right.evaluate(constant)?);
                operator.apply(left, right)
            }
        };
        if value.real().is_finite() {
            Ok(value)
        } else {
            Err(Some("the result is not a finite number"))
        }
    }
}

impl Operator {
    fn apply(self, left: Value, right: Value) -> Value {
        if let (Value::Integer(l), Value::Integer(r)) = (left, right) {
            let exact = match self {
                Self::Add => l.checked_add(r),
                Self::Subtract => l.checked_sub(r),
                Self::Multiply => l.checked_mul(r),
                Self::Divide => l.checked_rem(r).filter(|&rest| rest == 0).map(|_| l / r),
            };
            // An exact `i128::MIN` could not be negated.
            if let Some(exact) = exact.filter(|&e| e != i128::MIN) {
                return Value::Integer(exact);
            }
        }
        let (l, r) = (left.real(), right.real());
        Value::Real(match self {
            Self::Add => l + r,
            Self::Subtract => l - r,
            Self::Multiply => l * r,
            Self::Divide => l / r,
        })
    }
}

fn sum(input: &str, depth: usize) -> IResult<&str, Expression> {
    chain(
        input,
        depth,
        product,
        &[('+', Operator::Add), ('-', Operator::Subtract)],
    )
}

fn product(input: &str, depth: usize) -> IResult<&str, Expression> {
    chain(
        input,
        depth,
        factor,
        &[('*', Operator::Multiply), ('/', Operator::Divide)],
    )
}

/// Parses operands joined by operators of one rank, from left to right.
fn chain<'a>(
    input: &'a str,
    depth: usize,
    operand: fn(&'a str, usize) -> IResult<&'a str, Expression>,
    operators: &[(char, Operator)],
) -> IResult<&'a str, Expression> {
    let sign = |input: &'a str| {
        map_opt(delimited(multispace0, one_of("+-*/"), multispace0), |c| {
            operators.iter().find(|(sign, _)| *sign == c).map(|o| o.1)
        })
        .parse(input)
    };
    let (input, first) = operand(input, depth)?;
    let (input, rest) = many0(pair(sign, cut(|i| operand(i, depth)))).parse(input)?;
    let joined = rest.into_iter().fold(first, |left, (operator, right)| {
        Expression::Binary(operator, Box::new(left), Box::new(right))
    });
    Ok((input, joined))
}

fn factor(input: &str, depth: usize) -> IResult<&str, Expression> {
    if depth >= DEEPEST {
        return Err(nom::Err::Failure(Error::new(input, ErrorKind::TooLarge)));
    }
    let inner = |i| factor(i, depth + 1);
    alt((
        map(preceded((char('-'), multispace0), inner), |e| {
            Expression::Negated(Box::new(e))
        }),
        preceded((char('+'), multispace0), inner),
        delimited(
            (char('('), multispace0),
            cut(|i| sum(i, depth + 1)),
            cut((multispace0, char(')'))),
        ),
        map(number, Expression::Number),
        map(separated_list1(char('.'), identifier), Expression::Name),
    ))
    .parse(input)
}

fn identifier(input: &str) -> IResult<&str, String> {
    let first = satisfy(|c| c.is_ascii_alphabetic() || c == '_');
    let rest = take_while(|c: char| c.is_ascii_alphanumeric() || c == '_');
    map(recognize(pair(first, rest)), str::to_owned).parse(input)
}

fn number(input: &str) -> IResult<&str, Value> {
    let digits = |i| recognize(many1_count(one_of("0123456789,"))).parse(i);
    let fraction = || recognize(pair(char('.'), opt(digits)));
    let exponent = recognize((one_of("eE"), opt(one_of("+-")), digits));
    let mantissa = alt((
        recognize(pair(digits, opt(fraction()))),
        recognize(pair(char('.'), digits)),
    ));
    map_opt(recognize(pair(mantissa, opt(exponent))), |text: &str| {
        let plain = text.replace(',', "");
        match plain.parse() {
            Ok(integer) => Some(Value::Integer(integer)),
            Err(_) => plain.parse().ok().map(Value::Real),
        }
    })
    .parse(input)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Result<Value, String> {
        let mut pi = |name: &[String]| (name == ["c", "PI"]).then_some(Value::Real(3.5));
        Expression::parse(text)?
            .evaluate(&mut pi)
            .map_err(|e| e.unwrap_or("unknown name").to_owned())
    }

    #[test]
    fn the_usual_precedence_holds_and_integers_stay_exact() {
        assert_eq!(value(" 1 + 2*3 - 8/2/2 "), Ok(Value::Integer(5)));
        assert_eq!(value("-(2+3)*-4"), Ok(Value::Integer(20)));
        assert_eq!(
            value("18446744073709551615"),
            Ok(Value::Integer(u64::MAX.into()))
        );
        assert_eq!(value("1/2"), Ok(Value::Real(0.5)));
        assert_eq!(value("1,234,567"), Ok(Value::Integer(1_234_567)));
        assert_eq!(value("-1.5E+2"), Ok(Value::Real(-150.0)));
        assert_eq!(value("5.00").map(Value::integer), Ok(Some(5)));
    }

    #[test]
    fn constants_are_looked_up_by_their_dotted_name() {
        assert_eq!(value("-10*c.PI"), Ok(Value::Real(-35.0)));
        assert_eq!(value("c.E"), Err("unknown name".into()));
    }

    #[test]
    fn what_is_no_expression_is_refused_with_the_place() {
        assert_eq!(value("3 +"), Err("it is incomplete".into()));
        assert_eq!(value("3 $ 4"), Err("`$ 4` is not recognised".into()));
        assert_eq!(value("(3"), Err("it is incomplete".into()));
        assert_eq!(
            value("1/0"),
            Err("the result is not a finite number".into())
        );
        assert!(value(&"(".repeat(200)).is_err());
        assert!(value(&"1+".repeat(200)).is_err());
    }
}
