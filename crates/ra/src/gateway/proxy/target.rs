//! A JAUS component as an RA component addresses it, and its list elements as numbered places of
//! the Reference Architecture.

use std::time::Instant;

use bytes::Bytes;

use crate::convert::{Element, Places, Refusal};
use crate::gateway::counters::{Counter, Tally};
use crate::ids::RaComponent;
use crate::message::Message;
use jaus::address::JausId;
use jaus::codec::Message as _;
use jaus::messages::core::{QueryElement, ReportElement};
use jaus::service::Stack;

/// A JAUS component addressed by an RA component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::gateway) struct Target {
    /// Its id.
    pub(in crate::gateway) id: JausId,
    /// The minor version of its service.
    pub(in crate::gateway) minor: u8,
    /// Whether it executes a list of places.
    pub(in crate::gateway) lists: bool,
}

/// A message of an RA component to a JAUS component, and what its handling needs.
pub(super) struct RaRequest<'a> {
    pub(super) now: Instant,
    pub(super) message: &'a Message,
    pub(super) peer: Target,
    pub(super) stack: &'a mut Stack,
    pub(super) tally: &'a mut Tally,
}

impl RaRequest<'_> {
    /// Counts the message as refused.
    pub(super) fn refuse(&mut self, counter: Counter) {
        let Message { code, source, .. } = *self.message;
        self.tally.refuse(self.now, counter, code, source);
    }
}

/// The places of a JAUS driver, if it has a list.
pub(super) fn places(request: &Message, peer: Target) -> Option<Places> {
    let part = RaComponent(request.destination.component);
    Places::of(part).filter(|_| peer.lists)
}

/// Converts a query for a place to a query for its element.
pub(super) fn element_query(places: Places, request: &Message) -> Option<Bytes> {
    let number = places.queried(&request.data)?;
    let element_uid = number.checked_add(1)?;
    QueryElement { element_uid }.encode().ok()
}

/// Converts the report of an element to code and data of a place report.
pub(super) fn place_report(places: Places, report: &Bytes) -> Result<(u16, Bytes), Refusal> {
    let report = ReportElement::decode(report)?;
    let number = report.element_uid.saturating_sub(1);
    let format = jaus::messages::core::set_element::ElementDataFormat(report.element_data.format.0);
    let element = Element::new(format, report.element_data.data);
    Ok((places.report(), places.to_ra(&element, number)?))
}
