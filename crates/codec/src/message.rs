//! Common interface of all messages: a trait for types known at compile time, and a trait object
//! for types known only by message code.

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::any::Any;
use core::fmt::{self, Debug};

use bytes::Bytes;

use super::error::{DecodeError, EncodeError};
use super::reader::Reader;
use super::writer::Writer;

/// Identity of a service: URN and version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ServiceId {
    /// For example `urn:jaus:jss:core:Discovery`.
    pub urn: &'static str,
    /// Major version, raised by incompatible changes.
    pub major: u8,
    /// Minor version, raised by additions.
    pub minor: u8,
}

impl fmt::Display for ServiceId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}.{}", self.urn, self.major, self.minor)
    }
}

/// A message type. Generated from its definition, never written by hand.
///
/// The encoded form begins with the two octets of the message code. It contains no transport
/// headers.
///
/// ```
/// use jaus_codec::{Bytes, DecodeError, Message};
///
/// /// Decodes a message of any type, and says which it is.
/// fn name<M: Message>(octets: &Bytes) -> Result<&'static str, DecodeError> {
///     let message = M::decode(octets)?;
///     assert_eq!(message.encode().as_ref(), Ok(octets));
///     Ok(M::NAME)
/// }
/// ```
pub trait Message: Sized + View + Clone + Debug + PartialEq + Send + Sync + 'static {
    /// The message code, for example `0x4B00`.
    const CODE: u16;
    /// The name in the definition, for example `ReportIdentification`.
    const NAME: &'static str;
    /// Whether the definition marks the message as a command.
    const IS_COMMAND: bool = false;
    /// Whether the message is a command of a service that inherits Access Control, which only the
    /// client in control may send. Exceptions are Set Emergency and Clear Emergency: Management
    /// accepts them from any client.
    const NEEDS_CONTROL: bool = false;
    /// Whether the message is a command of a service that inherits Management: the component obeys
    /// it only while it is ready, and stops what it has started.
    const NEEDS_READINESS: bool = false;
    /// The services and versions that declare the message with another layout.
    const OTHER_LAYOUTS: &'static [ServiceId] = &[];

    /// Size in octets, including the message code.
    fn encoded_len(&self) -> usize;

    /// Appends the message, beginning with its code.
    ///
    /// # Errors
    /// As [`encode`](Self::encode), without the message's name.
    fn write(&self, output: &mut Writer<'_>) -> Result<(), EncodeError>;

    /// Reads a message, beginning with its code.
    ///
    /// # Errors
    /// As [`decode`](Self::decode), without the message's name.
    fn read(input: &mut Reader<'_>) -> Result<Self, DecodeError>;

    /// Encodes the message.
    ///
    /// # Errors
    /// If a count or a length is outside the limits of the definition.
    fn encode(&self) -> Result<Bytes, EncodeError> {
        let mut buffer = Vec::with_capacity(self.encoded_len());
        self.encode_into(&mut buffer)?;
        Ok(buffer.into())
    }

    /// Appends the message to a buffer. On error the buffer is unchanged.
    ///
    /// # Errors
    /// As [`encode`](Self::encode).
    #[inline]
    fn encode_into(&self, buffer: &mut Vec<u8>) -> Result<(), EncodeError> {
        let start = buffer.len();
        match self.write(&mut Writer::new(buffer)) {
            Ok(()) => Ok(()),
            Err(error) => {
                buffer.truncate(start);
                Err(error.of(Self::NAME, Self::CODE))
            }
        }
    }

    /// Decodes a message, which must occupy all octets.
    ///
    /// # Errors
    /// If the octets are not exactly one message of this type.
    #[inline]
    fn decode(octets: &Bytes) -> Result<Self, DecodeError> {
        let mut input = Reader::new(octets);
        // A single variable holds the result throughout, so it is built in place.
        let mut result = Self::read(&mut input);
        if result.is_err() || input.remaining() != 0 {
            let error = result.err().unwrap_or_else(|| input.trailing());
            result = Err(error.of(Self::NAME, Self::CODE));
        }
        result
    }
}

#[cfg(feature = "serde")]
use super::view::View;

/// Replaces `view::View` when the feature `serde` is disabled.
#[cfg(not(feature = "serde"))]
#[doc(hidden)]
pub trait View: Sized {}

#[cfg(not(feature = "serde"))]
impl<T> View for T {}

#[cfg(feature = "serde")]
impl serde::Serialize for dyn AnyMessage {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serde::Serialize::serialize(&self.view(), serializer)
    }
}

/// A message whose type is known only at run time.
pub trait AnyMessage: Any + Debug + Send + Sync {
    /// [`Message::CODE`].
    fn code(&self) -> u16;

    /// [`Message::NAME`].
    fn name(&self) -> &'static str;

    /// [`Message::IS_COMMAND`].
    fn is_command(&self) -> bool;

    /// [`Message::encode`].
    ///
    /// # Errors
    /// As there.
    fn encode(&self) -> Result<Bytes, EncodeError>;

    /// The human-readable view.
    #[cfg(feature = "serde")]
    fn view(&self) -> super::view::Value;

    /// Whether both are the same message with the same content.
    fn equals(&self, other: &dyn AnyMessage) -> bool;

    /// A copy.
    fn clone_box(&self) -> Box<dyn AnyMessage>;
}

impl<M: Message> AnyMessage for M {
    fn code(&self) -> u16 {
        M::CODE
    }

    fn name(&self) -> &'static str {
        M::NAME
    }

    fn is_command(&self) -> bool {
        M::IS_COMMAND
    }

    fn encode(&self) -> Result<Bytes, EncodeError> {
        Message::encode(self)
    }

    #[cfg(feature = "serde")]
    fn view(&self) -> super::view::Value {
        View::view(self)
    }

    fn equals(&self, other: &dyn AnyMessage) -> bool {
        other.downcast_ref::<M>() == Some(self)
    }

    fn clone_box(&self) -> Box<dyn AnyMessage> {
        Box::new(self.clone())
    }
}

impl dyn AnyMessage {
    /// Whether the message is an `M`.
    pub fn is<M: Message>(&self) -> bool {
        self.downcast_ref::<M>().is_some()
    }

    /// The message as an `M`, if it is one.
    pub fn downcast_ref<M: Message>(&self) -> Option<&M> {
        (self as &dyn Any).downcast_ref()
    }

    /// Converts the message to an `M`.
    ///
    /// # Errors
    /// The unchanged message, if it is not an `M`.
    pub fn downcast<M: Message>(self: Box<Self>) -> Result<M, Box<Self>> {
        if !self.is::<M>() {
            return Err(self);
        }
        let any: Box<dyn Any> = self;
        match any.downcast::<M>() {
            Ok(message) => Ok(*message),
            Err(_) => unreachable!("its type has just been checked"),
        }
    }
}

impl Clone for Box<dyn AnyMessage> {
    fn clone(&self) -> Self {
        (**self).clone_box()
    }
}

impl PartialEq for dyn AnyMessage {
    fn eq(&self, other: &Self) -> bool {
        self.equals(other)
    }
}
