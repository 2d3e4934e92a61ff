//! The canonical layout of XML: two blanks per level, attributes in one order, lines of at most [`WIDTH`]
//! characters, comments and text preserved.

mod nodes;
mod write;

pub(crate) use nodes::{Attribute, Content, Element, Kind, Node, nodes};

/// Maximum line length, where words allow it.
pub(crate) const WIDTH: usize = 116;

/// An XML text that is known to be well-formed, in the canonical layout.
pub(crate) fn document(xml: &str) -> String {
    write::document(&nodes(xml))
}

/// As [`document`], without the first line.
pub(crate) fn part(xml: &str) -> String {
    write::part(&nodes(xml))
}

/// The nodes of a document, in the canonical layout.
pub(crate) fn written(nodes: &[Node<'_>]) -> String {
    write::document(nodes)
}
