//! Writes small map files (PMTiles, version 3), and tiles for them.

use std::io::Write;

use flate2::Compression;
use flate2::Crc;
use flate2::write::{GzEncoder, ZlibEncoder};

/// Code of no compression.
pub const NONE: u8 = 1;
/// Code of gzip compression.
pub const GZIP: u8 = 2;
/// Code of vector tiles.
pub const VECTOR: u8 = 1;
/// Code of PNG tiles.
pub const PNG: u8 = 2;

/// A map file to write.
#[derive(Debug, Clone)]
pub struct MapFile {
    /// Numbers and octets of the tiles.
    pub tiles: Vec<(u64, Vec<u8>)>,
    /// Code of the tiles' format.
    pub format: u8,
    /// Code of the tiles' compression. They are compressed before they are added.
    pub compression: u8,
    /// Code of the compression of directories and metadata.
    pub internal: u8,
    /// Directories on the way to a tile, besides the first.
    pub leaves: usize,
    /// Lowest and highest zoom level.
    pub zooms: (u8, u8),
    /// West, south, east and north in degrees.
    pub bounds: [f64; 4],
    /// JSON; empty for none.
    pub metadata: String,
}

impl MapFile {
    /// Without tiles, for all zoom levels and the whole world.
    #[must_use]
    pub fn new(format: u8) -> Self {
        Self {
            tiles: Vec::new(),
            format,
            compression: NONE,
            internal: GZIP,
            leaves: 0,
            zooms: (0, 20),
            bounds: [-180.0, -85.0, 180.0, 85.0],
            metadata: r#"{"name":"Test","attribution":"<a href=\"x\">&copy; Testers</a>"}"#
                .to_owned(),
        }
    }

    /// Adds a tile.
    #[must_use]
    pub fn tile(mut self, (zoom, x, y): (u8, u32, u32), octets: &[u8]) -> Self {
        self.tiles.push((number(zoom, x, y), octets.to_vec()));
        self
    }

    /// The octets of the file.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        let mut tiles = self.tiles.clone();
        tiles.sort();
        let mut data = Vec::new();
        let mut entries = Vec::new();
        for (id, octets) in &tiles {
            entries.push([*id, 1, octets.len() as u64, data.len() as u64]);
            data.extend(octets);
        }
        let mut directory = self.compress(&directory(&entries));
        let mut leaves = Vec::new();
        for _ in 0..self.leaves {
            let entry = [0, 0, directory.len() as u64, leaves.len() as u64];
            leaves.extend(directory);
            directory = self.compress(&self::directory(&[entry]));
        }
        let metadata = match &*self.metadata {
            "" => Vec::new(),
            text => self.compress(text.as_bytes()),
        };
        let mut file = b"PMTiles\x03".to_vec();
        let mut offset = 127;
        for section in [&directory, &metadata, &leaves, &data] {
            file.extend(u64::to_le_bytes(offset));
            file.extend((section.len() as u64).to_le_bytes());
            offset += section.len() as u64;
        }
        file.extend([0; 25]);
        file.extend([self.internal, self.compression, self.format]);
        file.extend([self.zooms.0, self.zooms.1]);
        for degrees in self.bounds {
            file.extend(((degrees * 1e7) as i32).to_le_bytes());
        }
        file.extend([0; 9]);
        assert_eq!(file.len(), 127);
        [file, directory, metadata, leaves, data].concat()
    }

    fn compress(&self, octets: &[u8]) -> Vec<u8> {
        match self.internal {
            GZIP => gzip(octets),
            _ => octets.to_vec(),
        }
    }
}

/// Compresses octets.
#[must_use]
pub fn gzip(octets: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(octets).unwrap();
    encoder.finish().unwrap()
}

