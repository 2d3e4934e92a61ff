//! Path segments in the local frame and on the globe, as kinds of places for the list drivers.

use super::exchange::Exchange;
use super::kind::Kind;
use super::path_segment::{self, PathSegment};
use super::place::Place;
use jaus::codec::{Message, OutOfRange, Query, ServiceId};
use jaus::messages::core::reject_element_request::ResponseCode;
use jaus::messages::mobility::{
    QueryGlobalPathSegment, QueryGlobalPathSegmentExt, QueryLocalPathSegment,
    QueryLocalPathSegmentExt, global_path_segment_driver, local_path_segment_driver,
};
use jaus::service::{Elements, Handled, code_of};

/// Path segments in the local frame.
pub(super) struct LocalPath;

impl Kind for LocalPath {
    const LIST_DRIVER: ServiceId = local_path_segment_driver::V1_1;

    fn accept(elements: &Elements) {
        accept(elements, path_segment::LOCAL);
    }

    fn handle_query(code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        match code {
            QueryLocalPathSegment::CODE => {
                tell::<QueryLocalPathSegment>(local(exchange), exchange, PathSegment::report_local);
            }
            QueryLocalPathSegmentExt::CODE => {
                tell::<QueryLocalPathSegmentExt>(
                    local(exchange),
                    exchange,
                    PathSegment::report_local_ext,
                );
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }
}

/// Path segments on the globe.
pub(super) struct GlobalPath;

impl Kind for GlobalPath {
    const LIST_DRIVER: ServiceId = global_path_segment_driver::V1_1;

    fn accept(elements: &Elements) {
        accept(elements, path_segment::GLOBAL);
    }

    fn handle_query(code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        match code {
            QueryGlobalPathSegment::CODE => {
                tell::<QueryGlobalPathSegment>(
                    global(exchange),
                    exchange,
                    PathSegment::report_global,
                );
            }
            QueryGlobalPathSegmentExt::CODE => {
                tell::<QueryGlobalPathSegmentExt>(
                    global(exchange),
                    exchange,
                    PathSegment::report_global_ext,
                );
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }
}

/// Registers segments from messages with these codes with a list, if their end is within reach.
fn accept(elements: &Elements, codes: [u16; 2]) {
    for code in codes {
        elements.accept_code(code, |octets| {
            let place = code_of(octets).and_then(|code| Place::of_path(code, octets));
            match place {
                Some(place) if place.is_in_reach() => Ok(()),
                Some(_) => Err(ResponseCode::UNSPECIFIED_ERROR),
                None => Err(ResponseCode::UNSUPPORTED_ELEMENT_TYPE),
            }
        });
    }
}

fn local(exchange: &Exchange<'_, '_>) -> Option<PathSegment> {
    match exchange.controls.place()? {
        Place::LocalPath(path) => Some(path),
        _ => None,
    }
}

fn global(exchange: &Exchange<'_, '_>) -> Option<PathSegment> {
    match exchange.controls.place()? {
        Place::GlobalPath(path) => Some(path),
        _ => None,
    }
}

/// Reports the current segment or the first of the list. Without one there is no reply.
fn tell<Q: Query>(
    path: Option<PathSegment>,
    exchange: &mut Exchange<'_, '_>,
    report: impl FnOnce(&PathSegment) -> Result<Q::Report, OutOfRange>,
) {
    if let Some(path) = path {
        exchange.answer_if(|_: &Q, _| report(&path));
    }
}
