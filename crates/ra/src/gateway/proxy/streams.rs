//! Service connections to an RA component for client subscriptions: one per report, at the highest
//! requested rate. If the component refuses or does not confirm a connection, queries replace it.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use bytes::Bytes;

use super::super::pairs;
use crate::RaId;
use crate::connection::{ConnectionId, Connections, Request};

/// Reports requested of one RA component, by report code.
#[derive(Debug)]
pub(super) struct Streams {
    /// The RA component and the gateway.
    between: (RaId, RaId),
    all: BTreeMap<u16, Stream>,
}

#[derive(Debug)]
struct Stream {
    state: pairs::State,
    hz: f64,
    /// Its connection, unless refused.
    connection: Option<ConnectionId>,
    /// The confirmed rate, while reports arrive.
    confirmed: Option<f64>,
    /// When the next query replaces the connection.
    query: Option<Instant>,
}

impl Streams {
    /// Maximum rate of queries that replace a connection, in hertz.
    const MOST_QUERIES: f64 = 10.0;

    pub(super) const fn new(provider: RaId, client: RaId) -> Self {
        Self {
            between: (provider, client),
            all: BTreeMap::new(),
        }
    }

    /// Sets the requested rates, by report code.
    pub(super) fn want(
        &mut self,
        now: Instant,
        wanted: &BTreeMap<u16, f64>,
        connections: &mut Connections,
    ) {
        let same = |stream: &Stream, hz: f64| (stream.hz - hz).abs() <= 0.01 * hz;
        self.all.retain(|report, stream| {
            let stays = wanted.get(report).is_some_and(|&hz| same(stream, hz));
            if let Some(connection) = stream.connection.filter(|_| !stays) {
                connections.end(connection);
            }
            stays
        });
        for (&report, &hz) in wanted {
            if let Some(state) = pairs::state(report).filter(|_| !self.all.contains_key(&report)) {
                let stream = self.begin(now, state, hz, connections);
                self.all.insert(report, stream);
            }
        }
    }

    fn begin(
        &self,
        now: Instant,
        state: pairs::State,
        hz: f64,
        connections: &mut Connections,
    ) -> Stream {
        let (provider, client) = self.between;
        let request = Request {
            provider,
            client,
            code: state.report,
            presence: state.all(),
            rate: hz,
        };
        let connection = connections.create(now, request).ok();
        Stream {
            state,
            hz,
            connection,
            confirmed: None,
            query: connection.is_none().then_some(now),
        }
    }

    fn of(&mut self, connection: ConnectionId) -> Option<&mut Stream> {
        let mut all = self.all.values_mut();
        all.find(|stream| stream.connection == Some(connection))
    }

    /// Stores the confirmed rate of a connection.
    pub(super) fn handle_established(&mut self, connection: ConnectionId, hz: f64) {
        if let Some(stream) = self.of(connection) {
            stream.confirmed = Some(hz);
            stream.query = None;
        }
    }

    /// Falls back to queries while a silent connection is requested again.
    pub(super) fn handle_silence(&mut self, now: Instant, connection: ConnectionId) {
        if let Some(stream) = self.of(connection) {
            stream.confirmed = None;
            stream.query = Some(now);
        }
    }

    /// Handles a refused or terminated connection; returns whether it was one of these.
    pub(super) fn handle_end(&mut self, now: Instant, connection: ConnectionId) -> bool {
        let Some(stream) = self.of(connection) else {
            return false;
        };
        stream.connection = None;
        stream.confirmed = None;
        stream.query = Some(now);
        true
    }

    /// Maximum age of a report with a connection; `None` without one.
    pub(super) fn freshness(&self, report: u16) -> Option<Duration> {
        let hz = self.all.get(&report)?.confirmed?;
        Some(Duration::from_secs_f64(2.0 / hz.max(0.01)))
    }

    /// The due queries that replace connections.
    pub(super) fn take_queries(&mut self, now: Instant) -> Vec<(u16, Bytes)> {
        let mut queries = Vec::new();
        for stream in self.all.values_mut() {
            if stream.query.is_some_and(|due| due <= now) {
                let hz = stream.hz.min(Self::MOST_QUERIES);
                stream.query = Some(now + Duration::from_secs_f64(1.0 / hz));
                queries.push((stream.state.query(), stream.state.query_for_all()));
            }
        }
        queries
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.all.values().filter_map(|stream| stream.query).min()
    }
}
