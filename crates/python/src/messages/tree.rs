//! Values of the dynamic codec as plain Python objects.
//!
//! | value | Python |
//! |---|---|
//! | group, list, array | `list`; `None` for an absent member |
//! | variant | `(tag, value)` |
//! | number, bit field | `int` or `float`; a scaled integer as its integer |
//! | string, octets | `bytes` |
//! | octets in a format | `(format, bytes)` |
//! | measure | `(index, number)` |
//!
//! The Python classes check what an application sets; here an object of another type is a
//! `TypeError`, a number that does not fit an `OverflowError`.

use jsidl::dynamic::{Raw, Value};
use jsidl::model::{Item, Message, Number, Shape};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList};

/// The value as Python objects.
pub(super) fn from_value<'py>(py: Python<'py>, value: Value) -> PyResult<Bound<'py, PyAny>> {
    match value {
        Value::Group(slots) => {
            let slots = slots.into_iter();
            let slots = slots.map(|slot| slot.map(|value| from_value(py, value)).transpose());
            list(py, slots.collect::<PyResult<Vec<_>>>()?)
        }
        Value::List(values) | Value::Array(values) => {
            let values = values.into_iter().map(|value| from_value(py, value));
            list(py, values.collect::<PyResult<Vec<_>>>()?)
        }
        Value::Variant { tag, value } => {
            let value = value.map(|value| from_value(py, *value)).transpose()?;
            (tag, value).into_bound_py_any(py)
        }
        Value::Number(raw) => from_raw(py, raw),
        Value::Bits(raw) => raw.into_bound_py_any(py),
        Value::Text(octets) | Value::Blob(octets) => Ok(PyBytes::new(py, &octets).into_any()),
        Value::Formatted { format, octets } => {
            (format, PyBytes::new(py, &octets)).into_bound_py_any(py)
        }
        Value::Measure { index, number } => (index, from_raw(py, number)?).into_bound_py_any(py),
    }
}

fn list<'py>(
    py: Python<'py>,
    elements: Vec<impl IntoPyObject<'py>>,
) -> PyResult<Bound<'py, PyAny>> {
    Ok(PyList::new(py, elements)?.into_any())
}

fn from_raw(py: Python<'_>, raw: Raw) -> PyResult<Bound<'_, PyAny>> {
    match raw {
        Raw::Unsigned(raw) => raw.into_bound_py_any(py),
        Raw::Signed(raw) => raw.into_bound_py_any(py),
        Raw::F32(raw) => widened(raw).into_bound_py_any(py),
        Raw::F64(raw) => raw.into_bound_py_any(py),
    }
}

/// The decimal with the fewest digits that stands for a number of four octets: 0.1, not
/// 0.10000000149011612. A NaN keeps its bits, some of which arithmetic would change.
pub(super) fn widened(number: f32) -> f64 {
    if !number.is_nan() {
        let decimal = number.to_string().parse();
        return decimal.unwrap_or_else(|_| number.into());
    }
    let bits = u64::from(number.to_bits());
    let (sign, fraction) = (bits >> 31, bits & 0x7F_FFFF);
    f64::from_bits((sign << 63) | (0x7FF << 52) | (fraction << 29))
}

/// The nearest number with four octets. A NaN from [`widened`] is restored.
pub(super) fn narrowed(number: f64) -> f32 {
    if !number.is_nan() {
        return number as f32;
    }
    let bits = number.to_bits();
    let fraction = match ((bits >> 29) & 0x7F_FFFF) as u32 {
        0 => 1 << 22,
        fraction => fraction,
    };
    let sign = (bits >> 63) as u32;
    f32::from_bits((sign << 31) | (0xFF << 23) | fraction)
}

/// The value of a message from Python objects.
pub(super) fn to_value(message: &Message, tree: &Bound<'_, PyAny>) -> PyResult<Value> {
    if message.header.is_none() && message.footer.is_none() {
        return match &message.body {
            Some(body) => of_shape(&body.shape, tree),
            None => Ok(Value::Group(Vec::new())),
        };
    }
    let sections = [&message.header, &message.body, &message.footer];
    let slots = tree.cast::<PyList>()?.iter().zip(sections);
    let slots = slots.map(|(slot, section)| match section {
        Some(item) => of_slot(item, &slot),
        None => Ok(None),
    });
    Ok(Value::Group(slots.collect::<PyResult<_>>()?))
}

fn of_slot(item: &Item, slot: &Bound<'_, PyAny>) -> PyResult<Option<Value>> {
    let present = !slot.is_none();
    present.then(|| of_shape(&item.shape, slot)).transpose()
}

fn of_shape(shape: &Shape, tree: &Bound<'_, PyAny>) -> PyResult<Value> {
    Ok(match shape {
        Shape::Group(group) => {
            let slots = tree.cast::<PyList>()?.iter().zip(&group.members);
            let slots = slots.map(|(slot, item)| of_slot(item, &slot));
            Value::Group(slots.collect::<PyResult<_>>()?)
        }
        Shape::List(list) => Value::List(elements(&list.element, tree)?),
        Shape::Array(array) => Value::Array(elements(&array.element, tree)?),
        Shape::Variant(variant) => {
            let (tag, value): (u64, Bound<'_, PyAny>) = tree.extract()?;
            let tag_as_index = usize::try_from(tag).ok();
            let item = tag_as_index.and_then(|tag| variant.alternatives.get(tag));
            let value = item.map(|item| of_slot(item, &value)).transpose()?;
            Value::Variant {
                tag,
                value: value.flatten().map(Box::new),
            }
        }
        Shape::Scalar(scalar) => Value::Number(raw(scalar.number, tree)?),
        Shape::Bits(_) => Value::Bits(tree.extract()?),
        Shape::FixedString { .. } | Shape::VariableString { .. } => Value::Text(octets(tree)?),
        Shape::Blob { .. } => Value::Blob(octets(tree)?),
        Shape::FormattedBlob { .. } => {
            let (format, data): (u8, Bound<'_, PyAny>) = tree.extract()?;
            Value::Formatted {
                format,
                octets: octets(&data)?,
            }
        }
        Shape::Measure { choices } => {
            let (index, number): (u8, Bound<'_, PyAny>) = tree.extract()?;
            let choice = choices.iter().find(|choice| choice.index == index);
            let number = match choice {
                Some(choice) => raw(choice.scalar.number, &number)?,
                // Encoding reports the index.
                None => Raw::Unsigned(0),
            };
            Value::Measure { index, number }
        }
        other => {
            return Err(PyTypeError::new_err(format!(
                "this package does not know {other:?}"
            )));
        }
    })
}

fn elements(item: &Item, tree: &Bound<'_, PyAny>) -> PyResult<Vec<Value>> {
    let elements = tree.cast::<PyList>()?.iter();
    elements
        .map(|element| of_shape(&item.shape, &element))
        .collect()
}

fn raw(number: Number, tree: &Bound<'_, PyAny>) -> PyResult<Raw> {
    Ok(match number {
        Number::Unsigned(_) => Raw::Unsigned(tree.extract()?),
        Number::Signed(_) => Raw::Signed(tree.extract()?),
        Number::F32 => Raw::F32(narrowed(tree.extract()?)),
        Number::F64 => Raw::F64(tree.extract()?),
    })
}

fn octets(tree: &Bound<'_, PyAny>) -> PyResult<Vec<u8>> {
    Ok(tree.cast::<PyBytes>()?.as_bytes().to_vec())
}
