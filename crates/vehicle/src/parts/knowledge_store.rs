//! The vector knowledge store: objects, maps and operating zones for all parts of a vehicle, stored in a file.
#![expect(clippy::disallowed_methods, reason = "notices a silent pose sensor")]

use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::time::Duration;

use bytes::Bytes;
use tokio::sync::mpsc;
use tokio::time::timeout;

use super::drivers::{ChainControl, Sense};
use super::{Part, PartError, Slot};
use crate::ground::{OperatingZones, WorldStore, refuse_map_change};
use crate::messages::ground::{CreateRasterMap, DeleteRasterMap, SetRasterCells};
use crate::motion::Frame;
use crate::world::{Change, Done, OpenError, Picture, Raster, World};
use jaus::codec::Message;
use jaus::component::{AccessControl, Component};
use jaus::messages::mobility::{
    DeleteZone, QueryExcursion, SetGlobalOperatingZone, SetLocalOperatingZone,
};

/// Stores the world of a vehicle and serves it to all clients.
///
/// It offers Vector Knowledge Store and Raster Maps, whose changes it accepts from any client, and
/// Local and Global Operating Zone, whose changes it accepts from the client in control.
///
/// While a driver of its subsystem is controlled, it accepts changes of maps and zones only from the
/// client at the head of that chain of drivers. Exceptions: zones that are new, because they only
/// restrict; and maps changed by components of the subsystem, because a vehicle may map while it
/// drives.
#[derive(Debug, Clone, PartialEq)]
pub struct KnowledgeStore {
    /// The file. It is created if it does not exist.
    pub file: PathBuf,
    /// Handling of a damaged file.
    pub broken: Broken,
    /// An initial map, created unless a map of its name exists.
    pub map: Option<(Raster, Picture)>,
    /// Position of the local frame on the globe, for maps as objects.
    pub frame: Frame,
}

/// Handling of a file that is damaged or not a store.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Broken {
    /// Refuse to start. The file is left unchanged.
    #[default]
    Refuse,
    /// Rename the file and start with an empty store.
    SetAside,
}

impl Default for KnowledgeStore {
    fn default() -> Self {
        Self {
            file: PathBuf::from(Self::FILE),
            broken: Broken::default(),
            map: None,
            frame: Frame::default(),
        }
    }
}

impl KnowledgeStore {
    /// Default file name.
    pub const FILE: &'static str = "knowledge-store.redb";

    /// The demonstration map of 16 x 16 cells, centred on the origin of the local frame.
    #[must_use]
    pub fn demo_map() -> (Raster, Picture) {
        let picture = Picture::demo();
        let raster = picture.at("traversability".to_owned(), 1.0, (-8.0, -8.0));
        (raster, picture)
    }

    /// The same map in cells of a quarter metre, on which a path leads closely round an obstacle.
    #[must_use]
    pub fn fine_demo_map() -> (Raster, Picture) {
        const PARTS: u16 = 4;
        let (raster, picture) = Self::demo_map();
        let Some(fine) = picture.divided(PARTS) else {
            return (raster, picture);
        };
        let cell = raster.cell / f32::from(PARTS);
        (fine.at(raster.name, cell, (raster.x, raster.y)), fine)
    }

    fn open(&self) -> Result<World, PartError> {
        let mut world = match World::open(&self.file) {
            Err(error @ OpenError::Broken { .. }) if self.broken == Broken::SetAside => {
                set_aside(&self.file, &error)?;
                World::open(&self.file)
            }
            opened => opened,
        }
        .map_err(|error| PartError::Broken(advice(&error)))?;
        if let Some((raster, picture)) = &self.map {
            import(&mut world, raster, picture)?;
        }
        tell(&self.file, &world);
        Ok(world)
    }
}

