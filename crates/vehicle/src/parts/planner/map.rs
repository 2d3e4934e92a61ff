//! Fetches the map and the zones from the knowledge store, and the pose from the pose sensor.

use std::sync::Arc;

use super::{find_soon, hand_over::in_words, on_board};
use crate::ground::{RasterEdition, fetch_cells, reported_zones};
use crate::messages::ground::report_raster_maps::MapRec;
use crate::messages::ground::{QueryRasterMaps, QueryWheelOdometry, raster_maps, wheel_odometry};
use crate::mission::{Point, Terrain};
use crate::zones::Zones;
use jaus::address::JausId;
use jaus::component::Component;
use jaus::messages::mobility::{
    QueryLocalOperatingZone, QueryLocalPose, local_operating_zone, local_pose_sensor,
};

/// Number of attempts to fetch a map that changes during the transfer.
const TRIES: u32 = 3;

/// A map at a certain revision.
#[derive(Debug, Clone)]
pub(in crate::parts) struct Map {
    store: JausId,
    about: MapRec,
    pub(in crate::parts) terrain: Arc<Terrain>,
}

/// Fetches the map with this name, or the only one. Returns `known` if it is unchanged.
pub(super) async fn fetch(
    component: &Component,
    name: &str,
    known: Option<Map>,
) -> Result<Map, String> {
    let store = find_soon(
        component,
        on_board(component, raster_maps::URN),
        "knowledge store",
    )
    .await?;
    fetch_from(component, store, name, known).await
}

/// Fetches the map from a known store.
pub(in crate::parts) async fn fetch_from(
    component: &Component,
    store: JausId,
    name: &str,
    known: Option<Map>,
) -> Result<Map, String> {
    for _ in 0..TRIES {
        let report = component
            .query(store, &QueryRasterMaps {})
            .await
            .map_err(in_words)?;
        let about = choose(report.map_list, name, store)?;
        if let Some(known) = known
            .as_ref()
            .filter(|known| known.store == store && known.about == about)
        {
            return Ok(known.clone());
        }
        let edition = RasterEdition {
            map: about.map,
            revision: about.revision,
            rows: about.rows,
            columns: about.columns,
        };
        let cells = fetch_cells(component, store, edition).await;
        if let Some(cells) = cells.map_err(in_words)? {
            tracing::info!(
                "map {:?} of {store}, {} x {} cells, revision {}",
                about.name.to_string_lossy(),
                about.rows,
                about.columns,
                about.revision
            );
            let corner = (about.x, about.y);
            let cell = f64::from(about.cell_size);
            let terrain = Terrain::new(about.rows, about.columns, cell, corner, cells);
            return Ok(Map {
                store,
                about,
                terrain: Arc::new(terrain.map_err(in_words)?),
            });
        }
    }
    Err(format!(
        "the map of {store} kept changing while it was fetched"
    ))
}

fn choose(maps: Vec<MapRec>, name: &str, store: JausId) -> Result<MapRec, String> {
    let names: Vec<_> = maps
        .iter()
        .map(|map| format!("{:?}", map.name.to_string_lossy()))
        .take(8)
        .collect();
    let only = maps.len() == 1;
    let mut maps = maps.into_iter();
    match maps.find(|map| map.name == *name || only) {
        Some(map) => Ok(map),
        None if names.is_empty() => Err(format!("{store} has no map: create one named {name:?}")),
        None => Err(format!(
            "{store} has no map named {name:?}, but {}: create one, or choose one of these with --map",
            names.join(", ")
        )),
    }
}

/// Fetches the operating zones from the first component of the subsystem that has them. `None` if
/// there is no such component.
pub(super) async fn fetch_zones(component: &Component) -> Result<Option<Zones>, String> {
    let providers = on_board(component, local_operating_zone::URN);
    let Some(&store) = component.members(providers).first() else {
        return Ok(None);
    };
    let query = QueryLocalOperatingZone::default();
    let report = component.query(store, &query).await.map_err(in_words)?;
    let zones = reported_zones(&report);
    zones
        .map(Some)
        .map_err(|why| format!("{store} has unusable operating zones: {why}"))
}

/// Fetches the vehicle's position.
pub(super) async fn fetch_pose(component: &Component) -> Result<Point, String> {
    let sensors = on_board(component, local_pose_sensor::URN);
    let sensor = find_soon(component, sensors, "local pose sensor").await?;
    let query = QueryLocalPose::none().with_x().with_y();
    let pose = component.query(sensor, &query).await.map_err(in_words)?;
    match pose.x_m().zip(pose.y_m()) {
        Some(place) => Ok(place),
        None => Err(format!(
            "{sensor} reports no pose: {}",
            why_no_pose(component).await
        )),
    }
}

/// Why a pose sensor knows no pose: most often it gets no wheel travel.
async fn why_no_pose(component: &Component) -> String {
    let providers = component.members(on_board(component, wheel_odometry::URN));
    let Some(&wheels) = providers.first() else {
        return "no wheel travel, because no primitive driver is known: start one".to_owned();
    };
    match component.query(wheels, &QueryWheelOdometry {}).await {
        Ok(_) => "check it, and what it measures with".to_owned(),
        Err(error) => format!("no wheel travel from the primitive driver ({error}): restart it"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_of_maps_in_an_error_are_escaped() {
        let named = |name: &str| MapRec {
            name: name.into(),
            ..MapRec::default()
        };
        let maps = vec![named("\x1b[2Ja"), named("b\r\nfake \u{202e}")];
        let store = JausId::new(101, 1, 61);
        let error = choose(maps, "terrain", store).unwrap_err();
        assert!(
            error.contains(r#""\u{1b}[2Ja", "b\r\nfake \u{202e}""#),
            "{error}"
        );
    }
}
