//! The JSON view: requests of other zenoh programs, answered by JAUS queries and subscriptions.
//!
//! A request without parameters gets the report once. With `rate` it also starts a subscription,
//! whose reports are published under the key of the request: `rate=5;for=60s`, or `rate=change`.
//! The view only reads: no request leads to anything but a query or a subscription.

use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock};
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::component::{Component, Undecoded, Update};
use jaus::node::{now, sleep_until, units};
use jaus::service::{QueryOptions, Topic, When};
use jaus_vehicle::messages;
use jaus_view::{Dictionary, EncodedQuery, Line};
use serde::Serialize;
use tokio::sync::watch;
use tokio::task::{AbortHandle, JoinSet};
use zenoh::query::{Parameters, Query};

use crate::link::{Answer, Shared};

/// The most requests that wait for the bridge's task.
pub(crate) const MOST_WAITING: usize = 64;
/// The most queries that wait for their reports.
const MOST_QUERIES: usize = 64;
/// The most subscriptions.
const MOST_STREAMS: usize = 256;
/// How long a subscription lasts unless the request says so, and at most.
const LASTS: Duration = Duration::from_secs(60);
const LASTS_AT_MOST: Duration = Duration::from_secs(3600);

/// A request for a view.
#[derive(Debug)]
pub(crate) struct Request {
    component: JausId,
    report: u16,
    query: Query,
}

impl Request {
    pub(crate) const fn new(component: JausId, report: u16, query: Query) -> Self {
        Self {
            component,
            report,
            query,
        }
    }

    pub(crate) const fn query(&self) -> &Query {
        &self.query
    }
}

/// How often a subscription reports, and for how long.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Schedule {
    when: When,
    lasts: Duration,
}

impl Schedule {
    /// Reads the parameters of a request; `None` without a rate.
    fn parse(parameters: &Parameters<'_>) -> Result<Option<Self>, String> {
        let Some(rate) = parameters.get("rate") else {
            return match parameters.get("for") {
                Some(_) => Err("`for` needs a rate, such as rate=5;for=60s".to_owned()),
                None => Ok(None),
            };
        };
        let when = match rate {
            "change" => When::OnChange,
            _ => When::hz(rate.parse().map_err(|_| RATE.to_owned())?),
        };
        let lasts = match parameters.get("for") {
            Some(text) => units::duration(text).map_err(|error| error.to_string())?,
            None => LASTS,
        };
        if lasts > LASTS_AT_MOST {
            return Err("write a `for` of 1h at most, and renew the subscription".to_owned());
        }
        Ok(Some(Self { when, lasts }))
    }
}

const RATE: &str = "write a rate in hertz, such as rate=5, or rate=change";

/// A running subscription.
#[derive(Debug)]
struct Stream {
    when: When,
    end: watch::Sender<std::time::Instant>,
    task: AbortHandle,
}

impl Drop for Stream {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// Answers requests.
pub(crate) struct Viewer {
    component: Component,
    shared: Arc<Shared>,
    queries: JoinSet<()>,
    streams: BTreeMap<(JausId, u16), Stream>,
    tasks: JoinSet<()>,
}

impl Viewer {
    pub(crate) fn new(component: Component, shared: Arc<Shared>) -> Self {
        Self {
            component,
            shared,
            queries: JoinSet::new(),
            streams: BTreeMap::new(),
            tasks: JoinSet::new(),
        }
    }

    /// Answers a request, later.
    pub(crate) fn handle(&mut self, request: Request) {
        self.reap();
        let query = match self.prepare(&request) {
            Ok(query) => query,
            Err(why) => {
                self.shared
                    .with(crate::exchange::Exchange::count_refused_view);
                let query = request.query;
                return self.shared.answer(Answer {
                    query,
                    result: Err(why),
                });
            }
        };
        let (component, shared) = (self.component.clone(), self.shared.clone());
        self.queries.spawn(async move {
            let (peer, report) = (request.component, query.report);
            let options = QueryOptions::default();
            let asked = component.query_undecoded(options, peer, query.octets, report);
            let result = asked.await.map_err(|error| error.to_string());
            let result = result.and_then(|octets| json(peer, &octets));
            let query = request.query;
            shared.answer(Answer { query, result });
        });
    }

    /// Forgets what has ended.
    fn reap(&mut self) {
        while self.queries.try_join_next().is_some() {}
        while self.tasks.try_join_next().is_some() {}
        self.streams.retain(|_, stream| !stream.task.is_finished());
    }

    /// Checks a request, and starts the subscription that it asks for.
    fn prepare(&mut self, request: &Request) -> Result<EncodedQuery, String> {
        let Request {
            component,
            report,
            query,
        } = request;
        if !self.shared.lock().exchange.serves(*component) {
            return Err(format!("{component} is not reachable through this bridge"));
        }
        if self.queries.len() >= MOST_QUERIES {
            return Err("too many queries wait for their reports: try again".to_owned());
        }
        let encoded = encode(*report)?;
        if let Some(schedule) = Schedule::parse(query.parameters())? {
            self.subscribe(*component, &encoded, schedule)?;
        }
        Ok(encoded)
    }

