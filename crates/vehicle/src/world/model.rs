//! The world: objects, maps and zones, held in memory for queries and in the file for durability.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use redb::StorageBackend;

use super::change::{Change, Describe, Done, Refusal};
use super::collection::Collection;
use super::file::{Counter, File, KeepError, Loaded, OpenError, Writing};
use super::object::{Object, ObjectId};
use super::raster::{MapId, Raster, Window};
use super::selection::Selection;
use super::zone::Outline;
use crate::zones::ZoneId;

/// Objects, feature classes, maps and zones.
///
/// Objects and descriptions are in memory and take at most some tens of megabytes. Cells remain in
/// the file and are read on demand.
///
/// ```no_run
/// # use std::path::Path;
/// # use bytes::Bytes;
/// # use jaus_vehicle::world::{Change, Raster, World};
/// # fn example() -> Result<(), Box<dyn std::error::Error>> {
/// let mut world = World::open(Path::new("/var/lib/jaus/world.redb"))?;
/// let map = Raster {
///     name: "traversability".to_owned(),
///     rows: 16,
///     columns: 16,
///     cell: 0.5,
///     x: 0.0,
///     y: 0.0,
///     fill: 255,
///     revision: 0,
/// };
/// world.apply(vec![Change::AddRaster(map, Bytes::new())])?;
/// println!("{} maps", world.rasters().len());
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct World {
    file: File,
    objects: Collection,
    classes: BTreeMap<u16, String>,
    rasters: BTreeMap<MapId, Raster>,
    zones: BTreeMap<ZoneId, Outline>,
    last_object: u32,
    last_map: u16,
    failed: bool,
}

impl World {
    /// Maximum number of maps.
    pub const MOST_MAPS: usize = 256;
    /// Maximum number of cells of all maps together: four maps of maximum size.
    pub const MOST_CELLS: usize = 4 * 4096 * 4096;
    /// Maximum size of the description of a feature class in octets.
    pub const MOST_DESCRIPTION: usize = u16::MAX as usize;
    /// Maximum number of feature classes with a description.
    pub const MOST_CLASSES: usize = 256;

    /// Maximum number of keep-out zones: the count in messages is one octet.
    pub const MOST_KEEP_OUT_ZONES: usize = u8::MAX as usize;
    /// Maximum number of vertices of all zones together. Drivers measure their distance from all of
    /// them many times a second.
    pub const MOST_ZONE_VERTICES: usize = 4096;

    /// Opens the file of a world, or creates an empty one. Recovers a file that was being written
    /// during a power cut.
    ///
    /// # Errors
    /// If the file is not a store, is damaged, or cannot be used. It is left unchanged.
    pub fn open(path: &Path) -> Result<Self, OpenError> {
        File::open(path).map(Self::new)
    }

