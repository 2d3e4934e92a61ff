//! Views of the field types that generated messages consist of.

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt::Write;

use bytes::Bytes;

use super::{Error, Object, Value, View};
use crate::bits;
use crate::bits::Bits;
use crate::blob::FormattedBlob;
use crate::enumeration::Enumeration;
use crate::large_array::LargeArray;
use crate::scale::{OutOfRange, Scale};
use crate::text::Text;

/// Member name for the bits of a bit field outside all sub-fields.
const RESERVED: &str = "_reserved";

macro_rules! integer {
    ($($integer:ty => $kind:ident),*) => {$(
        impl View for $integer {
            fn view(&self) -> Value {
                Value::$kind((*self).into())
            }

            fn from_view(value: &Value) -> Result<Self, Error> {
                value.integer()
            }
        }
    )*};
}

integer!(
    u8 => Unsigned, u16 => Unsigned, u32 => Unsigned, u64 => Unsigned,
    i8 => Signed, i16 => Signed, i32 => Signed, i64 => Signed
);

impl View for f64 {
    fn view(&self) -> Value {
        match *self {
            value if value.is_nan() => Value::Text("NaN".into()),
            Self::INFINITY => Value::Text("Infinity".into()),
            Self::NEG_INFINITY => Value::Text("-Infinity".into()),
            value => Value::Real(value),
        }
    }

    fn from_view(value: &Value) -> Result<Self, Error> {
        match value {
            Value::Text(text) if text == "NaN" => Ok(Self::NAN),
            Value::Text(text) if text == "Infinity" => Ok(Self::INFINITY),
            Value::Text(text) if text == "-Infinity" => Ok(Self::NEG_INFINITY),
            _ => value.number(),
        }
    }
}

impl View for f32 {
    /// Widens to the `f64` with the same shortest decimal: 0.1, not 0.10000000149011612.
    fn view(&self) -> Value {
        let decimal = self.to_string().parse().unwrap_or(f64::from(*self));
        if decimal as Self == *self {
            decimal.view()
        } else {
            f64::from(*self).view()
        }
    }

    fn from_view(value: &Value) -> Result<Self, Error> {
        let wide = f64::from_view(value)?;
        let narrow = wide as Self;
        if narrow.is_infinite() && wide.is_finite() {
            return Err(value.unexpected("a number in the range of a float"));
        }
        Ok(narrow)
    }
}

impl<T: View> View for Option<T> {
    fn view(&self) -> Value {
        self.as_ref().map_or(Value::Null, View::view)
    }

    fn from_view(value: &Value) -> Result<Self, Error> {
        T::from_view(value).map(Some)
    }

    fn absent() -> Option<Self> {
        Some(None)
    }
}

impl<T: View> View for Vec<T> {
    fn view(&self) -> Value {
        Value::list(self)
    }

    fn from_view(value: &Value) -> Result<Self, Error> {
        value.elements()
    }
}

impl<T: View, const N: usize> View for [T; N] {
    fn view(&self) -> Value {
        Value::list(self)
    }

    fn from_view(value: &Value) -> Result<Self, Error> {
        let elements: Vec<T> = value.elements()?;
        let found = elements.len();
        let wrong = |_| Error::new(format!("expected {N} elements, found {found}"));
        Self::try_from(elements).map_err(wrong)
    }
}

impl<T: View, const N: usize> View for LargeArray<T, N> {
    fn view(&self) -> Value {
        Value::list(self)
    }

    fn from_view(value: &Value) -> Result<Self, Error> {
        let elements: Vec<T> = value.elements()?;
        let wrong =
            |found: Vec<T>| Error::new(format!("expected {N} elements, found {}", found.len()));
        Self::try_from(elements).map_err(wrong)
    }
}

impl View for Text {
    fn view(&self) -> Value {
        match self.as_str() {
            Some(text) => Value::Text(text.to_owned().into()),
            None => Value::object(1).with("hex", hex(self.as_bytes())),
        }
    }

    fn from_view(value: &Value) -> Result<Self, Error> {
        match value {
            Value::Text(text) => Ok(Self::from(&**text)),
            Value::Object(_) => {
                let object = Object::new(value, &["hex"])?;
                object.member::<Bytes>("hex").map(Self::from)
            }
            _ => Err(value.unexpected("text or {\"hex\": …}")),
        }
    }
}

impl View for Bytes {
    fn view(&self) -> Value {
        hex(self)
    }

    fn from_view(value: &Value) -> Result<Self, Error> {
        let octets = match value {
            Value::Text(text) => from_hex(text),
            _ => None,
        };
        let octets = octets.map(Self::from);
        octets.ok_or_else(|| value.unexpected("text of hexadecimal digits, two for each octet"))
    }
}

fn hex(octets: &[u8]) -> Value {
    let mut text = String::with_capacity(2 * octets.len());
    for octet in octets {
        // Writing to a string never fails.
        let _ = write!(text, "{octet:02x}");
    }
    Value::Text(text.into())
}

