//! Events with the behaviour of JAUS++: event ids start at 0 for each kind of query, the first
//! report is sent twice, and a repeated request of a client returns the same event.

use std::time::{Duration, Instant};

use jaus::address::JausId;

use super::body;

/// Event type: on every change.
const EVERY_CHANGE: u8 = 1;
/// Number of copies of the first report.
const COPIES: usize = 2;
/// The interval used for a rate of 0.
const SLOWEST: Duration = Duration::from_secs(1);

#[derive(Debug)]
struct Event {
    client: JausId,
    id: u8,
    kind: u8,
    every: Duration,
    query: Vec<u8>,
    sequence: u8,
    next: Instant,
}

/// All events of a peer.
#[derive(Debug, Default)]
pub(super) struct Events(Vec<Event>);

impl Events {
    /// Creates, cancels or lists events. Returns the answers, including the first reports.
    pub(super) fn handle(
        &mut self,
        client: JausId,
        request: &[u8],
        report: impl Fn(&[u8]) -> Option<Vec<u8>>,
    ) -> Vec<Vec<u8>> {
        match (body::code(request), &request[2..]) {
            (Some(body::CREATE_EVENT), &[request, kind, low, high, _, _, _, _, ref query @ ..]) => {
                let Some(first) = report(query) else {
                    return Vec::new();
                };
                let event = self.create(client, kind, [low, high], query);
                let confirm =
                    body::message(body::CONFIRM_EVENT, &[&[request, event.id, low, high]]);
                let mut answers = vec![confirm];
                answers.extend((0..COPIES).map(|_| event.bring(&first)));
                answers
            }
            (Some(body::CANCEL_EVENT), &[request, id]) => {
                // The first event of the client with this id.
                let found = self
                    .0
                    .iter()
                    .position(|event| event.client == client && event.id == id);
                found.map(|index| self.0.remove(index));
                vec![body::message(body::CONFIRM_EVENT, &[&[request, id, 0, 0]])]
            }
            (Some(body::QUERY_EVENTS), _) => vec![self.list(client)],
            _ => Vec::new(),
        }
    }

    fn create(&mut self, client: JausId, kind: u8, rate: [u8; 2], query: &[u8]) -> &mut Event {
        let is_same =
            |event: &Event| event.client == client && event.kind == kind && event.query == query;
        let index = self.0.iter().position(is_same).unwrap_or_else(|| {
            let alike = self
                .0
                .iter()
                .filter(|event| body::code(&event.query) == body::code(query));
            let hz = f64::from(u16::from_le_bytes(rate)) / f64::from(u16::MAX) * 1092.0;
            let every = Duration::try_from_secs_f64(1.0 / hz).unwrap_or(SLOWEST);
            self.0.push(Event {
                client,
                id: alike.count() as u8,
                kind,
                every,
                query: query.to_vec(),
                sequence: 0,
                next: Instant::now() + every,
            });
            self.0.len() - 1
        });
        &mut self.0[index]
    }

    /// Report Events with all events of the client.
    fn list(&self, client: JausId) -> Vec<u8> {
        let of_client: Vec<&Event> = self
            .0
            .iter()
            .filter(|event| event.client == client)
            .collect();
        let mut list = body::message(
            body::report(body::QUERY_EVENTS),
            &[&[of_client.len() as u8]],
        );
        for event in of_client {
            list.extend([event.kind, event.id]);
            list.extend((event.query.len() as u32).to_le_bytes());
            list.extend(&event.query);
        }
        list
    }

    /// The due events, each with its client.
    pub(super) fn due(
        &mut self,
        now: Instant,
        has_changed: bool,
        report: impl Fn(&[u8]) -> Option<Vec<u8>>,
    ) -> Vec<(JausId, Vec<u8>)> {
        let mut due = Vec::new();
        for event in &mut self.0 {
            let is_due = if event.kind == EVERY_CHANGE {
                has_changed
            } else {
                now >= event.next
            };
            if let Some(report) = report(&event.query).filter(|_| is_due) {
                event.next = now + event.every;
                due.push((event.client, event.bring(&report)));
            }
        }
        due
    }
}

impl Event {
    /// The Event message with a report.
    fn bring(&mut self, report: &[u8]) -> Vec<u8> {
        let head = [self.id, self.sequence];
        self.sequence = self.sequence.wrapping_add(1);
        let length = (report.len() as u32).to_le_bytes();
        body::message(body::EVENT, &[&head, &length, report])
    }
}
