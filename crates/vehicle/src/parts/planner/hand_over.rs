//! Hands a path over to the path segment driver: clears its list, fills it with the segments and
//! executes it. Every command is acknowledged, and every change of the list is confirmed.
#![expect(clippy::disallowed_methods, reason = "waits for a confirmation")]

use std::time::Duration;

use bytes::Bytes;

use crate::mission::{Path, Point};
use jaus::address::JausId;
use jaus::codec::{FormattedBlob, Message, OutOfRange};
use jaus::component::{Messages, Session};
use jaus::messages::core::delete_element::DeleteElementRec;
use jaus::messages::core::set_element::{ElementDataFormat, ElementRec, RequestIdRec};
use jaus::messages::core::{
    ConfirmElementRequest, DeleteElement, RejectElementRequest, SetElement,
};
use jaus::messages::mobility::report_local_path_segment::{
    P1X, P1Y, P2X, P2Y, PathTolerance, WeightingFactor,
};
use jaus::messages::mobility::{ExecuteList, ReportLocalPathSegment};
use jaus::service::code_of;

/// Set Local Path Segment. It has the layout of its report and occurs only in list elements.
const SET_LOCAL_PATH_SEGMENT: u16 = 0x0410;
/// Number of segments per message, so that it fits into a packet.
const AT_ONCE: usize = 24;
/// Selects all elements of a list.
const ALL: u16 = u16::MAX;
/// Timeout for a confirmation.
const PATIENCE: Duration = Duration::from_secs(3);

/// Hands over all segments and starts their execution.
pub(super) async fn hand_over(
    messages: Messages,
    session: &Session,
    driver: JausId,
    path: &Path,
    speed: f64,
    tolerance: f64,
) -> Result<(), String> {
    let elements = elements(path, tolerance).map_err(|error| {
        format!("cannot encode the path as path segments: {error}; choose a closer destination")
    })?;
    let mut list = List {
        messages,
        session,
        driver,
        request: 0,
    };
    list.clear().await?;
    for some in elements.chunks(AT_ONCE) {
        list.append(some).await?;
    }
    let mut execute = ExecuteList {
        element_uid: Some(0),
        ..ExecuteList::default()
    };
    execute
        .set_speed_m_per_s(speed)
        .map_err(|error| format!("cannot encode the speed: {error}"))?;
    list.session.deliver(&execute).await.map_err(in_words)
}

/// Converts the segments to list elements, numbered from 1.
pub(super) fn elements(path: &Path, tolerance: f64) -> Result<Vec<ElementRec>, OutOfRange> {
    let numbers = 1_u16..;
    let segments = path.segments().zip(numbers);
    segments
        .map(|((from, to), uid)| {
            let data = segment(from, to, tolerance)?;
            Ok(ElementRec {
                element_uid: uid,
                previous_uid: uid - 1,
                // Set when the successor is appended.
                next_uid: 0,
                element_data: FormattedBlob::new(ElementDataFormat::JAUS_MESSAGE, data),
            })
        })
        .collect()
}

/// Encodes a straight segment.
fn segment(from: Point, to: Point, tolerance: f64) -> Result<Bytes, OutOfRange> {
    let (x, y) = (f64::midpoint(from.0, to.0), f64::midpoint(from.1, to.1));
    let segment = ReportLocalPathSegment {
        p1_x: P1X::new(x)?,
        p1_y: P1Y::new(y)?,
        p2_x: P2X::new(to.0)?,
        p2_y: P2Y::new(to.1)?,
        weighting_factor: WeightingFactor::new(0.0)?,
        path_tolerance: Some(PathTolerance::new(tolerance)?),
        ..ReportLocalPathSegment::default()
    };
    let mut octets = Vec::with_capacity(segment.encoded_len());
    octets.extend(SET_LOCAL_PATH_SEGMENT.to_le_bytes());
    // All fields have a fixed length, so encoding cannot fail.
    let encoded = segment.encode().unwrap_or_default();
    octets.extend(encoded.iter().skip(2));
    Ok(octets.into())
}

