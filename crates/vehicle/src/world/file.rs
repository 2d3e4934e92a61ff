//! Persistent storage of a world: one file with atomic and durable changes.
//!
//! The file is a `redb` database. A change is written to free pages first, then committed by one
//! write of a checksummed header, with disk flushes to enforce this order. The file records its
//! format version.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use jaus_files::{FileDraft, Readers};
use redb::backends::FileBackend;
use redb::{
    Builder, Database, DatabaseError, ReadableDatabase, ReadableTable, StorageBackend,
    TableDefinition, TableError, WriteTransaction,
};

use super::collection::Collection;
use super::object::{Object, ObjectId};
use super::raster::{MapId, Raster, Window};
use super::record;
use super::tiles::{self, TileId};
use super::zone::Outline;
use crate::zones::ZoneId;

/// Format version of the file. A newer program reads older formats or rejects them explicitly.
const FORMAT: u64 = 2;
/// Format of a file without zones. Programs that know no zones read it.
const FORMAT_WITHOUT_ZONES: u64 = 1;
/// Size of the page cache in octets. A map of 1024 x 1024 cells fits.
const CACHE: usize = 4 << 20;

/// Key of the format version in the table of numbers.
const FORMAT_KEY: &str = "format";

const NUMBERS: TableDefinition<'_, &str, u64> = TableDefinition::new("numbers");
const OBJECTS: TableDefinition<'_, u32, &[u8]> = TableDefinition::new("objects");
const CLASSES: TableDefinition<'_, u16, &str> = TableDefinition::new("classes");
const RASTERS: TableDefinition<'_, u16, &[u8]> = TableDefinition::new("rasters");
/// Absent from a file in which no zone was ever set.
const ZONES: TableDefinition<'_, u16, &[u8]> = TableDefinition::new("zones");
/// Key: map, row and column of the tile.
const TILES: TableDefinition<'_, (u16, u16, u16), &[u8]> = TableDefinition::new("tiles");

/// A counter whose values are never reused.
#[derive(Debug, Clone, Copy)]
pub(super) enum Counter {
    LastObject,
    LastMap,
}

impl Counter {
    const fn key(self) -> &'static str {
        match self {
            Self::LastObject => "last object",
            Self::LastMap => "last map",
        }
    }
}

/// Why a file cannot be opened. The file is left unchanged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// Another process has the file open.
    #[error("{}: another process has this store open; stop it or use another file", .0.display())]
    InUse(PathBuf),
    /// The file is damaged or not a store.
    #[error("{}: not a store, or damaged: {why}", path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// The cause.
        why: String,
    },
    /// The file was written by a newer version of this program.
    #[error(
        "{}: the store has format {found}, but this program supports up to {FORMAT}; use a newer \
         program",
        path.display()
    )]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its format version.
        found: u64,
    },
}

impl OpenError {
    fn broken(path: &Path, why: &impl ToString) -> Self {
        Self::Broken {
            path: path.to_owned(),
            why: why.to_string(),
        }
    }

    fn io(path: &Path, source: io::Error) -> Self {
        Self::Io {
            path: path.to_owned(),
            source,
        }
    }
}

/// Error: data cannot be written or read. The file is unchanged and must be opened again.
#[derive(Debug, thiserror::Error)]
#[error("cannot access the store: {0}")]
pub struct KeepError(String);

impl<E: Into<redb::Error>> From<E> for KeepError {
    fn from(error: E) -> Self {
        Self(error.into().to_string())
    }
}

impl KeepError {
    fn record(error: &impl ToString) -> Self {
        Self(error.to_string())
    }

    /// The error for requests after the first failure.
    pub(super) fn closed() -> Self {
        Self("it failed before and is closed".to_owned())
    }
}

/// Everything but the cells, as loaded from the file.
#[derive(Default)]
pub(super) struct Loaded {
    pub(super) objects: Collection,
    pub(super) classes: Vec<(u16, String)>,
    pub(super) rasters: Vec<(MapId, Raster)>,
    pub(super) zones: Vec<(ZoneId, Outline)>,
    pub(super) last_object: u32,
    pub(super) last_map: u16,
}

/// An open file.
#[derive(Debug)]
pub(super) struct File {
    database: Database,
}

