//! Maps the places that an RA client sets at a JAUS driver to elements of the driver's list.
//!
//! Place n becomes element n + 1, which follows element n. Elements are set one by one, each after
//! the confirmation of its predecessor; unconfirmed ones are set again. Foreign elements left in
//! the list are deleted before the first one is set.
//!
//! A speed above zero applies to the whole list, and must not restart it each time, so the driver
//! is queried for its active element first. With an active element, only the speed changes. Without
//! one, execution begins with the first place set since the driver last moved; without such a
//! place, the driver gets the speed alone. A speed of zero is sent at once.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use bytes::Bytes;

use super::list::Refused;
use crate::convert::{Element, Places, Refusal, speed_to_jaus};
use jaus::codec::{EncodeError, Message};
use jaus::messages::core::delete_element::DeleteElementRec;
use jaus::messages::core::reject_element_request::ResponseCode;
use jaus::messages::core::set_element::ElementRec;
use jaus::messages::core::{
    ConfirmElementRequest, DeleteElement, RejectElementRequest, SetElement, set_element,
};
use jaus::messages::mobility::{ExecuteList, QueryActiveElement};
use jaus::service::{ElementList, code_of};

/// Places of an RA client at a JAUS driver, mirrored in the driver's list.
#[derive(Debug)]
pub(in crate::gateway) struct Entries {
    places: Places,
    patience: Duration,
    set: BTreeMap<u16, Element>,
    /// Number of places, from 0, in the driver's list; `None` until the list was cleared.
    there: Option<u16>,
    /// Places in the list that were replaced since.
    replaced: Vec<u16>,
    current: Option<Request>,
    request_id: u8,
    /// Whether the list was rebuilt because the driver had lost it.
    made_anew: bool,
    /// The speed that waits for the list, or for the driver's answer.
    speed: Option<ExecuteList>,
    /// Purpose of the pending query for the active element.
    asked: Option<Asked>,
    /// The first place set since the driver was at an element.
    fresh: Option<u16>,
    wants: Vec<Want>,
}

/// Actions that the entries request.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::gateway) enum Want {
    /// Send a message to the driver.
    Send(Bytes),
    /// Query the driver's active element.
    Ask(Bytes),
    /// Count a refusal.
    Refuse(u16, Refused),
}

/// A request that awaits its confirmation.
#[derive(Debug)]
struct Request {
    /// Number of the place; `None` to delete all.
    number: Option<u16>,
    id: u8,
    payload: Bytes,
    next: Instant,
    until: Instant,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Asked {
    /// To decide how to apply the speed.
    ForSpeed,
    /// To learn whether execution has begun.
    AfterBegin,
}

/// Element id that addresses all elements.
const ALL: u16 = u16::MAX;

impl Entries {
    /// Interval of repeated requests.
    const AGAIN: Duration = Duration::from_millis(300);

    /// No places, for a driver to places of this kind.
    pub(in crate::gateway) const fn new(places: Places, patience: Duration) -> Self {
        Self {
            places,
            patience,
            set: BTreeMap::new(),
            there: None,
            replaced: Vec::new(),
            current: None,
            request_id: 0,
            made_anew: false,
            speed: None,
            asked: None,
            fresh: None,
            wants: Vec::new(),
        }
    }

    /// Handles a place set by the client.
    pub(in crate::gateway) fn handle_set(&mut self, now: Instant, data: &Bytes) {
        if let Err(why) = self.take_in(data) {
            self.refuse(why);
        }
        self.pump(now);
    }

    /// Handles a speed set by the client.
    pub(in crate::gateway) fn handle_speed(&mut self, now: Instant, code: u16, data: &Bytes) {
        match speed_to_jaus(data) {
            Err(why) => self.wants.push(Want::Refuse(code, why.into())),
            Ok(execute) if execute.speed_m_per_s() > 0.0 => self.speed = Some(execute),
            Ok(stop) => {
                self.speed = None;
                self.send(code, &stop);
            }
        }
        self.pump(now);
    }

