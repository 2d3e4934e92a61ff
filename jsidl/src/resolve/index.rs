//! Finds type sets, constant sets and services by URN and version.
//!
//! Published directories carry copies of each other's sets under one identity. A reference means
//! the copy nearest to the referring file.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use crate::diagnostic::Report;
use crate::model::{Id, Version};
use crate::source::{Sources, Span};
use crate::spelling::nearest;
use crate::syntax::{ConstSet, Program, ServiceRef, TypeSet, TypeSetIndex};

/// Maximum number of copies of a set that are compared.
const MOST_COPIES: usize = 64;

/// Maximum number of URNs that are compared with an unknown one.
const MOST_COMPARED: usize = 1000;

/// Everything with an identity, by position in the [`Program`]; declarations of the sets by name.
pub(super) struct Index<'a> {
    pub(super) type_sets: Identities<'a>,
    pub(super) const_sets: Identities<'a>,
    pub(super) services: Identities<'a>,
    declarations: Vec<Names<'a>>,
    constants: Vec<Names<'a>>,
}

/// Positions in a set; the first of several declarations with one name.
type Names<'a> = HashMap<&'a str, usize>;

/// Declarations of one kind by URN and version.
#[derive(Default)]
pub(super) struct Identities<'a>(BTreeMap<(&'a str, Version), Vec<(usize, Span)>>);

impl<'a> Index<'a> {
    pub(super) fn new(program: &'a Program) -> Self {
        let type_sets = program.type_sets.iter().map(|s| (s.id.as_ref(), s.span));
        let const_sets = program.const_sets.iter().map(|s| (s.id.as_ref(), s.span));
        let services = program.services.iter();
        let services = services.map(|s| (Some(&s.id).filter(|_| s.sound), s.span));
        let declared = |set: &'a TypeSet| set.declarations.iter().map(|d| d.name.as_str());
        let defined = |set: &'a ConstSet| set.definitions.iter().map(|d| d.name.as_str());
        Self {
            type_sets: Identities::new(type_sets),
            const_sets: Identities::new(const_sets),
            services: Identities::new(services),
            declarations: program
                .type_sets
                .iter()
                .map(|s| names(declared(s)))
                .collect(),
            constants: program
                .const_sets
                .iter()
                .map(|s| names(defined(s)))
                .collect(),
        }
    }

    /// Position of a declaration in a type set.
    pub(super) fn declaration(&self, set: TypeSetIndex, name: &str) -> Option<usize> {
        self.declarations[set].get(name).copied()
    }

    /// Position of a constant in a constant set.
    pub(super) fn constant(&self, set: usize, name: &str) -> Option<usize> {
        self.constants[set].get(name).copied()
    }

    /// Warns of duplicate sets of which neither is nearer.
    pub(super) fn report_copies(&self, sources: &Sources, report: &mut Report) {
        self.type_sets.report_copies("type set", sources, report);
        self.const_sets
            .report_copies("constant set", sources, report);
    }
}

impl<'a> Identities<'a> {
    fn new(found: impl Iterator<Item = (Option<&'a Id>, Span)>) -> Self {
        let mut identities = Self::default();
        for (position, (id, span)) in found.enumerate() {
            let Some(id) = id else { continue };
            let copies = identities.0.entry((&id.urn, id.version)).or_default();
            if copies.len() < MOST_COPIES {
                copies.push((position, span));
            }
        }
        identities
    }

    /// The declaration loaded first.
    pub(super) fn first(&self, id: &Id) -> Option<usize> {
        self.copies(id).first().map(|(position, _)| *position)
    }

    /// The service that a reference means: of several versions the newest.
    pub(super) fn service(&self, reference: &ServiceRef) -> Option<usize> {
        let id = self.newest(reference)?;
        self.first(&id)
    }

    /// The identity that a reference means: of several versions the newest.
    pub(super) fn newest(&self, reference: &ServiceRef) -> Option<Id> {
        let ids = self.versions(&reference.urn).map(|version| Id {
            urn: reference.urn.clone(),
            version,
        });
        ids.filter(|id| reference.admits(id)).last()
    }

    /// All versions of a URN, the oldest first.
    fn versions<'s>(&'s self, urn: &'s str) -> impl Iterator<Item = Version> + 's {
        let least = Version { major: 0, minor: 0 };
        let greatest = Version {
            major: u8::MAX,
            minor: u8::MAX,
        };
        let versions = self.0.range((urn, least)..=(urn, greatest));
        versions.map(|((_, version), _)| *version)
    }

    /// The declaration nearest to the referring file; the first of equally near ones.
    pub(super) fn nearest(&self, id: &Id, from: Span, sources: &Sources) -> Option<usize> {
        let copies = self.copies(id);
        if let [(only, _)] = copies {
            return Some(*only);
        }
        let home = sources.path(from);
        let nearest = copies.iter().min_by_key(|(_, span)| {
            let steps = steps(home, sources.path(*span));
            (!span.same_file(from), steps)
        });
        nearest.map(|(position, _)| *position)
    }

    /// Advice for a reference to a missing declaration.
    pub(super) fn advice(&self, urn: &str) -> String {
        let versions: Vec<_> = self.versions(urn).map(|it| it.to_string()).collect();
        if !versions.is_empty() {
            return format!("only its version {} is loaded", versions.join(", "));
        }
        let known = self.0.keys().map(|(known, _)| *known);
        // Limits the time spent on a hint.
        match nearest(urn, known.take(MOST_COMPARED)) {
            Some(urn) => format!("did you mean `{urn}`?"),
            None => "load the file that declares it as well".into(),
        }
    }

    fn copies<'s>(&'s self, id: &'s Id) -> &'s [(usize, Span)] {
        let copies = self.0.get(&(&*id.urn, id.version));
        copies.map_or(&[], Vec::as_slice)
    }

    fn report_copies(&self, what: &str, sources: &Sources, report: &mut Report) {
        for ((urn, version), copies) in &self.0 {
            let mut homes = HashMap::new();
            for (_, span) in copies {
                let Some(first) = homes.insert(sources.path(*span).parent(), *span) else {
                    continue;
                };
                let message = format!(
                    "the {what} `{urn} {version}` is declared twice in this directory; the first \
                     one is used: remove one, or give it another id or version"
                );
                report.warning(*span, message).note(first, "the other one");
            }
        }
    }
}

fn names<'a>(names: impl Iterator<Item = &'a str>) -> Names<'a> {
    let mut positions = Names::new();
    for (position, name) in names.enumerate() {
        positions.entry(name).or_insert(position);
    }
    positions
}

/// Steps from one file to another through the directory tree.
fn steps(from: &Path, to: &Path) -> usize {
    let common = from
        .components()
        .zip(to.components())
        .take_while(|(a, b)| a == b)
        .count();
    from.components().count() + to.components().count() - 2 * common
}