impl File {
    /// Opens a file, or creates it if it does not exist.
    pub(super) fn open(path: &Path) -> Result<(Self, Loaded), OpenError> {
        match fs::metadata(path) {
            Ok(_) => Self::check(path, builder().open(path)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Self::create(path),
            Err(error) => Err(OpenError::io(path, error)),
        }
    }

    /// Creates the file under a temporary name first, so that after a power cut it is complete or
    /// absent.
    fn create(path: &Path) -> Result<(Self, Loaded), OpenError> {
        let fail = |error| OpenError::io(path, error);
        let directory = path.parent().filter(|it| !it.as_os_str().is_empty());
        let directory = directory.unwrap_or(Path::new("."));
        fs::create_dir_all(directory).map_err(|error| OpenError::io(directory, error))?;
        let mut draft = FileDraft::new(path, Readers::Everyone).map_err(fail)?;
        let file = draft.file().try_clone().map_err(fail)?;
        let database = FileBackend::new(file).and_then(|it| builder().create_with_backend(it));
        let made = Self::check(path, database)?;
        draft.replace().map_err(fail)?;
        Ok(made)
    }

    /// Opens a store on another backend than a file.
    pub(super) fn on(backend: impl StorageBackend) -> Result<(Self, Loaded), OpenError> {
        Self::check(
            Path::new("(not a file)"),
            builder().create_with_backend(backend),
        )
    }

    fn check(
        path: &Path,
        opened: Result<Database, DatabaseError>,
    ) -> Result<(Self, Loaded), OpenError> {
        let database = opened.map_err(|error| match error {
            DatabaseError::DatabaseAlreadyOpen => OpenError::InUse(path.to_owned()),
            DatabaseError::Storage(redb::StorageError::Io(error))
                if error.kind() != io::ErrorKind::InvalidData
                    && error.kind() != io::ErrorKind::UnexpectedEof =>
            {
                OpenError::io(path, error)
            }
            error => OpenError::broken(path, &error),
        })?;
        let file = Self { database };
        let format = file
            .format()
            .map_err(|error| OpenError::broken(path, &error))?;
        if format > FORMAT {
            return Err(OpenError::Newer {
                path: path.to_owned(),
                found: format,
            });
        }
        let loaded = file
            .load()
            .map_err(|error| OpenError::broken(path, &error))?;
        Ok((file, loaded))
    }

    /// The format version of the file. Initialises a new file.
    fn format(&self) -> Result<u64, KeepError> {
        let reading = self.database.begin_read()?;
        match reading.open_table(NUMBERS) {
            Ok(numbers) => match numbers.get(FORMAT_KEY)? {
                Some(format) => Ok(format.value()),
                None => Err(KeepError::record(&"its format is missing")),
            },
            Err(TableError::TableDoesNotExist(_)) => {
                let writing = self.database.begin_write()?;
                {
                    let mut numbers = writing.open_table(NUMBERS)?;
                    numbers.insert(FORMAT_KEY, FORMAT_WITHOUT_ZONES)?;
                    writing.open_table(OBJECTS)?;
                    writing.open_table(CLASSES)?;
                    writing.open_table(RASTERS)?;
                    writing.open_table(TILES)?;
                }
                writing.commit()?;
                Ok(FORMAT_WITHOUT_ZONES)
            }
            Err(error) => Err(error.into()),
        }
    }

    fn load(&self) -> Result<Loaded, KeepError> {
        let reading = self.database.begin_read()?;
        let mut objects = Vec::new();
        for entry in reading.open_table(OBJECTS)?.iter()? {
            let (id, octets) = entry?;
            let object =
                record::read_object(octets.value()).map_err(|error| KeepError::record(&error))?;
            objects.push((ObjectId(id.value()), object));
        }
        let mut classes = Vec::new();
        for entry in reading.open_table(CLASSES)?.iter()? {
            let (id, text) = entry?;
            classes.push((id.value(), text.value().to_owned()));
        }
        let mut rasters = Vec::new();
        for entry in reading.open_table(RASTERS)?.iter()? {
            let (id, octets) = entry?;
            let raster =
                record::read_raster(octets.value()).map_err(|error| KeepError::record(&error))?;
            rasters.push((MapId(id.value()), raster));
        }
        let zones = match reading.open_table(ZONES) {
            Ok(table) => load_zones(&table)?,
            Err(TableError::TableDoesNotExist(_)) => Vec::new(),
            Err(error) => return Err(error.into()),
        };
        let numbers = reading.open_table(NUMBERS)?;
        let last = |counter: Counter| -> Result<u64, KeepError> {
            Ok(numbers.get(counter.key())?.map_or(0, |it| it.value()))
        };
        Ok(Loaded {
            objects: Collection::new(objects.into_iter()),
            classes,
            rasters,
            zones,
            last_object: last(Counter::LastObject)? as u32,
            last_map: last(Counter::LastMap)? as u16,
        })
    }

    /// The cells of a window within the map.
    pub(super) fn cells(&self, map: MapId, fill: u8, window: Window) -> Result<Vec<u8>, KeepError> {
        let tiles = self.database.begin_read()?.open_table(TILES)?;
        let mut cells = vec![fill; window.cells()];
        for overlap in tiles::overlaps(window) {
            let (row, column) = overlap.tile;
            if let Some(tile) = tiles.get((map.0, row, column))? {
                overlap.take(whole(tile.value())?, &mut cells);
            }
        }
        Ok(cells)
    }

    /// Begins a change. It takes effect when it is [kept](Writing::keep).
    pub(super) fn begin(&self) -> Result<Writing, KeepError> {
        Ok(Writing {
            transaction: self.database.begin_write()?,
        })
    }
}

/// A pending change. Dropping it discards it.
pub(super) struct Writing {
    transaction: WriteTransaction,
}

impl Writing {
    pub(super) fn put_object(&self, id: ObjectId, object: &Object) -> Result<(), KeepError> {
        let octets = record::write_object(object).map_err(|error| KeepError::record(&error))?;
        let mut objects = self.transaction.open_table(OBJECTS)?;
        objects.insert(id.0, &octets[..])?;
        Ok(())
    }

