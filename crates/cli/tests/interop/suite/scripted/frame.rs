//! AS5669A frames in UDP datagrams, encoded and decoded without this project's code: a test cannot
//! verify code that both of its sides share.

use jaus::address::JausId;

/// First octet of a datagram.
const VERSION: u8 = 2;
/// Octets of a frame before its payload, and in total.
const HEAD: usize = 12;
const LEAST: usize = 14;

/// Acknowledgement field of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Receipt {
    None,
    Wanted,
    Refused,
    Given,
}

/// Data control field: which part of a message the frame carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Piece {
    Whole,
    First,
    Middle,
    Last,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Frame {
    pub(super) priority: u8,
    /// 0 for one destination, 1 for the subsystem, 2 for all.
    pub(super) broadcast: u8,
    pub(super) receipt: Receipt,
    pub(super) piece: Piece,
    pub(super) destination: JausId,
    pub(super) source: JausId,
    pub(super) payload: Vec<u8>,
    pub(super) sequence: u16,
}

impl Frame {
    /// A datagram with this frame only.
    pub(super) fn datagram(&self) -> Vec<u8> {
        let flags = self.priority
            | self.broadcast << 2
            | (self.receipt as u8) << 4
            | (self.piece as u8) << 6;
        let size = (self.payload.len() + LEAST) as u16;
        let mut datagram = vec![VERSION, 0];
        datagram.extend(size.to_le_bytes());
        datagram.push(flags);
        datagram.extend(id_octets(self.destination));
        datagram.extend(id_octets(self.source));
        datagram.extend(&self.payload);
        datagram.extend(self.sequence.to_le_bytes());
        datagram
    }

    /// The frames of a datagram, up to the first invalid one.
    pub(super) fn all(datagram: &[u8]) -> Vec<Self> {
        let mut frames = Vec::new();
        let Some((&VERSION, mut rest)) = datagram.split_first() else {
            return frames;
        };
        while let Some(size) = size(rest) {
            let (frame, behind) = rest.split_at(size);
            frames.push(Self::read(frame));
            rest = behind;
        }
        frames
    }

    /// Decodes a frame of the right size.
    fn read(octets: &[u8]) -> Self {
        let flags = octets[3];
        let end = octets.len() - 2;
        Self {
            priority: flags & 3,
            broadcast: flags >> 2 & 3,
            receipt: match flags >> 4 & 3 {
                0 => Receipt::None,
                1 => Receipt::Wanted,
                2 => Receipt::Refused,
                _ => Receipt::Given,
            },
            piece: match flags >> 6 {
                0 => Piece::Whole,
                1 => Piece::First,
                2 => Piece::Middle,
                _ => Piece::Last,
            },
            destination: id(&octets[4..8]),
            source: id(&octets[8..12]),
            payload: octets[HEAD..end].to_vec(),
            sequence: u16::from_le_bytes([octets[end], octets[end + 1]]),
        }
    }
}

/// The size of the frame at the start of these octets, if there is a valid one.
fn size(octets: &[u8]) -> Option<usize> {
    let (kind, size) = (*octets.first()?, octets.get(1..3)?);
    let size = usize::from(u16::from_le_bytes([size[0], size[1]]));
    (kind == 0 && size >= LEAST && size <= octets.len()).then_some(size)
}

fn id_octets(id: JausId) -> [u8; 4] {
    let [low, high] = id.subsystem().to_le_bytes();
    [id.component(), id.node(), low, high]
}

fn id(octets: &[u8]) -> JausId {
    JausId::new(
        u16::from_le_bytes([octets[2], octets[3]]),
        octets[1],
        octets[0],
    )
}
