//! Encodes a [`Value`] by walking the definition.
//!
//! Nothing is adjusted to fit: a value of another kind, a number out of range or a string that is
//! too long is an error that names the field.

use super::error::{EncodeError, EncodeProblem, Fault, Step};
use super::{EmptyElements, Limits, Raw, Value};
use crate::model::{
    Array, Count, Group, Item, List, Message, Number, Shape, Signed, Unsigned, Variant,
};

/// Encodes a whole message: its code, header, body and footer.
///
/// # Errors
/// If the definition cannot express the value: see [`EncodeProblem`].
pub fn encode(message: &Message, value: &Value) -> Result<Vec<u8>, EncodeError> {
    encode_with(message, value, Limits::Enforced)
}

/// [`encode`] with a choice how to treat counts outside the definition's limits. A count beyond its
/// type is always an error.
///
/// # Errors
/// As [`encode`].
pub fn encode_with(
    message: &Message,
    value: &Value,
    limits: Limits,
) -> Result<Vec<u8>, EncodeError> {
    let mut writer = Writer {
        octets: Vec::new(),
        limits,
        empty: EmptyElements::new(),
    };
    match writer.message(message, value) {
        Ok(()) => Ok(writer.octets),
        Err(fault) => Err(fault.encoding(&message.name)),
    }
}

type Written = Result<(), Fault<EncodeProblem>>;

struct Writer {
    octets: Vec<u8>,
    limits: Limits,
    empty: EmptyElements,
}

impl Writer {
    fn message(&mut self, message: &Message, value: &Value) -> Written {
        self.octets.extend(message.code.to_le_bytes());
        if message.header.is_some() || message.footer.is_some() {
            let sections = [&message.header, &message.body, &message.footer];
            let slots = slots(value, sections.len() as u64)?;
            for (section, slot) in sections.into_iter().zip(slots) {
                match (section, slot) {
                    (Some(item), Some(value)) => self.shape(&item.shape, value)?,
                    (Some(item), None) => return Err(missing(item)),
                    (None, None) => {}
                    (None, Some(value)) => return Err(mismatch("nothing", value)),
                }
            }
            return Ok(());
        }
        match &message.body {
            Some(body) => self.shape(&body.shape, value),
            None => slots(value, 0).map(drop),
        }
    }

    fn shape(&mut self, shape: &Shape, value: &Value) -> Written {
        match (shape, value) {
            (Shape::Group(group), Value::Group(_)) => self.group(group, value),
            (Shape::List(list), Value::List(elements)) => self.list(list, elements),
            (Shape::Variant(variant), Value::Variant { tag, value }) => {
                self.variant(variant, *tag, value.as_deref())
            }
            (Shape::Scalar(scalar), Value::Number(raw)) => self.number(scalar.number, *raw),
            (Shape::Bits(bits), Value::Bits(raw)) => self.unsigned(bits.base, *raw),
            (Shape::FixedString { length }, Value::Text(text)) => self.padded(*length, text),
            (Shape::VariableString { count }, Value::Text(octets))
            | (Shape::Blob { count, .. }, Value::Blob(octets)) => self.counted(count, octets),
            (Shape::FormattedBlob { count, .. }, Value::Formatted { format, octets }) => {
                self.octets.push(*format);
                self.counted(count, octets)
            }
            (Shape::Measure { choices }, Value::Measure { index, number }) => {
                let choice = choices.iter().find(|choice| choice.index == *index);
                let choice = choice.ok_or(EncodeProblem::Index { index: *index })?;
                self.octets.push(*index);
                self.number(choice.scalar.number, *number)
            }
            (Shape::Array(array), Value::Array(elements)) => self.array(array, elements),
            (shape, value) => Err(mismatch(shape.kind(), value)),
        }
    }

    fn group(&mut self, group: &Group, value: &Value) -> Written {
        let slots = slots(value, group.members.len() as u64)?;
        self.presence(group, slots)?;
        for (member, slot) in group.members.iter().zip(slots) {
            match slot {
                Some(value) => self
                    .shape(&member.shape, value)
                    .map_err(|fault| fault.member(&member.name))?,
                None if member.optional => {}
                None => return Err(missing(member)),
            }
        }
        Ok(())
    }

    fn presence(&mut self, group: &Group, slots: &[Option<Value>]) -> Written {
        let bits = group.presence.map_or(0, |width| width.size() * 8);
        let optional = group
            .members
            .iter()
            .zip(slots)
            .filter(|(member, _)| member.optional);
        let mut vector = 0;
        for (bit, (member, slot)) in optional.enumerate() {
            if slot.is_none() {
                continue;
            }
            if bit >= bits {
                return Err(Fault::from(EncodeProblem::NoPresenceBit).member(&member.name));
            }
            vector |= 1 << bit;
        }
        group
            .presence
            .map_or(Ok(()), |width| self.unsigned(width, vector))
    }

    fn list(&mut self, list: &List, elements: &[Value]) -> Written {
        self.count(&list.count, elements.len())?;
        self.elements(&list.element, elements)
    }

