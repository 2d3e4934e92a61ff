//! The thread that reads an inertial measurement unit.
#![expect(
    clippy::disallowed_methods,
    reason = "reads a device in real time, on its own thread"
)]

use std::io;
use std::path::PathBuf;
use std::time::Duration;

use tokio::sync::mpsc;

use super::PartError;
use crate::navigation::IioImu;

/// An inertial measurement unit of Linux's industrial I/O.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IioDevice {
    /// Its directory, such as `/sys/bus/iio/devices/iio:device0`.
    pub directory: PathBuf,
    /// Whether its Y axis points right and its Z axis down, not left and up.
    pub inverted: bool,
}

impl IioDevice {
    /// Interval between two readings.
    const PERIOD: Duration = Duration::from_millis(20);
    /// Interval between attempts to read a device that failed.
    const RETRY: Duration = Duration::from_secs(1);

    pub(super) fn open(&self) -> Result<IioImu, PartError> {
        let opened = IioImu::open(&self.directory, self.inverted);
        opened.map_err(|error| PartError::Broken(error.to_string()))
    }

    /// Starts a thread that takes readings of a device. It ends with the receiver.
    pub(super) fn start<T: Send + 'static>(
        mut device: IioImu,
        read: fn(&mut IioImu) -> io::Result<T>,
    ) -> Result<mpsc::Receiver<T>, PartError> {
        let (tell, readings) = mpsc::channel(8);
        let thread = std::thread::Builder::new().name("imu".to_owned());
        let reading = move || {
            let mut works = true;
            while !tell.is_closed() {
                match read(&mut device) {
                    Ok(reading) => {
                        works = true;
                        // A full queue means that the program hangs; old readings are useless.
                        let _ = tell.try_send(reading);
                    }
                    Err(error) if works => {
                        tracing::warn!("the inertial measurement unit failed: {error}");
                        works = false;
                    }
                    Err(_) => {}
                }
                std::thread::sleep(if works { Self::PERIOD } else { Self::RETRY });
            }
        };
        thread
            .spawn(reading)
            .map_err(|error| PartError::Broken(format!("cannot start a thread: {error}")))?;
        Ok(readings)
    }
}
