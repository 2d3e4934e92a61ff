//! An inertial measurement unit of Linux's industrial I/O: a gyroscope, and an accelerometer if the
//! device has one. Each reading is a file access.

use std::fmt::Display;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::motion::{Acceleration, Velocity};

/// A device under `/sys/bus/iio/devices` whose X axis points forward and whose Z axis is the
/// vehicle's vertical axis.
#[derive(Debug)]
pub struct IioImu {
    yaw: Channel,
    roll_and_pitch: Option<[Channel; 2]>,
    /// Along the vehicle's axes: forward, right, down.
    accelerometer: Option<[Channel; 3]>,
}

/// One measurement. What the device does not measure is NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InertialSample {
    /// The rates of turn about the vehicle's axes. The rest is NaN.
    pub velocity: Velocity,
    /// The linear acceleration along the vehicle's axes. The rest is NaN.
    pub acceleration: Acceleration,
}

/// Error: an inertial measurement unit cannot be used.
#[derive(Debug, thiserror::Error)]
#[error(
    "cannot use the inertial measurement unit {}: {why}; choose a directory with in_anglvel_z_raw, \
     such as /sys/bus/iio/devices/iio:device0",
    directory.display()
)]
pub struct ImuError {
    directory: PathBuf,
    why: io::Error,
}

impl IioImu {
    /// What an accelerometer at rest measures, in metres per second squared upwards.
    const GRAVITY: f64 = 9.806_65;

    /// Opens the device of a directory. Its Y axis points left and its Z axis up, or if it is
    /// `inverted`, right and down.
    ///
    /// # Errors
    /// If the directory has no readable gyroscope with a Z axis.
    pub fn open(directory: &Path, inverted: bool) -> Result<Self, ImuError> {
        let failed = |why| ImuError {
            directory: directory.to_owned(),
            why,
        };
        let side = if inverted { 1.0 } else { -1.0 };
        let rate = |axis, sign| Channel::open(directory, Quantity::RATE, axis, sign);
        let force = |axis, sign| Channel::open(directory, Quantity::FORCE, axis, sign);
        let roll_and_pitch = rate("x", 1.0).and_then(|roll| Ok([roll, rate("y", side)?]));
        let accelerometer =
            force("x", 1.0).and_then(|x| Ok([x, force("y", side)?, force("z", side)?]));
        Ok(Self {
            yaw: rate("z", side).map_err(failed)?,
            roll_and_pitch: roll_and_pitch.ok(),
            accelerometer: accelerometer.ok(),
        })
    }

    /// Whether the device has an accelerometer with three axes.
    #[must_use]
    pub const fn has_accelerometer(&self) -> bool {
        self.accelerometer.is_some()
    }

    /// The turn rate in radians per second, right positive.
    ///
    /// # Errors
    /// If the device cannot be read, repeats one reading, because it has stopped measuring, or
    /// measures what no vehicle does.
    pub fn turn_rate(&mut self) -> io::Result<f64> {
        self.yaw.read()
    }

    /// Measures on all axes. Gravity is subtracted from the acceleration as if the vehicle stood
    /// level.
    ///
    /// # Errors
    /// Those of [`turn_rate`](Self::turn_rate), for any axis.
    pub fn sample(&mut self) -> io::Result<InertialSample> {
        let [roll, pitch] = read_all(self.roll_and_pitch.as_mut())?;
        let [x, y, z] = read_all(self.accelerometer.as_mut())?;
        let velocity = Velocity {
            roll,
            pitch,
            yaw: self.yaw.read()?,
            ..InertialSample::UNKNOWN.velocity
        };
        let acceleration = Acceleration {
            x,
            y,
            z: z + Self::GRAVITY,
            ..InertialSample::UNKNOWN.acceleration
        };
        Ok(InertialSample {
            velocity,
            acceleration,
        })
    }
}

impl InertialSample {
    /// Nothing is measured.
    pub const UNKNOWN: Self = Self {
        velocity: Velocity {
            x: f64::NAN,
            y: f64::NAN,
            z: f64::NAN,
            roll: f64::NAN,
            pitch: f64::NAN,
            yaw: f64::NAN,
        },
        acceleration: Acceleration {
            x: f64::NAN,
            y: f64::NAN,
            z: f64::NAN,
            roll: f64::NAN,
            pitch: f64::NAN,
            yaw: f64::NAN,
        },
    };
}

