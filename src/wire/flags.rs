//! The bit fields of the AS5669A header: message type and header compression in one octet;
//! priority, broadcast, acknowledgement and data control in another. The older headers are
//! translated to these.

use std::fmt;

use deku::ctx::Endian;
use deku::prelude::*;

/// The priority of a message, which orders the queues for sending and delivery.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Priority {
    /// 0: can be delayed.
    Low,
    /// 1: nearly all messages.
    #[default]
    Standard,
    /// 2: before ordinary traffic.
    High,
    /// 3: before everything else.
    SafetyCritical,
}

impl Priority {
    /// All priorities, from low to safety critical.
    pub const ALL: [Self; 4] = [Self::Low, Self::Standard, Self::High, Self::SafetyCritical];

    /// The number in an AS5669A header, 0..=3.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self as u8
    }

    /// `low`, `standard`, `high` or `safety_critical`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Standard => "standard",
            Self::High => "high",
            Self::SafetyCritical => "safety_critical",
        }
    }
}

/// The broadcast scope of a message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Broadcast {
    /// 0: unicast or multicast to the destination only.
    #[default]
    None,
    /// 1: to matching components of the sender's subsystem.
    Local,
    /// 2: to matching components of every subsystem.
    Global,
}

impl Broadcast {
    /// `none`, `local` or `global`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Local => "local",
            Self::Global => "global",
        }
    }
}

/// Whether a message requests an acknowledgement, or is one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Acknowledgement {
    /// 0: neither.
    #[default]
    None,
    /// 1: requests an acknowledgement.
    Request,
    /// 2: the message with this sequence number was refused.
    Negative,
    /// 3: the message with this sequence number has arrived.
    Positive,
}

impl Acknowledgement {
    /// Whether this is an answer to an earlier message.
    #[must_use]
    pub const fn is_answer(self) -> bool {
        matches!(self, Self::Negative | Self::Positive)
    }

    /// `none`, `request`, `nak` or `ack`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Request => "request",
            Self::Negative => "nak",
            Self::Positive => "ack",
        }
    }
}

/// The part of a large message that a frame holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DataControl {
    /// 0: the whole message.
    #[default]
    Single,
    /// 1: the first fragment.
    First,
    /// 2: a fragment in between.
    Middle,
    /// 3: the last fragment.
    Last,
}

impl DataControl {
    /// `single`, `first`, `middle` or `last`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::First => "first",
            Self::Middle => "middle",
            Self::Last => "last",
        }
    }
}

macro_rules! display_by_name {
    ($($type:ty),*) => {$(
        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.pad(self.name())
            }
        }
    )*};
}
display_by_name!(Priority, Broadcast, Acknowledgement, DataControl);

/// The flags octet of an AS5669A header: priority in bits 0-1, broadcast in 2-3, acknowledgement in
/// 4-5, data control in 6-7.
#[derive(Clone, Copy, PartialEq, Eq, Hash, DekuRead, DekuWrite)]
#[deku(
    endian = "endian",
    ctx = "endian: Endian",
    ctx_default = "Endian::Little"
)]
pub struct Flags(pub u8);

impl Flags {
    /// Flags with the given priority, and otherwise "none" and "single".
    #[must_use]
    pub const fn new(priority: Priority) -> Self {
        Self(priority.bits())
    }

    /// The priority.
    #[must_use]
    pub const fn priority(self) -> Priority {
        Priority::ALL[self.field(0) as usize]
    }

    /// The broadcast scope; `None` for the reserved value 3.
    #[must_use]
    pub const fn broadcast(self) -> Option<Broadcast> {
        match self.field(2) {
            0 => Some(Broadcast::None),
            1 => Some(Broadcast::Local),
            2 => Some(Broadcast::Global),
            _ => None,
        }
    }

    /// The acknowledgement field.
    #[must_use]
    pub const fn acknowledgement(self) -> Acknowledgement {
        match self.field(4) {
            0 => Acknowledgement::None,
            1 => Acknowledgement::Request,
            2 => Acknowledgement::Negative,
            _ => Acknowledgement::Positive,
        }
    }

    /// The data control field.
    #[must_use]
    pub const fn data(self) -> DataControl {
        match self.field(6) {
            0 => DataControl::Single,
            1 => DataControl::First,
            2 => DataControl::Middle,
            _ => DataControl::Last,
        }
    }

    /// The same flags with another priority.
    #[must_use]
    pub const fn with_priority(self, priority: Priority) -> Self {
        self.with_field(0, priority.bits())
    }

    /// The same flags with another scope.
    #[must_use]
    pub const fn with_broadcast(self, broadcast: Broadcast) -> Self {
        self.with_field(2, broadcast as u8)
    }

    /// The same flags with another acknowledgement field.
    #[must_use]
    pub const fn with_acknowledgement(self, acknowledgement: Acknowledgement) -> Self {
        self.with_field(4, acknowledgement as u8)
    }

