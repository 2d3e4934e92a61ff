//! Path segments in the local frame and on the globe, as kinds of places for the list drivers.

use super::exchange::Exchange;
use super::kind::Kind;
use super::path_segment::{self, PathSegment};
use super::place::Place;
use super::wanted::Wanted;
use jaus::codec::{Message, ServiceId};
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
                if let Some(query) = exchange.query::<QueryLocalPathSegment>() {
                    let wanted = Wanted(query.presence_vector.into());
                    tell(local(exchange), exchange, |path| path.report_local(wanted));
                }
            }
            QueryLocalPathSegmentExt::CODE => {
                if let Some(query) = exchange.query::<QueryLocalPathSegmentExt>() {
                    let wanted = Wanted(query.presence_vector.into());
                    tell(local(exchange), exchange, |path| {
                        path.report_local_ext(wanted)
                    });
                }
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
                if let Some(query) = exchange.query::<QueryGlobalPathSegment>() {
                    let wanted = Wanted(query.presence_vector.into());
                    tell(global(exchange), exchange, |path| {
                        path.report_global(wanted)
                    });
                }
            }
            QueryGlobalPathSegmentExt::CODE => {
                if let Some(query) = exchange.query::<QueryGlobalPathSegmentExt>() {
                    let wanted = Wanted(query.presence_vector.into());
                    tell(global(exchange), exchange, |path| {
                        path.report_global_ext(wanted)
                    });
                }
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
fn tell<R: Message>(
    path: Option<PathSegment>,
    exchange: &mut Exchange<'_, '_>,
    report: impl FnOnce(&PathSegment) -> Result<R, jaus::codec::OutOfRange>,
) {
    if let Some(path) = path {
        exchange.reply_if(report(&path));
    }
}
