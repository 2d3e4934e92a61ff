//! Destinations of a vehicle: places set by clients or stored in list elements.

use std::f64::consts::SQRT_2;

use bytes::Bytes;

use super::global_waypoint::GlobalWaypoint;
use super::local_waypoint::LocalWaypoint;
use super::path_segment::{self, PathSegment};
use crate::motion::{Frame, Goal, Pose, Waypoint};
use jaus::codec::Message;
use jaus::messages::core::set_element::ElementRec;
use jaus::messages::mobility::{
    SetGlobalWaypoint, SetGlobalWaypointExt, SetLocalWaypoint, SetLocalWaypointExt,
};
use jaus::service::code_of;

/// A waypoint or path segment to drive to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Place {
    Local(LocalWaypoint),
    Global(GlobalWaypoint),
    LocalPath(PathSegment),
    GlobalPath(PathSegment),
}

macro_rules! set_by {
    ($($message:ident => $place:ident),* $(,)?) => {$(
        impl From<$message> for Place {
            fn from(message: $message) -> Self {
                Self::$place(message.into())
            }
        }
    )*};
}

set_by! {
    SetLocalWaypoint => Local,
    SetLocalWaypointExt => Local,
    SetGlobalWaypoint => Global,
    SetGlobalWaypointExt => Global,
}

impl Place {
    /// Largest distance of a place along each axis of the local frame, in metres: the range of Set
    /// Local Waypoint. Beyond it the globe cannot be treated as a plane.
    const REACH: f64 = 100_000.0;

    /// The place in a list element, if it holds one.
    pub(super) fn of(element: &ElementRec) -> Option<Self> {
        let octets = &element.element_data.data;
        match code_of(octets)? {
            SetLocalWaypoint::CODE => read::<SetLocalWaypoint>(octets),
            SetLocalWaypointExt::CODE => read::<SetLocalWaypointExt>(octets),
            SetGlobalWaypoint::CODE => read::<SetGlobalWaypoint>(octets),
            SetGlobalWaypointExt::CODE => read::<SetGlobalWaypointExt>(octets),
            code => Self::of_path(code, octets),
        }
    }

    /// The path segment in a message with this code.
    pub(super) fn of_path(code: u16, octets: &Bytes) -> Option<Self> {
        let local = || path_segment::local(code, octets).map(Self::LocalPath);
        let global = || path_segment::global(code, octets).map(Self::GlobalPath);
        local().or_else(global)
    }

    /// Whether the place is within reach. Places on the globe pass, since the position of the local
    /// frame is not known here.
    pub(super) fn is_in_reach(&self) -> bool {
        match self {
            Self::Local(waypoint) => in_reach(&waypoint.waypoint()),
            Self::LocalPath(path) => in_reach(&path.waypoint()),
            Self::Global(_) | Self::GlobalPath(_) => true,
        }
    }

    /// The goal for the pilot from a start point; `None` if the place is out of reach.
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

    /// The place, or the end of the path segment, in the local frame.
    pub(super) fn waypoint(&self, frame: &Frame) -> Waypoint {
        match self {
            Self::Local(waypoint) => waypoint.waypoint(),
            Self::Global(waypoint) => waypoint.waypoint(frame),
            Self::LocalPath(path) => path.waypoint(),
            Self::GlobalPath(path) => path.in_frame(frame).waypoint(),
        }
    }

    /// The path segment in the local frame, if the place is one.
    fn path(&self, frame: &Frame) -> Option<PathSegment> {
        match self {
            Self::LocalPath(path) => Some(*path),
            Self::GlobalPath(path) => Some(path.in_frame(frame)),
            Self::Local(_) | Self::Global(_) => None,
        }
    }
}

fn read<M: Message + Into<Place>>(octets: &Bytes) -> Option<Place> {
    M::decode(octets).ok().map(Into::into)
}

fn in_reach(waypoint: &Waypoint) -> bool {
    Pose::default().distance(waypoint.x, waypoint.y) <= Place::REACH * SQRT_2
}
