//! Course: the list that JAUS clients set for an RA driver.
//!
//! The list is kept here. On execution, the driver gets the elements from the starting element,
//! numbered from 0, and then the speed. While it moves, elements may be appended or replaced, which
//! updates the driver at once; any other change of their order is refused. As drivers keep every
//! place, a list shorter than its predecessor is padded with its last waypoint under each remaining
//! number; for path segments, which would form a path of their own, it is refused.

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::handover::{Do, Handover};
use crate::convert::{Places, Refusal, speed_to_ra};
use crate::messages::ra33::SetTravelSpeed;
use jaus::codec::Message;
use jaus::messages::core::reject_element_request::ResponseCode;
use jaus::messages::core::set_element::ElementRec;
use jaus::messages::core::{
    ConfirmElementRequest, DeleteElement, QueryElement, QueryElementCount, QueryElementList,
    RejectElementRequest, ReportElement, ReportElementCount, ReportElementList, SetElement,
    report_element_list,
};
use jaus::messages::mobility::{ExecuteList, QueryActiveElement, ReportActiveElement};
use jaus::service::{ElementList, code_of};

/// The list of an RA driver.
#[derive(Debug)]
pub(in crate::gateway) struct Course {
    places: Places,
    patience: Duration,
    list: ElementList,
    /// The elements sent to the driver, in the order of their numbers: the path that it follows, or
    /// followed until it was stopped.
    given: Vec<ElementRec>,
    /// Number of places that the driver holds.
    held: usize,
    /// Whether it moves along them.
    under_way: bool,
    handover: Handover,
    /// The speed that follows after the last place.
    speed: Option<Bytes>,
    /// The last speed sent to the driver.
    reported_speed: Option<Bytes>,
    /// Whether it reports its speed, as far as known.
    pub(in crate::gateway) tells_speed: bool,
    said: Effects,
}

/// Messages to send and refusals to count.
#[derive(Debug, Default)]
pub(in crate::gateway) struct Effects {
    /// Answers to the client whose message was handled.
    pub(in crate::gateway) answers: Vec<Bytes>,
    /// Code and data of messages for the driver.
    pub(in crate::gateway) to_ra: Vec<(u16, Bytes)>,
    /// Whether answers to queries have changed.
    pub(in crate::gateway) changed: bool,
    /// Refusals by message code.
    pub(in crate::gateway) refused: Vec<(u16, Refused)>,
}

/// Reason why a list request was not carried out.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(in crate::gateway) enum Refused {
    #[error(transparent)]
    Conversion(#[from] Refusal),
    #[error("no list, or no such element")]
    NoSuchElement,
    #[error("the order of waypoints cannot change while they are driven: stop first")]
    UnderWay,
    #[error("the order of waypoints has changed: execute the list from an element")]
    Reordered,
    #[error(
        "the driver holds {0} segments and discards none, but the list is shorter: reset the \
         driver first"
    )]
    Shorter(usize),
    #[error("the list manager refused: {0:?}")]
    List(ResponseCode),
    #[error("waypoint {0} was not confirmed: the list is not executed")]
    Unconfirmed(u16),
    #[error("the driver reports no waypoints: they are sent without confirmation")]
    Mute,
    #[error("the driver keeps its previous waypoint {0}: new ones are appended")]
    Keeps(u16),
    #[error("waypoint {0} is missing: the list is not executed")]
    Missing(u16),
    #[error("more waypoints than the limit")]
    TooMany,
    #[error("no answer to the new waypoints")]
    Unanswered,
}

/// Element id that addresses all elements.
const ALL: u16 = u16::MAX;

impl Course {
    /// An empty list for drivers to places of this kind.
    pub(in crate::gateway) fn new(places: Places, patience: Duration) -> Self {
        Self {
            places,
            patience,
            list: ElementList::default(),
            given: Vec::new(),
            held: 0,
            under_way: false,
            handover: Handover::default(),
            speed: None,
            reported_speed: None,
            tells_speed: true,
            said: Effects::default(),
        }
    }

