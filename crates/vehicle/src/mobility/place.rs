//! Where a vehicle may be sent to: what clients set, and what elements of a list hold.

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

/// Somewhere to drive to.
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
    /// How far along each axis of the local frame a place may be, in metres: the range of Set
    /// Local Waypoint. Further away the globe is no plane any more.
    const REACH: f64 = 100_000.0;

    /// What an element of a list holds, if it is a place.
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

    /// The place at the end of the path that a message with this code sets.
    pub(super) fn of_path(code: u16, octets: &Bytes) -> Option<Self> {
        let local = || path_segment::local(code, octets).map(Self::LocalPath);
        let global = || path_segment::global(code, octets).map(Self::GlobalPath);
        local().or_else(global)
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

fn read<M: Message + Into<Place>>(octets: &Bytes) -> Option<Place> {
    M::decode(octets).ok().map(Into::into)
}

fn in_reach(waypoint: &Waypoint) -> bool {
    Pose::default().distance(waypoint.x, waypoint.y) <= Place::REACH * SQRT_2
}