/// Something that a device measures along its axes.
#[derive(Debug, Clone, Copy)]
struct Quantity {
    /// In the names of its files.
    name: &'static str,
    /// The greatest magnitude that Report Velocity State or Report Acceleration State can hold.
    most: f64,
}

impl Quantity {
    /// In radians per second.
    const RATE: Self = Self {
        name: "anglvel",
        most: 32.767,
    };
    /// In metres per second squared.
    const FORCE: Self = Self {
        name: "accel",
        most: 1310.68,
    };
}

/// One axis of a quantity.
#[derive(Debug)]
struct Channel {
    raw: PathBuf,
    /// Physical units per unit of the file, with the sign of the vehicle's axis.
    scale: f64,
    /// In units of the file.
    offset: f64,
    most: f64,
    /// The last reading, and how often it has been repeated.
    last: (i64, u32),
}

impl Channel {
    /// A working sensor is never this often in sequence exactly the same: it has noise.
    const REPEATS: u32 = 50;

    fn open(directory: &Path, quantity: Quantity, axis: &str, sign: f64) -> io::Result<Self> {
        let Quantity { name, most } = quantity;
        let file = |end: &str| directory.join(format!("in_{name}_{end}"));
        // A device has one scale for all axes, or one for each.
        let scale: f64 = read(&file("scale")).or_else(|_| read(&file(&format!("{axis}_scale"))))?;
        let offset: f64 = read(&file(&format!("{axis}_offset"))).unwrap_or(0.0);
        let mut channel = Self {
            raw: file(&format!("{axis}_raw")),
            scale: sign * scale,
            offset,
            most,
            last: (0, 0),
        };
        channel.read()?;
        Ok(channel)
    }

    fn read(&mut self) -> io::Result<f64> {
        let raw: i64 = read(&self.raw)?;
        let (last, repeats) = self.last;
        self.last = (raw, if raw == last { repeats + 1 } else { 0 });
        if self.last.1 >= Self::REPEATS {
            self.last.1 = Self::REPEATS;
            return Err(named(&self.raw, &"it repeats the same reading"));
        }
        let value = (raw as f64 + self.offset) * self.scale;
        // Not for NaN either.
        if value.abs() <= self.most {
            return Ok(value);
        }
        let most = self.most;
        Err(named(&self.raw, &format!("{value} is beyond {most}")))
    }
}

/// Reads all channels; NaN if there are none.
fn read_all<const N: usize>(channels: Option<&mut [Channel; N]>) -> io::Result<[f64; N]> {
    let mut values = [f64::NAN; N];
    for (value, channel) in values.iter_mut().zip(channels.into_iter().flatten()) {
        *value = channel.read()?;
    }
    Ok(values)
}

/// Reads the number in a file.
fn read<T: FromStr>(path: &Path) -> io::Result<T> {
    let text = fs::read_to_string(path).map_err(|error| named(path, &error))?;
    let number = text.trim().parse();
    number.map_err(|_| named(path, &"it is not a number"))
}

