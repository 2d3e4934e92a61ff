//! Scaled integers.

use jsidl::dynamic::{Raw, Steps};
use jsidl::model::{self, Number, Rounding, Signed, Unsigned};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::tree;

/// Conversion between a real number in a range and the integer that carries it.
#[pyclass(frozen, module = "jaus._jaus")]
pub(super) struct Scale {
    steps: Steps,
}

#[pymethods]
impl Scale {
    /// A scale of an integer type such as `u16`.
    #[new]
    fn new(number: &str, lower: f64, upper: f64, rounding: &str) -> PyResult<Self> {
        let rounding = match rounding {
            "floor" => Rounding::Floor,
            "ceiling" => Rounding::Ceiling,
            _ => Rounding::Round,
        };
        let scale = model::Scale {
            lower,
            upper,
            rounding,
        };
        let number = number_of(number);
        let steps = number.and_then(|number| Steps::of(&scale, number));
        let steps =
            steps.ok_or_else(|| PyValueError::new_err("numbers of this type have no scale"));
        Ok(Self { steps: steps? })
    }

    /// The integer for a real number, rounded exactly; `None` outside the range.
    fn raw(&self, real: f64) -> Option<i64> {
        match self.steps.raw(real)? {
            Raw::Unsigned(raw) => i64::try_from(raw).ok(),
            Raw::Signed(raw) => Some(raw),
            Raw::F32(_) | Raw::F64(_) => None,
        }
    }

    /// The decimal with the fewest digits that stands for an integer; `None` if the type cannot
    /// hold the integer.
    fn value(&self, raw: i64) -> Option<f64> {
        let unsigned = u64::try_from(raw).ok().map(Raw::Unsigned);
        let shown = unsigned.and_then(|raw| self.steps.shown(raw));
        shown.or_else(|| self.steps.shown(Raw::Signed(raw)))
    }
}

/// The type with this name in the description of a layout. Only integers of at most four octets
/// have a scale.
fn number_of(name: &str) -> Option<Number> {
    Some(match name {
        "u8" => Number::Unsigned(Unsigned::U8),
        "u16" => Number::Unsigned(Unsigned::U16),
        "u32" => Number::Unsigned(Unsigned::U32),
        "i8" => Number::Signed(Signed::I8),
        "i16" => Number::Signed(Signed::I16),
        "i32" => Number::Signed(Signed::I32),
        _ => return None,
    })
}

/// The decimal with the fewest digits that stands for the nearest number of four octets; `None` if
/// that is infinite and the given number is not.
#[pyfunction]
pub(super) fn single(number: f64) -> Option<f64> {
    let nearest = tree::narrowed(number);
    (nearest.is_finite() || !number.is_finite()).then(|| tree::widened(nearest))
}