/// A picture of one colour.
#[must_use]
pub fn png([red, green, blue]: [u8; 3]) -> Vec<u8> {
    const SIDE: u32 = 16;
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut chunk = |kind: &[u8], content: &[u8]| {
        let mut crc = Crc::new();
        crc.update(kind);
        crc.update(content);
        file.extend((content.len() as u32).to_be_bytes());
        file.extend([kind, content, &crc.sum().to_be_bytes()].concat());
    };
    let size = SIDE.to_be_bytes();
    chunk(b"IHDR", &[&size[..], &size, &[8, 2, 0, 0, 0]].concat());
    let row = [vec![0], [red, green, blue].repeat(SIDE as usize)].concat();
    let mut pixels = ZlibEncoder::new(Vec::new(), Compression::default());
    pixels.write_all(&row.repeat(SIDE as usize)).unwrap();
    chunk(b"IDAT", &pixels.finish().unwrap());
    chunk(b"IEND", &[]);
    file
}

/// A vector tile in which each layer is one square, from one corner of the tile to another, in
/// fractions of its side.
#[must_use]
pub fn vector(layers: &[(&str, [f64; 2], [f64; 2])]) -> Vec<u8> {
    const EXTENT: f64 = 4096.0;
    let layers = layers.iter().map(|(name, from, to)| {
        let [left, top, right, bottom] =
            [from[0], from[1], to[0], to[1]].map(|it| (it * EXTENT) as i64);
        let zigzag = |value: i64| ((value << 1) ^ (value >> 63)) as u64;
        let [right, down] = [right - left, bottom - top];
        let geometry = [
            9,
            zigzag(left),
            zigzag(top),
            26,
            zigzag(right),
            0,
            0,
            zigzag(down),
            zigzag(-right),
            0,
            15,
        ];
        let geometry: Vec<u8> = geometry.into_iter().flat_map(varint).collect();
        let feature = [vec![0x18, 3], field(4, &geometry)].concat();
        let extent = [vec![0x28], varint(EXTENT as u64)].concat();
        let layer = [
            field(1, name.as_bytes()),
            field(2, &feature),
            extent,
            vec![0x78, 2],
        ];
        field(3, &layer.concat())
    });
    layers.collect::<Vec<_>>().concat()
}

/// A field of a protocol buffer with octets.
fn field(number: u8, octets: &[u8]) -> Vec<u8> {
    [
        vec![number << 3 | 2],
        varint(octets.len() as u64),
        octets.to_vec(),
    ]
    .concat()
}

/// An uncompressed directory of entries: id, run, length, offset.
#[must_use]
pub fn directory(entries: &[[u64; 4]]) -> Vec<u8> {
    let mut octets = varint(entries.len() as u64);
    let mut last = 0;
    for [id, ..] in entries {
        octets.extend(varint(id - last));
        last = *id;
    }
    octets.extend(entries.iter().flat_map(|it| varint(it[1])));
    octets.extend(entries.iter().flat_map(|it| varint(it[2])));
    octets.extend(entries.iter().flat_map(|it| varint(it[3] + 1)));
    octets
}

fn varint(mut value: u64) -> Vec<u8> {
    let mut octets = Vec::new();
    while value > 0x7f {
        octets.push(value as u8 | 0x80);
        value >>= 7;
    }
    octets.push(value as u8);
    octets
}

/// Number of a tile, from its quadrants: along a Hilbert curve, whose first and last quadrants are
/// reflected.
fn number(zoom: u8, x: u32, y: u32) -> u64 {
    let before = (0..zoom).map(|level| 4_u64.pow(level.into())).sum::<u64>();
    before + along(zoom, x, y)
}

fn along(zoom: u8, x: u32, y: u32) -> u64 {
    let Some(level) = zoom.checked_sub(1) else {
        return 0;
    };
    let half = 1 << level;
    let (quadrant, x, y) = match (x >= half, y >= half) {
        (false, false) => (0, y, x),
        (false, true) => (1, x, y - half),
        (true, true) => (2, x - half, y - half),
        (true, false) => (3, half - 1 - y, 2 * half - 1 - x),
    };
    quadrant * 4_u64.pow(level.into()) + along(level, x, y)
}