    /// Handles a confirmation or refusal by the driver. Returns whether it was expected.
    pub(in crate::gateway) fn handle_answer(&mut self, now: Instant, payload: &Bytes) -> bool {
        let (id, refused) = match code_of(payload) {
            Some(ConfirmElementRequest::CODE) => match ConfirmElementRequest::decode(payload) {
                Ok(confirm) => (confirm.request_id, None),
                Err(_) => return false,
            },
            Some(RejectElementRequest::CODE) => match RejectElementRequest::decode(payload) {
                Ok(reject) => (reject.request_id, Some(reject.response_code)),
                Err(_) => return false,
            },
            _ => return false,
        };
        let Some(request) = self.current.take_if(|request| request.id == id) else {
            return false;
        };
        match (refused, request.number) {
            (None, Some(number)) => self.there = self.there.max(Some(number + 1)),
            (None, None) => self.there = Some(0),
            (Some(code), number) => self.handle_refusal(number, code),
        }
        self.pump(now);
        true
    }

    /// Handles the driver's active element: 0 for none, `None` without an answer.
    pub(in crate::gateway) fn handle_active(&mut self, now: Instant, active: Option<u16>) {
        let is_at_one = active.is_some_and(|uid| uid != 0);
        if is_at_one {
            self.fresh = None;
        }
        if self.asked.take() == Some(Asked::ForSpeed)
            && let Some(mut execute) = self.speed.take()
        {
            // 0 addresses the first element.
            execute.element_uid = self.fresh.map(|number| match number {
                0 => 0,
                number => number + 1,
            });
            self.send(ExecuteList::CODE, &execute);
            if execute.element_uid.is_some() {
                self.ask(Asked::AfterBegin);
            }
        }
        self.pump(now);
    }

    /// Clears the state after a reset has emptied the driver's list.
    pub(in crate::gateway) fn forget(&mut self) {
        let (places, patience) = (self.places, self.patience);
        let request_id = self.request_id;
        let wants = std::mem::take(&mut self.wants);
        *self = Self {
            request_id,
            wants,
            ..Self::new(places, patience)
        };
    }

    /// Takes the requested actions.
    pub(in crate::gateway) fn take_wants(&mut self) -> Vec<Want> {
        std::mem::take(&mut self.wants)
    }

    /// Runs due timers; calls before [`poll_timeout`](Self::poll_timeout) do no harm.
    pub(in crate::gateway) fn handle_timeout(&mut self, now: Instant) {
        let Some(request) = &mut self.current else {
            return;
        };
        if now >= request.until {
            self.forget();
            self.refuse(Refused::Unanswered);
        } else if now >= request.next {
            request.next = (now + Self::AGAIN).min(request.until);
            let payload = request.payload.clone();
            self.wants.push(Want::Send(payload));
        }
    }

    /// Time of the next timer.
    pub(in crate::gateway) fn poll_timeout(&self) -> Option<Instant> {
        self.current.as_ref().map(|request| request.next)
    }

    fn take_in(&mut self, data: &Bytes) -> Result<(), Refused> {
        let (number, element) = self.places.to_jaus(data)?;
        if number >= ALL - 1 {
            return Err(Refused::TooMany);
        }
        let is_new = !self.set.contains_key(&number);
        if is_new && self.set.len() >= ElementList::MAX_ELEMENTS {
            return Err(Refused::TooMany);
        }
        let is_other = self.set.get(&number) != Some(&element);
        if is_other && self.there.is_some_and(|there| number < there) {
            self.replaced.retain(|&other| other != number);
            self.replaced.push(number);
        }
        self.set.insert(number, element);
        self.fresh = Some(self.fresh.map_or(number, |first| first.min(number)));
        Ok(())
    }

