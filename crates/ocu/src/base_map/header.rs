//! The header of a PMTiles file, version 3: 127 octets in little-endian order.

use super::BaseMapError;
use super::directory::{DEEPEST_ZOOM, Span};

/// How octets are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Compression {
    None,
    Gzip,
}

impl Compression {
    fn of(code: u8, what: &'static str) -> Result<Self, BaseMapError> {
        let how = match code {
            1 => return Ok(Self::None),
            2 => return Ok(Self::Gzip),
            3 => "Brotli",
            4 => "Zstandard",
            _ => "an unknown method",
        };
        Err(BaseMapError::Compression { what, how })
    }
}

/// Format of the tiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    /// Mapbox Vector Tiles.
    Vector,
    Png,
    Jpeg,
    Webp,
    Avif,
}

impl Format {
    fn of(code: u8) -> Result<Self, BaseMapError> {
        Ok(match code {
            1 => Self::Vector,
            2 => Self::Png,
            3 => Self::Jpeg,
            4 => Self::Webp,
            5 => Self::Avif,
            _ => return Err(BaseMapError::Format(code)),
        })
    }

    pub(super) const fn content_type(self) -> &'static str {
        match self {
            Self::Vector => "application/vnd.mapbox-vector-tile",
            Self::Png => "image/png",
            Self::Jpeg => "image/jpeg",
            Self::Webp => "image/webp",
            Self::Avif => "image/avif",
        }
    }
}

/// The header.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Header {
    pub(super) root: Span,
    pub(super) metadata: Span,
    pub(super) leaves: Span,
    pub(super) tiles: Span,
    /// Compression of directories and metadata.
    pub(super) internal: Compression,
    /// Compression of tiles.
    pub(super) compression: Compression,
    pub(super) format: Format,
    pub(super) min_zoom: u8,
    pub(super) max_zoom: u8,
    /// West, south, east and north in degrees.
    pub(super) bounds: [f64; 4],
}

impl Header {
    pub(super) const LENGTH: usize = 127;
    const MAGIC: &[u8; 7] = b"PMTiles";
    const VERSION: u8 = 3;
    /// What Web Mercator can show, in degrees.
    const WORLD: [f64; 4] = [-180.0, -85.051_129, 180.0, 85.051_129];

    pub(super) fn read(octets: &[u8; Self::LENGTH]) -> Result<Self, BaseMapError> {
        let Some((Self::MAGIC, fields)) = octets.split_first_chunk() else {
            return Err(BaseMapError::NotPmtiles);
        };
        let mut fields = Fields { left: fields };
        let [version] = fields.take();
        if version != Self::VERSION {
            return Err(BaseMapError::Version(version));
        }
        let [root, metadata, leaves, tiles] = std::array::from_fn(|_| fields.span());
        // The numbers of tiles, and whether they are in order: not needed.
        let _: [u8; 25] = fields.take();
        let [internal, compression, format, min_zoom, max_zoom] = fields.take();
        let bounds = std::array::from_fn(|_| fields.degrees());
        if min_zoom > max_zoom || max_zoom > DEEPEST_ZOOM {
            return Err(BaseMapError::Zoom(min_zoom, max_zoom));
        }
        let compression = match Format::of(format)? {
            Format::Vector => Compression::of(compression, "tiles")?,
            // Pictures are compressed by themselves, and some writers leave this field empty.
            _ if compression == 0 => Compression::None,
            _ => Compression::of(compression, "tiles")?,
        };
        Ok(Self {
            root,
            metadata,
            leaves,
            tiles,
            internal: Compression::of(internal, "directories")?,
            compression,
            format: Format::of(format)?,
            min_zoom,
            max_zoom,
            bounds: Self::clip(bounds),
        })
    }

    /// Bounds within the world; all of it if they enclose nothing.
    fn clip([west, south, east, north]: [f64; 4]) -> [f64; 4] {
        let [least_west, least_south, most_east, most_north] = Self::WORLD;
        let [west, south] = [west.max(least_west), south.max(least_south)];
        let [east, north] = [east.min(most_east), north.min(most_north)];
        if west < east && south < north {
            [west, south, east, north]
        } else {
            Self::WORLD
        }
    }
}

/// The fields of a header that are left to read. A header has as many as are read.
struct Fields<'o> {
    left: &'o [u8],
}

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        match self.left.split_first_chunk() {
            Some((field, left)) => {
                self.left = left;
                *field
            }
            None => [0; N],
        }
    }

    fn span(&mut self) -> Span {
        Span {
            offset: u64::from_le_bytes(self.take()),
            length: u64::from_le_bytes(self.take()),
        }
    }

    /// An angle, stored in units of 10⁻⁷ degrees.
    fn degrees(&mut self) -> f64 {
        f64::from(i32::from_le_bytes(self.take())) / 1e7
    }
}
