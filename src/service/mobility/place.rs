//! Where a vehicle may be sent to: what clients set, and what elements of a list hold.

use std::f64::consts::SQRT_2;

use bytes::Bytes;

use super::exchange::Exchange;
use super::global_waypoint::{Global, GlobalWaypoint};
use super::local_waypoint::{Local, LocalWaypoint};
use super::path_segment::{self, PathSegment};
use crate::codec::{Message, ServiceId};
use crate::messages::core::set_element::ElementRec;
use crate::service::{Handled, code_of};
use crate::vehicle::{Frame, Goal, Pose, Waypoint};

/// Somewhere to drive to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Place {
    Local(LocalWaypoint),
    Global(GlobalWaypoint),
    LocalPath(PathSegment),
    GlobalPath(PathSegment),
}

/// One kind of waypoints, and the services that drive to them.
pub(super) trait Kind: Send + 'static {
    /// The service that drives to one of them.
    const DRIVER: ServiceId;
    /// The service that drives to one after the other.
    const LIST_DRIVER: ServiceId;
    /// The message that sets one, in version 1.0.
    type Set: Message + Clone + Into<Place>;
    /// The message that sets one, in version 1.1.
    type SetExt: Message + Clone + Into<Place>;

    /// Answers the queries for the waypoint. As long as none is set, it is the first one of the
    /// list. If that is of another kind, or there is none at all, there is no answer.
    fn handle_query(code: u16, exchange: &mut Exchange<'_, '_>) -> Handled;

    /// The place that octets with a message say, if they are of this kind.
    fn place(code: u16, octets: &Bytes) -> Option<Place> {
        match code {
            code if code == Self::Set::CODE => Self::Set::decode(octets).ok().map(Into::into),
            code if code == Self::SetExt::CODE => Self::SetExt::decode(octets).ok().map(Into::into),
            _ => None,
        }
    }
}

impl Place {
    /// How far along each axis of the local frame a place may be, in metres: the range of Set
    /// Local Waypoint. Further away the globe is no plane any more.
    const REACH: f64 = 100_000.0;

    /// What an element of a list holds, if it is a place.
    pub(super) fn of(element: &ElementRec) -> Option<Self> {
        let octets = &element.element_data.data;
        let code = code_of(octets)?;
        Local::place(code, octets)
            .or_else(|| Global::place(code, octets))
            .or_else(|| path_segment::place(code, octets))
    }

    /// Whether it can be reached, as far as it can be told without knowing where on the globe the
    /// vehicle is.
    pub(super) fn is_in_reach(&self) -> bool {
        match self {
            Self::Local(waypoint) => in_reach(&waypoint.waypoint()),
            Self::LocalPath(path) => in_reach(&path.waypoint()),
            Self::Global(_) | Self::GlobalPath(_) => true,
        }
    }

    /// What to pursue to get there from a start; `None` if it is out of reach.
    pub(super) fn goal(
        &self,
        frame: &Frame,
        start: (f64, f64),
        speed: f64,
        goes_on: bool,
    ) -> Option<Goal> {
        let to = self.waypoint(frame);
        let goal = match self.path(frame) {
            Some(path) => Goal::Path {
                curve: path.curve(start),
                speed,
                tolerance: to.tolerance,
                goes_on,
            },
            None => Goal::Waypoint { to, speed, goes_on },
        };
        in_reach(&to).then_some(goal)
    }

    /// Where it is in the local frame, or where it ends.
    pub(super) fn waypoint(&self, frame: &Frame) -> Waypoint {
        match self {
            Self::Local(waypoint) => waypoint.waypoint(),
            Self::Global(waypoint) => waypoint.waypoint(frame),
            Self::LocalPath(path) => path.waypoint(),
            Self::GlobalPath(path) => path.in_frame(frame).waypoint(),
        }
    }

    /// The way to it in the local frame, if that is given.
    fn path(&self, frame: &Frame) -> Option<PathSegment> {
        match self {
            Self::LocalPath(path) => Some(*path),
            Self::GlobalPath(path) => Some(path.in_frame(frame)),
            Self::Local(_) | Self::Global(_) => None,
        }
    }
}

fn in_reach(waypoint: &Waypoint) -> bool {
    Pose::default().distance(waypoint.x, waypoint.y) <= Place::REACH * SQRT_2
}
