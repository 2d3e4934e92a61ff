//! Generates the pairs of queries and reports.

use super::messages::Plan;
use super::writer::Writer;

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
    out.gap();
    out.push(format!("impl codec::Query for {} {{", query.ident));
    out.push(format!("type Report = {path};\n}}"));
}

/// The report of a query: `ReportX` of `QueryX`, declared by a service that declares the query.
/// Of several layouts the newest, which comes first.
fn report<'p, 'm>(query: &Plan<'m>, plans: &'p [Plan<'m>]) -> Option<&'p Plan<'m>> {
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

/// As `jaus_codec::report_code`. Services outside of the standard use other codes, too.
const fn report_code(query: u16) -> Option<u16> {
    match query {
        0x2000..=0x3FFF => Some(query + 0x2000),
        0xE000..=0xEFFF => Some(query + 0x1000),
        _ => None,
    }
}
