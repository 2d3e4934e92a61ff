//! Brings a definition into the form that the standard prescribes: mandatory parts that say nothing
//! are added, and elements are put in order.

use std::borrow::Cow;

use crate::grammar::{self, Edition, Occurs};
use crate::layout::{Attribute, Content, Element, Kind, Node};

/// Values of mandatory attributes that published definitions leave out.
const DEFAULTS: [(&str, &str); 4] = [
    ("optional", "false"),
    ("offset_to_lower_limit", "false"),
    ("is_command", "false"),
    ("field_units", "one"),
];

/// The machine of a service without behaviour of its own.
const STATELESS: &str = "Stateless";

/// Completes all elements of a document.
pub(super) fn document(nodes: &mut [Node<'_>]) {
    let edition = edition(nodes).unwrap_or(Edition::V1_1);
    for node in nodes {
        if let Kind::Element(element) = &mut node.kind {
            complete(element, edition);
        }
    }
}

/// The edition of the first namespace of the language.
fn edition(nodes: &[Node<'_>]) -> Option<Edition> {
    nodes.iter().find_map(|node| {
        let Kind::Element(element) = &node.kind else {
            return None;
        };
        let mut values = element.attributes.iter().map(|it| it.value);
        let own = values.find_map(Edition::of_namespace);
        own.or_else(|| match &element.content {
            Content::Nodes(nodes) => edition(nodes),
            Content::Text(_) => None,
        })
    })
}

fn complete(element: &mut Element<'_>, edition: Edition) {
    let Some(known) = grammar::element(element.local_name()) else {
        return;
    };
    for attribute in known.attributes {
        let missing = attribute.occurs(edition) == Occurs::Once
            && !element
                .attributes
                .iter()
                .any(|it| it.name == attribute.name);
        let default = DEFAULTS.iter().find(|(name, _)| *name == attribute.name);
        if let Some((name, value)) = default.filter(|_| missing) {
            element.attributes.push(written(name, value));
        }
    }
    let prefix = element.prefix();
    let Content::Nodes(nodes) = &mut element.content else {
        return;
    };
    for node in &mut *nodes {
        if let Kind::Element(child) = &mut node.kind {
            complete(child, edition);
        }
    }
    for part in known.parts {
        let there = |node: &Node<'_>| match &node.kind {
            Kind::Element(child) => part.holds(child.local_name(), edition),
            _ => false,
        };
        if part.occurs(edition).is_mandatory() && !nodes.iter().any(there) {
            let name = part.elements(edition).next();
            nodes.extend(name.and_then(|name| silent(&prefix, name)));
        }
    }
    in_order(nodes, known);
}

/// A mandatory element that says nothing, if there is such a thing.
fn silent<'t>(prefix: &str, name: &'static str) -> Option<Node<'t>> {
    let node = |name: &str, attributes: &[(&'static str, &'static str)], nodes| Node {
        kind: Kind::Element(Element {
            name: Cow::Owned(format!("{prefix}{name}")),
            attributes: attributes.iter().map(|(n, v)| written(n, v)).collect(),
            content: Content::Nodes(nodes),
        }),
        apart: false,
        same_line: false,
    };
    match name {
        "description" | "assumptions" | "internal_events_set" => Some(node(name, &[], Vec::new())),
        "protocol_behavior" => {
            let state = node("state", &[("name", "Ready")], Vec::new());
            let names = [("state_machine_name", STATELESS), ("state_name", "Ready")];
            let start = node("start", &names, Vec::new());
            let machine = node("state_machine", &[("name", STATELESS)], vec![state]);
            let flag = [("is_stateless", "true")];
            Some(node(name, &flag, vec![start, machine]))
        }
        _ => None,
    }
}

fn written<'t>(name: &'static str, value: &'static str) -> Attribute<'t> {
    Attribute {
        name,
        value,
        quote: '"',
    }
}

/// Sorts the elements as the standard does. A comment stays before the element that it precedes, or
/// behind the one on its line.
fn in_order(nodes: &mut Vec<Node<'_>>, known: &grammar::Element) {
    let mut groups: Vec<(usize, Vec<Node<'_>>)> = Vec::new();
    let mut waiting = Vec::new();
    for node in nodes.drain(..) {
        let position = match &node.kind {
            Kind::Element(child) => {
                let part = known.part(child.local_name());
                let last = groups.last().map_or(0, |(position, _)| *position);
                Some(part.map_or(last, |(position, _)| position))
            }
            _ => None,
        };
        match (position, groups.last_mut()) {
            (Some(position), _) => {
                waiting.push(node);
                groups.push((position, std::mem::take(&mut waiting)));
            }
            (None, Some((_, group))) if node.same_line && waiting.is_empty() => group.push(node),
            (None, _) => waiting.push(node),
        }
    }
    groups.sort_by_key(|(position, _)| *position);
    nodes.extend(groups.into_iter().flat_map(|(_, group)| group));
    nodes.extend(waiting);
    // No blank line at the beginning.
    if let Some(first) = nodes.first_mut() {
        first.apart = false;
    }
}
