//! Binary records of objects and maps in the file, little-endian. Changing a layout requires a new
//! format version of the file.

use deku::prelude::*;

use super::object::{FeatureClass, Geometry, Object, Place};
use super::raster::Raster;

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