    /// Whether a command with this code concerns the list.
    pub(in crate::gateway) const fn is_command(code: u16) -> bool {
        matches!(
            code,
            SetElement::CODE | DeleteElement::CODE | ExecuteList::CODE
        )
    }

    /// Handles a command of the client in control.
    pub(in crate::gateway) fn handle_command(&mut self, now: Instant, payload: &Bytes) {
        let done = match code_of(payload) {
            Some(SetElement::CODE) => self.handle_set(payload),
            Some(DeleteElement::CODE) => self.handle_delete(payload),
            Some(ExecuteList::CODE) => match ExecuteList::decode(payload) {
                Ok(execute) => self.execute(&execute),
                Err(error) => Err(Refusal::from(error).into()),
            },
            _ => Ok(()),
        };
        if let Err(why) = done {
            let code = code_of(payload).unwrap_or_default();
            self.said.refused.push((code, why));
        }
        self.pump(now);
    }

    /// The answer to a query about the list.
    pub(in crate::gateway) fn answer(&self, payload: &Bytes) -> Option<Bytes> {
        match code_of(payload)? {
            QueryElement::CODE => {
                let query = QueryElement::decode(payload).ok()?;
                let element = self.list.get(query.element_uid)?.clone();
                let report = ReportElement {
                    element_uid: element.element_uid,
                    previous_uid: element.previous_uid,
                    next_uid: element.next_uid,
                    element_data: element.element_data,
                };
                report.encode().ok()
            }
            QueryElementList::CODE => {
                let uids = self.list.uids();
                let list =
                    uids.map(|element_uid| report_element_list::ElementListRec { element_uid });
                let element_list = list.collect();
                ReportElementList { element_list }.encode().ok()
            }
            QueryElementCount::CODE => {
                let element_count = self.list.len();
                ReportElementCount { element_count }.encode().ok()
            }
            QueryActiveElement::CODE => {
                let first = self.given.first().filter(|_| self.under_way);
                let element_uid = first.map_or(0, |element| element.element_uid);
                ReportActiveElement { element_uid }.encode().ok()
            }
            _ => None,
        }
    }

    /// The queries whose answers change with the list.
    pub(in crate::gateway) const QUERIES: [u16; 4] = [
        QueryElement::CODE,
        QueryElementList::CODE,
        QueryElementCount::CODE,
        QueryActiveElement::CODE,
    ];

    /// The data of a report of the last speed sent to the driver, if the driver does not report its
    /// speed itself.
    pub(in crate::gateway) fn given_speed(&self) -> Option<Bytes> {
        self.reported_speed.clone().filter(|_| !self.tells_speed)
    }

    /// Notes a speed that a client has set without a list.
    pub(in crate::gateway) fn note_speed(&mut self, data: Bytes) {
        self.reported_speed = Some(data);
    }

    /// Handles a report of the driver. Returns whether it was expected.
    pub(in crate::gateway) fn handle_report(
        &mut self,
        now: Instant,
        code: u16,
        data: &[u8],
    ) -> bool {
        if code != self.places.report() {
            return false;
        }
        let Some(number) = self.places.number(data) else {
            return false;
        };
        let is_same_as = |set: &Bytes| self.places.are_near(set, data);
        let waited_for = self.handover.handle_report(number, is_same_as);
        self.pump(now);
        waited_for
    }

    /// Stops the driver, as no client is in control any more.
    pub(in crate::gateway) fn leave(&mut self) {
        if self.under_way
            && let Err(why) = self.halt()
        {
            self.said.refused.push((ExecuteList::CODE, why));
        }
        self.stop();
    }

    /// Ends the execution: the driver was or will be sent to standby.
    pub(in crate::gateway) fn stop(&mut self) {
        self.handover.clear();
        self.speed = None;
        self.said.changed |= std::mem::take(&mut self.under_way);
        self.given.clear();
    }

