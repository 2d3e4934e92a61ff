//! Compares members: presence, order and layout.

use super::Walk;
use crate::fingerprint::same_shape_on_wire;
use crate::model::{Item, Shape};

impl Walk<'_> {
    /// Compares two corresponding members.
    pub(super) fn item(&mut self, old: &Item, new: &Item) {
        let places = (Some(&old.location), Some(&new.location));
        self.inside(new.name.clone(), places.0, places.1, |walk| {
            if old.name != new.name {
                walk.report(false, format!("renamed, was `{}`", old.name));
            }
            if old.optional != new.optional {
                let message = if new.optional {
                    "it is now optional"
                } else {
                    "it is no longer optional"
                };
                walk.report(true, message);
            }
            walk.shape(&old.shape, &new.shape);
        });
    }

    /// Compares members of a group or alternatives of a variant. `what` names one of them;
    /// `appending` is whether additions at the end affect the wire.
    pub(super) fn items(&mut self, what: &str, appending: bool, old: &[Item], new: &[Item]) {
        let pairs = pairs(old, new);
        let kept: Vec<_> = pairs.iter().filter_map(|(_, new)| *new).collect();
        let moved = kept.windows(2).any(|two| two[0] > two[1]);
        for (old_position, new_position) in &pairs {
            let old = &old[*old_position];
            match new_position {
                Some(position) => self.item(old, &new[*position]),
                None => self.inside(old.name.clone(), Some(&old.location), None, |walk| {
                    walk.report(true, format!("the {what} was removed"));
                }),
            }
        }
        for (position, item) in new.iter().enumerate() {
            if kept.contains(&position) {
                continue;
            }
            let at_end = kept.iter().all(|kept| *kept < position);
            let wire = appending || !at_end;
            self.inside(item.name.clone(), None, Some(&item.location), |walk| {
                walk.report(wire, format!("the {what} was added"));
            });
        }
        if moved {
            self.report(
                true,
                format!("the order of the {what}s changed: {}", names(new)),
            );
        }
    }

    fn shape(&mut self, old: &Shape, new: &Shape) {
        match (old, new) {
            (Shape::Group(old), Shape::Group(new)) => {
                self.presence(old.presence, new.presence);
                self.items("member", true, &old.members, &new.members);
            }
            (Shape::List(old), Shape::List(new)) => {
                self.count(old.count, new.count);
                self.item(&old.element, &new.element);
            }
            (Shape::Variant(old), Shape::Variant(new)) => {
                self.unsigned("the type of the tag", old.tag, new.tag);
                self.items("alternative", false, &old.alternatives, &new.alternatives);
            }
            (Shape::Array(old), Shape::Array(new)) => {
                self.dimensions(&old.dimensions, &new.dimensions);
                self.item(&old.element, &new.element);
            }
            (old, new) => self.field(old, new),
        }
    }
}

/// Pairs each old member's position with the position of its counterpart: the member with the same
/// name, otherwise one with the same layout at the same place.
fn pairs(old: &[Item], new: &[Item]) -> Vec<(usize, Option<usize>)> {
    let named = |item: &Item| new.iter().position(|other| other.name == item.name);
    let mut pairs: Vec<_> = old.iter().map(named).enumerate().collect();
    for position in 0..pairs.len() {
        let taken = |at: usize| old.iter().any(|item| item.name == new[at].name);
        let candidate = candidate(&pairs, position).filter(|&at| at < new.len() && !taken(at));
        if let Some(at) = candidate
            && pairs[position].1.is_none()
            && same_shape_on_wire(&old[position].shape, &new[at].shape)
        {
            pairs[position].1 = Some(at);
        }
    }
    pairs
}

/// The expected position of a renamed member: after its predecessor.
fn candidate(pairs: &[(usize, Option<usize>)], position: usize) -> Option<usize> {
    match position.checked_sub(1) {
        None => Some(0),
        Some(before) => pairs[before].1.map(|at| at + 1),
    }
}

fn names(items: &[Item]) -> String {
    let names: Vec<_> = items
        .iter()
        .map(|item| format!("`{}`", item.name))
        .collect();
    names.join(", ")
}
