//! A component of this library that answers a few queries, and reports changed answers every three
//! seconds.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering::Relaxed};
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::messages::core::{
    QueryAuthority, QueryControl, QueryStatus, ReportAuthority, ReportControl, ReportStatus,
    discovery,
};
use jaus::service::{Discovery, Handlers, Kind, Liveness, Profile, Scope, Service, Stack, Timing};

use crate::sim::{Event as EndpointEvent, OwnedEndpoint, Owner};

pub(crate) struct Vehicle {
    stack: Stack,
    changes: Arc<AtomicU8>,
    next: Instant,
}

impl Vehicle {
    /// How often the answers change.
    const CHANGE: Duration = Duration::from_secs(3);

    pub(crate) fn new(now: Instant, id: JausId) -> Self {
        let changes = Arc::new(AtomicU8::new(0));
        let profile = Profile::new(Kind::Vehicle, "Rover");
        let discovery = Discovery::new(id, profile, Scope::Nobody, Timing::default(), 1);
        let services: Vec<Box<dyn Service>> =
            vec![Box::new(Liveness::new()), Box::new(answers(&changes))];
        let mut stack = Stack::new(discovery, services);
        stack.start(now);
        Self {
            stack,
            changes,
            next: now + Self::CHANGE,
        }
    }

    fn settle(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        while let Some(message) = self.stack.poll_transmit() {
            // The route to the client may be gone.
            let _ = endpoint.send(now, message);
        }
        while self.stack.poll_event().is_some() {}
    }
}

fn answers(changes: &Arc<AtomicU8>) -> Handlers {
    let number = || {
        let changes = changes.clone();
        move || changes.load(Relaxed)
    };
    let (status, control, authority) = (number(), number(), number());
    // Any service would do.
    Handlers::new(discovery::LATEST)
        .answer(move |_: QueryStatus| ReportStatus {
            status: status().into(),
            reserved: 0,
        })
        .answer(move |_: QueryControl| ReportControl {
            authority_code: control(),
            ..ReportControl::default()
        })
        .answer(move |_: QueryAuthority| ReportAuthority {
            authority_code: authority(),
        })
}

impl Owner for Vehicle {
    fn handle_event(&mut self, now: Instant, endpoint: &mut OwnedEndpoint, event: EndpointEvent) {
        if let EndpointEvent::Received(message) = event {
            self.stack.handle_message(now, &message);
            self.settle(now, endpoint);
        }
    }

    fn handle_timeout(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        if self.next <= now {
            self.next += Self::CHANGE;
            self.changes.fetch_add(1, Relaxed);
            for query in [QueryStatus::CODE, QueryControl::CODE, QueryAuthority::CODE] {
                self.stack.announce(now, query);
            }
        }
        self.stack.handle_timeout(now);
        self.settle(now, endpoint);
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.stack
            .poll_timeout()
            .into_iter()
            .chain([self.next])
            .min()
    }
}
