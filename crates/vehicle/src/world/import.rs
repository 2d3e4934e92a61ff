//! Import of maps from PGM images and text files.
//!
//! In a PGM image (`P2` or `P5`) black is impassable and white is free. In text each line is a row:
//! `#` is impassable, `.` and space are free, `0` to `9` are in between. North is at the top.

use super::raster::Raster;

/// The cells of a map, without its position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Number of rows, from south to north.
    pub rows: u16,
    /// Number of columns, from west to east.
    pub columns: u16,
    /// The cells, row by row from the south.
    pub cells: Vec<u8>,
}

/// Why a file is not a valid map.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The header of an image is invalid.
    #[error(
        "the image's header is not that of a PGM file: P2 or P5, width, height, maximum value up \
         to 65535"
    )]
    Head,
    /// The map has no cells or too many.
    #[error("a map cannot have {rows} rows and {columns} columns: use 1 to 4096 of each")]
    Size {
        /// Number of rows in the file.
        rows: usize,
        /// Number of columns in the file.
        columns: usize,
    },
    /// The image ends early or contains an invalid value.
    #[error("the image has {found} readable values instead of {wanted}")]
    Cells {
        /// Width times height.
        wanted: usize,
        /// Number of valid values.
        found: usize,
    },
    /// A line differs in length from the first.
    #[error("line {line} has {found} cells, but the first has {wanted}; make them equally long")]
    Line {
        /// Line number, starting at 1.
        line: usize,
        /// Number of cells in the first line.
        wanted: usize,
        /// Number of cells in this line.
        found: usize,
    },
    /// A character does not represent a cell.
    #[error(
        "line {line}: '{found}' is not a cell; write # for impassable, . for free, 0 to 9 for in \
         between"
    )]
    Character {
        /// Line number, starting at 1.
        line: usize,
        /// The character.
        found: char,
    },
}

impl Picture {
    /// Reads the content of a file.
    ///
    /// # Errors
    /// If the file is not a valid map.
    pub fn read(octets: &[u8]) -> Result<Self, ImportError> {
        match octets {
            [b'P', b'2' | b'5', b' ' | b'\t' | b'\r' | b'\n' | b'#', ..] => read_pgm(octets),
            _ => read_text(&String::from_utf8_lossy(octets)),
        }
    }

    /// The demonstration map of 16 x 16 cells: two walls with gaps, and rough ground.
    #[must_use]
    pub fn demo() -> Self {
        read_text(DEMO).unwrap_or(Self {
            rows: 1,
            columns: 1,
            cells: vec![u8::MAX],
        })
    }

    /// The same map with each cell divided into `parts` x `parts` cells. `None` if these are none or
    /// too many.
    #[must_use]
    pub fn divided(&self, parts: u16) -> Option<Self> {
        let sides = 1..=Raster::MOST_SIDE;
        let side = |count: u16| count.checked_mul(parts).filter(|it| sides.contains(it));
        let (rows, columns) = (side(self.rows)?, side(self.columns)?);
        let part = |row: u16, column: u16| {
            let row = usize::from(row / parts);
            self.cells[row * usize::from(self.columns) + usize::from(column / parts)]
        };
        let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| part(row, column)));
        Some(Self {
            rows,
            columns,
            cells: cells.collect(),
        })
    }

    /// The map at a position.
    #[must_use]
    pub fn at(&self, name: String, cell: f32, (x, y): (f64, f64)) -> Raster {
        Raster {
            name,
            rows: self.rows,
            columns: self.columns,
            cell,
            x,
            y,
            fill: u8::MAX,
            revision: 0,
        }
    }

    /// Creates a picture from cells whose first row is the northernmost.
    fn from_north(rows: usize, columns: usize, cells: &[u8]) -> Result<Self, ImportError> {
        let side = |count: usize| {
            u16::try_from(count)
                .ok()
                .filter(|it| (1..=Raster::MOST_SIDE).contains(it))
        };
        let (Some(high), Some(wide)) = (side(rows), side(columns)) else {
            return Err(ImportError::Size { rows, columns });
        };
        Ok(Self {
            rows: high,
            columns: wide,
            cells: cells.chunks(columns).rev().flatten().copied().collect(),
        })
    }
}

const DEMO: &str = "\
................
................
..####....3333..
..#..#....3333..
..#..#....3333..
.....#..........
.....#######....
................
................
....#######.....
..........#.....
..........#..#..
..333.....####..
..333...........
................
................
";

fn read_text(text: &str) -> Result<Picture, ImportError> {
    let mut cells = Vec::new();
    let mut columns = 0;
    let mut rows = 0;
    for (index, line) in text.lines().enumerate() {
        let (line, before) = (line.trim_end_matches('\r'), cells.len());
        for found in line.chars() {
            let cell = cell(found);
            let number = index + 1;
            cells.push(cell.ok_or(ImportError::Character {
                line: number,
                found,
            })?);
        }
        let found = cells.len() - before;
        if index == 0 {
            columns = found;
        } else if found != columns {
            let (line, wanted) = (index + 1, columns);
            return Err(ImportError::Line {
                line,
                wanted,
                found,
            });
        }
        rows += 1;
    }
    Picture::from_north(rows, columns, &cells)
}

fn cell(character: char) -> Option<u8> {
    match character {
        '#' => Some(0),
        '.' | ' ' => Some(u8::MAX),
        _ => {
            let digit = character.to_digit(10)?;
            Some((digit * 255 / 9) as u8)
        }
    }
}

fn read_pgm(octets: &[u8]) -> Result<Picture, ImportError> {
    let binary = octets[1] == b'5';
    let mut rest = &octets[2..];
    let mut head = [0_usize; 3];
    for number in &mut head {
        *number = next_number(&mut rest).ok_or(ImportError::Head)?;
    }
    let [columns, rows, greatest] = head;
    if !(1..=65535).contains(&greatest) {
        return Err(ImportError::Head);
    }
    let side = 1..=usize::from(Raster::MOST_SIDE);
    if !side.contains(&rows) || !side.contains(&columns) {
        return Err(ImportError::Size { rows, columns });
    }
    let wanted = rows * columns;
    let scaled = |value: usize| (value.min(greatest) * 255 / greatest) as u8;
    let cells: Vec<u8> = if binary {
        // One whitespace octet ends the header.
        let values = rest.get(1..).unwrap_or_default();
        let size = if greatest > 255 { 2 } else { 1 };
        let values = values.chunks_exact(size);
        let number = |octets: &[u8]| {
            octets
                .iter()
                .fold(0, |sum, &it| sum * 256 + usize::from(it))
        };
        values.take(wanted).map(|it| scaled(number(it))).collect()
    } else {
        let values = std::iter::from_fn(|| next_number(&mut rest));
        values.take(wanted).map(scaled).collect()
    };
    if cells.len() != wanted {
        let found = cells.len();
        return Err(ImportError::Cells { wanted, found });
    }
    Picture::from_north(rows, columns, &cells)
}

/// Reads the next number of an image, skipping whitespace and comments.
fn next_number(rest: &mut &[u8]) -> Option<usize> {
    loop {
        match rest.first()? {
            b'#' => {
                let end = rest.iter().position(|&it| it == b'\n')?;
                *rest = &rest[end..];
            }
            octet if octet.is_ascii_whitespace() => *rest = &rest[1..],
            _ => break,
        }
    }
    let digits = rest.iter().take_while(|it| it.is_ascii_digit()).count();
    let (number, after) = rest.split_at(digits);
    *rest = after;
    std::str::from_utf8(number).ok()?.parse().ok()
}
