//! Finds type sets, constant sets and services by URN and version.
//!
//! Published directories carry copies of each other's sets under one identity. Among copies the
//! one nearest to the file that asks is meant.

use std::collections::HashMap;
use std::path::Path;

use crate::model::Id;
use crate::source::{Sources, Span};
use crate::syntax::Program;

/// Everything that has an identity, by position in the [`Program`].
pub(super) struct Index<'a> {
    type_sets: Positions<'a>,
    const_sets: Positions<'a>,
    services: Positions<'a>,
}

type Positions<'a> = HashMap<&'a Id, Vec<(usize, Span)>>;

impl<'a> Index<'a> {
    pub(super) fn new(program: &'a Program) -> Self {
        let identified = program
            .type_sets
            .iter()
            .map(|s| s.id.as_ref().map(|id| (id, s.span)));
        let type_sets = positions(identified);
        let identified = program
            .const_sets
            .iter()
            .map(|s| s.id.as_ref().map(|id| (id, s.span)));
        let const_sets = positions(identified);
        let services = positions(program.services.iter().map(|s| Some((&s.id, s.span))));
        Self {
            type_sets,
            const_sets,
            services,
        }
    }

    pub(super) fn type_set(&self, id: &Id, from: Span, sources: &Sources) -> Option<usize> {
        nearest(self.type_sets.get(id)?, from, sources)
    }

    pub(super) fn const_set(&self, id: &Id, from: Span, sources: &Sources) -> Option<usize> {
        nearest(self.const_sets.get(id)?, from, sources)
    }

    /// The service that counts under this identity: the one loaded first.
    pub(super) fn service(&self, id: &Id) -> Option<usize> {
        self.services.get(id)?.first().map(|(index, _)| *index)
    }

    /// The versions under which something is loaded as `what` says.
    pub(super) fn versions_of_type_set(&self, urn: &str) -> Vec<String> {
        versions(&self.type_sets, urn)
    }

    /// As [`versions_of_type_set`](Self::versions_of_type_set).
    pub(super) fn versions_of_const_set(&self, urn: &str) -> Vec<String> {
        versions(&self.const_sets, urn)
    }

    /// As [`versions_of_type_set`](Self::versions_of_type_set).
    pub(super) fn versions_of_service(&self, urn: &str) -> Vec<String> {
        versions(&self.services, urn)
    }
}

fn positions<'a>(found: impl Iterator<Item = Option<(&'a Id, Span)>>) -> Positions<'a> {
    let mut positions = Positions::new();
    for (index, found) in found.enumerate() {
        if let Some((id, span)) = found {
            positions.entry(id).or_default().push((index, span));
        }
    }
    positions
}

fn versions(positions: &Positions<'_>, urn: &str) -> Vec<String> {
    let mut found: Vec<_> = positions
        .keys()
        .filter(|id| &*id.urn == urn)
        .map(|id| id.version)
        .collect();
    found.sort_unstable();
    found
        .into_iter()
        .map(|version| version.to_string())
        .collect()
}

fn nearest(candidates: &[(usize, Span)], from: Span, sources: &Sources) -> Option<usize> {
    if let [(only, _)] = candidates {
        return Some(*only);
    }
    let home = sources.path(from);
    let distance = |span: Span| -> usize {
        if span.same_file(from) {
            return 0;
        }
        steps(home, sources.path(span))
    };
    // The first of those that are equally near.
    candidates
        .iter()
        .min_by_key(|(_, span)| distance(*span))
        .map(|(index, _)| *index)
}

/// Steps from one file to another through the tree of directories.
fn steps(from: &Path, to: &Path) -> usize {
    let common = from
        .components()
        .zip(to.components())
        .take_while(|(a, b)| a == b)
        .count();
    from.components().count() + to.components().count() - 2 * common
}