    fn array(&mut self, array: &Array, elements: &[Value]) -> Written {
        let (expected, found) = (array.elements(), elements.len());
        if expected != found as u64 {
            return Err(EncodeProblem::Slots { expected, found }.into());
        }
        self.elements(&array.element, elements)
    }

    fn elements(&mut self, element: &Item, values: &[Value]) -> Written {
        for (index, value) in values.iter().enumerate() {
            let start = self.octets.len();
            self.shape(&element.shape, value)
                .map_err(|fault| fault.under(Step::Element(index)))?;
            if self.octets.len() == start && !self.empty.take() {
                return Err(Fault::from(EncodeProblem::EmptyElements).under(Step::Element(index)));
            }
        }
        Ok(())
    }

    fn variant(&mut self, variant: &Variant, tag: u64, value: Option<&Value>) -> Written {
        let alternatives = variant.alternatives.len();
        let chosen = usize::try_from(tag)
            .ok()
            .and_then(|tag| variant.alternatives.get(tag));
        match (chosen, value) {
            (Some(item), Some(value)) => {
                self.unsigned(variant.tag, tag)?;
                self.shape(&item.shape, value)
                    .map_err(|fault| fault.member(&item.name))
            }
            (None, None) if alternatives == 0 && tag == 0 => self.unsigned(variant.tag, tag),
            _ => Err(EncodeProblem::Tag { tag, alternatives }.into()),
        }
    }

    fn padded(&mut self, field: u32, text: &[u8]) -> Written {
        let length = text.len();
        match usize::try_from(field)
            .ok()
            .and_then(|field| field.checked_sub(length))
        {
            Some(padding) => {
                self.octets.extend_from_slice(text);
                self.octets.resize(self.octets.len() + padding, 0);
                Ok(())
            }
            None => Err(EncodeProblem::TooLong { length, field }.into()),
        }
    }

    fn counted(&mut self, count: &Count, octets: &[u8]) -> Written {
        self.count(count, octets.len())?;
        self.octets.extend_from_slice(octets);
        Ok(())
    }

    fn count(&mut self, count: &Count, number: usize) -> Written {
        let number = number as u64;
        if self.limits.admit(count, number) && number <= count.unsigned.max() {
            return self.unsigned(count.unsigned, number);
        }
        let (min, max) = match self.limits {
            Limits::Enforced => (count.min, count.max.min(count.unsigned.max())),
            Limits::Ignored => (0, count.unsigned.max()),
        };
        Err(EncodeProblem::Count {
            count: number,
            min,
            max,
        }
        .into())
    }

    fn number(&mut self, number: Number, raw: Raw) -> Written {
        match (number, raw) {
            (Number::Unsigned(unsigned), Raw::Unsigned(raw)) => {
                return self.unsigned(unsigned, raw);
            }
            (Number::Signed(signed), Raw::Signed(raw)) => return self.signed(signed, raw),
            (Number::F32, Raw::F32(raw)) => self.octets.extend(raw.to_le_bytes()),
            (Number::F64, Raw::F64(raw)) => self.octets.extend(raw.to_le_bytes()),
            (number, raw) => return Err(unfit(raw, number)),
        }
        Ok(())
    }

    fn unsigned(&mut self, unsigned: Unsigned, raw: u64) -> Written {
        if raw > unsigned.max() {
            return Err(unfit(Raw::Unsigned(raw), Number::Unsigned(unsigned)));
        }
        self.octets
            .extend_from_slice(&raw.to_le_bytes()[..unsigned.size()]);
        Ok(())
    }

    fn signed(&mut self, signed: Signed, raw: i64) -> Written {
        // The surplus high octets must repeat the sign, otherwise the number does not fit.
        let surplus = 64 - 8 * signed.size();
        if (raw << surplus) >> surplus != raw {
            return Err(unfit(Raw::Signed(raw), Number::Signed(signed)));
        }
        self.octets
            .extend_from_slice(&raw.to_le_bytes()[..signed.size()]);
        Ok(())
    }
}

/// The slots of a group value, if their number matches the definition.
pub(crate) fn slots(
    value: &Value,
    expected: u64,
) -> Result<&[Option<Value>], Fault<EncodeProblem>> {
    match value {
        Value::Group(slots) if slots.len() as u64 == expected => Ok(slots),
        Value::Group(slots) => Err(EncodeProblem::Slots {
            expected,
            found: slots.len(),
        }
        .into()),
        other => Err(mismatch("a record or sequence", other)),
    }
}

pub(crate) fn mismatch(expected: &'static str, value: &Value) -> Fault<EncodeProblem> {
    EncodeProblem::Kind {
        expected,
        found: value.kind(),
    }
    .into()
}

pub(super) fn missing(member: &Item) -> Fault<EncodeProblem> {
    Fault::from(EncodeProblem::Missing).member(&member.name)
}

pub(crate) fn unfit(number: Raw, kind: Number) -> Fault<EncodeProblem> {
    EncodeProblem::Number {
        number,
        kind: kind.name(),
    }
    .into()
}
