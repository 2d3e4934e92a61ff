//! After every loss, the other side holds exactly the places that were set.

mod course;
mod entries;

use std::time::{Duration, Instant};

use bytes::Bytes;

use crate::convert::{Element, Places};
use crate::ids::RaComponent;
use jaus::codec::{FormattedBlob, Message};
use jaus::messages::core::set_element::{ElementDataFormat, ElementRec, RequestIdRec};
use jaus::messages::core::{DeleteElement, SetElement, delete_element};
use jaus::messages::mobility::{ExecuteList, SetGlobalWaypoint, SetLocalPathSegment};

const PATIENCE: Duration = Duration::from_secs(1);

#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
fn start() -> Instant {
    Instant::now()
}

fn waypoints() -> Places {
    Places::of(RaComponent::GLOBAL_WAYPOINT_DRIVER).unwrap()
}

fn segments() -> Places {
    Places::of(RaComponent::LOCAL_PATH_SEGMENT_DRIVER).unwrap()
}

/// A place identified by its number.
fn element(places: Places, place: u16) -> Element {
    if places.is_path {
        let mut segment = SetLocalPathSegment::default();
        segment.set_p2_x_m(place.into()).unwrap();
        return FormattedBlob::new(ElementDataFormat::JAUS_MESSAGE, segment.encode().unwrap());
    }
    let mut waypoint = SetGlobalWaypoint::default();
    waypoint
        .set_latitude_deg(f64::from(place) / 1000.0)
        .unwrap();
    FormattedBlob::new(ElementDataFormat::JAUS_MESSAGE, waypoint.encode().unwrap())
}

/// A list element: its number and its neighbours.
fn rec(places: Places, [previous, uid, next]: [u16; 3], place: u16) -> ElementRec {
    ElementRec {
        element_uid: uid,
        previous_uid: previous,
        next_uid: next,
        element_data: element(places, place),
    }
}

fn set(element_list: Vec<ElementRec>) -> Bytes {
    SetElement {
        request_id_rec: RequestIdRec { request_id: 7 },
        element_list,
    }
    .encode()
    .unwrap()
}

fn delete(uid: u16) -> Bytes {
    DeleteElement {
        request_id_rec: RequestIdRec { request_id: 8 },
        delete_element_list: vec![delete_element::DeleteElementRec { element_uid: uid }],
    }
    .encode()
    .unwrap()
}

fn execute(element_uid: Option<u16>, speed: f64) -> Bytes {
    let mut execute = ExecuteList {
        element_uid,
        ..ExecuteList::default()
    };
    execute.set_speed_m_per_s(speed).unwrap();
    execute.encode().unwrap()
}
