//! The file in which the pose sensor stores the pose and the matching wheel counts. It is replaced
//! atomically, so after a power cut either the old or the new content exists.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::io;
use std::path::Path;

use jaus_files::Readers;
use tokio::fs;

use super::PartError;
use crate::motion::{Pose, WheelCount};

/// The stored content.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Kept {
    pub(super) pose: Pose,
    pub(super) count: WheelCount,
}

/// The longest file that is read: several times the usual size.
const MOST: u64 = 4096;

impl Kept {
    /// Whether pose or counts differ. A later time alone is not worth a write.
    pub(super) fn differs(&self, other: &Self) -> bool {
        let count = WheelCount {
            time_ms: self.count.time_ms,
            ..other.count
        };
        self.pose != other.pose || self.count != count
    }

    fn text(&self) -> String {
        let Self { pose, count } = self;
        let mut text = String::from("# The vehicle's pose, saved by jaus-local-pose-sensor.\n");
        let numbers = [
            ("x", pose.x),
            ("y", pose.y),
            ("z", pose.z),
            ("roll", pose.roll),
            ("pitch", pose.pitch),
            ("yaw", pose.yaw),
            ("left", count.left),
            ("right", count.right),
            ("track", count.track),
            ("start", count.start.into()),
            ("time_ms", count.time_ms.into()),
        ];
        for (key, number) in numbers {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{key} = {number:?}");
        }
        text
    }

    fn parse(text: &str) -> Result<Self, String> {
        let lines = text.lines().map(str::trim);
        let lines = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
        let mut numbers = BTreeMap::new();
        for line in lines {
            let pair = line.split_once('=').and_then(|(key, number)| {
                let number: f64 = number.trim().parse().ok()?;
                number.is_finite().then(|| (key.trim(), number))
            });
            let (key, number) = pair.ok_or_else(|| format!("\"{line}\" is not a number"))?;
            numbers.insert(key, number);
        }
        let number = |key: &str| {
            let number = numbers.get(key).copied();
            number.ok_or_else(|| format!("{key} is missing"))
        };
        Ok(Self {
            pose: Pose {
                x: number("x")?,
                y: number("y")?,
                z: number("z")?,
                roll: number("roll")?,
                pitch: number("pitch")?,
                yaw: number("yaw")?,
            },
            count: WheelCount {
                left: number("left")?,
                right: number("right")?,
                track: number("track")?,
                start: number("start")? as u32,
                time_ms: number("time_ms")? as u32,
            },
        })
    }
}

/// Reads the file; `None` if it does not exist.
pub(super) async fn read(file: &Path) -> Result<Option<Kept>, PartError> {
    let broken = |why: String| {
        PartError::Broken(format!(
            "{}: {why}; correct it, or delete it to start at the initial pose",
            file.display()
        ))
    };
    let length = match fs::metadata(file).await {
        Ok(found) => found.len(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(broken(error.to_string())),
    };
    if length > MOST {
        return Err(broken(format!("has {length} octets, too many for a pose")));
    }
    let text = fs::read_to_string(file).await;
    let text = text.map_err(|error| broken(error.to_string()))?;
    Kept::parse(&text).map(Some).map_err(broken)
}

/// Replaces the file.
pub(super) async fn write(file: &Path, kept: &Kept) -> Result<(), PartError> {
    let (path, text) = (file.to_owned(), kept.text());
    let replace = move || jaus_files::replace(&path, Readers::Everyone, text.as_bytes());
    let written = tokio::task::spawn_blocking(replace).await;
    written.map_err(io::Error::from).flatten().map_err(|error| {
        PartError::Broken(format!(
            "cannot save the pose to {}: {error}",
            file.display()
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEPT: Kept = Kept {
        pose: Pose {
            x: 1.25,
            y: -3.0e-7,
            z: 0.0,
            roll: 0.0,
            pitch: 0.0,
            yaw: 2.5,
        },
        count: WheelCount {
            start: u32::MAX,
            time_ms: 4_000_000_000,
            left: 123.456,
            right: -0.1,
            track: 0.5,
        },
    };

    #[test]
    fn what_is_written_is_read_again_to_the_last_bit() {
        assert_eq!(Kept::parse(&KEPT.text()), Ok(KEPT));
    }

    #[test]
    fn a_damaged_file_is_refused_with_the_reason() {
        for (text, why) in [
            ("", "x is missing"),
            ("x = one", "\"x = one\" is not a number"),
            ("x = NaN", "\"x = NaN\" is not a number"),
            ("nonsense", "\"nonsense\" is not a number"),
        ] {
            assert_eq!(Kept::parse(text), Err(why.to_owned()), "{text}");
        }
    }

    #[test]
    fn a_later_time_alone_is_nothing_new() {
        let mut later = KEPT;
        later.count.time_ms = 5;
        assert!(!KEPT.differs(&later));
        later.count.left = 0.0;
        assert!(KEPT.differs(&later));
    }
}
