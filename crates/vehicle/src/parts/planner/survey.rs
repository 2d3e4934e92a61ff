//! Looks at the map and the zones while the vehicle drives, and checks the path under way when they
//! have changed.

use std::sync::Arc;
use std::time::Duration;

use super::map::{self, Map};
use crate::mission::{Footprint, Path, Point, Terrain, blocked_after};
use crate::zones::Zones;
use jaus::component::Component;

/// Interval between two surveys.
pub(super) const PERIOD: Duration = Duration::from_secs(1);

/// What is known about the surroundings of the path under way.
#[derive(Debug, Clone)]
pub(super) struct Survey {
    pub(super) map: Map,
    pub(super) zones: Arc<Zones>,
    /// Why the path is blocked, if it is.
    pub(super) blocked: Option<String>,
}

/// The path under way.
#[derive(Debug, Clone)]
pub(super) struct UnderWay {
    pub(super) vehicle: Footprint,
    pub(super) here: Point,
    pub(super) path: Arc<Path>,
    /// The segment that the vehicle drives, counted from 0.
    pub(super) segment: usize,
}

impl UnderWay {
    /// The segment that is driven after this share of the path's segments, in percent.
    pub(super) fn segment(path: &Path, progress: u8) -> usize {
        // The share was rounded down.
        (usize::from(progress) * path.segments().len()).div_ceil(100)
    }
}

impl Survey {
    /// Fetches map and zones, and checks the path if they are not the known ones. Without an answer
    /// of the store the known ones hold.
    pub(super) async fn make(self, component: &Component, name: &str, way: UnderWay) -> Self {
        let map = map::fetch(component, name, Some(self.map.clone())).await;
        let map = map.unwrap_or_else(|error| {
            tracing::debug!(%error, "the known map holds");
            self.map.clone()
        });
        let zones = match map::fetch_zones(component).await {
            Ok(Some(zones)) if zones != *self.zones => Arc::new(zones),
            Ok(_) => Arc::clone(&self.zones),
            Err(error) => {
                tracing::debug!(%error, "the known zones hold");
                Arc::clone(&self.zones)
            }
        };
        let is_known =
            Arc::ptr_eq(&map.terrain, &self.map.terrain) && Arc::ptr_eq(&zones, &self.zones);
        let blocked = if is_known {
            None
        } else {
            let terrain = Arc::clone(&map.terrain);
            let zones = Arc::clone(&zones);
            let check = move || {
                let terrain = Terrain::clone(&terrain).within(zones);
                blocked_after(&terrain, &way.vehicle, way.here, &way.path, way.segment)
            };
            let after = tokio::task::spawn_blocking(check).await.unwrap_or_default();
            after.map(|after| {
                format!("the map or the zones have changed: the path is blocked after {after:.1} m")
            })
        };
        Self {
            map,
            zones,
            blocked,
        }
    }
}
