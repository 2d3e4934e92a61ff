//! The `[[serial]]` sections: serial lines.
//!
//! ```toml
//! [[serial]]
//! device = "/dev/ttyUSB0"
//! baud = 115200              # the default
//! parity = "none"            # or "odd", "even"
//! stop_bits = 1              # or 2
//! flow_control = "none"      # or "hardware"
//! ```

use super::ConfigError;
use crate::link::serial::Settings;

/// Checks the settings of the lines, without opening them.
pub(super) fn validate(lines: &[Settings]) -> Result<(), ConfigError> {
    for (index, line) in lines.iter().enumerate() {
        let device = || line.device.clone();
        if line.baud == 0 {
            let baud = line.baud;
            return Err(ConfigError::Baud {
                device: device(),
                baud,
            });
        }
        if !(1..=2).contains(&line.stop_bits) {
            let stop_bits = line.stop_bits;
            return Err(ConfigError::StopBits {
                device: device(),
                stop_bits,
            });
        }
        if lines[..index]
            .iter()
            .any(|other| other.device == line.device)
        {
            return Err(ConfigError::SerialTwice(device()));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_line_can_have_is_refused_with_the_port() {
        let line = || Settings::new("/dev/ttyUSB0");
        let error = |lines: &[Settings]| validate(lines).unwrap_err().to_string();
        assert_eq!(validate(&[line(), Settings::new("/dev/ttyUSB1")]), Ok(()));
        assert!(
            error(&[Settings { baud: 0, ..line() }])
                .contains("baud 0 of the serial line /dev/ttyUSB0")
        );
        assert!(
            error(&[Settings {
                stop_bits: 3,
                ..line()
            }])
            .contains("choose 1 or 2")
        );
        assert!(error(&[line(), line()]).contains("/dev/ttyUSB0 is named twice"));
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_line_needs_no_more_than_its_device() {
        let read = |text: &str| toml::from_str::<Settings>(text).map_err(|error| error.to_string());
        assert_eq!(read("device = \"COM3\"").unwrap(), Settings::new("COM3"));
        assert!(
            read("baud = 9600")
                .unwrap_err()
                .contains("missing field `device`")
        );
        let unknown = read("device = \"COM3\"\nparity = \"mark\"").unwrap_err();
        assert!(
            unknown.contains("expected one of `none`, `odd`, `even`"),
            "{unknown}"
        );
    }
}