    /// The same flags with another data control.
    #[must_use]
    pub const fn with_data(self, data: DataControl) -> Self {
        self.with_field(6, data as u8)
    }

    const fn field(self, shift: u8) -> u8 {
        (self.0 >> shift) & 0b11
    }

    const fn with_field(self, shift: u8, value: u8) -> Self {
        Self((self.0 & !(0b11 << shift)) | (value << shift))
    }
}

impl Default for Flags {
    /// Standard priority, no broadcast, no acknowledgement, a single message.
    fn default() -> Self {
        Self::new(Priority::Standard)
    }
}

impl fmt::Debug for Flags {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let broadcast = self.broadcast().map_or("reserved", Broadcast::name);
        let (priority, acknowledgement, data) =
            (self.priority(), self.acknowledgement(), self.data());
        write!(
            f,
            "{:02X}h (priority {priority}, broadcast {broadcast}, ack {acknowledgement}, data {data})",
            self.0
        )
    }
}

/// The first octet of an AS5669A message: its type in bits 0-5 and header compression flags in bits
/// 6-7.
///
/// Type 0 is a JAUS message; the others are reserved. (Junior reads the compression flags from bits
/// 0-1; no other implementation does.)
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, DekuRead, DekuWrite)]
pub struct Kind(pub u8);

impl Kind {
    /// The message type, 0..=63.
    #[must_use]
    pub const fn message_type(self) -> u8 {
        self.0 & 0x3F
    }

    /// The header compression flags, 0..=3. Compression is skipped when reading and never offered.
    #[must_use]
    pub const fn compression(self) -> u8 {
        self.0 >> 6
    }

    /// Whether a header compression number and length follow the size field, as they do if any flag
    /// is set.
    #[must_use]
    pub const fn has_compression_fields(self) -> bool {
        self.compression() != 0
    }

    /// Whether the rest of the header is itself compressed (flags 3). It cannot be read without
    /// negotiation, which this implementation never enters. With flags 1 and 2 the peer only offers
    /// compression, and the header is complete.
    #[must_use]
    pub const fn is_compressed(self) -> bool {
        self.compression() == 3
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flags_of_a_recorded_first_message_are_read() {
        // Junior to an unknown id: standard priority, global, acknowledgement wanted.
        let flags = Flags(0x19);
        assert_eq!(flags.priority(), Priority::Standard);
        assert_eq!(flags.broadcast(), Some(Broadcast::Global));
        assert_eq!(flags.acknowledgement(), Acknowledgement::Request);
        assert_eq!(flags.data(), DataControl::Single);
        let built = Flags::default()
            .with_broadcast(Broadcast::Global)
            .with_acknowledgement(Acknowledgement::Request);
        assert_eq!(built, flags);
    }

    #[test]
    fn every_octet_is_taken_apart_and_put_together() {
        for octet in 0..=u8::MAX {
            let flags = Flags(octet);
            let Some(broadcast) = flags.broadcast() else {
                assert_eq!(octet >> 2 & 3, 3, "only value 3 is reserved");
                continue;
            };
            let built = Flags(0xFF)
                .with_priority(flags.priority())
                .with_broadcast(broadcast)
                .with_acknowledgement(flags.acknowledgement())
                .with_data(flags.data());
            assert_eq!(built, flags);
        }
    }

    #[test]
    fn compression_flags_sit_in_the_two_high_bits() {
        assert_eq!(
            (Kind(0x41).message_type(), Kind(0x41).compression()),
            (1, 1)
        );
        assert!(Kind(0x40).has_compression_fields() && !Kind(0x40).is_compressed());
        assert!(Kind(0xC0).is_compressed());
        assert!(
            !Kind(0x03).has_compression_fields(),
            "bits 0-1 belong to the message type"
        );
    }

    #[test]
    fn each_value_of_a_field_has_its_number_and_its_name() {
        let shown = |flags: Flags| {
            let scope = flags.broadcast().map(|scope| scope.to_string());
            (
                flags.priority().to_string(),
                scope.unwrap_or_default(),
                flags.acknowledgement().to_string(),
                flags.data().to_string(),
            )
        };
        for (value, expected) in [
            (0, ("low", "none", "none", "single")),
            (1, ("standard", "local", "request", "first")),
            (2, ("high", "global", "nak", "middle")),
            (3, ("safety_critical", "", "ack", "last")),
        ] {
            let (priority, scope, acknowledgement, data) = shown(Flags(value * 0b0101_0101));
            let names = (&*priority, &*scope, &*acknowledgement, &*data);
            assert_eq!(names, expected, "{value}");
        }
        assert_eq!(
            format!("{:?}", Flags(0x5D)),
            "5Dh (priority standard, broadcast reserved, ack request, data first)"
        );
    }
}
