//! Path segments: 040Fh 0410h, 240Eh to 2410h, 440Eh to 4410h, and their travel speed.
//!
//! Both sides use the same curve, with a control point P1, an end P2 and a weight. An RA path
//! segment driver gets numbered segments and starts when it gets a travel speed. Ours has a list: a
//! segment is an element that follows its predecessor, and the list is executed at a speed. So
//! segment n is element n + 1, which follows element n, and for these drivers Set Travel Speed is
//! Execute List: above zero from the first element, whether or not the vehicle is moving; at zero
//! without an element, which only changes the speed. Our list accepts no second first element:
//! another path is set after a Reset. (A caller that knows the earlier segments can do better: the
//! gateway keeps the list and converts only the places with [`Places`](super::Places).)
//!
//! Our report is about the current segment; it is queried and reported under the number 0. A limit
//! of the path is refused in a command and left out in a report.

use super::carry::{Carry, Counterpart, same_fields};
use super::pair::Pair;
use super::waypoints::{ONLY, only, unlimited};
use super::{Context, Refusal};
use crate::ids::RaComponent;
use crate::messages::ra33;
use jaus::codec::{FormattedBlob, Message};
use jaus::messages::core::set_element::{ElementDataFormat, ElementRec};
use jaus::messages::{core, mobility};

const GLOBAL: &[RaComponent] = &[RaComponent::GLOBAL_PATH_SEGMENT_DRIVER];
const LOCAL: &[RaComponent] = &[RaComponent::LOCAL_PATH_SEGMENT_DRIVER];
const BOTH: &[RaComponent] = &[
    RaComponent::GLOBAL_PATH_SEGMENT_DRIVER,
    RaComponent::LOCAL_PATH_SEGMENT_DRIVER,
];
const WAYPOINTS: &[RaComponent] = &[
    RaComponent::GLOBAL_WAYPOINT_DRIVER,
    RaComponent::LOCAL_WAYPOINT_DRIVER,
];

pub(super) const PAIRS: &[Pair] = &[
    Pair::of::<ra33::SetTravelSpeed, mobility::ExecuteList>().for_parts(BOTH),
    Pair::of::<ra33::SetGlobalPathSegment, core::SetElement>().for_parts(GLOBAL),
    Pair::of::<ra33::SetLocalPathSegment, core::SetElement>().for_parts(LOCAL),
    Pair::of::<ra33::QueryGlobalPathSegment, mobility::QueryGlobalPathSegment>(),
    Pair::of::<ra33::QueryLocalPathSegment, mobility::QueryLocalPathSegment>(),
    Pair::of::<ra33::ReportGlobalPathSegment, mobility::ReportGlobalPathSegment>(),
    Pair::of::<ra33::ReportLocalPathSegment, mobility::ReportLocalPathSegment>(),
    Pair::of::<ra33::QueryPathSegmentCount, core::QueryElementCount>().for_parts(BOTH),
    Pair::of::<ra33::ReportPathSegmentCount, core::ReportElementCount>().for_parts(BOTH),
    Pair::of::<ra33::QueryWaypointCount, core::QueryElementCount>().for_parts(WAYPOINTS),
    Pair::of::<ra33::ReportWaypointCount, core::ReportElementCount>().for_parts(WAYPOINTS),
];

same_fields! {
    ra33::QueryPathSegmentCount, core::QueryElementCount {}
    ra33::QueryWaypointCount, core::QueryElementCount {}
    ra33::ReportPathSegmentCount, core::ReportElementCount {; path_segment_count = element_count }
    ra33::ReportWaypointCount, core::ReportElementCount {; waypoint_count = element_count }
}

impl Counterpart<mobility::ExecuteList> for ra33::SetTravelSpeed {
    fn counterpart(self, _: Context<'_>) -> Result<mobility::ExecuteList, Refusal> {
        let sets_out = self.speed_m_per_s() > 0.0;
        Ok(mobility::ExecuteList {
            speed: self.speed.carry()?,
            element_uid: sets_out.then_some(FROM_THE_FIRST),
        })
    }
}

impl Counterpart<ra33::SetTravelSpeed> for mobility::ExecuteList {
    fn counterpart(self, _: Context<'_>) -> Result<ra33::SetTravelSpeed, Refusal> {
        match self.element_uid {
            None | Some(FROM_THE_FIRST) => {}
            Some(_) => {
                return Err(Refusal::Inexpressible {
                    field: "ElementUID",
                });
            }
        }
        Ok(ra33::SetTravelSpeed {
            speed: self.speed.carry()?,
        })
    }
}

/// Execute List's id for the first element.
const FROM_THE_FIRST: u16 = 0;

/// Neighbour id at the ends of the list.
const NONE: u16 = 0;

