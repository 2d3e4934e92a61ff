//! Fetches the map from the knowledge store in tiles, and the pose from the pose sensor.

use std::sync::Arc;

use super::{find_soon, hand_over::in_words};
use crate::messages::ground::report_raster_maps::MapRec;
use crate::messages::ground::{
    QueryRasterCells, QueryRasterMaps, ReportRasterCells, ReportRasterMaps, raster_maps,
};
use crate::mission::{Point, Terrain};
use jaus::address::JausId;
use jaus::component::Component;
use jaus::messages::mobility::{QueryLocalPose, ReportLocalPose, local_pose_sensor};

/// The most cells requested at once.
const TILE: usize = 1 << 16;
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
    let store = find_soon(component, &[raster_maps::URN], "knowledge store").await?;
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
        let report: ReportRasterMaps = component
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
        if let Some(cells) = fetch_cells(component, store, &about).await? {
            tracing::info!(
                "map \"{}\" of {store}, {} x {} cells, revision {}",
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
        .map(|map| format!("\"{}\"", map.name.to_string_lossy()))
        .take(8)
        .collect();
    let only = maps.len() == 1;
    let mut maps = maps.into_iter();
    match maps.find(|map| map.name == *name || only) {
        Some(map) => Ok(map),
        None if names.is_empty() => Err(format!("{store} has no map: create one named \"{name}\"")),
        None => Err(format!(
            "{store} has no map named \"{name}\", but {}: create one, or choose one of these with \
             --map",
            names.join(", ")
        )),
    }
}

/// Fetches all cells; `None` if they change during the transfer.
async fn fetch_cells(
    component: &Component,
    store: JausId,
    about: &MapRec,
) -> Result<Option<Vec<u8>>, String> {
    let columns = usize::from(about.columns);
    let at_once = (TILE / columns.max(1)).clamp(1, usize::from(u16::MAX)) as u16;
    let mut cells = Vec::new();
    let mut row = 0;
    while row < about.rows {
        let rows = at_once.min(about.rows - row);
        let query = QueryRasterCells {
            map: about.map,
            row,
            column: 0,
            rows,
            columns: about.columns,
        };
        let tile: ReportRasterCells = component.query(store, &query).await.map_err(in_words)?;
        let is_asked =
            (tile.map, tile.row, tile.rows, tile.columns) == (about.map, row, rows, about.columns);
        let is_full = tile.cells.len() == usize::from(rows) * columns;
        if !is_asked || !is_full || tile.revision != about.revision {
            return Ok(None);
        }
        cells.extend_from_slice(&tile.cells);
        row += rows;
    }
    Ok(Some(cells))
}

/// Fetches the vehicle's position.
pub(super) async fn fetch_pose(component: &Component) -> Result<Point, String> {
    let services = [local_pose_sensor::URN];
    let sensor = find_soon(component, &services, "local pose sensor").await?;
    let query = QueryLocalPose {
        presence_vector: X_AND_Y,
    };
    let pose: ReportLocalPose = component.query(sensor, &query).await.map_err(in_words)?;
    let place = pose.x_m().zip(pose.y_m());
    place.ok_or_else(|| format!("{sensor} reports no pose: set the vehicle's pose"))
}

const X_AND_Y: u16 = 0b11;