    /// Clears the list after a reset. OpenJAUS's drivers keep their waypoints across a reset.
    pub(in crate::gateway) fn reset(&mut self) {
        self.stop();
        self.list.clear();
        self.said.changed = true;
        if self.places.is_path {
            self.held = 0;
        }
    }

    /// Takes the queued messages and refusals.
    pub(in crate::gateway) fn take_said(&mut self) -> Effects {
        std::mem::take(&mut self.said)
    }

    /// Runs due timers.
    pub(in crate::gateway) fn handle_timeout(&mut self, now: Instant) {
        self.pump(now);
    }

    /// Time of the next timer.
    pub(in crate::gateway) fn poll_timeout(&self) -> Option<Instant> {
        self.handover.poll_timeout()
    }

    fn handle_set(&mut self, payload: &Bytes) -> Result<(), Refused> {
        let request = SetElement::decode(payload).map_err(Refusal::from)?;
        let id = request.request_id_rec.request_id;
        let done = self.set(&request.element_list);
        self.reply(id, done)
    }

    fn handle_delete(&mut self, payload: &Bytes) -> Result<(), Refused> {
        let request = DeleteElement::decode(payload).map_err(Refusal::from)?;
        let id = request.request_id_rec.request_id;
        let uids = request.delete_element_list.iter();
        let uids: Vec<_> = uids.map(|element| element.element_uid).collect();
        let done = self.delete(&uids);
        self.reply(id, done)
    }

    /// Reports the result of a request to the client.
    fn reply(&mut self, request_id: u8, done: Result<(), Refused>) -> Result<(), Refused> {
        let answer = match &done {
            Ok(()) => ConfirmElementRequest { request_id }.encode(),
            Err(why) => RejectElementRequest {
                request_id,
                response_code: why.response(),
            }
            .encode(),
        };
        self.said.answers.extend(answer.ok());
        self.said.changed |= done.is_ok();
        done
    }

    fn set(&mut self, elements: &[ElementRec]) -> Result<(), Refused> {
        for element in elements {
            self.places.to_ra(&element.element_data, 0)?;
        }
        let mut list = self.list.clone();
        list.set(elements).map_err(Refused::List)?;
        self.replace(list)
    }

    fn delete(&mut self, uids: &[u16]) -> Result<(), Refused> {
        if uids.contains(&ALL) {
            self.list.clear();
            self.leave();
            return Ok(());
        }
        let mut list = self.list.clone();
        list.delete(uids).map_err(Refused::List)?;
        self.replace(list)
    }

    /// Replaces the list; while the driver moves, sends it the changes.
    fn replace(&mut self, list: ElementList) -> Result<(), Refused> {
        if self.under_way {
            let chain = self.continuation(&list).ok_or(Refused::UnderWay)?;
            self.give_new(chain)?;
        }
        self.list = list;
        Ok(())
    }

    /// The elements of a list that continues the one sent to the driver, from its first element on.
    fn continuation(&self, list: &ElementList) -> Option<Vec<ElementRec>> {
        let first = self.given.first()?.element_uid;
        let chain = chain(list, first);
        let same = |(one, other): (&ElementRec, &ElementRec)| one.element_uid == other.element_uid;
        let goes_on = chain.len() >= self.given.len() && chain.iter().zip(&self.given).all(same);
        goes_on.then_some(chain)
    }

    /// Sends the elements that are new or changed.
    fn give_new(&mut self, chain: Vec<ElementRec>) -> Result<(), Refused> {
        let is_new = |(number, element): &(usize, &ElementRec)| {
            let before = self.given.get(*number);
            before.is_none_or(|it| it.element_data != element.element_data)
        };
        let new = chain.iter().enumerate().filter(is_new);
        let new: Result<Vec<_>, _> = new.map(|(at, element)| self.place(at, element)).collect();
        self.handover.add(new?);
        self.given = chain;
        self.held = self.held.max(self.given.len());
        Ok(())
    }

