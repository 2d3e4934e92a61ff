//! Binary records of objects and maps in the file, little-endian. Changing a layout requires a new
//! format version of the file.

use deku::prelude::*;

use super::object::{FeatureClass, Geometry, Object, Place};
use super::raster::Raster;
use super::zone::Outline;
use crate::zones::ZoneId;

#[derive(DekuRead, DekuWrite)]
#[deku(endian = "little")]
struct ObjectRecord {
    geometry: Geometry,
    buffer: f32,
    class_count: u8,
    #[deku(count = "class_count")]
    classes: Vec<FeatureClass>,
    point_count: u16,
    #[deku(count = "point_count")]
    points: Vec<Place>,
}

#[derive(DekuRead, DekuWrite)]
#[deku(endian = "little")]
struct RasterRecord {
    name_length: u8,
    #[deku(count = "name_length")]
    name: Vec<u8>,
    rows: u16,
    columns: u16,
    cell: f32,
    x: f64,
    y: f64,
    fill: u8,
    revision: u32,
}

#[derive(DekuRead, DekuWrite)]
#[deku(endian = "little")]
struct ZoneRecord {
    /// 1 for latitude and longitude.
    on_globe: u8,
    coordinate_count: u16,
    #[deku(count = "coordinate_count")]
    coordinates: Vec<f64>,
}

/// Encodes a valid zone, without its number.
pub(super) fn write_zone(zone: &Outline) -> Result<Vec<u8>, DekuError> {
    let coordinates: Vec<_> = zone.vertices.iter().flat_map(|&(a, b)| [a, b]).collect();
    let record = ZoneRecord {
        on_globe: zone.on_globe.into(),
        coordinate_count: coordinates.len() as u16,
        coordinates,
    };
    record.to_bytes()
}

/// Decodes the zone with this number.
pub(super) fn read_zone(id: ZoneId, octets: &[u8]) -> Result<Outline, DekuError> {
    let record = ZoneRecord::try_from(octets)?;
    let vertices = record.coordinates.chunks_exact(2);
    Ok(Outline {
        id,
        on_globe: record.on_globe != 0,
        vertices: vertices.map(|pair| (pair[0], pair[1])).collect(),
    })
}

/// Encodes a valid object.
pub(super) fn write_object(object: &Object) -> Result<Vec<u8>, DekuError> {
    let record = ObjectRecord {
        geometry: object.geometry,
        buffer: object.buffer,
        class_count: object.classes.len() as u8,
        classes: object.classes.clone(),
        point_count: object.points.len() as u16,
        points: object.points.clone(),
    };
    record.to_bytes()
}

/// Decodes an object.
pub(super) fn read_object(octets: &[u8]) -> Result<Object, DekuError> {
    let record = ObjectRecord::try_from(octets)?;
    Ok(Object {
        geometry: record.geometry,
        buffer: record.buffer,
        classes: record.classes,
        points: record.points,
    })
}

/// Encodes a valid map, without its cells.
pub(super) fn write_raster(raster: &Raster) -> Result<Vec<u8>, DekuError> {
    let record = RasterRecord {
        name_length: raster.name.len() as u8,
        name: raster.name.clone().into(),
        rows: raster.rows,
        columns: raster.columns,
        cell: raster.cell,
        x: raster.x,
        y: raster.y,
        fill: raster.fill,
        revision: raster.revision,
    };
    record.to_bytes()
}

/// Decodes a map, without its cells.
pub(super) fn read_raster(octets: &[u8]) -> Result<Raster, DekuError> {
    let record = RasterRecord::try_from(octets)?;
    Ok(Raster {
        name: String::from_utf8_lossy(&record.name).into_owned(),
        rows: record.rows,
        columns: record.columns,
        cell: record.cell,
        x: record.x,
        y: record.y,
        fill: record.fill,
        revision: record.revision,
    })
}
