//! The geographic map behind the vehicle: a PMTiles file (version 3) of the user, read tile by tile.
//!
//! The file is not trusted: every offset is checked against its length, and nothing is decompressed
//! beyond a limit.

mod directory;
mod header;
#[cfg(test)]
mod tests;

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use flate2::read::GzDecoder;
use serde::{Deserialize, Serialize};

use self::directory::{Directory, Span, Target, tile_id};
use self::header::{Compression, Format, Header};

/// Why a map file, or one of its tiles, cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BaseMapError {
    /// The file cannot be opened or read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// It is another kind of file.
    #[error("this is not a PMTiles file: it does not begin with the word PMTiles")]
    NotPmtiles,
    /// It has another version of the format.
    #[error("this is version {0} of PMTiles; only version 3 is supported: convert the file")]
    Version(u8),
    /// The file ends before its content.
    #[error(
        "the file is truncated: its {what} end at octet {end}, and it has {length}; copy it again"
    )]
    Truncated {
        /// The part of the file.
        what: &'static str,
        /// Where it ends.
        end: u64,
        /// Length of the file.
        length: u64,
    },
    /// It is compressed in a way that is not supported.
    #[error("the {what} are compressed with {how}; only gzip is supported: convert the file")]
    Compression {
        /// The part of the file.
        what: &'static str,
        /// The method.
        how: &'static str,
    },
    /// The format of its tiles is not supported.
    #[error(
        "its tiles have format {0}, which is not supported; use vector tiles (MVT), PNG, JPEG, WebP \
         or AVIF"
    )]
    Format(u8),
    /// Its zoom levels contradict each other.
    #[error("its zoom levels {0} to {1} are invalid; they range from 0 to 31")]
    Zoom(u8, u8),
    /// A part of it is larger than the limit.
    #[error("its {what} exceed the limit of {limit} octets")]
    TooLarge {
        /// The part of the file.
        what: &'static str,
        /// The limit.
        limit: u64,
    },
    /// A part of it does not decompress.
    #[error("its {what} are damaged: {why}")]
    Damaged {
        /// The part of the file.
        what: &'static str,
        /// What is wrong.
        why: io::Error,
    },
    /// A directory is invalid.
    #[error("a directory is damaged: {0}")]
    Directory(&'static str),
    /// Its metadata is invalid.
    #[error("its metadata is invalid: {0}")]
    Metadata(#[from] serde_json::Error),
}

/// A map file.
#[derive(Debug, Clone)]
pub struct BaseMap {
    archive: Arc<Archive>,
}

#[derive(Debug)]
struct Archive {
    file: Mutex<File>,
    length: u64,
    header: Header,
    root: Directory,
    metadata: Metadata,
}

/// What the pages use of the metadata.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Metadata {
    name: String,
    /// Whom the map's licence wants to be named, as HTML.
    attribution: String,
}

/// The map file as described to pages.
#[derive(Debug, PartialEq, Serialize)]
pub(crate) struct Description {
    name: String,
    /// Plain text.
    attribution: String,
    /// Whether its tiles are vector tiles.
    vector: bool,
    min_zoom: u8,
    max_zoom: u8,
    /// West, south, east and north in degrees.
    bounds: [f64; 4],
}

/// A tile as stored.
#[derive(Debug, PartialEq)]
pub(crate) struct Tile {
    pub(crate) octets: Bytes,
    pub(crate) is_gzip: bool,
}

impl BaseMap {
    /// Limits in octets, compressed and not: what files of whole continents need, several times.
    const DIRECTORY: u64 = 2 << 20;
    const METADATA: u64 = 4 << 20;
    const TILE: u64 = 8 << 20;
    /// Limit of directories on the way to a tile. Usual files have two.
    const DEPTH: usize = 4;

    /// Opens a file, and checks all of it except its tiles and leaf directories.
    ///
    /// # Errors
    /// If it cannot be read, is damaged, or has a format that is not supported.
    pub fn open(path: &Path) -> Result<Self, BaseMapError> {
        let mut file = File::open(path)?;
        let length = file.metadata()?.len();
        let mut octets = [0; Header::LENGTH];
        let count = read_up_to(&mut file, &mut octets)?;
        let header = Header::read(&octets)?;
        if count < octets.len() {
            return Err(BaseMapError::Truncated {
                what: "first 127 octets",
                end: Header::LENGTH as u64,
                length,
            });
        }
        let mut source = Source {
            file: &mut file,
            length,
        };
        source.check("leaf directories", header.leaves)?;
        source.check("tiles", header.tiles)?;
        let root = source.read("directories", header.root, Self::DIRECTORY)?;
        let root = inflate("directories", root, header.internal, Self::DIRECTORY)?;
        let metadata = source.read("metadata", header.metadata, Self::METADATA)?;
        let metadata = match metadata.is_empty() {
            true => Metadata::default(),
            false => serde_json::from_slice(&inflate(
                "metadata",
                metadata,
                header.internal,
                Self::METADATA,
            )?)?,
        };
        let archive = Archive {
            root: Directory::read(&root)?,
            file: Mutex::new(file),
            length,
            header,
            metadata,
        };
        Ok(Self {
            archive: Arc::new(archive),
        })
    }

    pub(crate) fn description(&self) -> Description {
        let Archive {
            header, metadata, ..
        } = &*self.archive;
        Description {
            name: plain(&metadata.name),
            attribution: plain(&metadata.attribution),
            vector: header.format == Format::Vector,
            min_zoom: header.min_zoom,
            max_zoom: header.max_zoom,
            bounds: header.bounds,
        }
    }

