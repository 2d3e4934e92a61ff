//! Map files that the test writes, whole and damaged.

use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

use jaus_test_kit::map_file::{GZIP, MapFile, NONE, PNG, VECTOR, directory, gzip, png};

use super::*;

/// A file with these octets; removed when dropped.
struct Written(PathBuf);

impl Written {
    fn new(octets: &[u8]) -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = format!("jaus-base-map-{}-{number}.pmtiles", std::process::id());
        let path = std::env::temp_dir().join(name);
        fs::write(&path, octets).unwrap();
        Self(path)
    }

    fn open(&self) -> Result<BaseMap, BaseMapError> {
        BaseMap::open(&self.0)
    }
}

impl Drop for Written {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

fn opened(octets: &[u8]) -> Result<BaseMap, BaseMapError> {
    Written::new(octets).open()
}

const RED: [u8; 3] = [255, 0, 0];
const PLACE: (u8, u32, u32) = (14, 8801, 5373);

fn small() -> MapFile {
    MapFile::new(PNG)
        .tile((0, 0, 0), b"world")
        .tile(PLACE, &png(RED))
}

#[test]
fn tiles_are_found_whatever_the_number_of_directories_and_their_compression() {
    for (internal, leaves) in [(NONE, 0), (GZIP, 0), (NONE, 1), (GZIP, 1), (GZIP, 3)] {
        let file = MapFile {
            internal,
            leaves,
            ..small()
        };
        let map = opened(&file.encode()).unwrap();
        let (zoom, x, y) = PLACE;
        let tile = map.tile(zoom, x, y).unwrap().unwrap();
        assert_eq!((&*tile.octets, tile.is_gzip), (&*png(RED), false));
        assert_eq!(&*map.tile(0, 0, 0).unwrap().unwrap().octets, b"world");
        assert_eq!(map.tile(zoom, x + 1, y).unwrap(), None);
        assert_eq!(map.content_type(), "image/png");
    }
}

#[test]
fn a_compressed_tile_is_sent_as_stored_or_decompressed() {
    let file = MapFile {
        compression: GZIP,
        ..MapFile::new(VECTOR)
    };
    let stored = gzip(b"roads");
    let map = opened(&file.tile((3, 1, 2), &stored).encode()).unwrap();
    let tile = map.tile(3, 1, 2).unwrap().unwrap();
    assert_eq!((&*tile.octets, tile.is_gzip), (&*stored, true));
    assert_eq!(&*tile.inflated().unwrap(), b"roads");
}

#[test]
fn pages_learn_the_extent_the_levels_and_whom_to_name() {
    let file = MapFile {
        zooms: (3, 14),
        bounds: [13.0, 52.0, 14.0, 53.0],
        ..small()
    };
    let description = opened(&file.encode()).unwrap().description();
    let expected = Description {
        name: "Test".to_owned(),
        attribution: "© Testers".to_owned(),
        vector: false,
        min_zoom: 3,
        max_zoom: 14,
        bounds: [13.0, 52.0, 14.0, 53.0],
    };
    assert_eq!(description, expected);
    let nowhere = MapFile {
        bounds: [0.0; 4],
        metadata: "{}".to_owned(),
        ..small()
    };
    let description = opened(&nowhere.encode()).unwrap().description();
    assert_eq!(description.bounds, [-180.0, -85.051_129, 180.0, 85.051_129]);
}

#[test]
fn no_tile_is_outside_the_levels_of_the_file() {
    let file = MapFile {
        zooms: (1, 14),
        ..small()
    };
    let map = opened(&file.encode()).unwrap();
    for (zoom, x, y) in [(0, 0, 0), (15, 0, 0), (14, u32::MAX, 0), (255, 0, 0)] {
        assert_eq!(map.tile(zoom, x, y).unwrap(), None);
    }
}

#[test]
fn a_file_that_is_cut_anywhere_is_refused_at_the_start() {
    let whole = small().encode();
    for end in 0..whole.len() {
        let error = opened(&whole[..end]).expect_err("cut");
        let expected = match end {
            0..7 => matches!(error, BaseMapError::NotPmtiles),
            7 => matches!(error, BaseMapError::Version(0)),
            // The fields that are missing are zero.
            8..127 => !matches!(error, BaseMapError::NotPmtiles),
            _ => matches!(error, BaseMapError::Truncated { .. }),
        };
        assert!(expected, "{end}: {error}");
    }
}

#[test]
fn another_file_version_format_or_compression_is_refused_by_name() {
    let with = |position: usize, value: u8| {
        let mut octets = small().encode();
        octets[position] = value;
        opened(&octets).expect_err("refused").to_string()
    };
    assert!(with(0, b'Q').contains("not a PMTiles file"));
    assert!(with(7, 2).contains("version 2"));
    assert!(with(97, 3).contains("directories are compressed with Brotli"));
    assert!(with(98, 4).contains("tiles are compressed with Zstandard"));
    assert!(with(99, 6).contains("format 6"));
    assert!(with(100, 21).contains("zoom levels 21 to 20"));
    assert!(with(101, 32).contains("zoom levels 0 to 32"));
    // Metadata that is not JSON.
    let file = MapFile {
        metadata: "<xml>".to_owned(),
        ..small()
    };
    let error = opened(&file.encode()).expect_err("not JSON");
    assert!(matches!(error, BaseMapError::Metadata(_)), "{error}");
}

/// Octets that compress well, more of them than any limit allows.
fn bomb() -> Vec<u8> {
    gzip(&vec![0; 9 << 20])
}

#[test]
fn octets_that_decompress_without_end_are_an_error() {
    let file = MapFile {
        compression: GZIP,
        ..MapFile::new(PNG)
    };
    let map = opened(&file.tile((0, 0, 0), &bomb()).encode()).unwrap();
    let error = map.tile(0, 0, 0).expect_err("a bomb");
    assert!(matches!(error, BaseMapError::TooLarge { .. }), "{error}");

    // The root directory, which begins right after the header, is replaced.
    let mut octets = small().encode();
    let end = octets.len() as u64;
    octets[8..16].copy_from_slice(&end.to_le_bytes());
    octets[16..24].copy_from_slice(&(bomb().len() as u64).to_le_bytes());
    octets.extend(bomb());
    let error = opened(&octets).expect_err("a bomb");
    assert!(matches!(error, BaseMapError::TooLarge { .. }), "{error}");
}

#[test]
fn sections_and_tiles_beyond_the_end_of_the_file_are_errors() {
    for section in [8, 24, 40, 56] {
        for field in [section, section + 8] {
            let mut octets = small().encode();
            octets[field..field + 8].copy_from_slice(&u64::MAX.to_le_bytes());
            let error = opened(&octets).expect_err("beyond the end");
            assert!(matches!(error, BaseMapError::Truncated { .. }), "{error}");
        }
    }
    // A directory that leads far away, and one that leads to itself.
    let far = directory(&[[0, 1, 10, 1 << 40]]);
    let endless = directory(&[[0, 0, 5, 0]]);
    for (root, leaves) in [(far, Vec::new()), (endless.clone(), endless)] {
        let mut octets = MapFile {
            internal: NONE,
            metadata: String::new(),
            ..MapFile::new(PNG)
        }
        .encode();
        octets.truncate(127);
        let spans = [
            (127, root.len()),
            (127, 0),
            (127 + root.len(), leaves.len()),
            (127, 0),
        ];
        for (index, (offset, length)) in spans.into_iter().enumerate() {
            let at = 8 + 16 * index;
            octets[at..at + 8].copy_from_slice(&(offset as u64).to_le_bytes());
            octets[at + 8..at + 16].copy_from_slice(&(length as u64).to_le_bytes());
        }
        octets.extend([root, leaves].concat());
        let map = opened(&octets).unwrap();
        let error = map.tile(0, 0, 0).expect_err("leads nowhere");
        let is_clear = matches!(
            error,
            BaseMapError::Truncated { .. } | BaseMapError::Directory(_)
        );
        assert!(is_clear, "{error}");
    }
}

#[test]
fn a_file_with_any_octet_changed_never_panics() {
    let file = MapFile {
        internal: NONE,
        leaves: 1,
        ..small()
    };
    let whole = file.encode();
    for position in 0..whole.len() {
        for change in [0xff, 0x80, 0x01] {
            let mut octets = whole.clone();
            octets[position] ^= change;
            if let Ok(map) = opened(&octets) {
                let (zoom, x, y) = PLACE;
                let _ = map.tile(zoom, x, y);
                let _ = map.tile(0, 0, 0);
                map.description();
            }
        }
    }
}
