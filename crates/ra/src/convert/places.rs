//! Converts numbered places of RA waypoint and path segment drivers to list elements of ours: each
//! element holds a message.
//!
//! The number is not part of the place: the keeper of the list assigns it.

use bytes::{Bytes, BytesMut};

use super::{Context, Refusal, to_jaus_with, to_ra_with};
use crate::ids::RaComponent;
use crate::messages::ra33;
use jaus::codec::{FormattedBlob, Message};
use jaus::messages::core::SetElement;
use jaus::messages::core::set_element::{ElementDataFormat, ElementRec};
use jaus::messages::mobility;

/// Kind of places that an RA driver moves to, with its message codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Places {
    /// Type of the driver.
    pub part: RaComponent,
    /// Code of the message that sets a place; its report has the same layout.
    pub set: u16,
    /// The code of the query for a place.
    pub query: u16,
    /// Whether a place is the end of a given path: a path segment.
    pub is_path: bool,
}

/// Data of an element: a message of ours in its format.
pub type Element = FormattedBlob<ElementDataFormat>;

/// Offset of a report's code from the code of its set message.
const REPORT: u16 = 0x4000;

/// Position of the number, after the presence vector.
const NUMBER: std::ops::Range<usize> = 1..3;

const ALL: [Places; 4] = [
    Places {
        part: RaComponent::GLOBAL_WAYPOINT_DRIVER,
        set: ra33::SetGlobalWaypoint::CODE,
        query: ra33::QueryGlobalWaypoint::CODE,
        is_path: false,
    },
    Places {
        part: RaComponent::LOCAL_WAYPOINT_DRIVER,
        set: ra33::SetLocalWaypoint::CODE,
        query: ra33::QueryLocalWaypoint::CODE,
        is_path: false,
    },
    Places {
        part: RaComponent::GLOBAL_PATH_SEGMENT_DRIVER,
        set: ra33::SetGlobalPathSegment::CODE,
        query: ra33::QueryGlobalPathSegment::CODE,
        is_path: true,
    },
    Places {
        part: RaComponent::LOCAL_PATH_SEGMENT_DRIVER,
        set: ra33::SetLocalPathSegment::CODE,
        query: ra33::QueryLocalPathSegment::CODE,
        is_path: true,
    },
];

impl Places {
    /// The places of a component type, if it moves to places.
    #[must_use]
    pub fn of(part: RaComponent) -> Option<Self> {
        ALL.into_iter().find(|places| places.part == part)
    }

    /// Code of a place report.
    #[must_use]
    pub const fn report(self) -> u16 {
        self.set + REPORT
    }

    /// The RA data that sets or reports an element as the place with this number.
    ///
    /// # Errors
    /// An element of another kind, or content that does not convert.
    pub fn to_ra(self, element: &Element, number: u16) -> Result<Bytes, Refusal> {
        let code = element.data.first_chunk().copied().map(u16::from_le_bytes);
        let is_known = element.format == ElementDataFormat::JAUS_MESSAGE && code == Some(self.set);
        if !is_known {
            return Err(Refusal::Inexpressible {
                field: "ElementData",
            });
        }
        let payload = match self.is_path {
            true => first(element.clone()).encode()?,
            false => element.data.clone(),
        };
        let (_, data) = to_ra_with(self.context(), &payload)?;
        Ok(with_number(&data, number))
    }

    /// The number and element of RA data that sets or reports a place.
    ///
    /// # Errors
    /// Data that is too short, or content that does not convert.
    pub fn to_jaus(self, data: &Bytes) -> Result<(u16, Element), Refusal> {
        let number = self.number(data).ok_or(Refusal::Missing {
            field: "the number",
        })?;
        let payload = to_jaus_with(self.context(), self.set, &with_number(data, 0))?;
        if !self.is_path {
            let element = FormattedBlob::new(ElementDataFormat::JAUS_MESSAGE, payload);
            return Ok((number, element));
        }
        let set = SetElement::decode(&payload)?;
        let element = set.element_list.into_iter().next();
        let element = element.ok_or(Refusal::Missing {
            field: "ElementList",
        })?;
        Ok((number, element.element_data))
    }

    /// The number in RA data that sets or reports a place.
    #[must_use]
    pub fn number(self, data: &[u8]) -> Option<u16> {
        let octets = data.get(NUMBER)?;
        Some(u16::from_le_bytes([octets[0], octets[1]]))
    }

    /// Whether two RA messages set or report the same place: drivers that compute with it may
    /// report it with a different last digit.
    #[must_use]
    pub fn are_near(self, one: &[u8], other: &[u8]) -> bool {
        const SLACK: u32 = 2;
        let coordinate = |data: &[u8], at: usize| {
            let octets = data.get(NUMBER.end + 4 * at..)?;
            Some(u32::from_le_bytes(*octets.first_chunk()?))
        };
        let near = |at| match (coordinate(one, at), coordinate(other, at)) {
            (Some(one), Some(other)) => {
                let apart = one.wrapping_sub(other);
                apart.min(apart.wrapping_neg()) <= SLACK
            }
            _ => false,
        };
        near(0) && near(1)
    }

    /// Data of the query for the place with this number.
    #[must_use]
    pub fn query_for(self, number: u16) -> Bytes {
        let mut data = BytesMut::from(number.to_le_bytes().as_slice());
        if self.is_path {
            // No heights.
            data.extend_from_slice(&[0]);
        }
        data.freeze()
    }

    /// The number that a query requests.
    #[must_use]
    pub fn queried(self, data: &[u8]) -> Option<u16> {
        data.first_chunk().copied().map(u16::from_le_bytes)
    }

    fn context(self) -> Context<'static> {
        Context {
            part: Some(self.part),
            ..Context::default()
        }
    }
}

/// Sets an element as the only one, which stands for the place with number 0.
fn first(element_data: Element) -> SetElement {
    SetElement {
        element_list: vec![ElementRec {
            element_uid: 1,
            previous_uid: 0,
            next_uid: 0,
            element_data,
        }],
        ..SetElement::default()
    }
}

fn with_number(data: &Bytes, number: u16) -> Bytes {
    let mut numbered = BytesMut::from(data.as_ref());
    if let Some(place) = numbered.get_mut(NUMBER) {
        place.copy_from_slice(&number.to_le_bytes());
    }
    numbered.freeze()
}

/// Data of Set Travel Speed for a list executed at a speed.
///
/// # Errors
/// A speed out of the other side's range.
pub fn speed_to_ra(execute: &mobility::ExecuteList) -> Result<Bytes, Refusal> {
    let mut set = ra33::SetTravelSpeed::default();
    set.set_speed_m_per_s(execute.speed_m_per_s())?;
    Ok(set.encode()?.slice(2..))
}

/// Converts Set Travel Speed to Execute List without a starting element.
///
/// # Errors
/// Malformed data, or a speed out of the other side's range.
pub fn speed_to_jaus(data: &Bytes) -> Result<mobility::ExecuteList, Refusal> {
    let mut payload = BytesMut::from(ra33::SetTravelSpeed::CODE.to_le_bytes().as_slice());
    payload.extend_from_slice(data);
    let set = ra33::SetTravelSpeed::decode(&payload.freeze())?;
    let mut execute = mobility::ExecuteList::default();
    execute.set_speed_m_per_s(set.speed_m_per_s())?;
    Ok(execute)
}
