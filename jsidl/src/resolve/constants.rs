//! Computes constant expressions.

use super::{Memo, Resolver};
use crate::check;
use crate::expr::Value;
use crate::model::Number;
use crate::source::Span;
use crate::syntax::{ConstSet, Constant, Expr, SetRef, TypeSetIndex};

/// The constant sets visible to an expression.
#[derive(Debug, Clone, Copy)]
enum Scope {
    TypeSet(TypeSetIndex),
    ConstSet(usize),
}

impl Resolver<'_> {
    /// Computes an expression of a type set.
    pub(super) fn value(&mut self, scope: TypeSetIndex, expression: &Expr) -> Option<Value> {
        self.evaluate(Scope::TypeSet(scope), expression)
    }

    /// As [`value`](Self::value), for an attribute that must be an integer.
    pub(super) fn integer(
        &mut self,
        scope: TypeSetIndex,
        expression: &Expr,
        attribute: &str,
    ) -> Option<i128> {
        let value = self.value(scope, expression)?;
        let integer = value.integer();
        if integer.is_none() {
            self.report.error(
                expression.span,
                format!("`{attribute}` is {}, but must be an integer", value.real()),
            );
        }
        integer
    }

    /// Computes all constants of a set, used or not.
    pub(super) fn const_set(&mut self, set: usize) {
        let definitions = &self.program.const_sets[set].definitions;
        let names = definitions.iter().map(|d| (d.name.as_str(), d.span));
        self.report.unique("constants", names);
        for definition in definitions {
            if let Some(units) = &definition.units {
                check::units(self.report, units);
            }
        }
        for position in 0..definitions.len() {
            // The faulty constant is already reported.
            let _ = self.constant(set, position);
        }
    }

    fn evaluate(&mut self, scope: Scope, expression: &Expr) -> Option<Value> {
        let span = expression.span;
        let mut lookup = |path: &[String]| self.constant_named(scope, path, span);
        match expression.value.evaluate(&mut lookup) {
            Ok(value) => Some(value),
            Err(None) => None,
            Err(Some(reason)) => {
                self.report
                    .error(span, format!("cannot evaluate this: {reason}"));
                None
            }
        }
    }

    fn constant_named(&mut self, scope: Scope, path: &[String], span: Span) -> Option<Value> {
        let found = match path {
            [name] => self.own_constants(scope).map(|set| (set, name)),
            [alias, name] => self.aliased_constants(scope, alias)?.map(|set| (set, name)),
            _ => None,
        };
        let position = found.and_then(|(set, name)| Some((set, self.index.constant(set, name)?)));
        let Some((set, position)) = position else {
            let path = path.join(".");
            self.report.error(
                span,
                format!(
                    "the constant `{path}` is not declared: declare it in a \
                     `declared_const_set` and refer to that with `declared_const_set_ref`"
                ),
            );
            return None;
        };
        let definition = &self.program.const_sets[set].definitions[position];
        if matches!(definition.value, Constant::Text) {
            let path = path.join(".");
            let message = format!("the constant `{path}` is a text: use a number here");
            self.report
                .error(span, message)
                .note(definition.span, "declared here");
            return None;
        }
        if matches!(self.constants.get(&(set, position)), Some(Memo::Active)) {
            let path = path.join(".");
            self.report
                .error(span, format!("the constant `{path}` is defined by itself"));
            return None;
        }
        if self.nesting >= super::DEEPEST {
            self.too_deep(span);
            return None;
        }
        self.nesting += 1;
        let value = self.constant(set, position);
        self.nesting -= 1;
        value
    }

    fn own_constants(&self, scope: Scope) -> Option<usize> {
        match scope {
            Scope::TypeSet(set) => self.program.type_sets[set].constants,
            Scope::ConstSet(set) => Some(set),
        }
    }

    /// The set with this alias: `None` if it is not loaded (reported), `Some(None)` if there is no
    /// such alias.
    fn aliased_constants(&mut self, scope: Scope, alias: &str) -> Option<Option<usize>> {
        let program = self.program;
        let own = self.own_constants(scope);
        if let Some(own) = own.filter(|&set| program.const_sets[set].name == alias) {
            return Some(Some(own));
        }
        let references: &[SetRef] = match scope {
            Scope::TypeSet(set) => &program.type_sets[set].const_sets,
            Scope::ConstSet(set) => &program.const_sets[set].const_sets,
        };
        let Some(reference) = references.iter().find(|r| r.name == alias) else {
            return Some(None);
        };
        let found = self
            .index
            .const_sets
            .nearest(&reference.id, reference.span, self.sources);
        if found.is_none() {
            let advice = self.index.const_sets.advice(&reference.id.urn);
            self.missing_set(reference, "constant set", &advice);
        }
        found.map(Some)
    }

    fn constant(&mut self, set: usize, position: usize) -> Option<Value> {
        match self.constants.get(&(set, position)) {
            Some(Memo::Done(value)) => return Some(*value),
            Some(Memo::Faulty | Memo::Active) => return None,
            Some(Memo::Unseen) | None => {}
        }
        self.constants.insert((set, position), Memo::Active);
        let const_set: &ConstSet = &self.program.const_sets[set];
        let definition = &const_set.definitions[position];
        let value = match &definition.value {
            Constant::Number(number, expression) => self
                .evaluate(Scope::ConstSet(set), expression)
                .filter(|value| self.fits(*value, *number, expression.span)),
            Constant::Text => None,
        };
        let memo = value.map_or(Memo::Faulty, Memo::Done);
        self.constants.insert((set, position), memo);
        value
    }

    fn fits(&mut self, value: Value, number: Number, span: Span) -> bool {
        let Some((least, greatest)) = number.integers() else {
            return true;
        };
        let fits = value
            .integer()
            .is_some_and(|i| (least..=greatest).contains(&i));
        if !fits {
            self.report.error(
                span,
                format!(
                    "the value of the constant is not an integer from {least} to \
                     {greatest}, as its `const_type` says"
                ),
            );
        }
        fits
    }
}
