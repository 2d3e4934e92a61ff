//! One dimension of an array in Rust: within its struct, or on the heap.

/// One dimension of an array in Rust.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dimension {
    pub(super) length: u32,
    /// Whether its elements are on the heap.
    pub(super) on_heap: bool,
}

impl Dimension {
    /// The type of an array with these elements.
    pub(super) fn of(self, element: &str) -> String {
        let length = self.length;
        match self.on_heap {
            true => format!("codec::LargeArray<{element}, {length}>"),
            false => format!("[{element}; {length}]"),
        }
    }

    /// An array whose elements are all made by an expression.
    pub(super) fn filled(self, element: &str) -> String {
        match self.on_heap {
            true => format!("codec::LargeArray::from_fn(|_| {element})"),
            false => format!("::core::array::from_fn(|_| {element})"),
        }
    }

    /// The function that makes random arrays of this kind.
    pub(super) const fn random(self) -> &'static str {
        if self.on_heap { "large_array" } else { "array" }
    }
}
