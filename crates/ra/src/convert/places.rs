//! Places by number and as elements of a list: what a client sets at a waypoint or path segment driver
//! of the Reference Architecture is, among ours, an element that holds a message.
//!
//! The number is no matter of the place: who keeps the list gives it.

use bytes::{Bytes, BytesMut};

use super::{Context, Refusal, to_jaus_with, to_ra_with};
use crate::ids::RaComponent;
use crate::messages::ra33;
use jaus::codec::{FormattedBlob, Message};
use jaus::messages::core::SetElement;
use jaus::messages::core::set_element::{ElementDataFormat, ElementRec};
use jaus::messages::mobility;

/// The kind of places that a driver of the Reference Architecture goes to, and its messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Places {
    /// The type of the driver.
    pub part: RaComponent,
    /// The code of the message that sets a place; its report is laid out alike.
    pub set: u16,
    /// The code of the query for a place.
    pub query: u16,
    /// Whether a place is the end of a given way: a path segment.
    pub is_path: bool,
}

/// The data of an element: a message of ours in its format.
pub type Element = FormattedBlob<ElementDataFormat>;

/// What a report's code is above that of the message that sets the same.
const REPORT: u16 = 0x4000;

/// Where the number stands, behind the presence vector.
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
    /// Those of a component of this type, if it goes to places.
    #[must_use]
    pub fn of(part: RaComponent) -> Option<Self> {
        ALL.into_iter().find(|places| places.part == part)
    }

    /// The code of the report of a place.
    #[must_use]
    pub const fn report(self) -> u16 {
        self.set + REPORT
    }

    /// The data of the RA message that sets, or reports, an element as the place with a number.
    ///
    /// # Errors
    /// An element of another kind, and what cannot be said of it.
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

    /// The number and the element that the data of an RA message sets or reports.
    ///
    /// # Errors
    /// Data that is too short, and what cannot be said of the place.
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

    /// The number in the data of a message that sets or reports a place.
    #[must_use]
    pub fn number(self, data: &[u8]) -> Option<u16> {
        let octets = data.get(NUMBER)?;
        Some(u16::from_le_bytes([octets[0], octets[1]]))
    }

    /// Whether the data of two messages that set or report a place say the same one: drivers that
    /// compute with it may tell it with another last digit.
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

    /// The data of the query for the place with a number.
    #[must_use]
    pub fn query_for(self, number: u16) -> Bytes {
        let mut data = BytesMut::from(number.to_le_bytes().as_slice());
        if self.is_path {
            // Without heights.
            data.extend_from_slice(&[0]);
        }
        data.freeze()
    }

    /// The number that a query asks for.
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

/// The message that sets an element as the only one, which stands for the place with the number 0.
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

/// The data of Set Travel Speed for a list that is executed at a speed.
///
/// # Errors
/// A speed that the other side cannot hold.
pub fn speed_to_ra(execute: &mobility::ExecuteList) -> Result<Bytes, Refusal> {
    let mut set = ra33::SetTravelSpeed::default();
    set.set_speed_m_per_s(execute.speed_m_per_s())?;
    Ok(set.encode()?.slice(2..))
}

/// The execution of a list, without an element to begin with, for the data of Set Travel Speed.
///
/// # Errors
/// Data that is none, or a speed that the other side cannot hold.
pub fn speed_to_jaus(data: &Bytes) -> Result<mobility::ExecuteList, Refusal> {
    let mut payload = BytesMut::from(ra33::SetTravelSpeed::CODE.to_le_bytes().as_slice());
    payload.extend_from_slice(data);
    let set = ra33::SetTravelSpeed::decode(&payload.freeze())?;
    let mut execute = mobility::ExecuteList::default();
    execute.set_speed_m_per_s(set.speed_m_per_s())?;
    Ok(execute)
}
