//! Generates the pairs of queries and reports, and the builders of presence vectors.

use std::collections::HashMap;

use super::ident::Names;
use super::layout::Layout;
use super::plan::Plan;
use super::selections::{Record, Selection, Step, selections};
use super::structs::method_names;
use super::types::{Field, Kind, Type, shared_key};
use super::writer::Writer;
use crate::fingerprint;
use crate::heads::{Echo, echoes};
use crate::model::Item;

/// Implements `Query` if the message is a query with a report in the set. `shared` has the types
/// that are defined so far, with their paths.
pub(super) fn implement(
    out: &mut Writer,
    query: &Plan<'_>,
    plans: &[Plan<'_>],
    shared: &HashMap<String, String>,
) {
    let Some(report) = report(query, plans) else {
        return;
    };
    let (path, types) = match report.names_in(query.version) {
        Some([ident, module]) => (ident.to_owned(), module.to_owned()),
        None => (
            format!("super::{}", report.definition()),
            format!("super::{}", report.module_path()),
        ),
    };
    let layouts = Layout::of(query.message).zip(Layout::of(report.message));
    let request = layouts
        .as_ref()
        .and_then(|(query, report)| Request::of(query, report));
    out.gap();
    let dropping = request.as_ref().filter(|it| it.drops());
    let echoes = echoes(query.message, report.message);
    let head = format!(
        "impl codec::Query for {} {{ type Report = {path};",
        query.ident
    );
    if dropping.is_none() && echoes.is_empty() {
        out.push(format!("{head} }}"));
    } else {
        out.push(head);
        write_echoes(out, &echoes);
        if let Some(request) = dropping {
            request.drop_unrequested(out, &path, &format!("{types}::"));
        }
        out.push("}");
    }
    match request {
        Some(Request {
            selections,
            has_more,
            list: None,
            names,
        }) => Builder::new(&selections, has_more).write(out, &query.ident, &path, names),
        Some(Request {
            selections,
            has_more,
            list: Some(list),
            names,
        }) if list.is_defined_in(query, shared) => {
            let ident = format!("{}::{}", query.module, list.ident);
            Builder::new(&selections, has_more).write(out, &ident, &path, names);
        }
        _ => {}
    }
}

fn write_echoes(out: &mut Writer, echoes: &[Echo]) {
    if echoes.is_empty() {
        return;
    }
    let echoes = echoes.iter().map(|it| {
        format!(
            "codec::Echo {{ query: {}, report: {}, octets: {} }}",
            it.query, it.report, it.octets
        )
    });
    let echoes: Vec<_> = echoes.collect();
    out.list("const ECHOES: &'static [codec::Echo] = &[", &echoes, "];");
}

/// The report of a query, declared by a service that declares the query. Of several layouts the newest,
/// which comes first.
pub(super) fn report<'p, 'm>(query: &Plan<'m>, plans: &'p [Plan<'m>]) -> Option<&'p Plan<'m>> {
    let report = query.report?;
    plans.iter().find(|plan| {
        let mut services = plan.services.iter();
        plan.message.name == report && services.any(|service| query.services.contains(service))
    })
}

/// The query that a report answers.
pub(super) fn query_of<'p, 'm>(report: &Plan<'m>, plans: &'p [Plan<'m>]) -> Option<&'p Plan<'m>> {
    let answers =
        |query: &&Plan<'m>| self::report(query, plans).is_some_and(|it| it.path() == report.path());
    plans.iter().find(answers)
}

/// The presence vectors of a query.
struct Request<'m> {
    selections: Vec<Selection<'m>>,
    /// Whether the record with the vectors has other members.
    has_more: bool,
    /// The query's list, if the vectors are in its elements.
    list: Option<List<'m>>,
    /// The methods that the record has besides.
    names: Names,
}

/// The list of a query whose elements have presence vectors.
struct List<'m> {
    /// The query's member.
    member: String,
    /// The type of the elements, and their definition.
    ident: String,
    element: &'m Item,
    /// How the elements of query and report identify each other, if the definition says so.
    keys: Option<[String; 2]>,
}

impl<'m> Request<'m> {
    fn of(query: &Layout<'m>, report: &Layout<'m>) -> Option<Self> {
        let own = selections(&query.fields, report);
        if !own.is_empty() {
            return Some(Self {
                has_more: query.fields.len() > own.len(),
                selections: own,
                list: None,
                names: method_names(&query.fields),
            });
        }
        let [field] = &*query.fields else {
            return None;
        };
        let (ident, element, fields) = element(query, field)?;
        let selections = selections(fields, report);
        let list = List {
            member: field.ident.clone(),
            ident: ident.to_owned(),
            element,
            keys: fields.first().and_then(|key| keys(key, report)),
        };
        (!selections.is_empty()).then_some(Self {
            has_more: fields.len() > selections.len(),
            selections,
            list: Some(list),
            names: method_names(fields),
        })
    }

    /// Whether it is known which fields of the report a query does not request.
    fn drops(&self) -> bool {
        self.list.as_ref().is_none_or(|list| list.keys.is_some())
    }

    fn drop_unrequested(&self, out: &mut Writer, report: &str, types: &str) {
        out.gap();
        out.push(format!(
            "fn drop_unrequested(&self, report: &mut {report}) {{"
        ));
        for selection in &self.selections {
            for record in &selection.records {
                drop_fields(out, selection, record, self.list.as_ref(), types);
            }
        }
        out.push("}");
    }
}

impl List<'_> {
    /// Whether the type of the elements is the message's own. If it is defined by another message,
    /// that has the builder.
    fn is_defined_in(&self, query: &Plan<'_>, shared: &HashMap<String, String>) -> bool {
        let content = fingerprint::content(&self.element.shape);
        let path = shared.get(&shared_key(&self.element.name, &content));
        path.is_some_and(|path| *path == format!("{}::{}", query.module_path(), self.ident))
    }
}

