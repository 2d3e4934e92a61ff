//! A path segment in the local frame or on the globe, as stored in list elements.
//!
//! Set Local and Set Global Path Segment (0410h, 04B0h, 040Fh, 04AFh) occur only inside Set
//! Element.

use bytes::Bytes;

use crate::motion::{Curve, Frame, GlobalPose, Waypoint};
use jaus::codec::{Message, OutOfRange};
use jaus::messages::mobility::report_global_path_segment as global;
use jaus::messages::mobility::report_global_path_segment_ext as global_ext;
use jaus::messages::mobility::report_local_path_segment as local;
use jaus::messages::mobility::report_local_path_segment_ext as local_ext;
use jaus::messages::mobility::{
    ReportGlobalPathSegment, ReportGlobalPathSegmentExt, ReportLocalPathSegment,
    ReportLocalPathSegmentExt, SetGlobalPathSegment, SetGlobalPathSegmentExt, SetLocalPathSegment,
    SetLocalPathSegmentExt,
};

/// A curve from the start of the segment to its end, drawn towards a control point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PathSegment {
    /// P1: X and Y in metres, or latitude and longitude in degrees.
    control: (f64, f64),
    /// P2, in the same units.
    end: (f64, f64),
    weight: f64,
    /// In metres.
    path_tolerance: Option<f64>,
}

/// Codes of the messages that set segments in the local frame, versions 1.0 and 1.1.
pub(super) const LOCAL: [u16; 2] = [SetLocalPathSegment::CODE, SetLocalPathSegmentExt::CODE];
/// Codes of the messages that set segments on the globe, versions 1.0 and 1.1.
pub(super) const GLOBAL: [u16; 2] = [SetGlobalPathSegment::CODE, SetGlobalPathSegmentExt::CODE];

/// Reads a segment in the local frame from its message.
pub(super) fn local(code: u16, octets: &Bytes) -> Option<PathSegment> {
    match code {
        SetLocalPathSegment::CODE => {
            let message = SetLocalPathSegment::decode(octets).ok()?;
            Some(PathSegment {
                control: (message.p1_x_m(), message.p1_y_m()),
                end: (message.p2_x_m(), message.p2_y_m()),
                weight: message.weighting_factor_value(),
                path_tolerance: message.path_tolerance_m(),
            })
        }
        SetLocalPathSegmentExt::CODE => {
            let message = SetLocalPathSegmentExt::decode(octets).ok()?;
            Some(PathSegment {
                control: (message.p1_x_m(), message.p1_y_m()),
                end: (message.p2_x_m(), message.p2_y_m()),
                weight: message.weighting_factor_value(),
                path_tolerance: message.path_tolerance_m(),
            })
        }
        _ => None,
    }
}

/// Reads a segment on the globe from its message.
pub(super) fn global(code: u16, octets: &Bytes) -> Option<PathSegment> {
    match code {
        SetGlobalPathSegment::CODE => {
            let message = SetGlobalPathSegment::decode(octets).ok()?;
            Some(PathSegment {
                control: (message.p1_latitude_deg(), message.p1_longitude_deg()),
                end: (message.p2_latitude_deg(), message.p2_longitude_deg()),
                weight: message.weighting_factor_value(),
                path_tolerance: message.path_tolerance_m(),
            })
        }
        SetGlobalPathSegmentExt::CODE => {
            let message = SetGlobalPathSegmentExt::decode(octets).ok()?;
            Some(PathSegment {
                control: (message.p1_latitude_deg(), message.p1_longitude_deg()),
                end: (message.p2_latitude_deg(), message.p2_longitude_deg()),
                weight: message.weighting_factor_value(),
                path_tolerance: message.path_tolerance_m(),
            })
        }
        _ => None,
    }
}

impl PathSegment {
    /// The curve from a start point in the local frame.
    pub(super) const fn curve(&self, start: (f64, f64)) -> Curve {
        Curve {
            start,
            control: self.control,
            end: self.end,
            weight: self.weight,
        }
    }

    /// Converts a segment on the globe to the local frame.
    pub(super) fn in_frame(&self, frame: &Frame) -> Self {
        let local = |(latitude, longitude)| {
            let pose = frame.to_local(&GlobalPose {
                latitude,
                longitude,
                ..GlobalPose::default()
            });
            (pose.x, pose.y)
        };
        Self {
            control: local(self.control),
            end: local(self.end),
            ..*self
        }
    }

    /// The end of the segment in the local frame.
    pub(super) const fn waypoint(&self) -> Waypoint {
        Waypoint::at(self.end.0, self.end.1)
    }

    /// Report Local Path Segment.
    pub(super) fn report_local(&self) -> Result<ReportLocalPathSegment, OutOfRange> {
        let tolerance = local::PathTolerance::new;
        Ok(ReportLocalPathSegment {
            p1_x: local::P1X::new(self.control.0)?,
            p1_y: local::P1Y::new(self.control.1)?,
            p2_x: local::P2X::new(self.end.0)?,
            p2_y: local::P2Y::new(self.end.1)?,
            weighting_factor: local::WeightingFactor::new(self.weight)?,
            path_tolerance: self.path_tolerance.and_then(|it| tolerance(it).ok()),
            ..ReportLocalPathSegment::default()
        })
    }

    /// Report Local Path Segment Ext.
    pub(super) fn report_local_ext(&self) -> Result<ReportLocalPathSegmentExt, OutOfRange> {
        let tolerance = local_ext::PathTolerance::new;
        Ok(ReportLocalPathSegmentExt {
            p1_x: local_ext::P1X::new(self.control.0)?,
            p1_y: local_ext::P1Y::new(self.control.1)?,
            p2_x: local_ext::P2X::new(self.end.0)?,
            p2_y: local_ext::P2Y::new(self.end.1)?,
            weighting_factor: local_ext::WeightingFactor::new(self.weight)?,
            path_tolerance: self.path_tolerance.and_then(|it| tolerance(it).ok()),
            ..ReportLocalPathSegmentExt::default()
        })
    }

    /// Report Global Path Segment.
    pub(super) fn report_global(&self) -> Result<ReportGlobalPathSegment, OutOfRange> {
        let tolerance = global::PathTolerance::new;
        Ok(ReportGlobalPathSegment {
            p1_latitude: global::P1Latitude::new(self.control.0)?,
            p1_longitude: global::P1Longitude::new(self.control.1)?,
            p2_latitude: global::P2Latitude::new(self.end.0)?,
            p2_longitude: global::P2Longitude::new(self.end.1)?,
            weighting_factor: global::WeightingFactor::new(self.weight)?,
            path_tolerance: self.path_tolerance.and_then(|it| tolerance(it).ok()),
            ..ReportGlobalPathSegment::default()
        })
    }

    /// Report Global Path Segment Ext.
    pub(super) fn report_global_ext(&self) -> Result<ReportGlobalPathSegmentExt, OutOfRange> {
        let tolerance = global_ext::PathTolerance::new;
        Ok(ReportGlobalPathSegmentExt {
            p1_latitude: global_ext::P1Latitude::new(self.control.0)?,
            p1_longitude: global_ext::P1Longitude::new(self.control.1)?,
            p2_latitude: global_ext::P2Latitude::new(self.end.0)?,
            p2_longitude: global_ext::P2Longitude::new(self.end.1)?,
            weighting_factor: global_ext::WeightingFactor::new(self.weight)?,
            path_tolerance: self.path_tolerance.and_then(|it| tolerance(it).ok()),
            ..ReportGlobalPathSegmentExt::default()
        })
    }
}
