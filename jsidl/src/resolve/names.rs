//! Walks dotted names: every part but the last is a local alias of a set; the last one is a
//! declaration in that set.

use std::rc::Rc;

use super::{Memo, Resolved, Resolver};
use crate::source::Span;
use crate::syntax::{Construct, DeclarationKind, SetRef, Target, TypeSetIndex};

/// Maximum length of a chain of references.
const LONGEST_CHAIN: usize = super::DEEPEST;

impl<'a> Resolver<'a> {
    /// Resolves the target of a reference. `None` if that is impossible, which is reported.
    pub(super) fn follow(&mut self, scope: TypeSetIndex, target: &Target) -> Option<Resolved> {
        let (set, position) = self.find(scope, target)?;
        let declaration = &self.program.type_sets[set].declarations[position];
        let actual = declaration.kind.construct();
        if actual.is_some_and(|actual| actual != target.construct) {
            let (path, wanted) = (&target.path.value, target.construct.element());
            let actual = actual.map_or("", Construct::element);
            self.report
                .error(
                    target.path.span,
                    format!(
                        "`{path}` is a `{actual}`: refer to it with `declared_{actual}`, or \
                         name a `{wanted}`"
                    ),
                )
                .note(declaration.span, "declared here");
            return None;
        }
        if self.nesting >= LONGEST_CHAIN {
            self.too_deep(target.path.span);
            return None;
        }
        if matches!(self.declarations[set][position], Memo::Active) {
            let path = &target.path.value;
            self.report
                .error(
                    target.path.span,
                    format!("`{path}` contains itself, which makes it infinite: break the cycle"),
                )
                .note(declaration.span, "declared here");
            return None;
        }
        self.nesting += 1;
        let resolved = self.declaration(set, position);
        self.nesting -= 1;
        resolved
    }

    /// Resolves a declaration of a type set and memoises the result.
    pub(super) fn declaration(&mut self, set: TypeSetIndex, position: usize) -> Option<Resolved> {
        match &self.declarations[set][position] {
            Memo::Done(resolved) => return Some(resolved.clone()),
            Memo::Faulty | Memo::Active => return None,
            Memo::Unseen => {}
        }
        self.declarations[set][position] = Memo::Active;
        let declaration = &self.program.type_sets[set].declarations[position];
        let resolved = match &declaration.kind {
            DeclarationKind::Message(message) => self
                .message(set, declaration, message)
                .map(Resolved::Message),
            DeclarationKind::Event(event) => self.event(set, event).map(|()| Resolved::Event),
            DeclarationKind::Section(_, section) => {
                self.section(set, section).map(Resolved::Section)
            }
            DeclarationKind::Node(node) => self.whole(set, node).map(Resolved::Node),
            DeclarationKind::Values(values) => self
                .value_set(set, values)
                .map(|values| Resolved::Values(Rc::new(values))),
            DeclarationKind::Reference(target) => self.follow(set, target),
            DeclarationKind::Faulty => None,
        };
        let resolved = resolved.filter(|_| declaration.sound);
        self.declarations[set][position] = resolved.clone().map_or(Memo::Faulty, Memo::Done);
        resolved
    }

    fn find(&mut self, scope: TypeSetIndex, target: &Target) -> Option<(TypeSetIndex, usize)> {
        let (path, span) = (target.path.value.as_str(), target.path.span);
        let (aliases, name) = path.rsplit_once('.').map_or(("", path), |(a, n)| (a, n));
        let mut set = scope;
        for alias in aliases.split('.').filter(|_| !aliases.is_empty()) {
            set = self.aliased_type_set(set, alias, path, span)?;
        }
        if let Some(position) = self.index.declaration(set, name) {
            return Some((set, position));
        }
        let declarations = &self.program.type_sets[set].declarations;
        // Limits the time spent on a hint.
        let similar = declarations
            .iter()
            .take(1000)
            .find(|d| d.name.eq_ignore_ascii_case(name));
        let advice = match similar {
            Some(similar) => format!("did you mean `{}`?", similar.name),
            None => "declare it, or correct the name".into(),
        };
        let set = &self.program.type_sets[set];
        self.report
            .error(span, format!("`{path}` is not declared: {advice}"))
            .note(set.span, format!("the type set searched for `{name}`"));
        None
    }

    fn aliased_type_set(
        &mut self,
        set: TypeSetIndex,
        alias: &str,
        path: &str,
        span: Span,
    ) -> Option<TypeSetIndex> {
        let own = &self.program.type_sets[set];
        let reference = own.type_sets.iter().find(|r| r.name == alias);
        let Some(reference) = reference.or_else(|| self.borrowed(set, alias)) else {
            self.report
                .error(
                    span,
                    format!(
                        "`{path}` is not declared: there is no `declared_type_set_ref` \
                         named `{alias}`"
                    ),
                )
                .note(own.span, "the type set searched");
            return None;
        };
        let found = self.referenced(reference);
        if found.is_none() {
            let advice = self.index.type_sets.advice(&reference.id.urn);
            self.missing_set(reference, "type set", &advice);
        }
        found
    }

    /// An alias that the set does not declare, but one of the sets that it refers to does.
    /// Published definitions rely on this, so it is a warning.
    fn borrowed(&mut self, set: TypeSetIndex, alias: &str) -> Option<&'a SetRef> {
        let program = self.program;
        let own = &program.type_sets[set];
        let lenders = own.type_sets.iter().filter_map(|r| self.referenced(r));
        let mut aliases = lenders.flat_map(|lender| &program.type_sets[lender].type_sets);
        let reference = aliases.find(|r| r.name == alias)?;
        if self.first_complaint(own.span) {
            self.report
                .warning(
                    own.span,
                    format!(
                        "the alias `{alias}` is declared only in a referenced set: add a \
                         `declared_type_set_ref` for it here"
                    ),
                )
                .note(reference.span, "declared here");
        }
        Some(reference)
    }

    fn referenced(&self, reference: &SetRef) -> Option<TypeSetIndex> {
        self.index
            .type_sets
            .nearest(&reference.id, reference.span, self.sources)
    }

    /// Reports a set that is not loaded, once per reference.
    pub(super) fn missing_set(&mut self, reference: &SetRef, what: &str, advice: &str) {
        if self.first_complaint(reference.span) {
            let message = format!("the {what} `{}` is not loaded: {advice}", reference.id);
            self.report.error(reference.span, message);
        }
    }

    /// Reports definitions that are nested too deeply.
    pub(super) fn too_deep(&mut self, span: Span) {
        let limit = super::DEEPEST;
        self.report.error(
            span,
            format!("composites and references are nested more than {limit} deep: flatten them"),
        );
    }
}
