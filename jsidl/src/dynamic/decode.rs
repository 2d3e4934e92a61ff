//! Decodes octets to a [`Value`] by walking the definition.
//!
//! The walk is no deeper than the definition, and every element of a list is read before memory is
//! allocated for the next: a count beyond the available octets ends in an error, not in an
//! allocation.

use super::error::{DecodeError, DecodeProblem, Fault, Step};
use super::trace::{Part, Place, Trace};
use super::{EmptyElements, Limits, Raw, Value};
use crate::model::{
    Array, Count, Group, Item, List, Message, Number, Scalar, Shape, Signed, Unsigned, Variant,
};

/// Decodes a whole message: its code, header, body and footer, and nothing after it.
///
/// Accepted octets encode back to the same octets. Numbers outside a range, unknown enumerated
/// values, unknown formats and reserved bits are accepted and preserved: the layout does not depend
/// on them.
///
/// # Errors
/// If the octets are not one message of this definition: see [`DecodeProblem`].
pub fn decode(message: &Message, octets: &[u8]) -> Result<Value, DecodeError> {
    decode_with(message, octets, Limits::Enforced)
}

/// [`decode`] with a choice how to treat counts outside the definition's limits.
///
/// # Errors
/// As [`decode`], but no [`DecodeProblem::Count`] if limits are ignored.
pub fn decode_with(message: &Message, octets: &[u8], limits: Limits) -> Result<Value, DecodeError> {
    decode_traced(message, octets, limits, ())
}

/// [`decode_with`], with a trace of octets and fields.
pub(crate) fn decode_traced<'m>(
    message: &'m Message,
    octets: &[u8],
    limits: Limits,
    trace: impl Trace<'m>,
) -> Result<Value, DecodeError> {
    let mut reader = Reader {
        octets,
        position: 0,
        limits,
        empty: EmptyElements::new(),
        trace,
    };
    reader
        .message(message)
        .map_err(|fault| fault.decoding(&message.name))
}

type Read<T> = Result<T, Fault<DecodeProblem>>;

struct Reader<'a, T> {
    octets: &'a [u8],
    position: usize,
    limits: Limits,
    empty: EmptyElements,
    trace: T,
}

impl<'a, 'm, T: Trace<'m>> Reader<'a, T> {
    fn message(&mut self, message: &'m Message) -> Read<Value> {
        let found = u16::from_le_bytes(self.array()?);
        if found != message.code {
            return Err(Fault::at(
                0,
                DecodeProblem::Code {
                    expected: message.code,
                    found,
                },
            ));
        }
        self.record(0, Part::Code(message));
        let value = if message.header.is_none() && message.footer.is_none() {
            self.section(message.body.as_ref())?
                .unwrap_or(Value::Group(Vec::new()))
        } else {
            let header = self.section(message.header.as_ref())?;
            let body = self.section(message.body.as_ref())?;
            let footer = self.section(message.footer.as_ref())?;
            Value::Group(vec![header, body, footer])
        };
        match self.left() {
            0 => Ok(value),
            left => Err(Fault::at(self.position, DecodeProblem::Trailing { left })),
        }
    }

    fn section(&mut self, section: Option<&'m Item>) -> Read<Option<Value>> {
        section.map(|item| self.shape(&item.shape)).transpose()
    }

