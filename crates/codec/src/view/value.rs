//! The tree of plain values between messages and text formats.

use alloc::borrow::Cow;
use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeMap, Serializer};

use super::{Error, View};

/// A plain value of a text format.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Null. When reading, it stands for an absent member.
    Null,
    /// True or false. No message field uses it.
    Bool(bool),
    /// A non-negative integer.
    Unsigned(u64),
    /// A non-negative integer, with its name in the definition. Serializes as the integer.
    Named(u64, &'static str),
    /// A negative integer when reading; any signed field when writing.
    Signed(i64),
    /// A negative integer, with its name in the definition. Serializes as the integer.
    SignedNamed(i64, &'static str),
    /// A real number.
    Real(f64),
    /// Text.
    Text(Cow<'static, str>),
    /// An array.
    List(Vec<Self>),
    /// Names and values, ordered.
    Object(Vec<(Cow<'static, str>, Self)>),
}

impl Value {
    /// Creates an empty object with capacity for `members` members.
    pub fn object(members: usize) -> Self {
        Self::Object(Vec::with_capacity(members))
    }

    /// Adds a member and returns the object. A [`Null`](Self::Null) value adds nothing.
    #[inline(never)]
    #[must_use]
    pub fn with(mut self, name: &'static str, value: Self) -> Self {
        if let Self::Object(members) = &mut self
            && value != Self::Null
        {
            members.push((Cow::Borrowed(name), value));
        }
        self
    }

    /// Creates an array of the elements' views.
    pub fn list<'a, T: View + 'a>(elements: impl IntoIterator<Item = &'a T>) -> Self {
        Self::List(elements.into_iter().map(View::view).collect())
    }

    /// Creates an object whose only key is the name of the selected alternative.
    pub fn alternative(name: &'static str, value: Self) -> Self {
        Self::Object(Vec::from([(Cow::Borrowed(name), value)]))
    }

    /// The name and value of the selected alternative.
    ///
    /// # Errors
    /// If it is not an object with one key.
    pub fn chosen(&self) -> Result<(&str, &Self), Error> {
        match self {
            Self::Object(members) if members.len() == 1 => Ok((&members[0].0, &members[0].1)),
            _ => Err(self.unexpected("an object whose one key names the alternative")),
        }
    }

    /// Reads the elements of an array and adds the index to errors.
    ///
    /// # Errors
    /// If the value is not an array. Errors of the elements.
    pub fn elements<T: View>(&self) -> Result<Vec<T>, Error> {
        let Self::List(elements) = self else {
            return Err(self.unexpected("an array"));
        };
        let read = |(index, value)| T::from_view(value).map_err(|error| error.element(index));
        elements.iter().enumerate().map(read).collect()
    }

    /// Any number.
    ///
    /// # Errors
    /// If it is not a number.
    pub fn number(&self) -> Result<f64, Error> {
        match self {
            Self::Unsigned(value) | Self::Named(value, _) => Ok(*value as f64),
            Self::Signed(value) | Self::SignedNamed(value, _) => Ok(*value as f64),
            Self::Real(value) => Ok(*value),
            _ => Err(self.unexpected("a number")),
        }
    }

    /// Converts to an integer type.
    ///
    /// # Errors
    /// If it is not an integer, or does not fit.
    pub fn integer<T: TryFrom<u64> + TryFrom<i64>>(&self) -> Result<T, Error> {
        let integer = match *self {
            Self::Unsigned(value) | Self::Named(value, _) => T::try_from(value).ok(),
            Self::Signed(value) | Self::SignedNamed(value, _) => T::try_from(value).ok(),
            _ => return Err(self.unexpected("an integer")),
        };
        let bits = 8 * size_of::<T>();
        integer.ok_or_else(|| self.unexpected(&format!("an integer of {bits} bits")))
    }

    /// Adds the name of an integer, if it has one that stands for no other value.
    pub(super) fn with_name(self, names: &[(u64, &'static str)]) -> Self {
        let raw = match self {
            Self::Unsigned(raw) => Some(raw),
            // The names of negative values are in two's complement.
            Self::Signed(raw) => Some(raw.cast_unsigned()),
            _ => None,
        };
        let named = names.iter().find(|(value, _)| Some(*value) == raw);
        let stands_for = |name| names.iter().find(|(_, it)| *it == name);
        match named {
            Some(&(raw, name)) if stands_for(name).is_some_and(|(it, _)| *it == raw) => {
                match self {
                    Self::Signed(negative @ ..0) => Self::SignedNamed(negative, name),
                    _ => Self::Named(raw, name),
                }
            }
            _ => self,
        }
    }

    /// Replaces a name with the integer it stands for. Other values are returned unchanged.
    ///
    /// # Errors
    /// If the value is a text that is not in `names`.
    pub fn named(&self, names: &[(u64, &str)]) -> Result<Self, Error> {
        let Self::Text(text) = self else {
            return Ok(self.clone());
        };
        match names.iter().find(|(_, name)| name == text) {
            Some((value, _)) => Ok(Self::Unsigned(*value)),
            None => {
                let names: Vec<_> = names
                    .iter()
                    .map(|(_, name)| format!("\"{name}\""))
                    .collect();
                Err(self.unexpected(&format!("an integer or one of {}", names.join(", "))))
            }
        }
    }

    /// The error for a value of an unexpected kind.
    pub(super) fn unexpected(&self, expected: &str) -> Error {
        Error::new(format!("expected {expected}, found {self}"))
    }
}

/// Identifies the value in an error: the value itself if it is short, otherwise its kind.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Null => f.write_str("null"),
            Self::Bool(value) => value.fmt(f),
            Self::Unsigned(value) | Self::Named(value, _) => value.fmt(f),
            Self::Signed(value) | Self::SignedNamed(value, _) => value.fmt(f),
            Self::Real(value) => value.fmt(f),
            Self::Text(text) if text.chars().count() <= 40 => write!(f, "{text:?}"),
            Self::Text(_) => f.write_str("a long text"),
            Self::List(_) => f.write_str("an array"),
            Self::Object(_) => f.write_str("an object"),
        }
    }
}

/// Reads an object member by member.
#[derive(Debug)]
pub struct Object<'a> {
    members: &'a [(Cow<'static, str>, Value)],
}

