//! Builds pcap captures for the tests: messages in UDP datagrams or TCP segments.

use std::fs;
use std::path::Path;

/// The port that the dissector registers for.
const JAUS_PORT: u16 = 3794;
/// `LINKTYPE_RAW`: packets begin with their IP header.
const RAW_IP: u32 = 101;
/// Longer payloads are sent in fragments.
const LONGEST_PAYLOAD: usize = 1400;

/// The octets of a pcap file.
pub(crate) struct Packets {
    file: Vec<u8>,
    count: usize,
    sequence: u16,
}

impl Packets {
    pub(crate) fn new() -> Self {
        let mut file = Vec::new();
        file.extend(0xA1B2_C3D4_u32.to_le_bytes());
        file.extend([2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        file.extend(0x0004_0000_u32.to_le_bytes());
        file.extend(RAW_IP.to_le_bytes());
        Self {
            file,
            count: 0,
            sequence: 0,
        }
    }

    /// Adds a message, in fragments if it is large; returns the number (from 0) of the packet that
    /// completes it.
    pub(crate) fn message(&mut self, octets: &[u8]) -> usize {
        let pieces: Vec<_> = octets.chunks(LONGEST_PAYLOAD).collect();
        let last = pieces.len().saturating_sub(1);
        for (index, piece) in pieces.iter().enumerate() {
            let data_control = match index {
                _ if last == 0 => 0,
                0 => 1,
                _ if index == last => 3,
                _ => 2,
            };
            self.sequence = self.sequence.wrapping_add(1);
            let message = as5669a(data_control, self.sequence, piece);
            self.datagram(&[&[2], &message[..]].concat());
        }
        self.count - 1
    }

    /// The same with headers of the Reference Architecture.
    pub(crate) fn ra_message(&mut self, octets: &[u8]) -> usize {
        let (code, data) = octets.split_at(2);
        let pieces: Vec<_> = data.chunks(LONGEST_PAYLOAD).collect();
        let last = pieces.len().saturating_sub(1);
        for index in 0..=last {
            let flag: u16 = match index {
                _ if last == 0 => 0,
                0 => 1,
                _ if index == last => 8,
                _ => 2,
            };
            let piece = pieces.get(index).copied().unwrap_or_default();
            self.sequence = self.sequence.wrapping_add(1);
            let control = flag << 12 | u16::try_from(piece.len()).unwrap();
            let ids = [1, 1, 1, 10, 1, 35, 1, 20];
            let (control, sequence) = (control.to_le_bytes(), self.sequence.to_le_bytes());
            let parts: [&[u8]; 7] = [b"JAUS01.0", &[6, 2], code, &ids, &control, &sequence, piece];
            self.datagram(&parts.concat());
        }
        self.count - 1
    }

    /// Adds a datagram from and to the JAUS port.
    pub(crate) fn datagram(&mut self, payload: &[u8]) {
        let mut packet = vec![0x45, 0];
        packet.extend(u16::try_from(28 + payload.len()).unwrap().to_be_bytes());
        packet.extend([0, 0, 0, 0, 64, 17, 0, 0, 10, 0, 0, 1, 10, 0, 0, 2]);
        packet.extend(JAUS_PORT.to_be_bytes());
        packet.extend(JAUS_PORT.to_be_bytes());
        packet.extend(u16::try_from(8 + payload.len()).unwrap().to_be_bytes());
        packet.extend([0, 0]);
        packet.extend(payload);
        self.packet(&packet);
    }

    /// Adds a segment of a TCP connection to the JAUS port.
    pub(crate) fn segment(&mut self, position: u32, payload: &[u8]) {
        let mut packet = vec![0x45, 0];
        packet.extend(u16::try_from(40 + payload.len()).unwrap().to_be_bytes());
        packet.extend([0, 0, 0, 0, 64, 6, 0, 0, 10, 0, 0, 1, 10, 0, 0, 2]);
        packet.extend(40_000_u16.to_be_bytes());
        packet.extend(JAUS_PORT.to_be_bytes());
        packet.extend((1 + position).to_be_bytes());
        packet.extend([0, 0, 0, 1, 0x50, 0x18, 0xFF, 0xFF, 0, 0, 0, 0]);
        packet.extend(payload);
        self.packet(&packet);
    }

    fn packet(&mut self, octets: &[u8]) {
        let length = u32::try_from(octets.len()).unwrap().to_le_bytes();
        self.file
            .extend(u32::try_from(self.count).unwrap().to_le_bytes());
        self.file.extend([0; 4]);
        self.file.extend(length);
        self.file.extend(length);
        self.file.extend(octets);
        self.count += 1;
    }

    pub(crate) fn write(&self, path: &Path) {
        fs::write(path, &self.file).unwrap();
    }
}

/// An AS5669A message from 42.1.1 to 101.1.1.
pub(crate) fn as5669a(data_control: u8, sequence: u16, payload: &[u8]) -> Vec<u8> {
    let mut message = vec![0];
    message.extend(u16::try_from(payload.len() + 14).unwrap().to_le_bytes());
    message.push(1 | data_control << 6);
    message.extend([1, 1, 101, 0, 1, 1, 42, 0]);
    message.extend(payload);
    message.extend(sequence.to_le_bytes());
    message
}
