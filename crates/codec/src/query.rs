//! Queries and the reports that answer them: by type and by message code.

use core::time::Duration;

use super::message::Message;

/// A query, which its report answers. Generated for each message for which the definition of its service has
/// a report: by what the state machine sends, by the names, or by [`report_code`].
pub trait Query: Message {
    /// The report. Of several layouts the newest that a service declares beside the query.
    type Report: Report;
    /// The numbers that both have in common.
    const ECHOES: &'static [Echo] = &[];

    /// Removes the optional fields of a report that the query's presence vector does not request.
    /// Without effect if the query has no presence vector for the report's own fields.
    fn drop_unrequested(&self, _report: &mut Self::Report) {}
}

/// A number that a query and its report have in common, such as the number of the list element that is asked
/// for: a report with another value answers another query. Places are in octets from the beginning of each
/// message, with its code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Echo {
    /// The place in the query.
    pub query: usize,
    /// The place in the report.
    pub report: usize,
    /// The length.
    pub octets: usize,
}

impl Echo {
    /// Whether a report may answer a query: it says nothing else, or the query asks for whatever there is.
    #[must_use]
    pub fn is_in(self, query: &[u8], report: &[u8]) -> bool {
        let number = |place: usize| place..place.saturating_add(self.octets);
        match (
            query.get(number(self.query)),
            report.get(number(self.report)),
        ) {
            // In many queries 0 or the greatest number stands for whatever there is.
            (Some(asked), Some(_))
                if [0, 0xFF].iter().any(|all| asked.iter().all(|it| it == all)) =>
            {
                true
            }
            (Some(asked), Some(told)) => asked == told,
            // It is malformed, which its reader notices.
            _ => true,
        }
    }
}

/// A report, which answers a query. Generated for each message that is the [`Query::Report`] of one.
pub trait Report: Message {
    /// Sets the time of the sample, since the beginning of 1970 (UTC), in the time fields that are
    /// unset: the standard's time stamp, or seconds and nanoseconds. Without effect if the
    /// definition has neither in the records that every report contains.
    fn stamp(&mut self, _since_1970: Duration) {}

    /// The report without any value; `None` if its definition requires one.
    #[must_use]
    fn without_values() -> Option<Self> {
        None
    }
}

/// The code of the report that answers a query, by the standard's arithmetic; `None` if the code is not a
/// query. A definition knows better: [`Registry::report_of`](super::Registry::report_of).
///
/// Queries are 2000h to 3FFFh and their reports 2000h higher (AS5710). In the experimental range,
/// IOP services and this stack's own use queries from E000h and reports 1000h higher.
#[must_use]
pub const fn report_code(query: u16) -> Option<u16> {
    match query {
        0x2000..=0x3FFF => Some(query + 0x2000),
        0xE000..=0xEFFF => Some(query + 0x1000),
        _ => None,
    }
}

/// The code of the query that a report answers; `None` if the code is not a report. The inverse of
/// [`report_code`].
#[must_use]
pub const fn query_code(report: u16) -> Option<u16> {
    match report {
        0x4000..=0x5FFF => Some(report - 0x2000),
        0xF000..=0xFFFF => Some(report - 0x1000),
        _ => None,
    }
}

/// Drops the content of an optional field that is not requested.
#[doc(hidden)]
pub fn keep_if<T>(is_requested: bool, field: &mut Option<T>) {
    if !is_requested {
        *field = None;
    }
}

/// Implements the builder methods that set bits of presence vectors.
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_requests {
    ($name:ty, new {
        $($(#[$of_new:meta])* fn($($const:tt)?) $new:ident => $value:expr;)*
    } with {
        $($(#[$doc:meta])* $method:ident: $vector:ident | $bit:literal;)*
    }) => {
        impl $name {
            $(
                $(#[$of_new])*
                #[must_use]
                pub $($const)? fn $new() -> Self {
                    $value
                }
            )*

            $(
                $(#[$doc])*
                #[must_use]
                pub const fn $method(mut self) -> Self {
                    self.$vector |= $bit;
                    self
                }
            )*
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_query_has_its_report_and_others_have_none() {
        assert_eq!(report_code(0x2B00), Some(0x4B00));
        assert_eq!(report_code(0xE702), Some(0xF702));
        for other in [0x0405, 0x4B00, 0xD110, 0xF702] {
            assert_eq!(report_code(other), None, "{other:04X}");
        }
        for code in 0..=u16::MAX {
            let query = query_code(code);
            assert_eq!(query.and_then(report_code), query.map(|_| code));
            let report = report_code(code);
            assert_eq!(report.and_then(query_code), report.map(|_| code));
        }
    }
}
