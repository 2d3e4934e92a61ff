//! Resolves the syntax tree: follows every reference, computes every constant and builds the
//! [`model`](crate::model), which [`check`](crate::check) validates on the way.
//!
//! Every declaration is resolved once and memoised, so a mistake is reported once. A faulty
//! declaration is `None` from then on, and its dependents are left out.

mod constants;
mod field;
mod index;
mod item;
mod message;
mod names;
mod service;

use std::collections::{HashMap, HashSet};
use std::rc::Rc;
use std::sync::Arc;

use crate::check::Placed;
use crate::diagnostic::Report;
use crate::expr::Value;
use crate::library::Library;
use crate::model::{Id, Item, Location, Message};
use crate::source::{Sources, Span};
use crate::syntax::{Program, TypeSetIndex};

use index::Index;

/// Maximum depth of composites and references; published definitions need 9.
const DEEPEST: usize = 32;

/// Maximum length of an inheritance chain; published definitions need 7.
const LONGEST_LINEAGE: usize = 32;

/// Maximum number of items added by references: a few lines that double their size with each step
/// must not exhaust memory. All published definitions together need 5 000.
const MOST_ITEMS: usize = 200_000;

/// Resolves a whole program. Returns the sound services and reports all mistakes.
pub(crate) fn resolve(program: &Program, sources: &Sources, report: &mut Report) -> Library {
    let lost = program.services.iter().filter(|service| !service.sound);
    let mut resolver = Resolver {
        program,
        sources,
        report,
        index: Index::new(program),
        declarations: program
            .type_sets
            .iter()
            .map(|set| vec![Memo::Unseen; set.declarations.len()])
            .collect(),
        constants: HashMap::new(),
        lost: lost.map(|service| &service.id).collect(),
        complained: HashSet::new(),
        nesting: 0,
        items_left: Some(MOST_ITEMS),
    };
    resolver.index.report_copies(sources, resolver.report);
    resolver.sets();
    resolver.library()
}

struct Resolver<'a> {
    program: &'a Program,
    sources: &'a Sources,
    report: &'a mut Report,
    index: Index<'a>,
    /// By type set, then by position in it.
    declarations: Vec<Vec<Memo<Resolved>>>,
    /// By constant set and position in it.
    constants: HashMap<(usize, usize), Memo<Value>>,
    /// Services that exist but cannot be kept.
    lost: HashSet<&'a Id>,
    /// Positions with a complaint that must not be repeated.
    complained: HashSet<Span>,
    nesting: usize,
    /// `None` once the limit has been exceeded and reported.
    items_left: Option<usize>,
}

/// Resolution state of a declaration.
#[derive(Debug, Clone)]
enum Memo<T> {
    Unseen,
    /// Being resolved; a reference to it closes a cycle.
    Active,
    Faulty,
    Done(T),
}

/// A resolved declaration.
#[derive(Debug, Clone)]
enum Resolved {
    Node(Rc<Whole>),
    /// The content of a header, body or footer.
    Section(Option<Rc<Whole>>),
    Message(Arc<Message>),
    Event,
    Values(Rc<Placed>),
}

/// An item with its copy cost, see [`item::measure`].
#[derive(Debug)]
struct Whole {
    item: Item,
    items: usize,
    height: usize,
}

impl Resolver<'_> {
    fn location(&self, span: Span) -> Location {
        self.sources.location(span)
    }

    /// Whether this is the first complaint about a position.
    fn first_complaint(&mut self, span: Span) -> bool {
        self.complained.insert(span)
    }

    /// Resolves every declaration before any service uses it, so that mistakes in unused ones are
    /// found too.
    fn sets(&mut self) {
        for set in 0..self.program.type_sets.len() {
            self.type_set(set);
        }
        for set in 0..self.program.const_sets.len() {
            self.const_set(set);
        }
    }

    fn type_set(&mut self, index: TypeSetIndex) {
        let set = &self.program.type_sets[index];
        let names = set.declarations.iter().map(|d| (d.name.as_str(), d.span));
        self.report.unique("declarations", names);
        for declaration in 0..set.declarations.len() {
            // A faulty declaration is already reported.
            let _ = self.declaration(index, declaration);
        }
    }
}
