//! The generated dissector, run by Wireshark's own `tshark`.

mod expected;
mod golden;
mod names;
mod packets;
mod random;
mod transport;
mod tshark;
