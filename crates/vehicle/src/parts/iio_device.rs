//! The thread that reads an inertial measurement unit.
#![expect(
    clippy::disallowed_methods,
    reason = "reads a device in real time, on its own thread"
)]

use std::io;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use tokio::sync::watch;

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

/// A value that a device has measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading<T> {
    /// When the measurement began.
    pub at: Instant,
    /// The value.
    pub value: T,
}

/// The latest reading of a device; `None` before the first. Older ones are useless, so a slow reader
/// misses them.
pub type Readings<T> = watch::Receiver<Option<Reading<T>>>;

/// Waits for a reading that has not been returned yet; `None` at the end of the device. Cancel safe.
pub(super) async fn next_reading<T: Clone>(readings: &mut Readings<T>) -> Option<Reading<T>> {
    loop {
        readings.changed().await.ok()?;
        let latest = readings.borrow_and_update().clone();
        if latest.is_some() {
            return latest;
        }
    }
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

    /// Starts a thread that takes readings of a device. It ends with the receivers.
    pub(super) fn start<T: Send + Sync + 'static>(
        mut device: IioImu,
        read: fn(&mut IioImu) -> io::Result<T>,
    ) -> Result<Readings<T>, PartError> {
        let (tell, readings) = watch::channel(None);
        let thread = std::thread::Builder::new().name("imu".to_owned());
        let reading = move || {
            let mut works = true;
            while !tell.is_closed() {
                let at = Instant::now();
                match read(&mut device) {
                    Ok(value) => {
                        works = true;
                        tell.send_replace(Some(Reading { at, value }));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_slow_reader_gets_the_latest_reading_with_its_time() {
        let (tell, mut readings) = watch::channel(None);
        let start = Instant::now();
        for value in 1..=20 {
            let at = start + value * IioDevice::PERIOD;
            tell.send_replace(Some(Reading { at, value }));
        }
        let at = start + 20 * IioDevice::PERIOD;
        let latest = next_reading(&mut readings).await;
        assert_eq!(latest, Some(Reading { at, value: 20 }));
        drop(tell);
        assert_eq!(next_reading(&mut readings).await, None, "not twice");
    }
}