fn from_hex(text: &str) -> Option<Vec<u8>> {
    let digit = |digit: u8| char::from(digit).to_digit(16).map(|digit| digit as u8);
    let octet = |pair: &[u8]| match *pair {
        [high, low] => Some(digit(high)? << 4 | digit(low)?),
        _ => None,
    };
    text.as_bytes().chunks(2).map(octet).collect()
}

impl<F: View> View for FormattedBlob<F> {
    fn view(&self) -> Value {
        Value::object(2)
            .with("format", self.format.view())
            .with("data", self.data.view())
    }

    fn from_view(value: &Value) -> Result<Self, Error> {
        let object = Object::new(value, &["format", "data"])?;
        Ok(Self {
            format: object.member("format")?,
            data: object.member("data")?,
        })
    }
}

/// The view of a scaled integer.
#[doc(hidden)]
#[inline(never)]
pub fn scaled(scale: &Scale, raw: u64) -> Value {
    Value::Real(scale.shortest(raw))
}

/// Reads a scaled integer from its view.
///
/// # Errors
/// If the view is not a number in the range.
#[doc(hidden)]
#[inline(never)]
pub fn raw_scaled(
    value: &Value,
    scale: &Scale,
    out_of_range: fn(f64) -> OutOfRange,
) -> Result<u64, Error> {
    let number = value.number()?;
    Ok(scale.raw(number).ok_or_else(|| out_of_range(number))?)
}

/// The view of a bit field.
#[doc(hidden)]
pub fn bits<B: Bits>(field: B) -> Value {
    let raw = field.raw();
    let sub_field = |&(name, from, to): &(&'static str, u32, u32)| {
        let value = Value::Unsigned(bits::get(raw, from, to));
        (name.into(), value.with_name(B::names(name)))
    };
    let mut members: Vec<_> = B::FIELDS.iter().map(sub_field).collect();
    let reserved = raw & bits::reserved::<B>();
    if reserved != 0 {
        members.push((RESERVED.into(), Value::Unsigned(reserved)));
    }
    Value::Object(members)
}

/// The view of an integer with named values.
#[doc(hidden)]
pub fn enumerated<E: Enumeration>(integer: Value) -> Value {
    integer.with_name(E::VALUES)
}

/// Reads the integer of a bit field from its view. Omitted sub-fields are 0.
///
/// # Errors
/// If a number does not fit its bits.
#[doc(hidden)]
pub fn raw_bits<B: Bits>(value: &Value) -> Result<u64, Error> {
    let names: Vec<_> = B::FIELDS
        .iter()
        .map(|&(name, ..)| name)
        .chain([RESERVED])
        .collect();
    let object = Object::new(value, &names)?;
    let mut raw = 0;
    if let Some(value) = object.get(RESERVED) {
        let free = bits::reserved::<B>() & (u64::MAX >> (64 - 8 * size_of::<B>()));
        raw = value
            .integer::<u64>()
            .map_err(|error| error.within(RESERVED))?;
        if raw & !free != 0 {
            let expected = format!("an integer with no bits but {free:#x}");
            return Err(value.unexpected(&expected).within(RESERVED));
        }
    }
    for &(name, from, to) in B::FIELDS {
        if let Some(value) = object.get(name) {
            raw |= sub_field::<B>(name, value, from, to).map_err(|error| error.within(name))?;
        }
    }
    Ok(raw)
}

/// The bits of a sub-field, shifted into position.
fn sub_field<B: Bits>(name: &str, value: &Value, from: u32, to: u32) -> Result<u64, Error> {
    let number = value.named(B::names(name))?.integer::<u64>()?;
    let greatest = u64::MAX >> (63 - (to - from));
    if number > greatest {
        return Err(value.unexpected(&format!("an integer from 0 to {greatest}")));
    }
    Ok(number << from)
}

/// The view of a `variable_field`.
#[doc(hidden)]
pub fn choice_of<T: View>(index: u8, units: &'static str, value: &T) -> Value {
    Value::object(3)
        .with("index", index.view())
        .with("units", Value::Text(units.into()))
        .with("value", value.view())
}

/// Reads a `variable_field`, whose index selects the type.
///
/// # Errors
/// If a key is missing or unknown. Errors from `read`, which receives the index and the value.
#[doc(hidden)]
pub fn choice<T>(
    value: &Value,
    read: impl FnOnce(u8, &Value) -> Option<Result<T, Error>>,
) -> Result<T, Error> {
    let object = Object::new(value, &["index", "units", "value"])?;
    let index = object.member("index")?;
    let missing = || Error::new("required, but absent").within("value");
    let chosen = object.get("value").ok_or_else(missing)?;
    match read(index, chosen) {
        Some(value) => value.map_err(|error| error.within("value")),
        None => Err(Error::new(format!("index {index} chooses no type")).within("index")),
    }
}