    fn shape(&mut self, shape: &'m Shape) -> Read<Value> {
        Ok(match shape {
            Shape::Group(group) => self.group(group)?,
            Shape::List(list) => self.list(list)?,
            Shape::Variant(variant) => self.variant(variant)?,
            Shape::Scalar(scalar) => Value::Number(self.scalar(scalar)?),
            Shape::Bits(bits) => {
                let start = self.position;
                let raw = self.unsigned(bits.base)?;
                self.record(start, Part::Bits(bits, raw));
                Value::Bits(raw)
            }
            Shape::FixedString { length } => Value::Text(self.padded(*length)?),
            Shape::VariableString { count } => Value::Text(self.counted(count, Part::Text)?),
            Shape::Blob { count, format } => {
                Value::Blob(self.counted(count, Part::Octets(format))?)
            }
            Shape::FormattedBlob { formats, count } => {
                let start = self.position;
                let [format] = self.array()?;
                self.record(start, Part::Format(formats, format));
                let name = formats.iter().find(|known| known.index == format);
                let name = name.map_or("", |known| &known.name);
                Value::Formatted {
                    format,
                    octets: self.counted(count, Part::Octets(name))?,
                }
            }
            Shape::Measure { choices } => {
                let offset = self.position;
                let [index] = self.array()?;
                let choice = choices.iter().find(|choice| choice.index == index);
                let choice = choice.ok_or(Fault::at(offset, DecodeProblem::Index { index }))?;
                self.record(offset, Part::Index(choice));
                Value::Measure {
                    index,
                    number: self.scalar(&choice.scalar)?,
                }
            }
            Shape::Array(array) => self.elements_of_array(array)?,
        })
    }

    fn group(&mut self, group: &'m Group) -> Read<Value> {
        let mut presence = self.presence(group)?;
        let mut slots = Vec::with_capacity(group.members.len());
        for member in &group.members {
            let present = !member.optional || {
                let bit = presence & 1 == 1;
                presence >>= 1;
                bit
            };
            slots.push(if present {
                Some(self.member(member)?)
            } else {
                self.trace.absent(member);
                None
            });
        }
        Ok(Value::Group(slots))
    }

    /// A member of a group, or an alternative of a variant.
    fn member(&mut self, member: &'m Item) -> Read<Value> {
        self.trace.enter(Place::Member(member));
        let value = self.shape(&member.shape);
        self.trace.leave();
        value.map_err(|fault| fault.member(&member.name))
    }

    /// The presence vector; bits beyond the last optional member are refused, because encoding
    /// could not restore them.
    fn presence(&mut self, group: &'m Group) -> Read<u64> {
        let Some(width) = group.presence else {
            return Ok(0);
        };
        let offset = self.position;
        let vector = self.unsigned(width)?;
        let owned = group
            .members
            .iter()
            .filter(|member| member.optional)
            .count();
        let undefined = u32::try_from(owned)
            .ok()
            .and_then(|shift| u64::MAX.checked_shl(shift))
            .map_or(0, |mask| vector & mask);
        if undefined == 0 {
            self.record(offset, Part::Presence(group, width, vector));
            Ok(vector)
        } else {
            Err(Fault::at(
                offset,
                DecodeProblem::Presence { vector, undefined },
            ))
        }
    }

    fn list(&mut self, list: &'m List) -> Read<Value> {
        let count = self.count(&list.count)?;
        Ok(Value::List(self.elements(count, &list.element)?))
    }

    fn elements_of_array(&mut self, array: &'m Array) -> Read<Value> {
        Ok(Value::Array(
            self.elements(array.elements(), &array.element)?,
        ))
    }

    fn elements(&mut self, count: u64, element: &'m Item) -> Read<Vec<Value>> {
        let mut elements = Vec::new();
        for _ in 0..count {
            let start = self.position;
            let place = Step::Element(elements.len());
            self.trace.enter(Place::Element(elements.len()));
            let value = match self.shape(&element.shape) {
                Ok(value) => value,
                Err(fault) => return Err(fault.under(place)),
            };
            if self.position == start && !self.empty.take() {
                return Err(Fault::at(start, DecodeProblem::EmptyElements).under(place));
            }
            self.trace.leave();
            elements.push(value);
        }
        Ok(elements)
    }

    fn variant(&mut self, variant: &'m Variant) -> Read<Value> {
        let offset = self.position;
        let tag = self.unsigned(variant.tag)?;
        let alternatives = variant.alternatives.len();
        let chosen = usize::try_from(tag)
            .ok()
            .and_then(|tag| variant.alternatives.get(tag));
        match chosen {
            Some(item) => {
                self.record(offset, Part::Tag(variant, tag));
                Ok(Value::Variant {
                    tag,
                    value: Some(Box::new(self.member(item)?)),
                })
            }
            None if alternatives == 0 && tag == 0 => {
                self.record(offset, Part::Tag(variant, tag));
                Ok(Value::Variant { tag, value: None })
            }
            None => Err(Fault::at(offset, DecodeProblem::Tag { tag, alternatives })),
        }
    }

