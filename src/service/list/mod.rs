//! The List Manager service: a linked list of elements that a client builds and drivers execute.
//!
//! The list itself is [`ElementList`], behind the shared handle [`Elements`]. [`ListManager`] is
//! the service with which clients read and change it. Drivers that execute a list hold a clone of
//! the same handle, and register the element types that they support ([`Elements::accept`]).

mod elements;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use bytes::Bytes;

use super::{Context, Handled, Hazards, Service, Standing, State, code_of, read};
use crate::codec::{Message, ServiceId};
use crate::endpoint::Received;
use crate::messages::core::reject_element_request::ResponseCode;
use crate::messages::core::set_element::{ElementDataFormat, ElementRec};
use crate::messages::core::{
    ConfirmElementRequest, DeleteElement, QueryElement, QueryElementCount, QueryElementList,
    RejectElementRequest, ReportElement, ReportElementCount, ReportElementList, SetElement,
    list_manager, report_element_list,
};

pub use elements::ElementList;

/// A list that a [`ListManager`] and any number of drivers share.
#[derive(Clone, Default)]
pub struct Elements {
    shared: Arc<Mutex<Shared>>,
}

impl std::fmt::Debug for Elements {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.lock().list.fmt(f)
    }
}

#[derive(Default)]
struct Shared {
    list: ElementList,
    /// By the message code of an element: the check whether a driver supports it.
    kinds: BTreeMap<u16, Check>,
}

type Check = Box<dyn Fn(&Bytes) -> Result<(), ResponseCode> + Send>;

impl Elements {
    /// An empty list that rejects all elements until a type is [accepted](Self::accept).
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Accepts elements that hold a message of type `M`.
    pub fn accept<M: Message>(&self) {
        self.accept_if(|_: &M| true);
    }

    /// Accepts elements that hold a message of type `M` if `can_do` returns true, for instance if
    /// it is in range.
    pub fn accept_if<M: Message>(&self, can_do: impl Fn(&M) -> bool + Send + 'static) {
        let check = move |octets: &Bytes| match M::decode(octets) {
            Ok(message) if can_do(&message) => Ok(()),
            Ok(_) => Err(ResponseCode::UNSPECIFIED_ERROR),
            Err(_) => Err(ResponseCode::UNSUPPORTED_ELEMENT_TYPE),
        };
        self.accept_code(M::CODE, check);
    }

    /// Accepts elements that hold a message with this code if the check of its octets succeeds.
    pub fn accept_code(
        &self,
        code: u16,
        check: impl Fn(&Bytes) -> Result<(), ResponseCode> + Send + 'static,
    ) {
        self.lock().kinds.insert(code, Box::new(check));
    }

    /// The element with a number, if it is in the list; 0 means the first one.
    #[must_use]
    pub fn get(&self, uid: u16) -> Option<ElementRec> {
        self.lock().list.get(uid).cloned()
    }

    /// The number of elements before the one with a number, and of all elements.
    #[must_use]
    pub fn place_of(&self, uid: u16) -> (usize, usize) {
        let shared = self.lock();
        let before = shared.list.uids().take_while(|&other| other != uid).count();
        (before, shared.list.len().into())
    }

    /// Removes all elements.
    pub fn clear(&self) {
        self.lock().list.clear();
    }

    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Shared {
    /// Checks whether a driver supports an element.
    fn check(&self, element: &ElementRec) -> Result<(), ResponseCode> {
        let data = &element.element_data;
        let check = code_of(&data.data).and_then(|code| self.kinds.get(&code));
        match check.filter(|_| data.format == ElementDataFormat::JAUS_MESSAGE) {
            Some(check) => check(&data.data),
            None => Err(ResponseCode::UNSUPPORTED_ELEMENT_TYPE),
        }
    }

    fn set(&mut self, elements: &[ElementRec]) -> Result<(), ResponseCode> {
        elements
            .iter()
            .try_for_each(|element| self.check(element))?;
        self.list.set(elements)
    }
}

/// Lets clients read the list, and the client in control change it.
///
/// A request takes effect as a whole or is rejected as a whole. The list is cleared when the
/// component [initializes](State::Initialize), as on a reset if it is
/// [configured](super::Management::initializes) to.
#[derive(Debug)]
pub struct ListManager {
    elements: Elements,
}

impl ListManager {
    /// The service for a list.
    #[must_use]
    pub const fn new(elements: Elements) -> Self {
        Self { elements }
    }