/// The type of a list's elements, if it is a record: its name, its definition and its fields.
fn element<'l, 'm>(
    layout: &'l Layout<'m>,
    list: &'l Field<'m>,
) -> Option<(&'l str, &'m Item, &'l [Field<'m>])> {
    let Type::List { element, .. } = &list.ty else {
        return None;
    };
    let (Type::Composite { ident, .. } | Type::Record { ident, .. }) = &**element else {
        return None;
    };
    match layout.definition(element)? {
        Kind::Struct { item, fields, .. } => Some((ident, item, fields)),
        _ => None,
    }
}

/// The members by which an element of a query's list and one of the report's list are compared.
fn keys(key: &Field<'_>, report: &Layout<'_>) -> Option<[String; 2]> {
    let [list] = &*report.fields else {
        return None;
    };
    let (_, _, fields) = element(report, list)?;
    let same = fields.iter().find(|it| it.item.name == key.item.name)?;
    let number = |field: &Field<'_>| match &field.ty {
        Type::Number(number) => Some((*number, field.ident.clone())),
        Type::Newtype {
            number,
            scale: None,
            ..
        } => Some((*number, format!("{}.0", field.ident))),
        _ => None,
    };
    let (query, report) = (number(key)?, number(same)?);
    (query.0 == report.0 && !same.item.optional).then_some([query.1, report.1])
}

