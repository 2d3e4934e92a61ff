//! The list that JAUS clients set for an RA driver: its place among the services of a proxy, and in
//! what passes through it.

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

/// The list of an RA driver. Cheap to clone; the clones are one.
#[derive(Debug, Clone)]
pub(super) struct Listing(Arc<Mutex<Course>>);

impl Listing {
    /// An empty list for a component in this role, if it goes to places.
    pub(super) fn of(role: Option<&Role>, patience: Duration) -> Option<Self> {
        let places = Places::of(role?.part)?;
        let course = Course::new(places, patience);
        Some(Self(Arc::new(Mutex::new(course))))
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Course> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Answers what clients ask about the list; commands come another way.
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
    /// Whether a message with this code is about the list that is kept here.
    pub(super) fn is_listed(&self, code: u16) -> bool {
        let concerns = Course::is_command(code) || Course::QUERIES.contains(&code);
        self.listing.is_some() && concerns
    }

    /// A client asks about the list or changes it.
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

    /// A client's command has been given to the driver, which may end the way along the list.
    pub(super) fn note_command(&self, code: u16, body: &Bytes) {
        let Some(listing) = &self.listing else { return };
        match code {
            Shutdown::CODE | Standby::CODE | SET_EMERGENCY => listing.lock().stop(),
            RESET => listing.lock().reset(),
            SET_SPEED => listing.lock().note_speed(body.clone()),
            _ => {}
        }
    }

    /// The driver has told a place; says whether it was asked for by the list.
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

    /// Time has passed for the list. A driver that does not tell its speed has the one that it was given.
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

    /// Tells the speed that the driver was given, if that report is wanted and it does not tell it
    /// itself.
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

    /// If nobody is in control any more, the driver is stopped before it is released. In an emergency,
    /// whoever has set it, nothing more is handed over, and no speed follows.
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

    /// Carries out what the list wants. `client` is whose message it was.
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

/// Counts what was refused about a list.
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
