//! Errors of a serial port, with their remedies.

use std::io;

use serial2_tokio::SerialPort;

/// A serial port that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error(
    "the serial port `{device}` cannot be used ({source}): {}; {}",
    remedy(source),
    choice(ports)
)]
pub struct SerialError {
    /// The port as given.
    pub device: String,
    /// The existing ports, to choose from.
    pub ports: Vec<String>,
    /// The error of the operating system.
    pub source: io::Error,
}

impl SerialError {
    pub(super) fn new(device: &str, source: io::Error) -> Self {
        let ports = SerialPort::available_ports().unwrap_or_default();
        let mut ports: Vec<_> = ports
            .iter()
            .map(|port| port.display().to_string())
            .collect();
        ports.sort_unstable();
        Self {
            device: device.to_owned(),
            ports,
            source,
        }
    }
}

fn choice(ports: &[String]) -> String {
    match ports {
        [] => "no serial ports found on this host".to_owned(),
        ports => format!("there are: {}", ports.join(", ")),
    }
}

fn remedy(error: &io::Error) -> &'static str {
    use io::ErrorKind::{InvalidInput, NotFound, PermissionDenied, ResourceBusy};
    /// ENOTTY has this number on all Unix systems: a terminal ioctl on a file that is no terminal.
    const ENOTTY: i32 = 25;
    match error.kind() {
        NotFound => "plug it in or choose another",
        PermissionDenied => {
            "add the user to the group that owns it, usually `dialout` (`sudo usermod -aG dialout \
             $USER`, then log in again)"
        }
        ResourceBusy => "stop the other program that uses it (find it with `sudo fuser -v`)",
        InvalidInput => "choose a baud rate, parity and stop bits that it supports",
        _ if cfg!(unix) && error.raw_os_error() == Some(ENOTTY) => {
            "it is not a serial port, choose another"
        }
        _ => "check the device, or choose another",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_remedy_fits_the_reason() {
        let message = |source| SerialError::new("/dev/ttyUSB7", source).to_string();
        let missing = message(io::ErrorKind::NotFound.into());
        assert!(
            missing.contains("`/dev/ttyUSB7`") && missing.contains("plug it in"),
            "{missing}"
        );
        let forbidden = message(io::ErrorKind::PermissionDenied.into());
        assert!(forbidden.contains("usermod -aG dialout"), "{forbidden}");
    }
}
