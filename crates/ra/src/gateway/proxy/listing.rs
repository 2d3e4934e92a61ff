//! The list that JAUS clients set for an RA driver, as a service of the proxy and in its message
//! flow.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bytes::Bytes;

use super::Proxy;
use super::codes::{RESET, SET_EMERGENCY, SET_SPEED, SPEED};
use crate::convert::Places;
use crate::gateway::convert;
use crate::gateway::counters::{Counter, Tally};
use crate::gateway::course::{Course, Refused};
use crate::gateway::roles::Role;
use crate::messages::ra33::{Shutdown, Standby};
use jaus::address::JausId;
use jaus::codec::{Message as _, ServiceId};
use jaus::endpoint::Received;
use jaus::messages::core::list_manager;
use jaus::messages::mobility::ExecuteList;
use jaus::service::{Context, Handled, Service};

/// The list of an RA driver. Clones share one list.
#[derive(Debug, Clone)]
pub(super) struct Listing(Arc<Mutex<Course>>);

impl Listing {
    /// An empty list for a component in this role, if it drives to places.
    pub(super) fn of(role: Option<&Role>, patience: Duration) -> Option<Self> {
        let places = Places::of(role?.part)?;
        let course = Course::new(places, patience);
        Some(Self(Arc::new(Mutex::new(course))))
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Course> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Service that answers list queries; commands take another path.
#[derive(Debug)]
pub(super) struct Listed {
    pub(super) listing: Listing,
    pub(super) role: Role,
}

impl Service for Listed {
    fn offers(&self) -> Vec<ServiceId> {
        // Version 1.0 has the same messages; mobility drivers of 2009 inherit it.
        let first = ServiceId {
            minor: 0,
            ..list_manager::V1_1
        };
        let managers = [list_manager::V1_1, first].into_iter();
        managers.chain(self.role.list).collect()
    }

    fn handle_message(
        &mut self,
        _: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        match self.listing.lock().answer(&message.payload) {
            Some(answer) => context.send_octets(message.source, answer),
            None => return Handled::No,
        }
        Handled::Yes
    }
}

impl Proxy {
    /// Whether a message with this code concerns the list.
    pub(super) fn is_listed(&self, code: u16) -> bool {
        let concerns = Course::is_command(code) || Course::QUERIES.contains(&code);
        self.listing.is_some() && concerns
    }

    /// Handles a list query or command of a client.
    pub(super) fn handle_listed(
        &mut self,
        now: Instant,
        message: &Received,
        code: u16,
        tally: &mut Tally,
    ) {
        let client = message.source;
        if !Course::is_command(code) {
            return self.stack.handle_message(now, message);
        }
        if !self.lease.obeys(client) {
            return tally.refuse(now, Counter::NotInControl, code, client);
        }
        if code == ExecuteList::CODE
            && let Some(why) = self.holds_back(now, SET_SPEED)
        {
            return tally.refuse(now, why, code, client);
        }
        if let Some(listing) = &self.listing {
            listing.lock().handle_command(now, &message.payload);
        }
        self.follow_list(now, Some(client), tally);
    }

    /// Notes a client's command to the driver, which may end the execution of the list.
    pub(super) fn note_command(&self, code: u16, body: &Bytes) {
        let Some(listing) = &self.listing else { return };
        match code {
            Shutdown::CODE | Standby::CODE | SET_EMERGENCY => listing.lock().stop(),
            RESET => listing.lock().reset(),
            SET_SPEED => listing.lock().note_speed(body.clone()),
            _ => {}
        }
    }

    /// Handles a place reported by the driver; returns whether the list had queried it.
    pub(super) fn handle_place(
        &mut self,
        now: Instant,
        report: u16,
        data: &Bytes,
        tally: &mut Tally,
    ) -> bool {
        let Some(listing) = &self.listing else {
            return false;
        };
        let waited_for = listing.lock().handle_report(now, report, data);
        if report == SPEED {
            listing.lock().tells_speed = true;
        }
        self.follow_list(now, None, tally);
        waited_for
    }

    /// Runs due timers of the list. A driver that does not report its speed has its last set speed.
    pub(super) fn handle_list_timeout(&mut self, now: Instant, tally: &mut Tally) {
        let Some(listing) = self.listing.clone() else {
            return;
        };
        listing.lock().handle_timeout(now);
        let is_late = self
            .held
            .iter()
            .any(|it| it.report == SPEED && now >= it.until);
        if is_late {
            listing.lock().tells_speed = false;
            self.tell_given_speed(now, SPEED);
        }
        self.follow_list(now, None, tally);
    }

    /// Reports the last set speed, if that report is requested and the driver does not report its
    /// speed itself.
    pub(super) fn tell_given_speed(&mut self, now: Instant, report: u16) {
        if report != SPEED {
            return;
        }
        let speed = self.listing.as_ref().and_then(|it| it.lock().given_speed());
        let Some(speed) = speed else { return };
        if let Ok(converted) = self.words.to_jaus(SPEED, &speed) {
            self.tell_state(now, SPEED, speed, &converted);
        }
    }

    /// Without a client in control, stops the driver before it is released. In an emergency,
    /// from any client, no further places and no speed follow.
    pub(super) fn stop_list_where_due(&mut self, now: Instant, tally: &mut Tally) {
        let Some(listing) = &self.listing else { return };
        if self.lease.controller().is_none() {
            listing.lock().leave();
        } else if self.in_emergency {
            listing.lock().stop();
        } else {
            return;
        }
        self.follow_list(now, None, tally);
    }

    /// Executes the actions of the list. `client` sent the message that caused them.
    pub(super) fn follow_list(&mut self, now: Instant, client: Option<JausId>, tally: &mut Tally) {
        let Some(listing) = &self.listing else { return };
        let said = listing.lock().take_said();
        for (code, data) in said.to_ra {
            tally.add(match code {
                0x2000.. => Counter::QueriesToRa,
                _ => Counter::CommandsToRa,
            });
            self.give(now, (code, data));
        }
        for answer in said.answers {
            if let Some(client) = client {
                self.stack.send_octets(client, answer);
            }
        }
        for (code, why) in said.refused {
            refuse(now, tally, code, &why);
        }
        if said.changed {
            for query in Course::QUERIES {
                self.stack.announce(now, query);
            }
        }
    }
}

/// Counts a refused list request.
pub(super) fn refuse(now: Instant, tally: &mut Tally, code: u16, why: &Refused) {
    match why {
        Refused::Conversion(refusal) => convert::refuse(now, tally, code, refusal),
        Refused::Unconfirmed(_) | Refused::Unanswered => {
            tally.refuse(now, Counter::Unanswered, code, why);
        }
        Refused::Mute | Refused::Keeps(_) => tally.refuse(now, Counter::Unconfirmed, code, why),
        _ => tally.refuse(now, Counter::NotListed, code, why),
    }
}
