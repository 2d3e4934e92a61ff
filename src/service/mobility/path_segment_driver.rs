//! Local and Global Path Segment Driver: drive along curves, one after the other.

use super::both_versions;
use super::exchange::Exchange;
use super::path_segment::{self, PathSegment};
use super::place::Place;
use super::travel;
use super::vehicle::{Behaviour, Cockpit};
use super::wanted::Wanted;
use crate::codec::{Message, ServiceId};
use crate::messages::core::reject_element_request::ResponseCode;
use crate::messages::mobility::{
    QueryGlobalPathSegment, QueryGlobalPathSegmentExt, QueryLocalPathSegment,
    QueryLocalPathSegmentExt, global_path_segment_driver, local_path_segment_driver,
};
use crate::service::{Context, Elements, Handled, code_of};

/// Drives along curves in the local frame.
pub(super) struct LocalPathSegmentDriver;

/// Drives along curves on the globe.
pub(super) struct GlobalPathSegmentDriver;

impl LocalPathSegmentDriver {
    /// A driver that works the vehicle's list off, which takes its segments from now on.
    pub(super) fn on(elements: &Elements) -> Self {
        accept(elements, path_segment::LOCAL);
        Self
    }
}

impl GlobalPathSegmentDriver {
    /// A driver that works the vehicle's list off, which takes its segments from now on.
    pub(super) fn on(elements: &Elements) -> Self {
        accept(elements, path_segment::GLOBAL);
        Self
    }
}

fn accept(elements: &Elements, codes: [u16; 2]) {
    for code in codes {
        elements.accept_code(code, |octets| {
            let place = code_of(octets).and_then(|code| path_segment::place(code, octets));
            match place {
                Some(place) if place.is_in_reach() => Ok(()),
                Some(_) => Err(ResponseCode::UNSPECIFIED_ERROR),
                None => Err(ResponseCode::UNSUPPORTED_ELEMENT_TYPE),
            }
        });
    }
}

impl Behaviour for LocalPathSegmentDriver {
    fn offers(&self) -> Vec<ServiceId> {
        both_versions(local_path_segment_driver::V1_1).into()
    }

    fn handle(&mut self, code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
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
            _ => return travel::handle_list(code, exchange),
        }
        Handled::Yes
    }

    fn tells_end_of(&self, command: u16) -> bool {
        travel::tells_end_of(command)
    }

    fn handle_motion(&mut self, cockpit: &mut Cockpit, context: &mut Context<'_>) {
        cockpit.work_off(context);
    }

    fn handle_stop(&mut self, cockpit: &mut Cockpit, context: &mut Context<'_>) {
        cockpit.abandon(context);
    }
}

impl Behaviour for GlobalPathSegmentDriver {
    fn offers(&self) -> Vec<ServiceId> {
        both_versions(global_path_segment_driver::V1_1).into()
    }

    fn handle(&mut self, code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
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
            _ => return travel::handle_list(code, exchange),
        }
        Handled::Yes
    }

    fn tells_end_of(&self, command: u16) -> bool {
        travel::tells_end_of(command)
    }

    fn handle_motion(&mut self, cockpit: &mut Cockpit, context: &mut Context<'_>) {
        cockpit.work_off(context);
    }

    fn handle_stop(&mut self, cockpit: &mut Cockpit, context: &mut Context<'_>) {
        cockpit.abandon(context);
    }
}

fn local(exchange: &Exchange<'_, '_>) -> Option<PathSegment> {
    match exchange.cockpit.place()? {
        Place::LocalPath(path) => Some(path),
        _ => None,
    }
}

fn global(exchange: &Exchange<'_, '_>) -> Option<PathSegment> {
    match exchange.cockpit.place()? {
        Place::GlobalPath(path) => Some(path),
        _ => None,
    }
}

/// Reports the segment that is driven along or that is the first of the list; without one there is
/// no answer.
fn tell<R: Message>(
    path: Option<PathSegment>,
    exchange: &mut Exchange<'_, '_>,
    report: impl FnOnce(&PathSegment) -> Result<R, crate::codec::OutOfRange>,
) {
    if let Some(path) = path {
        exchange.reply_if(report(&path));
    }
}
