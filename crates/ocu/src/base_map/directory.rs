//! Directories of a PMTiles file: sorted entries that lead from the number of a tile to its octets,
//! or to a further directory.

use super::BaseMapError;

/// Greatest zoom level whose tile numbers fit into 64 bits.
pub(super) const DEEPEST_ZOOM: u8 = 31;

/// Number of a tile: its place on the Hilbert curve of its zoom level, after all tiles of the lower
/// levels. `None` if the level has no such tile.
pub(super) fn tile_id(zoom: u8, x: u32, y: u32) -> Option<u64> {
    if zoom > DEEPEST_ZOOM {
        return None;
    }
    let side = 1_u64 << zoom;
    let (mut x, mut y) = (u64::from(x), u64::from(y));
    if x >= side || y >= side {
        return None;
    }
    let mut id = (side * side - 1) / 3;
    let mut half = side / 2;
    while half > 0 {
        let (right, lower) = (x & half != 0, y & half != 0);
        let quadrant = (3 * u64::from(right)) ^ u64::from(lower);
        id += half * half * quadrant;
        if !lower {
            if right {
                (x, y) = (side - 1 - x, side - 1 - y);
            }
            (x, y) = (y, x);
        }
        half /= 2;
    }
    Some(id)
}

/// A part of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) offset: u64,
    pub(super) length: u64,
}

/// Where a directory leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Target {
    /// To a tile, within the tile data.
    Tile(Span),
    /// To a further directory, within the leaf directories.
    Leaf(Span),
}

#[derive(Debug, Clone, Copy)]
struct Entry {
    id: u64,
    /// Number of consecutive tiles with the same content; 0 for a further directory.
    run: u64,
    span: Span,
}

/// A decoded directory.
#[derive(Debug)]
pub(super) struct Directory {
    entries: Vec<Entry>,
}

impl Directory {
    /// Octets of the shortest entry: four numbers of one octet.
    const SHORTEST_ENTRY: usize = 4;

    pub(super) fn read(octets: &[u8]) -> Result<Self, BaseMapError> {
        let mut numbers = Numbers { left: octets };
        let count = numbers.next()?;
        let most = octets.len() / Self::SHORTEST_ENTRY;
        let count = usize::try_from(count).ok().filter(|&it| it <= most);
        let count = count.ok_or(BaseMapError::Directory(
            "it has fewer entries than it states",
        ))?;
        let blank = Entry {
            id: 0,
            run: 0,
            span: Span {
                offset: 0,
                length: 0,
            },
        };
        let mut entries = vec![blank; count];
        let mut id = 0_u64;
        for entry in &mut entries {
            id = id.checked_add(numbers.next()?).ok_or(OVERFLOW)?;
            entry.id = id;
        }
        for entry in &mut entries {
            entry.run = numbers.next()?;
        }
        for entry in &mut entries {
            entry.span.length = numbers.next()?;
        }
        // 0 stands for the end of the entry before; other values are the offset plus 1.
        let mut end = None;
        for entry in &mut entries {
            entry.span.offset = match (numbers.next()?, end) {
                (0, Some(end)) => end,
                (0, None) => return Err(BaseMapError::Directory("its first entry has no offset")),
                (offset, _) => offset - 1,
            };
            let span = entry.span;
            end = Some(span.offset.checked_add(span.length).ok_or(OVERFLOW)?);
        }
        Ok(Self { entries })
    }

    /// Where the tile is, if the file has it.
    pub(super) fn find(&self, id: u64) -> Option<Target> {
        let after = self.entries.partition_point(|entry| entry.id <= id);
        let entry = self.entries.get(after.checked_sub(1)?)?;
        match entry.run {
            0 => Some(Target::Leaf(entry.span)),
            run => (id - entry.id < run).then_some(Target::Tile(entry.span)),
        }
    }
}

const OVERFLOW: BaseMapError = BaseMapError::Directory("a number in it exceeds 64 bits");

/// Numbers of variable length: seven bits per octet, least significant first.
struct Numbers<'o> {
    left: &'o [u8],
}

