//! Generates the pairs of queries and reports, and the selection of a report's fields by the
//! presence vector of its query.

use super::ident::Names;
use super::messages::Plan;
use super::writer::Writer;
use crate::model::{Group, Item, Meaning, Message, Number, Scalar, Shape};

/// Implements `Query` if the message is a query with a report in the set.
pub(super) fn implement(out: &mut Writer, query: &Plan<'_>, plans: &[Plan<'_>]) {
    let Some(report) = report(query, plans) else {
        return;
    };
    let path = match (&query.version, &report.version) {
        (Some(version), reports) if reports.as_ref() != Some(version) => {
            format!("super::{}", report.path())
        }
        (Some(_), _) => report.ident.clone(),
        (None, _) => report.path(),
    };
    let selection = Selection::of(query.message, report.message);
    out.gap();
    out.push(format!("impl codec::Query for {} {{", query.ident));
    out.push(format!("type Report = {path};"));
    if let Some(selection) = &selection {
        selection.drop_unrequested(out, &path);
    }
    out.push("}");
    if let Some(selection) = &selection {
        selection.builder(out, &query.ident, &path);
    }
}

/// The report of a query: `ReportX` of `QueryX`, declared by a service that declares the query.
/// Of several layouts the newest, which comes first.
pub(super) fn report<'p, 'm>(query: &Plan<'m>, plans: &'p [Plan<'m>]) -> Option<&'p Plan<'m>> {
    let stem = query.message.name.strip_prefix("Query")?;
    let code = report_code(query.message.code);
    plans.iter().find(|plan| {
        let name = plan.message.name.strip_prefix("Report");
        let mut services = plan.services.iter();
        name == Some(stem)
            && code.is_none_or(|code| plan.message.code == code)
            && services.any(|service| query.services.contains(service))
    })
}

/// The query that a report answers.
pub(super) fn query_of<'p, 'm>(report: &Plan<'m>, plans: &'p [Plan<'m>]) -> Option<&'p Plan<'m>> {
    let answers =
        |query: &&Plan<'m>| self::report(query, plans).is_some_and(|it| it.path() == report.path());
    plans.iter().find(answers)
}

/// As `jaus_codec::report_code`. Services outside of the standard use other codes, too.
const fn report_code(query: u16) -> Option<u16> {
    match query {
        0x2000..=0x3FFF => Some(query + 0x2000),
        0xE000..=0xEFFF => Some(query + 0x1000),
        _ => None,
    }
}

/// The presence vector in a query's body, and the optional fields of the report that it requests:
/// bit *i* is the *i*-th. Nested presence vectors have no selection.
struct Selection<'m> {
    /// The query's member.
    vector: String,
    /// Whether the query has other members.
    has_more: bool,
    /// The optional fields: name in the definition, and member of the report.
    fields: Vec<(&'m str, String)>,
}

impl<'m> Selection<'m> {
    fn of(query: &Message, report: &'m Message) -> Option<Self> {
        let (asked, members) = (members(query)?, members(report)?);
        let (vector, bits) = asked.iter().find_map(|(item, ident)| {
            let is_vector = matches!(&*item.name, "PresenceVector" | "QueryPresenceVector");
            let bits = unsigned_bits(item).filter(|_| is_vector)?;
            Some((ident.clone(), bits))
        })?;
        let fields = members.into_iter().filter(|(item, _)| item.optional);
        let fields: Vec<_> = fields.map(|(item, ident)| (&*item.name, ident)).collect();
        let fits = (1..=bits).contains(&fields.len());
        fits.then_some(Self {
            vector,
            has_more: asked.len() > 1,
            fields,
        })
    }

    fn drop_unrequested(&self, out: &mut Writer, report: &str) {
        out.gap();
        out.push(format!(
            "fn drop_unrequested(&self, report: &mut {report}) {{"
        ));
        for (bit, (_, field)) in self.fields.iter().enumerate() {
            let mask = 1_u64 << bit;
            out.push(format!("if self.{} & {mask:#06x} == 0 {{", self.vector));
            out.push(format!("report.{field} = None;\n}}"));
        }
        out.push("}");
    }

    fn builder(&self, out: &mut Writer, query: &str, report: &str) {
        let mut names = Names::reserving(&["all", "none"]);
        out.gap();
        out.push(format!("impl {query} {{"));
        let all = (1_u128 << self.fields.len()) - 1;
        self.constructor(
            out,
            &format!("Requests every optional field of [`{report}`]."),
            ("all", all),
        );
        out.gap();
        let doc = format!("Requests no optional field of [`{report}`] yet.");
        self.constructor(out, &doc, ("none", 0));
        for (bit, (name, _)) in self.fields.iter().enumerate() {
            let method = names.snake(&format!("with {name}"));
            let mask = 1_u64 << bit;
            out.gap();
            out.doc([format!("Also requests `{name}`, bit {bit}.").as_str()]);
            out.push("#[must_use]");
            out.push(format!("pub const fn {method}(mut self) -> Self {{"));
            out.push(format!("self.{} |= {mask:#06x};\nself\n}}", self.vector));
        }
        out.push("}");
    }

    fn constructor(&self, out: &mut Writer, doc: &str, (name, value): (&str, u128)) {
        let (constness, rest) = match self.has_more {
            true => ("", "..Self::default()\n"),
            false => ("const ", ""),
        };
        out.doc([doc]);
        out.push("#[must_use]");
        out.push(format!("pub {constness}fn {name}() -> Self {{\nSelf {{"));
        out.push(format!("{}: {value:#06x},\n{rest}}}\n}}", self.vector));
    }
}

/// The members of a message's struct and their names there, if its body is a group.
fn members(message: &Message) -> Option<Vec<(&Item, String)>> {
    let shape = message.body.as_ref().map(|body| &body.shape)?;
    let (Shape::Group(Group { members, .. }), None, None) =
        (shape, &message.header, &message.footer)
    else {
        return None;
    };
    let mut names = Names::default();
    let named = members.iter().map(|item| (item, names.snake(&item.name)));
    Some(named.collect())
}

/// The bits of a field that is a plain unsigned integer.
fn unsigned_bits(item: &Item) -> Option<usize> {
    match &item.shape {
        Shape::Scalar(Scalar {
            number: Number::Unsigned(unsigned),
            meaning,
            ..
        }) => match meaning {
            Meaning::Values(set) if !set.values.is_empty() => None,
            Meaning::Scaled(_) => None,
            _ => Some(8 * unsigned.size()),
        },
        _ => None,
    }
}