/// The list of a driver under control.
struct List<'a> {
    messages: Messages,
    session: &'a Session,
    driver: JausId,
    request: u8,
}

impl List<'_> {
    async fn clear(&mut self) -> Result<(), String> {
        let request_id_rec = self.next();
        self.request(&DeleteElement {
            request_id_rec,
            delete_element_list: vec![DeleteElementRec { element_uid: ALL }],
        })
        .await
    }

    /// Appends consecutive elements.
    async fn append(&mut self, elements: &[ElementRec]) -> Result<(), String> {
        let mut element_list = elements.to_vec();
        for index in 1..element_list.len() {
            element_list[index - 1].next_uid = element_list[index].element_uid;
        }
        let request_id_rec = self.next();
        self.request(&SetElement {
            request_id_rec,
            element_list,
        })
        .await
    }

    const fn next(&mut self) -> RequestIdRec {
        self.request = self.request.wrapping_add(1);
        RequestIdRec {
            request_id: self.request,
        }
    }

    /// Sends a command that changes the list, and waits for its confirmation.
    async fn request(&mut self, command: &impl Message) -> Result<(), String> {
        self.session.deliver(command).await.map_err(in_words)?;
        let answer = self.answer();
        match tokio::time::timeout(PATIENCE, answer).await {
            Ok(answer) => answer,
            Err(_) => Err(format!(
                "{} has not confirmed its list within {} s",
                self.driver,
                PATIENCE.as_secs()
            )),
        }
    }

    async fn answer(&mut self) -> Result<(), String> {
        let peer = self.driver;
        while let Some(message) = self.messages.next().await {
            if message.source != peer {
                continue;
            }
            match code_of(&message.payload) {
                Some(ConfirmElementRequest::CODE) => {
                    let answer = ConfirmElementRequest::decode(&message.payload);
                    if answer.is_ok_and(|answer| answer.request_id == self.request) {
                        return Ok(());
                    }
                }
                Some(RejectElementRequest::CODE) => {
                    if let Ok(answer) = RejectElementRequest::decode(&message.payload)
                        && answer.request_id == self.request
                    {
                        return Err(format!(
                            "{peer} rejects the segments: {:?}",
                            answer.response_code
                        ));
                    }
                }
                _ => {}
            }
        }
        Err("the node has stopped".to_owned())
    }
}

pub(super) fn in_words(error: impl std::fmt::Display) -> String {
    error.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use jaus::service::ElementList;

    #[test]
    fn the_segments_make_one_list_however_many_go_at_once() {
        let corner = |index: u16| (f64::from(index), f64::from(index % 2));
        let path = Path::new((0..=60).map(corner).collect());
        let elements = elements(&path, 0.3).unwrap();
        assert_eq!(elements.len(), 60);
        let mut list = ElementList::default();
        for some in elements.chunks(7) {
            let mut some = some.to_vec();
            for index in 1..some.len() {
                some[index - 1].next_uid = some[index].element_uid;
            }
            list.set(&some).unwrap();
        }
        assert!(list.uids().eq(1..=60));
    }

    #[test]
    fn a_segment_ends_where_the_path_turns() {
        let path = Path::new(vec![(0.0, 0.0), (3.0, 4.0), (3.0, 9.0)]);
        let elements = elements(&path, 0.3).unwrap();
        let data = &elements[1].element_data.data;
        assert_eq!(code_of(data), Some(0x0410));
        let code = ReportLocalPathSegment::CODE.to_le_bytes();
        let as_report = [&code, &data[2..]].concat();
        let segment = ReportLocalPathSegment::decode(&as_report.into()).unwrap();
        assert!((segment.p2_x_m() - 3.0).abs() < 1e-3);
        assert!((segment.p2_y_m() - 9.0).abs() < 1e-3);
        assert!((segment.p1_y_m() - 6.5).abs() < 1e-3);
    }

    #[test]
    fn a_path_beyond_what_segments_can_tell_is_an_error() {
        let path = Path::new(vec![(0.0, 0.0), (1e6, 0.0)]);
        assert!(elements(&path, 0.3).is_err());
    }
}