    /// Starts a subscription, or extends the one with the same rate.
    fn subscribe(
        &mut self,
        peer: JausId,
        query: &EncodedQuery,
        schedule: Schedule,
    ) -> Result<(), String> {
        let topic = Topic {
            peer,
            query: query.octets.clone(),
            report: query.report,
            when: schedule.when,
        };
        topic.check().map_err(|error| error.to_string())?;
        let end = now() + schedule.lasts;
        let id = (peer, query.report);
        if let Some(stream) = self.streams.get(&id).filter(|it| it.when == schedule.when) {
            stream.end.send_replace(end);
            return Ok(());
        }
        if self.streams.len() >= MOST_STREAMS && !self.streams.contains_key(&id) {
            return Err("too many subscriptions: let some end".to_owned());
        }
        // The component has one subscription to each query: the old one has to end first.
        self.streams.remove(&id);
        let (end, ends) = watch::channel(end);
        let publisher = Publisher {
            component: self.component.clone(),
            shared: self.shared.clone(),
        };
        let task = self.tasks.spawn(publisher.run(topic, ends));
        let when = schedule.when;
        self.streams.insert(id, Stream { when, end, task });
        Ok(())
    }
}

/// Publishes the reports of one subscription.
struct Publisher {
    component: Component,
    shared: Arc<Shared>,
}

impl Publisher {
    async fn run(self, topic: Topic, mut ends: watch::Receiver<std::time::Instant>) {
        let (peer, report) = (topic.peer, topic.report);
        let mut subscription = match self.component.subscribe_undecoded(topic).await {
            Ok(subscription) => subscription,
            Err(error) => return tracing::debug!(%peer, %error, "no subscription for a view"),
        };
        loop {
            let end = *ends.borrow_and_update();
            tokio::select! {
                update = subscription.next() => match update {
                    Some(Update::Report(Undecoded(octets))) => self.publish(peer, report, &octets),
                    Some(Update::Up | Update::Down { .. }) => {}
                    None => return,
                },
                changed = ends.changed() => if changed.is_err() { return },
                () = sleep_until(Some(end)) => return,
            }
        }
    }

    fn publish(&self, peer: JausId, report: u16, octets: &Bytes) {
        match json(peer, octets) {
            Ok(json) => self
                .shared
                .with(|exchange| exchange.publish_view(now(), peer, report, json.into())),
            Err(error) => tracing::debug!(%peer, error, "no view of a report"),
        }
    }
}

/// All messages that the tool `jaus` knows, too. Reading them takes some milliseconds, at the first
/// request of the process.
static DICTIONARY: LazyLock<Dictionary> =
    LazyLock::new(|| Dictionary::of(messages::registry()).with_catalogue());

/// The query that a report answers, with all fields of the report requested.
fn encode(report: u16) -> Result<EncodedQuery, String> {
    let registry = messages::registry();
    let mut queries = registry.iter().filter(|it| it.report == Some(report));
    let Some(query) = queries.next() else {
        return Err(format!("no query is known whose report is {report:04X}h"));
    };
    let request = jaus_view::Request::new(query.name, serde_json::json!({}));
    let encoded = DICTIONARY.query(&request, &[]);
    encoded.map_err(|error| error.to_string())
}

/// A report with its source, as one JSON object.
#[derive(Serialize)]
struct View<'d> {
    source: String,
    #[serde(flatten)]
    line: Line<'d>,
}

fn json(source: JausId, octets: &Bytes) -> Result<String, String> {
    let view = View {
        source: source.to_string(),
        line: DICTIONARY.line(octets),
    };
    serde_json::to_string(&view).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn schedule(text: &str) -> Result<Option<Schedule>, String> {
        Schedule::parse(&Parameters::from(text))
    }

    #[test]
    fn the_parameters_of_a_request_are_a_rate_and_a_time() {
        assert_eq!(schedule(""), Ok(None));
        let lasting = |seconds| Duration::from_secs(seconds);
        let expected = |when, lasts| Ok(Some(Schedule { when, lasts }));
        assert_eq!(schedule("rate=5"), expected(When::hz(5.0), LASTS));
        let ten = schedule("rate=change;for=10s");
        assert_eq!(ten, expected(When::OnChange, lasting(10)));
        for (text, hint) in [
            ("rate=often", "rate=5"),
            ("for=10s", "rate=5;for=60s"),
            ("rate=5;for=2h", "1h"),
            ("rate=5;for=x", "5ms"),
        ] {
            let error = schedule(text).unwrap_err();
            assert!(error.contains(hint), "{text}: {error}");
        }
    }

    #[test]
    fn a_view_exists_of_reports_and_of_nothing_else() {
        let query = encode(0x4404).unwrap();
        assert_eq!(query.octets[..2], [0x04, 0x24]);
        for code in [0x0405, 0x2404, 0x4FFF] {
            assert!(encode(code).is_err(), "{code:04X}h");
        }
    }

    #[test]
    fn a_view_is_an_object_with_the_source_and_the_fields_by_name() {
        let report = Bytes::from_static(b"\x04\x44\x00\x00");
        let text = json(JausId::new(101, 1, 43), &report).unwrap();
        let view: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(view["source"], "101.1.43");
        assert_eq!(view["message"], "ReportVelocityState");
        assert!(view["body"].is_object(), "{text}");
    }
}