    /// Opens a world on another backend than a file.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn on(backend: impl StorageBackend) -> Result<Self, OpenError> {
        File::on(backend).map(Self::new)
    }

    fn new((file, loaded): (File, Loaded)) -> Self {
        Self {
            file,
            objects: loaded.objects,
            classes: loaded.classes.into_iter().collect(),
            rasters: loaded.rasters.into_iter().collect(),
            zones: loaded.zones.into_iter().collect(),
            last_object: loaded.last_object,
            last_map: loaded.last_map,
            failed: false,
        }
    }

    /// All objects.
    #[must_use]
    pub const fn objects(&self) -> &Collection {
        &self.objects
    }

    /// The object with this number.
    #[must_use]
    pub fn object(&self, id: ObjectId) -> Option<&Arc<Object>> {
        self.objects.get(id)
    }

    /// The descriptions of feature classes.
    #[must_use]
    pub const fn classes(&self) -> &BTreeMap<u16, String> {
        &self.classes
    }

    /// The maps by number.
    #[must_use]
    pub const fn rasters(&self) -> &BTreeMap<MapId, Raster> {
        &self.rasters
    }

    /// The zones by number.
    #[must_use]
    pub const fn zones(&self) -> &BTreeMap<ZoneId, Outline> {
        &self.zones
    }

    /// The cells of a window, row by row from the south.
    ///
    /// # Errors
    /// If the map does not exist, the window extends beyond it, or the file cannot be read.
    pub fn cells(&self, map: MapId, window: Window) -> Result<Result<Vec<u8>, Refusal>, KeepError> {
        let window = self.raster(map).and_then(|raster| {
            let on_it = inside(raster, window)?;
            Ok((raster.fill, on_it))
        });
        match window {
            Ok((fill, window)) => self.file.cells(map, fill, window).map(Ok),
            Err(refusal) => Ok(Err(refusal)),
        }
    }

    /// Whether writing a change has failed. Memory and file may then differ, and the world must be
    /// opened again.
    #[must_use]
    pub const fn has_failed(&self) -> bool {
        self.failed
    }

    /// Applies changes in a single write. They are on disk when this returns. A refused change does
    /// not affect the others. Takes a few milliseconds of disk time.
    ///
    /// # Errors
    /// If the file cannot be written. Then no change is applied, and the world [has
    /// failed](Self::has_failed).
    pub fn apply(&mut self, changes: Vec<Change>) -> Result<Vec<Result<Done, Refusal>>, KeepError> {
        if self.failed {
            return Err(KeepError::closed());
        }
        let kept = self.try_apply(changes);
        self.failed = kept.is_err();
        kept
    }

    fn try_apply(&mut self, changes: Vec<Change>) -> Result<Vec<Result<Done, Refusal>>, KeepError> {
        let writing = self.file.begin()?;
        let mut results = Vec::with_capacity(changes.len());
        for change in changes {
            results.push(self.carry_out(change, &writing)?);
        }
        if results.iter().any(Result::is_ok) {
            writing.keep()?;
        }
        Ok(results)
    }

    fn carry_out(
        &mut self,
        change: Change,
        writing: &Writing,
    ) -> Result<Result<Done, Refusal>, KeepError> {
        match change {
            Change::AddObjects(objects) => self.add_objects(objects, writing).map(Ok),
            Change::RemoveObjects(selection) => self.remove_objects(&selection, writing),
            Change::DescribeClass(class, how) => self.describe(class, how, writing),
            Change::AddRaster(raster, cells) => self.add_raster(raster, &cells, writing),
            Change::SetCells(map, window, cells) => self.set_cells(map, window, &cells, writing),
            Change::RemoveRaster(map) => self.remove_raster(map, writing),
            Change::SetZones(zones) => self.set_zones(&zones, writing),
            Change::RemoveZones(ids) => self.remove_zones(&ids, writing).map(Ok),
        }
    }

    fn add_objects(&mut self, objects: Vec<Object>, writing: &Writing) -> Result<Done, KeepError> {
        let mut added = Vec::with_capacity(objects.len());
        for object in objects {
            let room = self.last_object < ObjectId::LAST.0 && self.objects.has_room_for(&object);
            if !room || !object.is_sound() {
                added.push(None);
                continue;
            }
            self.last_object += 1;
            let id = ObjectId(self.last_object);
            writing.put_object(id, &object)?;
            self.objects.insert(id, object);
            added.push(Some(id));
        }
        writing.count(Counter::LastObject, self.last_object.into())?;
        Ok(Done::Added(added))
    }

    fn remove_objects(
        &mut self,
        selection: &Selection,
        writing: &Writing,
    ) -> Result<Result<Done, Refusal>, KeepError> {
        if !selection.is_sound() {
            return Ok(Err(Refusal::Region));
        }
        let meant = self.objects.select(selection);
        for &id in &meant {
            writing.remove_object(id)?;
            self.objects.remove(id);
        }
        Ok(Ok(Done::Removed(meant.len())))
    }

    fn describe(
        &mut self,
        class: u16,
        how: Describe,
        writing: &Writing,
    ) -> Result<Result<Done, Refusal>, KeepError> {
        let before = self.classes.get(&class).map_or("", String::as_str);
        let text = match how {
            Describe::Append(text) => Some(format!("{before}{text}")),
            Describe::Prepend(text) => Some(format!("{text}{before}")),
            Describe::Overwrite(text) => Some(text),
            Describe::Erase => None,
        };
        let new = text.is_some() && !self.classes.contains_key(&class);
        if text
            .as_ref()
            .is_some_and(|it| it.len() > Self::MOST_DESCRIPTION)
        {
            return Ok(Err(Refusal::Full("a description has at most 65535 octets")));
        }
        if new && self.classes.len() >= Self::MOST_CLASSES {
            return Ok(Err(Refusal::Full("at most 256 classes are described")));
        }
        writing.describe(class, text.as_deref())?;
        match text {
            Some(text) => self.classes.insert(class, text),
            None => self.classes.remove(&class),
        };
        Ok(Ok(Done::Described))
    }

    fn add_raster(
        &mut self,
        raster: Raster,
        cells: &[u8],
        writing: &Writing,
    ) -> Result<Result<Done, Refusal>, KeepError> {
        if let Err(refusal) = self.check_new(&raster, cells) {
            return Ok(Err(refusal));
        }
        let id = self.next_map();
        let raster = Raster {
            revision: 1,
            ..raster
        };
        self.last_map = id.0;
        writing.put_raster(id, &raster)?;
        if !cells.is_empty() {
            writing.put_cells(id, raster.fill, raster.whole(), cells)?;
        }
        writing.count(Counter::LastMap, id.0.into())?;
        self.rasters.insert(id, raster);
        Ok(Ok(Done::Raster(id, 1)))
    }

    fn check_new(&self, raster: &Raster, cells: &[u8]) -> Result<(), Refusal> {
        if let Some(fault) = raster.fault() {
            return Err(Refusal::Size(fault));
        }
        if !cells.is_empty() {
            check_count(raster.whole(), cells)?;
        }
        if self.rasters.len() >= Self::MOST_MAPS {
            return Err(Refusal::Full("at most 256 maps; delete one first"));
        }
        let before: usize = self.rasters.values().map(Raster::cells).sum();
        if before + raster.cells() > Self::MOST_CELLS {
            let most = "all maps together have at most 67108864 cells; delete one first";
            return Err(Refusal::Full(most));
        }
        Ok(())
    }

    /// The next number. After 65535 maps, the next free one.
    fn next_map(&self) -> MapId {
        let mut next = self.last_map;
        loop {
            next = next.checked_add(1).unwrap_or(1);
            if !self.rasters.contains_key(&MapId(next)) {
                return MapId(next);
            }
        }
    }

    fn set_cells(
        &mut self,
        map: MapId,
        window: Window,
        cells: &[u8],
        writing: &Writing,
    ) -> Result<Result<Done, Refusal>, KeepError> {
        let checked = self.raster(map).and_then(|raster| {
            check_count(window, cells)?;
            inside(raster, window).map(|_| raster)
        });
        let raster = match checked {
            Ok(raster) => raster,
            Err(refusal) => return Ok(Err(refusal)),
        };
        let raster = Raster {
            revision: raster.revision.wrapping_add(1),
            ..raster.clone()
        };
        writing.put_cells(map, raster.fill, window, cells)?;
        writing.put_raster(map, &raster)?;
        let done = Done::Raster(map, raster.revision);
        self.rasters.insert(map, raster);
        Ok(Ok(done))
    }

    fn remove_raster(
        &mut self,
        map: MapId,
        writing: &Writing,
    ) -> Result<Result<Done, Refusal>, KeepError> {
        let revision = match self.raster(map) {
            Ok(raster) => raster.revision,
            Err(refusal) => return Ok(Err(refusal)),
        };
        writing.remove_raster(map)?;
        self.rasters.remove(&map);
        Ok(Ok(Done::Raster(map, revision)))
    }

    fn set_zones(
        &mut self,
        zones: &[Outline],
        writing: &Writing,
    ) -> Result<Result<Done, Refusal>, KeepError> {
        let mut all = self.zones.clone();
        all.extend(zones.iter().map(|zone| (zone.id, zone.clone())));
        let keep_out = all.keys().filter(|&&id| id != ZoneId::Operating).count();
        if keep_out > Self::MOST_KEEP_OUT_ZONES {
            let most = "at most 255 keep-out zones; delete some first";
            return Ok(Err(Refusal::Full(most)));
        }
        let vertices: usize = all.values().map(|zone| zone.vertices.len()).sum();
        if vertices > Self::MOST_ZONE_VERTICES {
            let most = "all zones together have at most 4096 vertices; delete some first";
            return Ok(Err(Refusal::Full(most)));
        }
        for zone in zones {
            writing.put_zone(zone)?;
        }
        self.zones = all;
        Ok(Ok(Done::Zones))
    }

    fn remove_zones(&mut self, ids: &[ZoneId], writing: &Writing) -> Result<Done, KeepError> {
        for id in ids {
            writing.remove_zone(*id)?;
            self.zones.remove(id);
        }
        Ok(Done::Zones)
    }

    fn raster(&self, map: MapId) -> Result<&Raster, Refusal> {
        self.rasters.get(&map).ok_or(Refusal::NoSuchMap(map))
    }
}

fn inside(raster: &Raster, window: Window) -> Result<Window, Refusal> {
    raster.window(window).ok_or(Refusal::Outside {
        window,
        rows: raster.rows,
        columns: raster.columns,
    })
}

fn check_count(window: Window, cells: &[u8]) -> Result<(), Refusal> {
    if !cells.is_empty() && cells.len() == window.cells() {
        return Ok(());
    }
    Err(Refusal::Size(format!(
        "{} cells for {} x {}: send as many as rows times columns, and at least one",
        cells.len(),
        window.rows,
        window.columns,
    )))
}
