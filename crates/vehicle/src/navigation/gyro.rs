//! A gyroscope of Linux's industrial I/O: one reading per file access.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// A gyroscope under `/sys/bus/iio/devices`, whose Z axis is the vehicle's vertical axis.
#[derive(Debug)]
pub struct IioGyro {
    raw: PathBuf,
    /// Radians per second per unit, right positive.
    scale: f64,
    /// In units.
    offset: f64,
    /// The last reading, and how often it has been repeated.
    last: (i64, u32),
}

/// Error: a gyroscope cannot be used.
#[derive(Debug, thiserror::Error)]
#[error(
    "cannot use the gyroscope {}: {why}; choose a directory with in_anglvel_z_raw, such as \
     /sys/bus/iio/devices/iio:device0",
    directory.display()
)]
pub struct GyroError {
    directory: PathBuf,
    why: io::Error,
}

impl IioGyro {
    /// A working gyroscope is never this often in sequence exactly the same: it has noise.
    const REPEATS: u32 = 50;

    /// Opens the device of a directory. `inverted` is for a device whose Z axis points down.
    ///
    /// # Errors
    /// If the directory has no readable gyroscope with a Z axis.
    pub fn open(directory: &Path, inverted: bool) -> Result<Self, GyroError> {
        let failed = |why| GyroError {
            directory: directory.to_owned(),
            why,
        };
        // A device has one scale for all axes, or one for each.
        let scale = read(&directory.join("in_anglvel_scale"))
            .or_else(|_| read(&directory.join("in_anglvel_z_scale")))
            .map_err(failed)?;
        let offset = read(&directory.join("in_anglvel_z_offset")).unwrap_or(0.0);
        let mut gyro = Self {
            raw: directory.join("in_anglvel_z_raw"),
            // About an axis that points up, a right turn is negative.
            scale: if inverted { scale } else { -scale },
            offset,
            last: (0, 0),
        };
        gyro.turn_rate().map_err(failed)?;
        Ok(gyro)
    }

    /// The turn rate in radians per second, right positive.
    ///
    /// # Errors
    /// If the device cannot be read, or repeats one reading: then it has stopped measuring.
    pub fn turn_rate(&mut self) -> io::Result<f64> {
        let raw: i64 = read(&self.raw)?;
        let (last, repeats) = self.last;
        self.last = (raw, if raw == last { repeats + 1 } else { 0 });
        if self.last.1 >= Self::REPEATS {
            self.last.1 = Self::REPEATS;
            return Err(io::Error::other("it repeats the same reading"));
        }
        Ok((raw as f64 + self.offset) * self.scale)
    }
}

/// Reads the number in a file.
fn read<T: std::str::FromStr>(path: &Path) -> io::Result<T> {
    let named = |why: &dyn std::fmt::Display| {
        let name = path.file_name().unwrap_or_default().display();
        io::Error::other(format!("{name}: {why}"))
    };
    let text = fs::read_to_string(path).map_err(|error| named(&error))?;
    let number = text.trim().parse();
    number.map_err(|_| named(&"it is not a number"))
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Device(PathBuf);

    impl Device {
        fn new(name: &str) -> Self {
            let name = format!("jaus-iio-{name}-{}", std::process::id());
            let path = std::env::temp_dir().join(name);
            fs::create_dir_all(&path).unwrap();
            let device = Self(path);
            device.set("in_anglvel_scale", "0.001");
            device.set("in_anglvel_z_raw", "100");
            device
        }

        fn set(&self, file: &str, text: &str) {
            fs::write(self.0.join(file), format!("{text}\n")).unwrap();
        }
    }

    impl Drop for Device {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn a_right_turn_is_positive_whichever_way_the_device_is_mounted() {
        let device = Device::new("sign");
        let rate = |inverted| {
            IioGyro::open(&device.0, inverted)
                .unwrap()
                .turn_rate()
                .unwrap()
        };
        assert!((rate(false) + 0.1).abs() < 1e-9 && (rate(true) - 0.1).abs() < 1e-9);
        device.set("in_anglvel_z_offset", "-40");
        assert!((rate(true) - 0.06).abs() < 1e-9);
    }

    #[test]
    fn a_gyroscope_that_repeats_itself_is_broken_until_it_measures_again() {
        let device = Device::new("stuck");
        let mut gyro = IioGyro::open(&device.0, false).unwrap();
        let good = (0..60).filter(|_| gyro.turn_rate().is_ok()).count();
        assert!(good < 50, "{good}");
        device.set("in_anglvel_z_raw", "101");
        assert!(gyro.turn_rate().is_ok());
    }

    #[test]
    fn what_is_no_gyroscope_is_named() {
        let device = Device::new("none");
        device.set("in_anglvel_z_raw", "much");
        let error = IioGyro::open(&device.0, false).unwrap_err().to_string();
        assert!(
            error.contains("in_anglvel_z_raw: it is not a number"),
            "{error}"
        );
        let error = IioGyro::open(Path::new("/nowhere"), false).unwrap_err();
        assert!(error.to_string().contains("/sys/bus/iio/devices"));
    }
}