    pub(crate) fn content_type(&self) -> &'static str {
        self.archive.header.format.content_type()
    }

    /// Reads a tile; `None` if the file does not have it. Blocks while it reads the file.
    pub(crate) fn tile(&self, zoom: u8, x: u32, y: u32) -> Result<Option<Tile>, BaseMapError> {
        let Archive { header, .. } = &*self.archive;
        let levels = header.min_zoom..=header.max_zoom;
        let Some(id) = tile_id(zoom, x, y).filter(|_| levels.contains(&zoom)) else {
            return Ok(None);
        };
        let Some(span) = self.find(id)? else {
            return Ok(None);
        };
        let octets = self.read("tiles", header.tiles, span, Self::TILE)?;
        let tile = Tile {
            octets,
            is_gzip: header.compression == Compression::Gzip,
        };
        // A browser decompresses without a limit.
        tile.inflated()?;
        Ok(Some(tile))
    }

    /// Where a tile is within the tile data.
    fn find(&self, id: u64) -> Result<Option<Span>, BaseMapError> {
        let Archive { header, root, .. } = &*self.archive;
        let mut target = root.find(id);
        for _ in 0..Self::DEPTH {
            let leaf = match target {
                None => return Ok(None),
                Some(Target::Tile(span)) => return Ok(Some(span)),
                Some(Target::Leaf(span)) => span,
            };
            let octets = self.read("directories", header.leaves, leaf, Self::DIRECTORY)?;
            let octets = inflate("directories", octets, header.internal, Self::DIRECTORY)?;
            target = Directory::read(&octets)?.find(id);
        }
        Err(BaseMapError::Directory(
            "too many directories lead to a tile",
        ))
    }

    /// Reads a span that is relative to a section of the file.
    fn read(
        &self,
        what: &'static str,
        section: Span,
        span: Span,
        limit: u64,
    ) -> Result<Bytes, BaseMapError> {
        let Archive { file, length, .. } = &*self.archive;
        let span = Span {
            offset: section.offset.saturating_add(span.offset),
            ..span
        };
        // A reader that panicked leaves no state behind: every read seeks first.
        let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
        let length = *length;
        Source {
            file: &mut file,
            length,
        }
        .read(what, span, limit)
    }
}

impl Tile {
    /// The octets for a client that does not decompress.
    pub(crate) fn inflated(&self) -> Result<Bytes, BaseMapError> {
        let compression = match self.is_gzip {
            true => Compression::Gzip,
            false => Compression::None,
        };
        inflate("tiles", self.octets.clone(), compression, BaseMap::TILE)
    }
}

/// The file with its length when it was opened.
struct Source<'f> {
    file: &'f mut File,
    length: u64,
}

impl Source<'_> {
    /// Checks that a part is within the file.
    fn check(&self, what: &'static str, span: Span) -> Result<(), BaseMapError> {
        let end = span.offset.saturating_add(span.length);
        let length = self.length;
        if end > length {
            return Err(BaseMapError::Truncated { what, end, length });
        }
        Ok(())
    }

    fn read(&mut self, what: &'static str, span: Span, limit: u64) -> Result<Bytes, BaseMapError> {
        self.check(what, span)?;
        let length = usize::try_from(span.length).ok();
        let length = length.filter(|_| span.length <= limit);
        let mut octets = vec![0; length.ok_or(BaseMapError::TooLarge { what, limit })?];
        self.file.seek(SeekFrom::Start(span.offset))?;
        self.file.read_exact(&mut octets)?;
        Ok(octets.into())
    }
}

/// Reads until the buffer is full or the file ends.
fn read_up_to(file: &mut File, buffer: &mut [u8]) -> io::Result<usize> {
    let mut count = 0;
    while let Some(rest) = buffer.get_mut(count..).filter(|rest| !rest.is_empty()) {
        match file.read(rest)? {
            0 => break,
            more => count += more,
        }
    }
    Ok(count)
}

/// Decompresses at most `limit` octets.
fn inflate(
    what: &'static str,
    octets: Bytes,
    compression: Compression,
    limit: u64,
) -> Result<Bytes, BaseMapError> {
    if compression == Compression::None {
        return Ok(octets);
    }
    let mut inflated = Vec::new();
    let mut decoder = GzDecoder::new(&*octets).take(limit + 1);
    let read = decoder.read_to_end(&mut inflated);
    read.map_err(|why| BaseMapError::Damaged { what, why })?;
    if inflated.len() as u64 > limit {
        return Err(BaseMapError::TooLarge { what, limit });
    }
    Ok(inflated.into())
}

/// Text without markup, one line of at most 200 characters. Attributions usually are links in HTML.
fn plain(html: &str) -> String {
    const MOST: usize = 200;
    let mut text = String::new();
    let mut is_tag = false;
    for letter in html.chars() {
        match letter {
            '<' => is_tag = true,
            '>' => is_tag = false,
            _ if is_tag => {}
            _ => text.push(letter),
        }
    }
    let named = [
        ("&copy;", "©"),
        ("&#169;", "©"),
        ("&nbsp;", " "),
        ("&quot;", "\""),
        ("&lt;", "<"),
        ("&gt;", ">"),
        ("&amp;", "&"),
    ];
    for (entity, letter) in named {
        text = text.replace(entity, letter);
    }
    let words: Vec<_> = text.split_whitespace().collect();
    words.join(" ").chars().take(MOST).collect()
}
