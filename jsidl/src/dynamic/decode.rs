//! Octets to [`Value`], by walking the definition.
//!
//! The walk goes no deeper than the definition, and every element of a list is read before room is
//! made for the next: a count that the octets cannot pay for ends in an error, not in memory.

use super::error::{DecodeError, DecodeProblem, Fault, Step};
use super::{EmptyElements, Limits, Raw, Value};
use crate::model::{
    Array, Count, Group, Item, List, Message, Number, Shape, Signed, Unsigned, Variant,
};

/// Reads a whole message: its code, header, body and footer, and nothing behind it.
///
/// What is accepted encodes back to the same octets. Numbers outside a range, unknown enumerated
/// values, unknown formats and reserved bits are accepted and kept: layout does not depend on them.
///
/// # Errors
/// If the octets are not one message of this definition: see [`DecodeProblem`].
pub fn decode(message: &Message, octets: &[u8]) -> Result<Value, DecodeError> {
    decode_with(message, octets, Limits::Enforced)
}

/// [`decode`] with a choice of what happens to counts outside the definition's limits.
///
/// # Errors
/// As [`decode`], but no [`DecodeProblem::Count`] if limits are ignored.
pub fn decode_with(message: &Message, octets: &[u8], limits: Limits) -> Result<Value, DecodeError> {
    let mut reader = Reader {
        octets,
        position: 0,
        limits,
        empty: EmptyElements::new(),
    };
    reader
        .message(message)
        .map_err(|fault| fault.decoding(&message.name))
}

type Read<T> = Result<T, Fault<DecodeProblem>>;

struct Reader<'a> {
    octets: &'a [u8],
    position: usize,
    limits: Limits,
    empty: EmptyElements,
}

impl<'a> Reader<'a> {
    fn message(&mut self, message: &Message) -> Read<Value> {
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

    fn section(&mut self, section: Option<&Item>) -> Read<Option<Value>> {
        section.map(|item| self.shape(&item.shape)).transpose()
    }

    fn shape(&mut self, shape: &Shape) -> Read<Value> {
        Ok(match shape {
            Shape::Group(group) => self.group(group)?,
            Shape::List(list) => self.list(list)?,
            Shape::Variant(variant) => self.variant(variant)?,
            Shape::Scalar(scalar) => Value::Number(self.number(scalar.number)?),
            Shape::Bits(bits) => Value::Bits(self.unsigned(bits.base)?),
            Shape::FixedString { length } => Value::Text(self.padded(*length)?),
            Shape::VariableString { count } => Value::Text(self.counted(count)?),
            Shape::Blob { count, .. } => Value::Blob(self.counted(count)?),
            Shape::FormattedBlob { count, .. } => {
                let [format] = self.array()?;
                Value::Formatted {
                    format,
                    octets: self.counted(count)?,
                }
            }
            Shape::Measure { choices } => {
                let offset = self.position;
                let [index] = self.array()?;
                let choice = choices.iter().find(|choice| choice.index == index);
                let choice = choice.ok_or(Fault::at(offset, DecodeProblem::Index { index }))?;
                Value::Measure {
                    index,
                    number: self.number(choice.scalar.number)?,
                }
            }
            Shape::Array(array) => self.elements_of_array(array)?,
        })
    }

    fn group(&mut self, group: &Group) -> Read<Value> {
        let mut presence = self.presence(group)?;
        let mut slots = Vec::with_capacity(group.members.len());
        for member in &group.members {
            let present = !member.optional || {
                let bit = presence & 1 == 1;
                presence >>= 1;
                bit
            };
            let read = |item: &Item| self.shape(&item.shape);
            let value = present.then_some(member).map(read).transpose();
            slots.push(value.map_err(|fault| fault.member(&member.name))?);
        }
        Ok(Value::Group(slots))
    }

    /// The presence vector; bits beyond the last optional member are refused, because encoding
    /// could not bring them back.
    fn presence(&mut self, group: &Group) -> Read<u64> {
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
            Ok(vector)
        } else {
            Err(Fault::at(
                offset,
                DecodeProblem::Presence { vector, undefined },
            ))
        }
    }

    fn list(&mut self, list: &List) -> Read<Value> {
        let count = self.count(&list.count)?;
        Ok(Value::List(self.elements(count, &list.element)?))
    }

    fn elements_of_array(&mut self, array: &Array) -> Read<Value> {
        Ok(Value::Array(
            self.elements(array.elements(), &array.element)?,
        ))
    }

    fn elements(&mut self, count: u64, element: &Item) -> Read<Vec<Value>> {
        let mut elements = Vec::new();
        for _ in 0..count {
            let start = self.position;
            let place = Step::Element(elements.len());
            let value = match self.shape(&element.shape) {
                Ok(value) => value,
                Err(fault) => return Err(fault.under(place)),
            };
            if self.position == start && !self.empty.take() {
                return Err(Fault::at(start, DecodeProblem::EmptyElements).under(place));
            }
            elements.push(value);
        }
        Ok(elements)
    }

    fn variant(&mut self, variant: &Variant) -> Read<Value> {
        let offset = self.position;
        let tag = self.unsigned(variant.tag)?;
        let alternatives = variant.alternatives.len();
        let chosen = usize::try_from(tag)
            .ok()
            .and_then(|tag| variant.alternatives.get(tag));
        match chosen {
            Some(item) => {
                let value = self
                    .shape(&item.shape)
                    .map_err(|fault| fault.member(&item.name))?;
                Ok(Value::Variant {
                    tag,
                    value: Some(Box::new(value)),
                })
            }
            None if alternatives == 0 && tag == 0 => Ok(Value::Variant { tag, value: None }),
            None => Err(Fault::at(offset, DecodeProblem::Tag { tag, alternatives })),
        }
    }

    /// A fixed length string without its padding.
    fn padded(&mut self, length: u32) -> Read<Vec<u8>> {
        let octets = self.take(u64::from(length))?;
        let end = octets
            .iter()
            .rposition(|&octet| octet != 0)
            .map_or(0, |last| last + 1);
        Ok(octets[..end].to_vec())
    }

    /// A count of octets and the octets.
    fn counted(&mut self, count: &Count) -> Read<Vec<u8>> {
        let length = self.count(count)?;
        Ok(self.take(length)?.to_vec())
    }

    fn count(&mut self, count: &Count) -> Read<u64> {
        let offset = self.position;
        let number = self.unsigned(count.unsigned)?;
        if self.limits.admit(count, number) {
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

    const fn left(&self) -> usize {
        self.octets.len() - self.position
    }
}
