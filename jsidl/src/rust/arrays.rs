//! Arrays in Rust: small ones within their struct, large ones on the heap.

use super::dimension::Dimension;
use super::types::Type;

/// Arrays of more octets are on the heap.
const MOST_INLINE: usize = 1024;

/// Octets of an array or a list on the heap within its struct.
const POINTERS: usize = 16;

impl Type {
    /// The dimensions of an array, from the outermost inwards; none of another type.
    pub(super) fn dimensions(&self) -> Vec<Dimension> {
        let Self::Array {
            dimensions,
            element,
        } = self
        else {
            return Vec::new();
        };
        let mut octets = element.memory();
        let inwards_out = dimensions.iter().rev().map(|&length| {
            octets = octets.saturating_mul(length as usize);
            let on_heap = octets > MOST_INLINE;
            if on_heap {
                octets = POINTERS;
            }
            Dimension { length, on_heap }
        });
        let mut all: Vec<_> = inwards_out.collect();
        all.reverse();
        all
    }

    /// About how many octets a value takes within its struct.
    fn memory(&self) -> usize {
        match self {
            Self::Array { element, .. } => {
                let inwards_out = self.dimensions().into_iter().rev();
                inwards_out.fold(element.memory(), |octets, dimension| {
                    match dimension.on_heap {
                        true => POINTERS,
                        false => octets.saturating_mul(dimension.length as usize),
                    }
                })
            }
            _ => self.size().unwrap_or(2 * POINTERS),
        }
    }

    /// The type of an array with another type of elements.
    pub(super) fn array_of(&self, element: &str) -> String {
        let inwards_out = self.dimensions().into_iter().rev();
        inwards_out.fold(element.to_owned(), |inner, dimension| dimension.of(&inner))
    }

    /// An array whose elements are all made by an expression.
    pub(super) fn filled(&self, element: &str) -> String {
        let inwards_out = self.dimensions().into_iter().rev();
        inwards_out.fold(element.to_owned(), |inner, dimension| {
            dimension.filled(&inner)
        })
    }
}
