//! A JAUS component as an RA component sees it, and the list of places that it may have: what stands
//! there for the numbered places of the Reference Architecture.

use bytes::Bytes;

use crate::Message;
use crate::convert::{Element, Places, Refusal};
use crate::ids::RaComponent;
use jaus::address::JausId;
use jaus::codec::Message as _;
use jaus::messages::core::{QueryElement, ReportElement};

/// A JAUS component as an RA component sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::gateway) struct Target {
    /// Its id.
    pub(in crate::gateway) id: JausId,
    /// The minor version of the service that is meant.
    pub(in crate::gateway) minor: u8,
    /// Whether it works a list of places off.
    pub(in crate::gateway) lists: bool,
}

/// The places that a JAUS driver goes to, if it has a list of them.
pub(super) fn places(request: &Message, peer: Target) -> Option<Places> {
    let part = RaComponent(request.destination.component);
    Places::of(part).filter(|_| peer.lists)
}

/// What stands for a query for a place: that for its element.
pub(super) fn element_query(places: Places, request: &Message) -> Option<Bytes> {
    let number = places.queried(&request.data)?;
    let element_uid = number.checked_add(1)?;
    QueryElement { element_uid }.encode().ok()
}

/// The code and data of the report of a place, for that of its element.
pub(super) fn place_report(places: Places, report: &Bytes) -> Result<(u16, Bytes), Refusal> {
    let report = ReportElement::decode(report)?;
    let number = report.element_uid.saturating_sub(1);
    let format = jaus::messages::core::set_element::ElementDataFormat(report.element_data.format.0);
    let element = Element::new(format, report.element_data.data);
    Ok((places.report(), places.to_ra(&element, number)?))
}