    fn set(&self, message: &Received, context: &mut Context<'_>) {
        if let Some(request) = requested::<SetElement>(message, context) {
            let result = self.elements.lock().set(&request.element_list);
            let id = request.request_id_rec.request_id;
            answer(id, result, message, context);
        }
    }

    fn delete(&self, message: &Received, context: &mut Context<'_>) {
        if let Some(request) = requested::<DeleteElement>(message, context) {
            let uids = request.delete_element_list.iter();
            let uids: Vec<_> = uids.map(|element| element.element_uid).collect();
            let result = self.elements.lock().list.delete(&uids);
            let id = request.request_id_rec.request_id;
            answer(id, result, message, context);
        }
    }

    /// A missing element is not reported: the standard defines no answer for it.
    fn report(&self, message: &Received, context: &mut Context<'_>) {
        let element = read::<QueryElement>(message);
        let element = element.and_then(|query| self.elements.get(query.element_uid));
        if let Some(element) = element {
            let report = ReportElement {
                element_uid: element.element_uid,
                previous_uid: element.previous_uid,
                next_uid: element.next_uid,
                element_data: element.element_data,
            };
            context.reply(message, &report);
        }
    }

    fn report_list(&self) -> ReportElementList {
        let shared = self.elements.lock();
        let uids = shared.list.uids();
        ReportElementList {
            element_list: uids
                .map(|element_uid| report_element_list::ElementListRec { element_uid })
                .collect(),
        }
    }

    fn report_count(&self) -> ReportElementCount {
        ReportElementCount {
            element_count: self.elements.lock().list.len(),
        }
    }
}

/// Reads a request of the client in control; requests of other clients are ignored.
fn requested<M: Message>(message: &Received, context: &Context<'_>) -> Option<M> {
    if context.standing().obeys(message.source) {
        return read(message);
    }
    tracing::debug!(source = %message.source, command = M::NAME, "ignored: sender not in control");
    None
}

/// Confirms or rejects a request, and reports the change of the list.
fn answer(
    request_id: u8,
    result: Result<(), ResponseCode>,
    message: &Received,
    context: &mut Context<'_>,
) {
    match result {
        Ok(()) => {
            context.reply(message, &ConfirmElementRequest { request_id });
            changed(context);
        }
        Err(response_code) => {
            tracing::debug!(source = %message.source, ?response_code, "element request refused");
            let refusal = RejectElementRequest {
                request_id,
                response_code,
            };
            context.reply(message, &refusal);
        }
    }
}

fn changed(context: &mut Context<'_>) {
    context.changed::<QueryElement>();
    context.changed::<QueryElementList>();
    context.changed::<QueryElementCount>();
}

impl Service for ListManager {
    fn offers(&self) -> Vec<ServiceId> {
        // Version 1.0 has the same messages; mobility drivers of 2009 inherit it.
        let first = ServiceId {
            minor: 0,
            ..list_manager::V1_1
        };
        vec![list_manager::V1_1, first]
    }

    fn hazards(&self) -> Hazards {
        Hazards {
            set_up_by: Some(SetElement::NAME),
            ..Hazards::default()
        }
    }

    fn handle_message(
        &mut self,
        _: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        match code_of(&message.payload) {
            Some(SetElement::CODE) => self.set(message, context),
            Some(DeleteElement::CODE) => self.delete(message, context),
            Some(QueryElement::CODE) => self.report(message, context),
            Some(QueryElementList::CODE) => context.reply(message, &self.report_list()),
            Some(QueryElementCount::CODE) => context.reply(message, &self.report_count()),
            _ => return Handled::No,
        }
        Handled::Yes
    }

    fn handle_standing(&mut self, _: Instant, _: &Standing, context: &mut Context<'_>) {
        if context.standing().state == State::Initialize {
            self.elements.clear();
            changed(context);
        }
    }
}