/// Converts a segment to a list element.
fn element<M: Message>(number: u16, segment: &M) -> Result<core::SetElement, Refusal> {
    let uid = number.checked_add(1).ok_or(Refusal::UnknownValue {
        field: "PathSegmentNumber",
        value: number.into(),
    })?;
    Ok(core::SetElement {
        element_list: vec![ElementRec {
            element_uid: uid,
            previous_uid: number,
            next_uid: NONE,
            element_data: FormattedBlob::new(ElementDataFormat::JAUS_MESSAGE, segment.encode()?),
        }],
        ..core::SetElement::default()
    })
}

/// The number and segment of the only element, which must follow its predecessor.
fn segment<M: Message>(set: &core::SetElement) -> Result<(u16, M), Refusal> {
    let inexpressible = |field| Err(Refusal::Inexpressible { field });
    let [element] = set.element_list.as_slice() else {
        return inexpressible("ElementList");
    };
    if element.next_uid != NONE {
        return inexpressible("NextUID");
    }
    if element.element_uid == NONE || element.previous_uid != element.element_uid - 1 {
        return inexpressible("PreviousUID");
    }
    let data = &element.element_data;
    let is_segment = data.format == ElementDataFormat::JAUS_MESSAGE
        && data.data.starts_with(&M::CODE.to_le_bytes());
    if !is_segment {
        return inexpressible("ElementData");
    }
    Ok((element.previous_uid, M::decode(&data.data)?))
}

/// Implements set and report of segments.
macro_rules! segments {
    ($(
        $set:path, $query:path, $report:path = $our_query:path, $our_report:path, $our_set:path
            { $($theirs:ident = $ours:ident),* }
    )*) => {$(
        impl Counterpart<$our_report> for $report {
            fn counterpart(self, _: Context<'_>) -> Result<$our_report, Refusal> {
                type There = $our_report;
                Ok(There {
                    $($ours: self.$theirs.carry()?,)*
                    path_tolerance: None,
                })
            }
        }

        impl Counterpart<$report> for $our_report {
            fn counterpart(self, _: Context<'_>) -> Result<$report, Refusal> {
                type There = $report;
                Ok(There {
                    path_segment_number: ONLY,
                    $($theirs: self.$ours.carry()?,)*
                })
            }
        }

        impl Counterpart<core::SetElement> for $set {
            fn counterpart(self, _: Context<'_>) -> Result<core::SetElement, Refusal> {
                type There = $our_set;
                let segment = There {
                    $($ours: self.$theirs.carry()?,)*
                    path_tolerance: None,
                };
                element(self.path_segment_number, &segment)
            }
        }

        impl Counterpart<$set> for core::SetElement {
            fn counterpart(self, _: Context<'_>) -> Result<$set, Refusal> {
                type There = $set;
                let (number, segment) = segment::<$our_set>(&self)?;
                unlimited(segment.path_tolerance_m())?;
                Ok(There {
                    path_segment_number: number,
                    $($theirs: segment.$ours.carry()?,)*
                })
            }
        }

        impl Counterpart<$our_query> for $query {
            fn counterpart(self, _: Context<'_>) -> Result<$our_query, Refusal> {
                type There = $our_query;
                only(self.path_segment_number, "PathSegmentNumber")?;
                let presence_vector = self.presence_vector & HEIGHTS;
                Ok(There { presence_vector })
            }
        }

        impl Counterpart<$query> for $our_query {
            fn counterpart(self, _: Context<'_>) -> Result<$query, Refusal> {
                type There = $query;
                Ok(There {
                    path_segment_number: ONLY,
                    presence_vector: self.presence_vector & HEIGHTS,
                })
            }
        }
    )*};
}

/// The heights of P1 and P2, optional on both sides.
const HEIGHTS: u8 = 0b11;

segments! {
    ra33::SetGlobalPathSegment, ra33::QueryGlobalPathSegment, ra33::ReportGlobalPathSegment
        = mobility::QueryGlobalPathSegment, mobility::ReportGlobalPathSegment,
        mobility::SetGlobalPathSegment {
        p1_latitude = p1_latitude, p1_longitude = p1_longitude, p1_altitude = p1_altitude,
        p2_latitude = p2_latitude, p2_longitude = p2_longitude, p2_altitude = p2_altitude,
        weighting_factor = weighting_factor
    }
    ra33::SetLocalPathSegment, ra33::QueryLocalPathSegment, ra33::ReportLocalPathSegment
        = mobility::QueryLocalPathSegment, mobility::ReportLocalPathSegment,
        mobility::SetLocalPathSegment {
        p1x = p1_x, p1y = p1_y, p1z = p1_z, p2x = p2_x, p2y = p2_y, p2z = p2_z,
        weighting_factor = weighting_factor
    }
}