    pub(super) fn remove_object(&self, id: ObjectId) -> Result<(), KeepError> {
        self.transaction.open_table(OBJECTS)?.remove(id.0)?;
        Ok(())
    }

    /// Sets the description of a class; `None` deletes it.
    pub(super) fn describe(&self, class: u16, text: Option<&str>) -> Result<(), KeepError> {
        let mut classes = self.transaction.open_table(CLASSES)?;
        match text {
            Some(text) => classes.insert(class, text)?,
            None => classes.remove(class)?,
        };
        Ok(())
    }

    pub(super) fn put_raster(&self, id: MapId, raster: &Raster) -> Result<(), KeepError> {
        let octets = record::write_raster(raster).map_err(|error| KeepError::record(&error))?;
        let mut rasters = self.transaction.open_table(RASTERS)?;
        rasters.insert(id.0, &octets[..])?;
        Ok(())
    }

    /// Sets a zone. The file then has the format with zones, so that no program drives without them.
    pub(super) fn put_zone(&self, zone: &Outline) -> Result<(), KeepError> {
        let octets = record::write_zone(zone).map_err(|error| KeepError::record(&error))?;
        let mut zones = self.transaction.open_table(ZONES)?;
        zones.insert(zone.id.number(), &octets[..])?;
        let mut numbers = self.transaction.open_table(NUMBERS)?;
        numbers.insert(FORMAT_KEY, FORMAT)?;
        Ok(())
    }

    pub(super) fn remove_zone(&self, id: ZoneId) -> Result<(), KeepError> {
        self.transaction.open_table(ZONES)?.remove(id.number())?;
        Ok(())
    }

    /// Removes a map with all its tiles.
    pub(super) fn remove_raster(&self, id: MapId) -> Result<(), KeepError> {
        self.transaction.open_table(RASTERS)?.remove(id.0)?;
        let mut tiles = self.transaction.open_table(TILES)?;
        tiles.retain_in((id.0, 0, 0)..=(id.0, u16::MAX, u16::MAX), |_, _| false)?;
        Ok(())
    }

    /// Sets the cells of a window within the map.
    pub(super) fn put_cells(
        &self,
        map: MapId,
        fill: u8,
        window: Window,
        cells: &[u8],
    ) -> Result<(), KeepError> {
        let mut tiles = self.transaction.open_table(TILES)?;
        for overlap in tiles::overlaps(window) {
            let (row, column): TileId = overlap.tile;
            let key = (map.0, row, column);
            let mut tile = [fill; tiles::CELLS];
            if let Some(before) = tiles.get(key)? {
                tile.copy_from_slice(whole(before.value())?);
            }
            overlap.put(cells, &mut tile);
            if tile.iter().all(|&cell| cell == fill) {
                tiles.remove(key)?;
            } else {
                tiles.insert(key, &tile[..])?;
            }
        }
        Ok(())
    }

    pub(super) fn count(&self, counter: Counter, last: u64) -> Result<(), KeepError> {
        let mut numbers = self.transaction.open_table(NUMBERS)?;
        numbers.insert(counter.key(), last)?;
        Ok(())
    }

    /// Commits the change. Returns once it is on disk.
    pub(super) fn keep(self) -> Result<(), KeepError> {
        Ok(self.transaction.commit()?)
    }
}

fn builder() -> Builder {
    let mut builder = Builder::new();
    builder.set_cache_size(CACHE);
    builder.set_check_integrity_on_open(true);
    builder
}

fn load_zones(
    table: &impl ReadableTable<u16, &'static [u8]>,
) -> Result<Vec<(ZoneId, Outline)>, KeepError> {
    let mut zones = Vec::new();
    for entry in table.iter()? {
        let (number, octets) = entry?;
        let id = ZoneId::of(number.value());
        let id = id.ok_or_else(|| KeepError::record(&"a zone has the number 0"))?;
        let zone = record::read_zone(id, octets.value());
        zones.push((id, zone.map_err(|error| KeepError::record(&error))?));
    }
    Ok(zones)
}

fn whole(tile: &[u8]) -> Result<&[u8], KeepError> {
    if tile.len() == tiles::CELLS {
        Ok(tile)
    } else {
        Err(KeepError::record(&"a tile has a wrong size"))
    }
}
