//! The settings of a serial line. Both ends must agree; they are not negotiated.

use serial2_tokio as serial2;

/// A serial line. Both ends need the same settings. Characters have 8 bits, as the framing
/// requires.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Settings {
    /// The port: a path such as `/dev/ttyUSB0`, on Windows a name such as `COM3`. Paths under
    /// `/dev/serial/by-id` do not change when ports are plugged in in another order.
    pub device: String,
    /// Bits per second. The default is 115200, as for USB converters and boards. (Junior's default
    /// is 19200.)
    #[cfg_attr(feature = "serde", serde(default = "usual_baud"))]
    pub baud: u32,
    /// The parity bit.
    #[cfg_attr(feature = "serde", serde(default))]
    pub parity: Parity,
    /// The stop bits, 1 or 2.
    #[cfg_attr(feature = "serde", serde(default = "one"))]
    pub stop_bits: u8,
    /// How a slow receiver stops the sender. (Junior's default is hardware.)
    #[cfg_attr(feature = "serde", serde(default))]
    pub flow_control: FlowControl,
}

/// The parity bit of each character.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
pub enum Parity {
    /// No parity bit.
    #[default]
    None,
    /// It makes the number of ones odd.
    Odd,
    /// It makes the number of ones even.
    Even,
}

/// How a slow receiver stops the sender.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
pub enum FlowControl {
    /// It cannot: three wires are enough.
    #[default]
    None,
    /// With the wires RTS and CTS.
    Hardware,
}

const fn usual_baud() -> u32 {
    115_200
}

#[cfg(feature = "serde")]
const fn one() -> u8 {
    1
}

impl Settings {
    /// The default settings: 115200 bits per second, 8 bits, no parity, one stop bit, no flow
    /// control.
    #[must_use]
    pub fn new(device: impl Into<String>) -> Self {
        Self {
            device: device.into(),
            baud: usual_baud(),
            parity: Parity::None,
            stop_bits: 1,
            flow_control: FlowControl::None,
        }
    }

    /// Opens the port with these settings.
    pub(super) fn open(&self) -> std::io::Result<serial2::SerialPort> {
        serial2::SerialPort::open(&self.device, |mut port: serial2::Settings| {
            port.set_raw();
            port.set_baud_rate(self.baud)?;
            port.set_char_size(serial2::CharSize::Bits8);
            port.set_parity(match self.parity {
                Parity::None => serial2::Parity::None,
                Parity::Odd => serial2::Parity::Odd,
                Parity::Even => serial2::Parity::Even,
            });
            port.set_stop_bits(if self.stop_bits == 2 {
                serial2::StopBits::Two
            } else {
                serial2::StopBits::One
            });
            port.set_flow_control(match self.flow_control {
                FlowControl::None => serial2::FlowControl::None,
                FlowControl::Hardware => serial2::FlowControl::RtsCts,
            });
            Ok(port)
        })
    }
}
