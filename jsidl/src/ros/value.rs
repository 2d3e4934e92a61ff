//! Values of ROS 2 messages, as trees.

/// A value of a ROS 2 message, or of a part of it.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// `bool`
    Bool(bool),
    /// An integer that is not negative: `uint8` to `uint64`, and `byte`.
    Unsigned(u64),
    /// An integer: `int8` to `int64`.
    Signed(i64),
    /// A number: `float32`, which fits `f64` exactly, or `float64`.
    Float(f64),
    /// `string`, without NUL.
    String(String),
    /// The elements of an array or a sequence, bounded or not. Those of `uint8[]` are
    /// [unsigned](Self::Unsigned).
    Sequence(Vec<Self>),
    /// A message: the values of its fields, in the order of its `.msg` file; none if it is empty.
    Message(Vec<Self>),
}

impl Value {
    /// The truth value.
    #[must_use]
    pub const fn as_bool(&self) -> Option<bool> {
        match self {
            Self::Bool(value) => Some(*value),
            _ => None,
        }
    }

    /// The integer, if it is not negative.
    #[must_use]
    pub fn as_unsigned(&self) -> Option<u64> {
        match self {
            Self::Unsigned(value) => Some(*value),
            Self::Signed(value) => u64::try_from(*value).ok(),
            _ => None,
        }
    }

    /// The integer, if it fits.
    #[must_use]
    pub fn as_signed(&self) -> Option<i64> {
        match self {
            Self::Unsigned(value) => i64::try_from(*value).ok(),
            Self::Signed(value) => Some(*value),
            _ => None,
        }
    }

    /// The number; an integer becomes the nearest one.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "the nearest number is meant")]
    pub const fn as_float(&self) -> Option<f64> {
        match self {
            Self::Unsigned(value) => Some(*value as f64),
            Self::Signed(value) => Some(*value as f64),
            Self::Float(value) => Some(*value),
            _ => None,
        }
    }

    /// The text.
    #[must_use]
    pub fn as_str(&self) -> Option<&str> {
        match self {
            Self::String(value) => Some(value),
            _ => None,
        }
    }

    /// The elements of an array or a sequence.
    #[must_use]
    pub fn as_sequence(&self) -> Option<&[Self]> {
        match self {
            Self::Sequence(elements) => Some(elements),
            _ => None,
        }
    }

    /// The kind of value, for errors: `an integer`, for example.
    #[must_use]
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Bool(_) => "a truth value",
            Self::Unsigned(_) | Self::Signed(_) => "an integer",
            Self::Float(_) => "a floating-point number",
            Self::String(_) => "a text",
            Self::Sequence(_) => "a sequence",
            Self::Message(_) => "a message",
        }
    }
}

macro_rules! from {
    ($($type:ty => $variant:ident),+ $(,)?) => {
        $(impl From<$type> for Value {
            fn from(value: $type) -> Self {
                Self::$variant(value.into())
            }
        })+
    };
}

from! {
    bool => Bool, u8 => Unsigned, u16 => Unsigned, u32 => Unsigned, u64 => Unsigned,
    i8 => Signed, i16 => Signed, i32 => Signed, i64 => Signed,
    f32 => Float, f64 => Float, &str => String, String => String,
}

impl<T: Into<Self>> From<Vec<T>> for Value {
    fn from(elements: Vec<T>) -> Self {
        Self::Sequence(elements.into_iter().map(Into::into).collect())
    }
}

impl<T: Into<Self>, const N: usize> From<[T; N]> for Value {
    fn from(elements: [T; N]) -> Self {
        Self::Sequence(elements.into_iter().map(Into::into).collect())
    }
}
