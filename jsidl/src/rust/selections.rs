//! Finds which optional fields of a report the presence vectors of its query request.
//!
//! The definitions say it by names. Bit *i* of a vector is the *i*-th optional field
//!
//! * of the report itself, or else of the only record with optional fields that every report
//!   contains, or else of the only one in its lists and variants: for `PresenceVector` and
//!   `QueryPresenceVector`;
//! * of the same in the member of the report with the name before `PresenceVector`, or with a name
//!   that contains it: for `VelocityVarPresenceVector` and the like. In the alternatives of a
//!   variant, fields with one name must have one bit.
//!
//! A query that is a list of records, each with a vector, requests the fields of the report's
//! element with the same first field, which is the number of a sensor.
//!
//! Other vectors remain plain numbers: those for several records of a report, signed ones, and those
//! in a list whose record another query uses, too.

use super::layout::{Layout, unsigned_bits};
use super::types::{Field, Kind, Type};
use crate::model::Unsigned;

/// A presence vector of a query, and the fields of the report that it requests.
pub(super) struct Selection<'m> {
    /// The query's member.
    pub(super) vector: String,
    /// The part of the report in the vector's name; empty if it is the whole report.
    pub(super) stem: String,
    /// The records with the fields: one, or the alternatives of a variant.
    pub(super) records: Vec<Record<'m>>,
}

/// A record of a report with a presence vector.
#[derive(Clone)]
pub(super) struct Record<'m> {
    /// The way from the report to the record.
    pub(super) steps: Vec<Step>,
    /// Whether every report contains it.
    is_always_there: bool,
    /// The optional fields, by bit: name in the definition, and member.
    pub(super) fields: Vec<(&'m str, String)>,
}

/// A step from a report to a record in it.
#[derive(Clone, PartialEq)]
pub(super) enum Step {
    /// To a member.
    Member(String),
    /// To each element of a list.
    Each,
    /// To the content of an alternative: the enum, and the alternative if there are others.
    Alternative { path: String, is_only: bool },
}

/// The selections by the presence vectors among some fields of a query.
pub(super) fn selections<'m>(query: &[Field<'m>], report: &Layout<'m>) -> Vec<Selection<'m>> {
    let of_vector = |field: &Field<'m>| {
        let bits = unsigned_bits(field.item)?;
        let stem = field.item.name.strip_suffix("PresenceVector")?;
        let stem = if stem == "Query" { "" } else { stem };
        let records = requested(report, stem)?;
        let fits = |it: &Record<'_>| (1..=bits).contains(&it.fields.len());
        records.iter().all(fits).then(|| Selection {
            vector: field.ident.clone(),
            stem: stem.to_owned(),
            records,
        })
    };
    query.iter().filter_map(of_vector).collect()
}

impl<'m> Selection<'m> {
    /// The requestable fields by name, with their bits.
    pub(super) fn fields(&self) -> Vec<(&'m str, usize)> {
        let mut fields: Vec<(&str, usize)> = Vec::new();
        for record in &self.records {
            let numbered = record.fields.iter().zip(0..);
            let named = numbered.map(|((name, _), bit)| (*name, bit));
            for field in named {
                if !fields.contains(&field) {
                    fields.push(field);
                }
            }
        }
        fields
    }
}

/// The records that a vector means, if the definition determines them.
fn requested<'m>(report: &Layout<'m>, stem: &str) -> Option<Vec<Record<'m>>> {
    let mut found = Vec::new();
    if stem.is_empty() {
        find(
            report,
            &report.fields,
            report.presence,
            &(Vec::new(), true),
            &mut found,
        );
        if report.presence.is_some() {
            found.truncate(1);
        }
    } else {
        let exactly = report.fields.iter().filter(|it| it.item.name == stem);
        let containing = report
            .fields
            .iter()
            .filter(|it| it.item.name.contains(stem));
        let member = match exactly.count() {
            0 => single(containing)?,
            _ => report.fields.iter().find(|it| it.item.name == stem)?,
        };
        find_in_member(report, member, &(Vec::new(), true), &mut found);
    }
    let always: Vec<_> = found
        .iter()
        .filter(|it| it.is_always_there)
        .cloned()
        .collect();
    let records = if always.is_empty() { found } else { always };
    let selection = Selection {
        vector: String::new(),
        stem: String::new(),
        records,
    };
    let fields = selection.fields();
    let is_ambiguous =
        |(place, (name, _)): (usize, &(&str, _))| fields[..place].iter().any(|it| it.0 == *name);
    let is_clear =
        are_alternatives(&selection.records) && !fields.iter().enumerate().any(is_ambiguous);
    is_clear.then_some(selection.records)
}

fn single<T>(mut items: impl Iterator<Item = T>) -> Option<T> {
    items.next().filter(|_| items.next().is_none())
}

/// Whether there is one record, or all are alternatives of one variant.
fn are_alternatives(records: &[Record<'_>]) -> bool {
    let mut of = records
        .iter()
        .map(|record| match record.steps.split_last() {
            Some((Step::Alternative { .. }, before)) => Some(before),
            _ => None,
        });
    match of.next() {
        None => false,
        Some(_) if records.len() == 1 => true,
        Some(first) => first.is_some() && of.all(|it| it == first),
    }
}

/// The steps so far, and whether every report contains what they lead to.
type Way = (Vec<Step>, bool);

fn with(way: &Way, step: Step, is_always_there: bool) -> Way {
    let mut steps = way.0.clone();
    steps.push(step);
    (steps, way.1 && is_always_there)
}

/// Finds the records with presence vectors among the fields of a record.
fn find<'m>(
    report: &Layout<'m>,
    fields: &[Field<'m>],
    presence: Option<Unsigned>,
    way: &Way,
    found: &mut Vec<Record<'m>>,
) {
    if presence.is_some() {
        let optional = fields.iter().filter(|field| field.item.optional);
        let named = optional.map(|field| (&*field.item.name, field.ident.clone()));
        found.push(Record {
            steps: way.0.clone(),
            is_always_there: way.1,
            fields: named.collect(),
        });
    }
    for field in fields.iter().filter(|field| !field.item.optional) {
        find_in_member(report, field, way, found);
    }
}

fn find_in_member<'m>(
    report: &Layout<'m>,
    member: &Field<'m>,
    way: &Way,
    found: &mut Vec<Record<'m>>,
) {
    let way = with(way, Step::Member(member.ident.clone()), true);
    find_in_type(report, &member.ty, &way, found);
}

fn find_in_type<'m>(report: &Layout<'m>, ty: &Type, way: &Way, found: &mut Vec<Record<'m>>) {
    if let Type::List { element, .. } = ty {
        return find_in_type(report, element, &with(way, Step::Each, false), found);
    }
    match report.definition(ty) {
        Some(Kind::Struct { group, fields, .. }) => {
            find(report, fields, group.presence, way, found);
        }
        Some(Kind::Variant { alternatives, .. }) => {
            let Type::Composite { ident, .. } = ty else {
                return;
            };
            for alternative in alternatives {
                let step = Step::Alternative {
                    path: format!("{ident}::{}", alternative.ident),
                    is_only: alternatives.len() == 1,
                };
                find_in_type(report, &alternative.ty, &with(way, step, false), found);
            }
        }
        _ => {}
    }
}