    fn handle_refusal(&mut self, number: Option<u16>, code: ResponseCode) {
        // The list differs from its mirror: another client has emptied or changed it.
        let is_lost = matches!(
            code,
            ResponseCode::INVALID_PREVIOUS_ELEMENT | ResponseCode::INVALID_NEXT_ELEMENT
        );
        if is_lost && !std::mem::replace(&mut self.made_anew, true) {
            self.there = None;
            self.replaced.clear();
            return;
        }
        self.refuse(Refused::List(code));
        match number {
            Some(number) => drop(self.set.split_off(&number)),
            None => self.set.clear(),
        }
        let set = &self.set;
        self.replaced.retain(|number| set.contains_key(number));
    }

    /// Requests the next change of the list; when the list is complete, the speed follows.
    fn pump(&mut self, now: Instant) {
        if self.current.is_some() {
            return;
        }
        if let Some((number, payload)) = self.next() {
            return self.request(now, number, payload);
        }
        self.made_anew = false;
        if self.speed.is_none() || self.asked.is_some() {
            return;
        }
        if let Some(missing) = self.missing() {
            self.speed = None;
            return self.refuse(Refused::Missing(missing));
        }
        self.ask(Asked::ForSpeed);
    }

    /// The next request, with the number of its place.
    fn next(&mut self) -> Option<(Option<u16>, Result<Bytes, EncodeError>)> {
        self.request_id = self.request_id.wrapping_add(1);
        let Some(there) = self.there else {
            let all = self.set.contains_key(&0).then(|| self.delete_all());
            return all.map(|payload| (None, payload));
        };
        let number = self.replaced.pop().unwrap_or(there);
        let element = self.set.get(&number)?.clone();
        Some((Some(number), self.set_one(number, there, element)))
    }

    fn delete_all(&self) -> Result<Bytes, EncodeError> {
        DeleteElement {
            request_id_rec: self.request_id(),
            delete_element_list: vec![DeleteElementRec { element_uid: ALL }],
        }
        .encode()
    }

    fn set_one(
        &self,
        number: u16,
        there: u16,
        element_data: Element,
    ) -> Result<Bytes, EncodeError> {
        let element = ElementRec {
            element_uid: number + 1,
            previous_uid: number,
            next_uid: if number + 1 < there { number + 2 } else { 0 },
            element_data,
        };
        SetElement {
            request_id_rec: self.request_id(),
            element_list: vec![element],
        }
        .encode()
    }

    const fn request_id(&self) -> set_element::RequestIdRec {
        set_element::RequestIdRec {
            request_id: self.request_id,
        }
    }

    fn request(&mut self, now: Instant, number: Option<u16>, payload: Result<Bytes, EncodeError>) {
        match payload {
            Ok(payload) => {
                self.wants.push(Want::Send(payload.clone()));
                self.current = Some(Request {
                    number,
                    id: self.request_id,
                    payload,
                    next: now + Self::AGAIN,
                    until: now + self.patience,
                });
            }
            Err(why) => self.refuse(Refusal::from(why).into()),
        }
    }

    /// The lowest number not in the list, if a later one was set.
    fn missing(&self) -> Option<u16> {
        let last = self.set.last_key_value().map(|(&number, _)| number)?;
        let there = self.there.unwrap_or_default();
        (last >= there).then_some(there)
    }

    fn ask(&mut self, why: Asked) {
        if let Ok(query) = QueryActiveElement.encode() {
            self.asked = Some(why);
            self.wants.push(Want::Ask(query));
        }
    }

    fn send(&mut self, code: u16, execute: &ExecuteList) {
        match execute.encode() {
            Ok(payload) => self.wants.push(Want::Send(payload)),
            Err(why) => self
                .wants
                .push(Want::Refuse(code, Refusal::from(why).into())),
        }
    }

    fn refuse(&mut self, why: Refused) {
        self.wants.push(Want::Refuse(self.places.set, why));
    }
}