impl Part for KnowledgeStore {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let frame = self.frame;
        let opening = tokio::task::spawn_blocking(move || self.open());
        let world = opening.await.map_err(|_| PartError::NodeStopped)??;
        let (fail, mut failures) = mpsc::unbounded_channel();
        let store = WorldStore::new(world, frame, move |error| {
            // Without a receiver the part has already ended.
            let _ = fail.send(error.to_string());
        });
        let store = store.open_to_all();
        let zones = store.operating_zones();
        let chain = ChainControl::default();
        let (subsystem, known) = (slot.port.id().subsystem(), zones.clone());
        let zone_guard = chain.guard(ZONES).unless(move |it| known.only_adds(it));
        let map_guard = chain.guard(MAPS).or_else(refuse_map_change);
        let map_guard = map_guard.unless(move |it| it.source.subsystem() == subsystem);
        let component = slot
            .component("Vector Knowledge Store")
            .access_control(AccessControl::new())
            .offer(zone_guard)
            .offer(map_guard)
            .offer(store.vector_knowledge_store())
            .offer(store.raster_maps())
            .offer(zones.clone())
            .live_on(slot.port)?;
        slot.telemetry.attach(&component);
        // A remaining copy of the store would keep the file open after the component's end.
        drop(store);
        tokio::select! {
            failure = failures.recv() => Err(failure.map_or(PartError::NodeStopped, PartError::Broken)),
            () = gone(&component) => Err(PartError::NodeStopped),
            end = follow(&component, &zones) => end,
            end = chain.track(&component) => end,
        }
    }
}

/// What changes zones.
const ZONES: &[u16] = &[
    SetLocalOperatingZone::CODE,
    SetGlobalOperatingZone::CODE,
    DeleteZone::CODE,
];
/// What changes maps.
const MAPS: &[u16] = &[
    CreateRasterMap::CODE,
    SetRasterCells::CODE,
    DeleteRasterMap::CODE,
];

/// How long a position counts without a new one.
const PATIENCE: Duration = Duration::from_secs(2);

/// Keeps the vehicle's position for Report Excursion.
async fn follow(component: &Component, zones: &OperatingZones) -> Result<Infallible, PartError> {
    let mut poses = Sense::pose(component, 5.0)?;
    loop {
        let place = match timeout(PATIENCE, poses.next()).await {
            Ok(report) => report.map(|pose| pose.x_m().zip(pose.y_m()))?,
            Err(_) => None,
        };
        if zones.handle_place(place) {
            _ = component.changed::<QueryExcursion>().await;
        }
    }
}

/// Returns once the component has stopped.
async fn gone(component: &Component) {
    let mut standing = component.watch_standing();
    while standing.changed().await.is_ok() {}
}

fn import(world: &mut World, raster: &Raster, picture: &Picture) -> Result<(), PartError> {
    let name = &raster.name;
    if world.rasters().values().any(|it| it.name == *name) {
        tracing::info!("the map \"{name}\" exists already and is kept");
        return Ok(());
    }
    let cells = Bytes::copy_from_slice(&picture.cells);
    let change = Change::AddRaster(raster.clone(), cells);
    let results = world.apply(vec![change]);
    let mut results = results.map_err(|error| PartError::Broken(error.to_string()))?;
    match results.pop() {
        Some(Err(refusal)) => Err(PartError::Broken(format!("the map \"{name}\": {refusal}"))),
        Some(Ok(Done::Raster(map, _))) => {
            tracing::info!(
                "{map}: \"{name}\", {} x {} cells",
                raster.rows,
                raster.columns
            );
            Ok(())
        }
        _ => Ok(()),
    }
}

fn tell(file: &Path, world: &World) {
    let (objects, maps) = (world.objects().len(), world.rasters().len());
    tracing::info!("{}: {objects} objects, {maps} maps", file.display());
}

/// The error with a remedy.
fn advice(error: &OpenError) -> String {
    match error {
        OpenError::Broken { .. } => format!(
            "{error}; the file is unchanged: restore a copy, or start empty with \
             --set-broken-aside, which renames it"
        ),
        _ => error.to_string(),
    }
}

/// Renames the file to an unused name.
fn set_aside(file: &Path, error: &OpenError) -> Result<(), PartError> {
    let name = |number: u32| {
        let mut name = file.as_os_str().to_owned();
        name.push(format!(".broken-{number}"));
        PathBuf::from(name)
    };
    let free = (1..=9999).map(name).find(|it| !it.exists());
    let Some(aside) = free else {
        return Err(PartError::Broken(format!(
            "{error}; 9999 files are set aside already: move them away"
        )));
    };
    std::fs::rename(file, &aside)
        .map_err(|error| PartError::Broken(format!("cannot rename {}: {error}", file.display())))?;
    tracing::warn!("{error}; it was renamed to {}", aside.display());
    Ok(())
}
