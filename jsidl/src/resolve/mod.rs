//! From syntax to meaning: follows every reference, computes every constant and builds the
//! [`model`](crate::model), asking [`check`](crate::check) on the way.
//!
//! Every declaration is resolved once and remembered, whoever refers to it, so that a mistake is
//! reported once. What is wrong is `None` from then on; what depends on it is left out.

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

use crate::check;
use crate::diagnostic::Report;
use crate::expr::Value;
use crate::library::Library;
use crate::model::{Id, Item, Location, Message};
use crate::source::{Sources, Span};
use crate::syntax::{Program, TypeSetIndex};

use index::Index;

/// Composites within each other, references followed; published definitions need 9.
const DEEPEST: usize = 32;

/// Services that inherit from each other in a row; published definitions need 7.
const LONGEST_LINEAGE: usize = 32;

/// How many items references may add to what is written: a few lines that double their size with
/// each step must not fill the memory. All published definitions together need 5 000.
const MOST_ITEMS: usize = 200_000;

/// Resolves everything that was read. What is sound comes back, what is not is in the report.
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
    /// Services that are there but cannot be kept.
    lost: HashSet<&'a Id>,
    /// Places about which something has been said that is to be said once.
    complained: HashSet<Span>,
    nesting: usize,
    /// `None` once the limit has been exceeded and reported.
    items_left: Option<usize>,
}

/// What is known of a declaration.
#[derive(Debug, Clone)]
enum Memo<T> {
    Unseen,
    /// Being resolved: whoever meets it now goes round in a circle.
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
}

/// An item with what it costs to copy it, see [`item::measure`].
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

    /// Whether this is the first complaint about a place.
    fn first_complaint(&mut self, span: Span) -> bool {
        self.complained.insert(span)
    }

    /// Resolves every declaration, so that mistakes in unused ones are found too, and before any
    /// service uses them.
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
        check::unique(self.report, "declarations", names);
        for declaration in 0..set.declarations.len() {
            // A declaration that is wrong has been reported.
            let _ = self.declaration(index, declaration);
        }
    }
}