impl Numbers<'_> {
    fn next(&mut self) -> Result<u64, BaseMapError> {
        let mut value = 0_u64;
        for shift in (0..u64::BITS).step_by(7) {
            let (&octet, left) = self
                .left
                .split_first()
                .ok_or(BaseMapError::Directory("it ends within an entry"))?;
            self.left = left;
            let bits = u64::from(octet & 0x7f);
            if bits << shift >> shift != bits {
                return Err(OVERFLOW);
            }
            value |= bits << shift;
            if octet & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(OVERFLOW)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_numbered_along_the_hilbert_curve_of_each_level() {
        let numbered = [
            ((0, 0, 0), 0),
            ((1, 0, 0), 1),
            ((1, 0, 1), 2),
            ((1, 1, 1), 3),
            ((1, 1, 0), 4),
            ((2, 0, 0), 5),
            ((12, 3423, 1763), 19_078_479),
        ];
        for ((zoom, x, y), id) in numbered {
            assert_eq!(tile_id(zoom, x, y), Some(id), "{zoom}/{x}/{y}");
        }
        for zoom in 0..7 {
            let side = 1 << zoom;
            let all = (0..side).flat_map(|x| (0..side).map(move |y| (x, y)));
            let mut ids: Vec<_> = all.filter_map(|(x, y)| tile_id(zoom, x, y)).collect();
            ids.sort_unstable();
            let first = ((1 << (2 * zoom)) - 1) / 3;
            assert!(
                ids.iter()
                    .copied()
                    .eq(first..first + u64::from(side * side))
            );
        }
    }

    #[test]
    fn a_tile_outside_its_level_has_no_number() {
        for (zoom, x, y) in [(0, 1, 0), (3, 8, 0), (3, 0, 8), (32, 0, 0), (255, 0, 0)] {
            assert_eq!(tile_id(zoom, x, y), None, "{zoom}/{x}/{y}");
        }
        let last = u32::MAX >> 1;
        assert!(tile_id(31, last, last).is_some());
    }

    /// One entry: a tile with id 5, 3 times, 7 octets from offset 0; then a directory from id 9.
    const DIRECTORY: [u8; 9] = [2, 5, 4, 3, 0, 7, 20, 1, 0];

    #[test]
    fn a_run_of_tiles_shares_its_octets_and_a_leaf_holds_all_that_follow() {
        let directory = Directory::read(&DIRECTORY).unwrap();
        let tile = Target::Tile(Span {
            offset: 0,
            length: 7,
        });
        let leaf = Target::Leaf(Span {
            offset: 7,
            length: 20,
        });
        let found: Vec<_> = [4, 5, 7, 8, 9, u64::MAX]
            .map(|id| directory.find(id))
            .into();
        let none = None;
        assert_eq!(
            found,
            [none, Some(tile), Some(tile), none, Some(leaf), Some(leaf)]
        );
    }

    #[test]
    fn a_directory_that_is_cut_anywhere_is_an_error() {
        for end in 0..DIRECTORY.len() {
            let read = Directory::read(DIRECTORY.get(..end).unwrap());
            assert!(matches!(read, Err(BaseMapError::Directory(_))), "{end}");
        }
    }

    #[test]
    fn numbers_that_claim_too_much_are_errors_and_reserve_no_memory() {
        let endless = [0xff; 64];
        let huge = [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1];
        let too_many = [huge.as_slice(), &[1; 40]].concat();
        // Two ids whose sum exceeds 64 bits, and a span that ends beyond them.
        let far_ids = [&[2], huge.as_slice(), huge.as_slice(), &[1; 6]].concat();
        let far_end = [&[1, 0, 1], huge.as_slice(), huge.as_slice()].concat();
        let no_offset = vec![1, 0, 1, 1, 0];
        for octets in [endless.to_vec(), too_many, far_ids, far_end, no_offset] {
            let read = Directory::read(&octets);
            assert!(
                matches!(read, Err(BaseMapError::Directory(_))),
                "{octets:?}"
            );
        }
    }
}
