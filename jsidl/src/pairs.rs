//! Which report answers a query: what the state machine of the service sends, else the output with the
//! query's name, and at last the one with the code that the standard assigns.

use std::sync::Arc;

use crate::behaviour::{StateMachine, Transition};
use crate::model::{Message, Service};

impl Service {
    /// The report that answers a query of this service; `None` if the message is no query.
    ///
    /// ```
    /// let mut loader = jsidl::Loader::new();
    /// loader.catalogue();
    /// let library = loader.load().library;
    /// let mut modes = library.versions("urn:jaus:jss:iop:PlatformMode");
    /// let modes = modes.next().expect("a service of the catalogue");
    /// let query = &modes.inputs.iter().find(|it| it.code == 0xFF21).expect("a query");
    /// assert_eq!(modes.report_of(query).map(|it| it.code), Some(0xFF23));
    /// ```
    pub fn report_of(&self, query: &Message) -> Option<&Arc<Message>> {
        let (stem, code) = (
            query.name.strip_prefix("Query"),
            standard_report(query.code),
        );
        if query.is_command || stem.is_none() && code.is_none() {
            return None;
        }
        self.sent_for(query)
            .or_else(|| self.named_after(stem?))
            .or_else(|| self.report(|it| Some(it.code) == code))
    }

    /// The report that the state machines send when they receive the message.
    fn sent_for(&self, query: &Message) -> Option<&Arc<Message>> {
        let transitions = self.behaviour.iter().flat_map(StateMachine::transitions);
        let mut sent = transitions
            .filter(|it| it.trigger.message() == Some(&query.name))
            .flat_map(Transition::answers);
        sent.find_map(|name| self.report(|it| it.name == name))
    }

    /// The report `ReportX` of `QueryX`; else `X`, or the only one whose name begins with that.
    fn named_after(&self, stem: &str) -> Option<&Arc<Message>> {
        let report = self.report(|it| it.name.strip_prefix("Report") == Some(stem));
        report
            .or_else(|| self.report(|it| it.name == stem))
            .or_else(|| {
                let mut others = self.reports().filter(|it| it.name.starts_with(stem));
                others.next().filter(|_| others.next().is_none())
            })
    }

    fn report(&self, is_it: impl Fn(&Message) -> bool) -> Option<&Arc<Message>> {
        self.reports().find(|it| is_it(it))
    }

    /// The outputs that a query may have as its answer.
    fn reports(&self) -> impl Iterator<Item = &Arc<Message>> {
        let is_input = |code| self.inputs.iter().any(|it| it.code == code);
        let outputs = self.outputs.iter();
        outputs.filter(move |it| !it.is_command && !is_input(it.code))
    }
}

/// The code of the report, as `jaus_codec::report_code` has it: the last resort.
const fn standard_report(query: u16) -> Option<u16> {
    match query {
        0x2000..=0x3FFF => Some(query + 0x2000),
        0xE000..=0xEFFF => Some(query + 0x1000),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_query_of_the_catalogue_has_its_report() {
        let mut loader = crate::Loader::new();
        loader.catalogue();
        let library = loader.load().library;
        let queries = library.services().flat_map(|service| {
            let queries = service.inputs.iter();
            let queries = queries.filter(|it| it.name.starts_with("Query"));
            queries.map(move |query| (service, query))
        });
        let without = queries.filter(|(service, query)| service.report_of(query).is_none());
        let without: Vec<_> = without
            .map(|(service, query)| (&service.id.urn, &query.name))
            .collect();
        assert!(without.is_empty(), "{without:?}");
    }
}