impl<'a> Object<'a> {
    /// Starts reading.
    ///
    /// # Errors
    /// If the value is not an object, or has members outside `known`.
    pub fn new(value: &'a Value, known: &[&str]) -> Result<Self, Error> {
        let Value::Object(members) = value else {
            return Err(value.unexpected("an object"));
        };
        if let Some((name, _)) = members.iter().find(|(name, _)| !known.contains(&&**name)) {
            return Err(Error::unknown_key(name, known));
        }
        Ok(Self { members })
    }

    /// The value of a member, if present.
    pub fn get(&self, name: &str) -> Option<&'a Value> {
        // The last duplicate wins, as in other JSON readers.
        let member = self.members.iter().rev().find(|(member, _)| member == name);
        member.map(|(_, value)| value)
    }

    /// Reads a member.
    ///
    /// # Errors
    /// If the member is required but absent. Errors of the member itself.
    pub fn member<T: View>(&self, name: &str) -> Result<T, Error> {
        match self.present(name) {
            Some(value) => T::from_view(value).map_err(|error| error.within(name)),
            None => T::absent().ok_or_else(|| Self::missing(name)),
        }
    }

    /// The value of a member that is present and not null.
    #[inline(never)]
    fn present(&self, name: &str) -> Option<&'a Value> {
        self.get(name).filter(|value| **value != Value::Null)
    }

    #[cold]
    #[inline(never)]
    fn missing(name: &str) -> Error {
        Error::new("required, but absent").within(name)
    }
}

impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Null => serializer.serialize_none(),
            Self::Bool(value) => serializer.serialize_bool(*value),
            Self::Unsigned(value) | Self::Named(value, _) => serializer.serialize_u64(*value),
            Self::Signed(value) | Self::SignedNamed(value, _) => serializer.serialize_i64(*value),
            Self::Real(value) => serializer.serialize_f64(*value),
            Self::Text(text) => serializer.serialize_str(text),
            Self::List(elements) => serializer.collect_seq(elements),
            Self::Object(members) => {
                let mut map = serializer.serialize_map(Some(members.len()))?;
                for (name, value) in members {
                    map.serialize_entry(name.as_ref(), value)?;
                }
                map.end()
            }
        }
    }
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AnyValue)
    }
}

/// Accepts any value of a self-describing format.
struct AnyValue;

impl<'de> Visitor<'de> for AnyValue {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a plain value")
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(Value::Bool(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(Value::Unsigned(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(u64::try_from(value).map_or(Value::Signed(value), Value::Unsigned))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
        Ok(Value::Real(value))
    }

    fn visit_str<E>(self, text: &str) -> Result<Value, E> {
        Ok(Value::Text(text.to_owned().into()))
    }

    fn visit_string<E>(self, text: String) -> Result<Value, E> {
        Ok(Value::Text(text.into()))
    }

    fn visit_none<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_some<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        Value::deserialize(deserializer)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut access: A) -> Result<Value, A::Error> {
        let mut elements = Vec::new();
        while let Some(element) = access.next_element()? {
            elements.push(element);
        }
        Ok(Value::List(elements))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut access: A) -> Result<Value, A::Error> {
        let mut members = Vec::new();
        while let Some((name, value)) = access.next_entry::<String, _>()? {
            members.push((name.into(), value));
        }
        Ok(Value::Object(members))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// -2 and 3, in two's complement.
    const NAMES: &[(u64, &str)] = &[((-2_i64).cast_unsigned(), "Reverse"), (3, "Third")];

    #[test]
    fn negative_values_have_their_names_and_the_same_integer() {
        let reverse = Value::Signed(-2).with_name(NAMES);
        assert_eq!(reverse, Value::SignedNamed(-2, "Reverse"));
        assert_eq!(reverse.integer::<i8>(), Ok(-2));
        assert_eq!(Value::Signed(3).with_name(NAMES), Value::Named(3, "Third"));
        assert_eq!(Value::Signed(-3).with_name(NAMES), Value::Signed(-3));
    }
}
