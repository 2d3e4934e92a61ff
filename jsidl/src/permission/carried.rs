//! Where in a message other messages are, in a notation that a node reads without definitions.
//!
//! | notation | octets |
//! |---|---|
//! | `7` | as many octets |
//! | `b2` | a count of 2 octets, and so many octets |
//! | `m4` | a count of 4 octets, and a message of that length |
//! | `d` | 4 octets: the component to which the messages behind it in the same element are sent |
//! | `f2:0,3` | a format, a count of 2 octets, and so many octets: a message in the formats 0 and 3 |
//! | `*1(…)` | a count of 1 octet, and so many elements |
//! | `?1(…;~…)` | a presence vector of 1 octet, and members; those with `~` are optional |
//! | `v1(…;…)` | a tag of 1 octet, and the alternative with that number |
//! | `x` | something that this notation cannot express |

use crate::heads::fixed_size;
use crate::model::{Group, Item, Message, Shape, is_message_format};

/// The layout of a message that carries others, after its code; `None` if it carries none.
pub(super) fn layout(message: &Message) -> Option<String> {
    let parts = [&message.header, &message.body, &message.footer];
    let parts: Vec<_> = parts.into_iter().flatten().collect();
    if !parts.iter().any(|it| carries(&it.shape)) {
        return None;
    }
    let mut notation = Notation {
        destination: message.destination.as_deref(),
        ..Notation::default()
    };
    for part in parts {
        notation.shape(&part.shape);
    }
    Some(notation.finish())
}

/// Whether a message is somewhere in it.
fn carries(shape: &Shape) -> bool {
    match shape {
        Shape::Blob { format, .. } => is_message_format(format),
        Shape::FormattedBlob { formats, .. } => {
            formats.iter().any(|it| is_message_format(&it.name))
        }
        other => other.items().any(|it| carries(&it.shape)),
    }
}

/// Octets of a component's id.
const ID: usize = 4;

/// Whether all messages that it carries have their destinations before them, as far as one can tell.
pub(super) fn has_destinations(message: &Message) -> bool {
    let layout = layout(message).unwrap_or_default();
    // Each list and each part in parentheses is looked at by itself.
    let elements = layout.split(['(', ')', ';']);
    let mut carriers = elements.filter(|it| it.contains(['m', 'f'])).peekable();
    let is_behind = |it: &str| {
        it.find('d')
            .is_some_and(|at| it.find(['m', 'f']) > Some(at))
    };
    carriers.peek().is_some() && carriers.all(is_behind)
}

#[derive(Default)]
struct Notation<'m> {
    /// The field with the destination.
    destination: Option<&'m str>,
    text: String,
    /// Octets of fixed fields that are not written yet.
    fixed: usize,
}

impl Notation<'_> {
    fn shape(&mut self, shape: &Shape) {
        if let Some(size) = fixed_size(shape).filter(|_| !self.has_destination(shape)) {
            self.fixed += size;
            return;
        }
        match shape {
            Shape::Group(group) => self.group(group),
            Shape::List(list) => {
                self.push(&format!("*{}", list.count.unsigned.size()));
                self.enclosed([&*list.element], |_| "");
            }
            Shape::Variant(variant) => {
                self.push(&format!("v{}", variant.tag.size()));
                self.enclosed(&variant.alternatives, |_| "");
            }
            Shape::VariableString { count } => self.push(&format!("b{}", count.unsigned.size())),
            Shape::Blob { count, format } => {
                let kind = if is_message_format(format) { 'm' } else { 'b' };
                self.push(&format!("{kind}{}", count.unsigned.size()));
            }
            Shape::FormattedBlob { formats, count } => {
                let messages = formats.iter().filter(|it| is_message_format(&it.name));
                let messages: Vec<_> = messages.map(|it| it.index.to_string()).collect();
                self.push(&format!(
                    "f{}:{}",
                    count.unsigned.size(),
                    messages.join(",")
                ));
            }
            _ => self.push("x"),
        }
    }

    fn group(&mut self, group: &Group) {
        let Some(presence) = group.presence else {
            for member in &group.members {
                self.member(member);
            }
            return;
        };
        self.push(&format!("?{}", presence.size()));
        self.enclosed(&group.members, |it| if it.optional { "~" } else { "" });
    }

    /// Whether the destination is in it.
    fn has_destination(&self, shape: &Shape) -> bool {
        let is_or_has =
            |it: &Item| self.destination == Some(&it.name) || self.has_destination(&it.shape);
        self.destination.is_some() && shape.items().any(is_or_has)
    }

    /// A member of a group, or what a list or variant has.
    fn member(&mut self, item: &Item) {
        if self.destination == Some(&item.name) && fixed_size(&item.shape) == Some(ID) {
            self.push("d");
        } else {
            self.shape(&item.shape);
        }
    }

    fn enclosed<'i>(
        &mut self,
        items: impl IntoIterator<Item = &'i Item>,
        mark: impl Fn(&Item) -> &'static str,
    ) {
        let inner = items.into_iter().map(|item| {
            let mut inner = Self {
                destination: self.destination,
                ..Self::default()
            };
            if item.optional {
                inner.shape(&item.shape);
            } else {
                inner.member(item);
            }
            format!("{}{}", mark(item), inner.finish())
        });
        let inner: Vec<_> = inner.collect();
        self.push(&format!("({})", inner.join(";")));
    }

    fn push(&mut self, text: &str) {
        self.flush();
        self.text.push_str(text);
    }

    fn flush(&mut self) {
        if self.fixed > 0 {
            let fixed = std::mem::take(&mut self.fixed).to_string();
            // Two numbers in a row would be read as one.
            if self.text.ends_with(|last: char| last.is_ascii_digit()) {
                self.text.push('.');
            }
            self.text.push_str(&fixed);
        }
    }

    fn finish(mut self) -> String {
        self.flush();
        self.text
    }
}