    /// The number and data of an element at this position.
    fn place(&self, at: usize, element: &ElementRec) -> Result<(u16, Bytes), Refused> {
        let number = u16::try_from(at).map_err(|_| Refused::TooMany)?;
        Ok((number, self.places.to_ra(&element.element_data, number)?))
    }

    fn execute(&mut self, execute: &ExecuteList) -> Result<(), Refused> {
        let speed = speed_to_ra(execute)?;
        match execute.element_uid {
            Some(uid) => self.begin(uid)?,
            None if self.given.is_empty() => return Err(Refused::NoSuchElement),
            None => {
                let chain = self.continuation(&self.list).ok_or(Refused::Reordered)?;
                self.give_new(chain)?;
            }
        }
        self.under_way = execute.speed_m_per_s() > 0.0;
        self.speed = Some(speed);
        self.said.changed = true;
        Ok(())
    }

    /// Sends the list from an element on.
    fn begin(&mut self, uid: u16) -> Result<(), Refused> {
        let first = self.list.get(uid).ok_or(Refused::NoSuchElement)?;
        let chain = chain(&self.list, first.element_uid);
        let is_repeated = !self.handover.is_done() && chain == self.given;
        if is_repeated {
            return Ok(());
        }
        if self.places.is_path && chain.len() < self.held {
            return Err(Refused::Shorter(self.held));
        }
        let last = chain.last().ok_or(Refused::NoSuchElement)?;
        let rest = (chain.len()..self.held).map(|at| (at, last));
        let all = chain.iter().enumerate().chain(rest);
        let all: Result<Vec<_>, _> = all.map(|(at, element)| self.place(at, element)).collect();
        let all = all?;
        self.held = all.len();
        self.handover.clear();
        self.handover.add(all);
        self.given = chain;
        Ok(())
    }

    /// Stops the driver at once.
    fn halt(&mut self) -> Result<(), Refused> {
        let stop = speed_to_ra(&ExecuteList::default())?;
        self.tell_speed(stop);
        Ok(())
    }

    fn tell_speed(&mut self, speed: Bytes) {
        self.reported_speed = Some(speed.clone());
        self.said.to_ra.push((SetTravelSpeed::CODE, speed));
    }

    /// Sends the due places, then the speed. A stop waits for nothing.
    fn pump(&mut self, now: Instant) {
        if !self.under_way
            && let Some(stop) = self.speed.take()
        {
            self.tell_speed(stop);
        }
        for step in self.handover.poll(now, self.patience) {
            match step {
                Do::Set(data) => self.said.to_ra.push((self.places.set, data)),
                Do::Ask(number) => {
                    let query = self.places.query_for(number);
                    self.said.to_ra.push((self.places.query, query));
                }
                Do::Mute => self.refuse(Refused::Mute),
                Do::Keeps(number) => self.refuse(Refused::Keeps(number)),
                Do::GiveUp(number) => {
                    self.refuse(Refused::Unconfirmed(number));
                    self.stop();
                }
            }
        }
        if self.handover.is_done()
            && let Some(speed) = self.speed.take()
        {
            self.tell_speed(speed);
        }
    }

    fn refuse(&mut self, why: Refused) {
        self.said.refused.push((self.places.set, why));
    }
}

/// The elements of a list from one on.
fn chain(list: &ElementList, first: u16) -> Vec<ElementRec> {
    let uids = list.uids().skip_while(|&uid| uid != first);
    uids.filter_map(|uid| list.get(uid).cloned()).collect()
}

impl Refused {
    /// The response code to the client.
    fn response(&self) -> ResponseCode {
        match self {
            Self::List(code) => *code,
            Self::Conversion(Refusal::Inexpressible {
                field: "ElementData",
            }) => ResponseCode::UNSUPPORTED_ELEMENT_TYPE,
            _ => ResponseCode::UNSPECIFIED_ERROR,
        }
    }
}