    /// A fixed length string without its padding.
    fn padded(&mut self, length: u32) -> Read<Vec<u8>> {
        let start = self.position;
        let octets = self.take(u64::from(length))?;
        self.record(start, Part::Text);
        let end = octets
            .iter()
            .rposition(|&octet| octet != 0)
            .map_or(0, |last| last + 1);
        Ok(octets[..end].to_vec())
    }

    /// A count of octets and the octets.
    fn counted(&mut self, count: &'m Count, part: Part<'m>) -> Read<Vec<u8>> {
        let length = self.count(count)?;
        let start = self.position;
        let octets = self.take(length)?.to_vec();
        self.record(start, part);
        Ok(octets)
    }

    fn count(&mut self, count: &'m Count) -> Read<u64> {
        let offset = self.position;
        let number = self.unsigned(count.unsigned)?;
        if self.limits.admit(count, number) {
            self.record(offset, Part::Count(count, number));
            Ok(number)
        } else {
            let Count { min, max, .. } = *count;
            Err(Fault::at(
                offset,
                DecodeProblem::Count {
                    count: number,
                    min,
                    max,
                },
            ))
        }
    }

    fn scalar(&mut self, scalar: &'m Scalar) -> Read<Raw> {
        let start = self.position;
        let raw = self.number(scalar.number)?;
        self.record(start, Part::Number(scalar, raw));
        Ok(raw)
    }

    fn number(&mut self, number: Number) -> Read<Raw> {
        Ok(match number {
            Number::Unsigned(unsigned) => Raw::Unsigned(self.unsigned(unsigned)?),
            Number::Signed(signed) => Raw::Signed(self.signed(signed)?),
            Number::F32 => Raw::F32(f32::from_le_bytes(self.array()?)),
            Number::F64 => Raw::F64(f64::from_le_bytes(self.array()?)),
        })
    }

    fn unsigned(&mut self, unsigned: Unsigned) -> Read<u64> {
        Ok(match unsigned {
            Unsigned::U8 => u8::from_le_bytes(self.array()?).into(),
            Unsigned::U16 => u16::from_le_bytes(self.array()?).into(),
            Unsigned::U32 => u32::from_le_bytes(self.array()?).into(),
            Unsigned::U64 => u64::from_le_bytes(self.array()?),
        })
    }

    fn signed(&mut self, signed: Signed) -> Read<i64> {
        Ok(match signed {
            Signed::I8 => i8::from_le_bytes(self.array()?).into(),
            Signed::I16 => i16::from_le_bytes(self.array()?).into(),
            Signed::I32 => i32::from_le_bytes(self.array()?).into(),
            Signed::I64 => i64::from_le_bytes(self.array()?),
        })
    }

    fn array<const N: usize>(&mut self) -> Read<[u8; N]> {
        let mut octets = [0; N];
        octets.copy_from_slice(self.take(N as u64)?);
        Ok(octets)
    }

    fn take(&mut self, needed: u64) -> Read<&'a [u8]> {
        let rest = self.octets.get(self.position..).unwrap_or_default();
        let taken = usize::try_from(needed)
            .ok()
            .and_then(|length| rest.get(..length));
        let Some(taken) = taken else {
            let problem = DecodeProblem::Short {
                needed,
                left: self.left(),
            };
            return Err(Fault::at(self.position, problem));
        };
        self.position += taken.len();
        Ok(taken)
    }

    /// Traces the octets since `start`.
    fn record(&mut self, start: usize, part: Part<'m>) {
        self.trace.read(start..self.position, part);
    }

    const fn left(&self) -> usize {
        self.octets.len() - self.position
    }
}
