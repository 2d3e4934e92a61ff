//! The devices of the global pose sensor: a serial line and a gyroscope.
#![expect(
    clippy::disallowed_methods,
    reason = "reads devices in real time, the gyroscope on its own thread"
)]

use std::convert::Infallible;
use std::path::PathBuf;
use std::time::Duration;

use tokio::sync::mpsc;

use super::PartError;
use crate::navigation::IioGyro;

/// A gyroscope of Linux's industrial I/O.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gyro {
    /// Its directory, such as `/sys/bus/iio/devices/iio:device0`.
    pub directory: PathBuf,
    /// Whether its Z axis points down.
    pub inverted: bool,
}

impl Gyro {
    /// Interval between two readings.
    const PERIOD: Duration = Duration::from_millis(20);
    /// Interval between attempts to read a device that failed.
    const RETRY: Duration = Duration::from_secs(1);

    /// Starts a thread that reads the turn rate. It ends with the receiver.
    pub(super) fn start(&self) -> Result<mpsc::Receiver<f64>, PartError> {
        let broken = |why: &dyn std::fmt::Display| PartError::Broken(why.to_string());
        let mut gyro =
            IioGyro::open(&self.directory, self.inverted).map_err(|error| broken(&error))?;
        let (tell, rates) = mpsc::channel(8);
        let thread = std::thread::Builder::new().name("gyroscope".to_owned());
        let reading = move || {
            let mut works = true;
            while !tell.is_closed() {
                match gyro.turn_rate() {
                    Ok(rate) => {
                        works = true;
                        // A full queue means that the program hangs; old rates are useless.
                        let _ = tell.try_send(rate);
                    }
                    Err(error) if works => {
                        tracing::warn!("no turn rate: {error}");
                        works = false;
                    }
                    Err(_) => {}
                }
                std::thread::sleep(if works { Self::PERIOD } else { Self::RETRY });
            }
        };
        thread
            .spawn(reading)
            .map_err(|error| broken(&format!("cannot start the gyroscope's thread: {error}")))?;
        Ok(rates)
    }
}

type Octets = mpsc::Receiver<Vec<u8>>;

/// Opens the serial line of a receiver. The future reads it, and opens it again when it was gone.
#[cfg(feature = "serial")]
pub(super) fn receiver(
    device: &str,
    baud: u32,
) -> Result<
    (
        impl Future<Output = Result<Infallible, PartError>> + use<>,
        Octets,
    ),
    PartError,
> {
    /// Pause before a lost line is opened again.
    const PAUSE: Duration = Duration::from_secs(1);
    let mut line = serial2_tokio::SerialPort::open(device, baud).map_err(|error| {
        PartError::Broken(format!(
            "cannot open the GNSS receiver's line {device}: {error}; check the device and the \
             group of its file, usually dialout"
        ))
    })?;
    let (tell, octets) = mpsc::channel(16);
    let device = device.to_owned();
    let reading = async move {
        let mut buffer = [0; 1024];
        loop {
            match line.read(&mut buffer).await {
                Ok(count @ 1..) => {
                    let octets = buffer.get(..count).unwrap_or_default().to_vec();
                    if tell.send(octets).await.is_err() {
                        return Err(PartError::NodeStopped);
                    }
                    continue;
                }
                Ok(_) => tracing::warn!("the GNSS receiver's line has ended"),
                Err(error) => tracing::warn!("the GNSS receiver's line failed: {error}"),
            }
            loop {
                tokio::time::sleep(PAUSE).await;
                if let Ok(again) = serial2_tokio::SerialPort::open(&device, baud) {
                    line = again;
                    break;
                }
            }
        }
    };
    Ok((reading, octets))
}

/// Without serial lines.
#[cfg(not(feature = "serial"))]
pub(super) fn receiver(
    device: &str,
    _baud: u32,
) -> Result<(std::future::Pending<Result<Infallible, PartError>>, Octets), PartError> {
    Err(PartError::Broken(format!(
        "cannot open {device}: built without serial lines (feature `serial`)"
    )))
}