/// An error with the name of its file.
fn named(path: &Path, why: &dyn Display) -> io::Error {
    let name = path.file_name().unwrap_or_default().display();
    io::Error::other(format!("{name}: {why}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Device(PathBuf);

    impl Device {
        /// A gyroscope with a vertical axis.
        fn new(name: &str) -> Self {
            let name = format!("jaus-iio-{name}-{}", std::process::id());
            let path = std::env::temp_dir().join(name);
            fs::create_dir_all(&path).unwrap();
            let device = Self(path);
            device.set("in_anglvel_scale", "0.001");
            device.set("in_anglvel_z_raw", "100");
            device
        }

        /// With all axes, and an accelerometer that stands on a slope.
        fn complete(name: &str) -> Self {
            let device = Self::new(name);
            for (file, text) in [
                ("in_anglvel_x_raw", "200"),
                ("in_anglvel_y_raw", "300"),
                ("in_accel_scale", "0.01"),
                ("in_accel_x_raw", "50"),
                ("in_accel_y_raw", "60"),
                ("in_accel_z_raw", "981"),
            ] {
                device.set(file, text);
            }
            device
        }

        fn set(&self, file: &str, text: &str) {
            fs::write(self.0.join(file), format!("{text}\n")).unwrap();
        }

        fn open(&self, inverted: bool) -> IioImu {
            IioImu::open(&self.0, inverted).unwrap()
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
        let rate = |inverted| device.open(inverted).turn_rate().unwrap();
        assert!((rate(false) + 0.1).abs() < 1e-9 && (rate(true) - 0.1).abs() < 1e-9);
        device.set("in_anglvel_z_offset", "-40");
        assert!((rate(true) - 0.06).abs() < 1e-9);
    }

    #[test]
    fn all_axes_are_those_of_the_vehicle_and_gravity_is_no_acceleration() {
        let device = Device::complete("axes");
        for (inverted, side) in [(false, -1.0), (true, 1.0)] {
            // An inverted accelerometer at rest measures gravity against its Z axis.
            device.set("in_accel_z_raw", if inverted { "-981" } else { "981" });
            let sample = device.open(inverted).sample().unwrap();
            let (velocity, acceleration) = (sample.velocity, sample.acceleration);
            for (found, expected) in [
                (velocity.roll, 0.2),
                (velocity.pitch, 0.3 * side),
                (velocity.yaw, 0.1 * side),
                (acceleration.x, 0.5),
                (acceleration.y, 0.6 * side),
                (acceleration.z, 0.0),
            ] {
                assert!((found - expected).abs() < 0.01, "{inverted}: {sample:?}");
            }
        }
    }

    #[test]
    fn what_the_device_does_not_measure_is_unknown() {
        let device = Device::new("yaw-only");
        let mut imu = device.open(false);
        assert!(!imu.has_accelerometer());
        let sample = imu.sample().unwrap();
        assert!(sample.velocity.yaw.is_finite());
        assert!(sample.velocity.roll.is_nan() && sample.acceleration.z.is_nan());
    }

    #[test]
    fn a_device_that_repeats_itself_is_broken_until_it_measures_again() {
        let device = Device::new("stuck");
        let mut imu = device.open(false);
        let good = (0..60).filter(|_| imu.turn_rate().is_ok()).count();
        assert!(good < 50, "{good}");
        device.set("in_anglvel_z_raw", "101");
        assert!(imu.turn_rate().is_ok());
    }

    #[test]
    fn a_reading_that_cannot_be_is_an_error_with_its_file() {
        let device = Device::complete("fault");
        let mut imu = device.open(false);
        for (file, text, why) in [
            ("in_anglvel_x_raw", "32768", "32.768 is beyond 32.767"),
            ("in_accel_z_raw", "-131069", "1310.69 is beyond 1310.68"),
            ("in_accel_y_raw", "nan", "it is not a number"),
            ("in_anglvel_z_raw", "", "it is not a number"),
        ] {
            let before = fs::read_to_string(device.0.join(file)).unwrap();
            device.set(file, text);
            let error = imu.sample().unwrap_err().to_string();
            assert_eq!(error, format!("{file}: {why}"));
            device.set(file, before.trim());
            assert!(imu.sample().is_ok());
        }
        device.set("in_anglvel_scale", "nan");
        let error = IioImu::open(&device.0, false).unwrap_err().to_string();
        assert!(error.contains("in_anglvel_z_raw: NaN is beyond"), "{error}");
    }

    #[test]
    fn what_is_no_gyroscope_is_named() {
        let device = Device::new("none");
        device.set("in_anglvel_z_raw", "much");
        let error = IioImu::open(&device.0, false).unwrap_err().to_string();
        assert!(
            error.contains("in_anglvel_z_raw: it is not a number"),
            "{error}"
        );
        let error = IioImu::open(Path::new("/nowhere"), false).unwrap_err();
        assert!(error.to_string().contains("/sys/bus/iio/devices"));
    }
}
