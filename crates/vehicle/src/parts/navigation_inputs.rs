//! The serial line of the global pose sensor.
#![cfg_attr(
    feature = "serial",
    expect(clippy::disallowed_methods, reason = "reads a line in real time")
)]

use std::convert::Infallible;
#[cfg(feature = "serial")]
use std::time::Duration;

use tokio::sync::mpsc;

use super::PartError;

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
