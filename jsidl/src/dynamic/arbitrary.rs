//! Generates values for tests and fuzzing: any value of a definition, from octets.

use super::{Raw, Value};
use crate::model::{Count, Group, Item, Message, Number, Shape, Signed, Unsigned, Variant};

/// A value of the definition, selected by the octets: the same octets give the same value, and
/// fewer and smaller octets give a smaller value. Without octets it is the least value: no optional
/// member, shortest lists, numbers 0.
///
/// Every such value can be encoded, unless the definition is unsatisfiable (for example a list with
/// a higher minimum than this crate permits).
pub fn arbitrary(message: &Message, entropy: &[u8]) -> Value {
    let mut choice = Choice { entropy };
    let section = |item: &Option<Item>, choice: &mut Choice<'_>| {
        item.as_ref().map(|item| choice.shape(&item.shape))
    };
    if message.header.is_none() && message.footer.is_none() {
        return section(&message.body, &mut choice).unwrap_or(Value::Group(Vec::new()));
    }
    let sections = [&message.header, &message.body, &message.footer];
    Value::Group(sections.map(|item| section(item, &mut choice)).into())
}

struct Choice<'a> {
    entropy: &'a [u8],
}

impl Choice<'_> {
    fn octet(&mut self) -> u8 {
        let Some((&first, rest)) = self.entropy.split_first() else {
            return 0;
        };
        self.entropy = rest;
        first
    }

    fn bits(&mut self) -> u64 {
        u64::from_le_bytes(std::array::from_fn(|_| self.octet()))
    }

    /// A number that is often at one of the limits, where bugs are likely.
    fn number_up_to(&mut self, max: u64) -> u64 {
        match self.octet() % 4 {
            0 => u64::from(self.octet()).min(max),
            1 => max - u64::from(self.octet() % 2).min(max),
            _ if max == u64::MAX => self.bits(),
            _ => self.bits() % (max + 1),
        }
    }

    /// A count that the remaining entropy can fill.
    fn count(&mut self, count: &Count) -> usize {
        let room = (self.entropy.len() as u64 / 2).min(count.max.saturating_sub(count.min));
        let extra = if room == 0 {
            0
        } else {
            u64::from(self.octet()) % (room + 1)
        };
        usize::try_from(count.min.saturating_add(extra)).unwrap_or(usize::MAX)
    }

    fn octets(&mut self, length: usize) -> Vec<u8> {
        (0..length).map(|_| self.octet()).collect()
    }

    /// Text, mostly readable.
    fn text(&mut self, length: usize) -> Vec<u8> {
        let any = self.octet() % 8 == 7;
        let mut octet = || {
            if any {
                self.octet()
            } else {
                b' ' + self.octet() % 95
            }
        };
        (0..length).map(|_| octet()).collect()
    }

    fn shape(&mut self, shape: &Shape) -> Value {
        match shape {
            Shape::Group(group) => self.group(group),
            Shape::List(list) => {
                let count = self.count(&list.count);
                Value::List(
                    (0..count)
                        .map(|_| self.shape(&list.element.shape))
                        .collect(),
                )
            }
            Shape::Variant(variant) => self.variant(variant),
            Shape::Scalar(scalar) => Value::Number(self.number(scalar.number)),
            Shape::Bits(bits) => Value::Bits(self.number_up_to(bits.base.max())),
            Shape::FixedString { length } => Value::Text(self.fixed_text(*length)),
            Shape::VariableString { count } => {
                let length = self.count(count);
                Value::Text(self.text(length))
            }
            Shape::Blob { count, .. } => {
                let length = self.count(count);
                Value::Blob(self.octets(length))
            }
            Shape::FormattedBlob { count, .. } => {
                let format = self.octet();
                let length = self.count(count);
                Value::Formatted {
                    format,
                    octets: self.octets(length),
                }
            }
            Shape::Measure { choices } => {
                let chosen = usize::from(self.octet()) % choices.len().max(1);
                let (index, number) = choices
                    .get(chosen)
                    .map_or((0, Number::Unsigned(Unsigned::U8)), |choice| {
                        (choice.index, choice.scalar.number)
                    });
                Value::Measure {
                    index,
                    number: self.number(number),
                }
            }
            Shape::Array(array) => {
                let elements = 0..array.elements();
                Value::Array(elements.map(|_| self.shape(&array.element.shape)).collect())
            }
        }
    }

    fn group(&mut self, group: &Group) -> Value {
        let slot = |member: &Item| {
            let present = !member.optional || self.octet() % 2 == 1;
            present.then(|| self.shape(&member.shape))
        };
        Value::Group(group.members.iter().map(slot).collect())
    }

    fn variant(&mut self, variant: &Variant) -> Value {
        let chosen = usize::from(self.octet()) % variant.alternatives.len().max(1);
        let alternative = variant.alternatives.get(chosen);
        let value = alternative.map(|item| Box::new(self.shape(&item.shape)));
        Value::Variant {
            tag: chosen as u64,
            value,
        }
    }

    /// Text that does not end in zeros, which decoding treats as padding.
    fn fixed_text(&mut self, length: u32) -> Vec<u8> {
        let room = u64::from(length).min(self.entropy.len() as u64);
        let length = usize::try_from(u64::from(self.octet()).min(room)).unwrap_or(0);
        let mut text = self.text(length);
        while text.last() == Some(&0) {
            text.pop();
        }
        text
    }

    fn number(&mut self, number: Number) -> Raw {
        match number {
            Number::Unsigned(unsigned) => Raw::Unsigned(self.number_up_to(unsigned.max())),
            Number::Signed(signed) => {
                let any = self.bits() as i64;
                Raw::Signed(match signed {
                    Signed::I8 => (any as i8).into(),
                    Signed::I16 => (any as i16).into(),
                    Signed::I32 => (any as i32).into(),
                    Signed::I64 => any,
                })
            }
            Number::F32 => Raw::F32(f32::from_bits(self.bits() as u32)),
            Number::F64 => Raw::F64(f64::from_bits(self.bits())),
        }
    }
}
