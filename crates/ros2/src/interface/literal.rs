//! Values written in `.msg` text: of constants, and of fields in a new message.

use super::fit;
use super::{Kind, Primitive, Size};
use crate::Value;

/// Reads a value of a field, which may be a list such as `[1, 2, 3]`.
pub(super) fn of_field<N>(text: &str, kind: &Kind<N>, size: Size) -> Result<Value, String> {
    let most = match size {
        Size::One => return of_kind(text, kind),
        Size::Fixed(most) | Size::AtMost(most) => Some(most),
        Size::Any => None,
    };
    let list = text
        .strip_prefix('[')
        .and_then(|text| text.strip_suffix(']'));
    let list = list.ok_or("the value of an array is a list: write for example [1, 2, 3]")?;
    let items = items(list)?
        .into_iter()
        .map(|item| of_kind(item, kind))
        .collect::<Result<Vec<_>, _>>()?;
    let count = items.len();
    if most.is_some_and(|most| count > most) || matches!(size, Size::Fixed(exact) if count != exact)
    {
        let most = most.unwrap_or_default();
        return Err(format!(
            "the list has {count} values for an array of {most}"
        ));
    }
    Ok(Value::Sequence(items))
}

/// Reads one value.
pub(super) fn of_kind<N>(text: &str, kind: &Kind<N>) -> Result<Value, String> {
    let value = match kind {
        Kind::Primitive(Primitive::Bool) => truth(text),
        Kind::Primitive(Primitive::Float32 | Primitive::Float64) => {
            text.parse().ok().map(Value::Float)
        }
        Kind::Primitive(_) => integer(text),
        Kind::String { .. } => Some(Value::String(unquoted(text)?)),
        Kind::Message(_) => return Err("a nested message has no value here: remove it".to_owned()),
    };
    let value =
        value.ok_or_else(|| format!("`{}` is not a value of this type", super::shown(text)))?;
    fit(value, kind)
}

fn truth(text: &str) -> Option<Value> {
    match text {
        "true" | "True" | "1" => Some(Value::Bool(true)),
        "false" | "False" | "0" => Some(Value::Bool(false)),
        _ => None,
    }
}

fn integer(text: &str) -> Option<Value> {
    let (sign, digits) = match text.strip_prefix('-') {
        Some(digits) => (-1, digits),
        None => (1, text.strip_prefix('+').unwrap_or(text)),
    };
    let (radix, digits) = match digits.get(..2) {
        Some("0x" | "0X") => (16, &digits[2..]),
        Some("0o" | "0O") => (8, &digits[2..]),
        Some("0b" | "0B") => (2, &digits[2..]),
        _ => (10, digits),
    };
    let is_sign = |c: char| matches!(c, '+' | '-');
    if digits.starts_with(is_sign) {
        return None;
    }
    let number = sign * i128::from_str_radix(digits, radix).ok()?;
    u64::try_from(number)
        .map(Value::Unsigned)
        .or_else(|_| i64::try_from(number).map(Value::Signed))
        .ok()
}

/// The text without its quotes, if it has any.
fn unquoted(text: &str) -> Result<String, String> {
    let Some(quote) = text.chars().next().filter(|c| matches!(c, '"' | '\'')) else {
        return Ok(text.to_owned());
    };
    let mut unquoted = String::new();
    let mut rest = text[1..].chars();
    while let Some(next) = rest.next() {
        match next {
            '\\' => unquoted.extend(rest.next()),
            _ if next == quote && rest.as_str().is_empty() => return Ok(unquoted),
            _ if next == quote => break,
            _ => unquoted.push(next),
        }
    }
    Err(format!(
        "the text does not end with the {quote} that it begins with"
    ))
}

/// The items of a list, divided by the commas outside quotes.
fn items(list: &str) -> Result<Vec<&str>, String> {
    let mut items = Vec::new();
    let (mut quote, mut is_escaped, mut start) = (None, false, 0);
    for (at, c) in list.char_indices() {
        match (quote, c) {
            _ if is_escaped => is_escaped = false,
            (Some(_), '\\') => is_escaped = true,
            (Some(open), _) if open == c => quote = None,
            (None, '"' | '\'') => quote = Some(c),
            (None, ',') => {
                items.push(list[start..at].trim());
                start = at + 1;
            }
            _ => {}
        }
    }
    let last = list[start..].trim();
    if !last.is_empty() || !items.is_empty() {
        items.push(last);
    }
    match items.iter().any(|item| item.is_empty()) {
        true => Err("a value is missing between two commas".to_owned()),
        false => Ok(items),
    }
}