/// Writes the statements that drop what a vector does not request from a record of the report.
fn drop_fields(
    out: &mut Writer,
    Selection { vector, .. }: &Selection<'_>,
    record: &Record<'_>,
    list: Option<&List<'_>>,
    types: &str,
) {
    let (mut place, mut request, mut blocks) = ("report".to_owned(), "self", 0);
    let mut list = list;
    for step in &record.steps {
        match step {
            Step::Member(member) => place = format!("{place}.{member}"),
            Step::Each => {
                out.push(format!("for item in &mut {place} {{"));
                (place, blocks) = ("item".to_owned(), blocks + 1);
                if let Some(List {
                    member,
                    keys: Some([query, report]),
                    ..
                }) = list.take()
                {
                    out.push(format!("let mut requests = self.{member}.iter();"));
                    out.push(format!(
                        "let Some(request) = requests.find(|it| it.{query} == item.{report}) else {{"
                    ));
                    out.push("continue;\n};");
                    request = "request";
                }
            }
            Step::Alternative { path, is_only } => {
                let borrow = if place.contains('.') { "&mut " } else { "" };
                let binding = format!("let {types}{path}(value) = {borrow}{place}");
                match is_only {
                    true => out.push(format!("{binding};")),
                    false => {
                        out.push(format!("if {binding} {{"));
                        blocks += 1;
                    }
                }
                place = "value".to_owned();
            }
        }
    }
    for (bit, (_, field)) in record.fields.iter().enumerate() {
        let mask = 1_u64 << bit;
        out.push(format!(
            "codec::keep_if({request}.{vector} & {mask:#06x} != 0, &mut {place}.{field});"
        ));
    }
    for _ in 0..blocks {
        out.push("}");
    }
}

/// The builder of a record with presence vectors.
struct Builder<'s, 'm> {
    selections: &'s [Selection<'m>],
    has_more: bool,
    /// Whether fields of two parts have the same name, so that the part is in the method's name.
    names_parts: bool,
}

impl<'s, 'm> Builder<'s, 'm> {
    fn new(selections: &'s [Selection<'m>], has_more: bool) -> Self {
        let fields = selections.iter().map(Selection::fields);
        let names: Vec<&str> = fields.flatten().map(|(name, _)| name).collect();
        let mut numbered = names.iter().enumerate();
        Self {
            selections,
            has_more,
            names_parts: numbered.any(|(place, name)| names[..place].contains(name)),
        }
    }

    fn write(&self, out: &mut Writer, ident: &str, report: &str, mut names: Names) {
        out.gap();
        out.push(format!("codec::requests!({ident}, new {{"));
        let all = |selection: &Selection<'_>| {
            let bits = selection.fields().into_iter().map(|(_, bit)| 1_u64 << bit);
            bits.fold(0, std::ops::BitOr::bitor)
        };
        let doc = format!("Requests every optional field of [`{report}`].");
        self.constructor(out, &doc, &names.snake("all"), all);
        let doc = format!("Requests no optional field of [`{report}`] yet.");
        self.constructor(out, &doc, &names.snake("none"), |_| 0);
        out.push("} with {");
        for selection in self.selections {
            for (name, bit) in selection.fields() {
                self.method(out, &mut names, selection, (name, bit));
            }
        }
        out.push("});");
    }

    fn method(
        &self,
        out: &mut Writer,
        names: &mut Names,
        selection: &Selection<'_>,
        (name, bit): (&str, usize),
    ) {
        let (part, of) = match &*selection.stem {
            "" => ("", String::new()),
            stem if self.names_parts => (stem, format!(" of `{stem}`")),
            stem => ("", format!(" of `{stem}`")),
        };
        let method = names.snake(&format!("with {part} {name}"));
        let (vector, mask) = (&selection.vector, 1_u64 << bit);
        out.doc([format!("Also requests `{name}`{of}, bit {bit}.").as_str()]);
        out.push(format!("{method}: {vector} | {mask:#06x};"));
    }

    fn constructor(
        &self,
        out: &mut Writer,
        doc: &str,
        name: &str,
        value: impl Fn(&Selection<'_>) -> u64,
    ) {
        let (constness, rest) = match self.has_more {
            true => ("", ", ..Self::default()"),
            false => ("const", ""),
        };
        let vectors = self.selections.iter();
        let vectors = vectors.map(|it| format!("{}: {:#06x}", it.vector, value(it)));
        let vectors: Vec<_> = vectors.collect();
        out.doc([doc]);
        out.push(format!(
            "fn({constness}) {name} => Self {{ {}{rest} }};",
            vectors.join(", ")
        ));
    }
}
