//! Hands a path over to the path segment driver: fills its list with the segments and executes it.

use crate::mission::{Path, Point};
use jaus::codec::OutOfRange;
use jaus::component::{Component, Session};
use jaus::messages::mobility::SetLocalPathSegment;
use jaus::messages::mobility::set_local_path_segment::{
    P1X, P1Y, P2X, P2Y, PathTolerance, WeightingFactor,
};

/// Hands over all segments and starts their execution.
pub(super) async fn hand_over(
    component: &Component,
    session: &Session,
    path: &Path,
    speed: f64,
    tolerance: f64,
) -> Result<(), String> {
    let segments = segments(path, tolerance).map_err(|error| {
        format!("cannot encode the path as path segments: {error}; choose a closer destination")
    })?;
    let list = component.list(session.check().map_err(in_words)?);
    list.replace(&segments).await.map_err(in_words)?;
    session.check().map_err(in_words)?;
    list.execute(speed).await.map_err(in_words)
}

/// The straight segments of a path.
fn segments(path: &Path, tolerance: f64) -> Result<Vec<SetLocalPathSegment>, OutOfRange> {
    let segments = path.segments();
    segments
        .map(|(from, to)| segment(from, to, tolerance))
        .collect()
}

fn segment(from: Point, to: Point, tolerance: f64) -> Result<SetLocalPathSegment, OutOfRange> {
    let (x, y) = (f64::midpoint(from.0, to.0), f64::midpoint(from.1, to.1));
    Ok(SetLocalPathSegment {
        p1_x: P1X::new(x)?,
        p1_y: P1Y::new(y)?,
        p2_x: P2X::new(to.0)?,
        p2_y: P2Y::new(to.1)?,
        weighting_factor: WeightingFactor::new(0.0)?,
        path_tolerance: Some(PathTolerance::new(tolerance)?),
        ..SetLocalPathSegment::default()
    })
}

pub(super) fn in_words(error: impl std::fmt::Display) -> String {
    error.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_ends_where_the_path_turns() {
        let path = Path::new(vec![(0.0, 0.0), (3.0, 4.0), (3.0, 9.0)]);
        let segments = segments(&path, 0.3).unwrap();
        assert_eq!(segments.len(), 2);
        let segment = &segments[1];
        assert!((segment.p2_x_m() - 3.0).abs() < 1e-3);
        assert!((segment.p2_y_m() - 9.0).abs() < 1e-3);
        assert!((segment.p1_y_m() - 6.5).abs() < 1e-3);
    }

    #[test]
    fn a_path_beyond_what_segments_can_tell_is_an_error() {
        let path = Path::new(vec![(0.0, 0.0), (1e6, 0.0)]);
        assert!(segments(&path, 0.3).is_err());
    }
}
