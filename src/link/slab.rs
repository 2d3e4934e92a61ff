//! Memory that datagrams are received into, so that payloads can be shared instead of copied.
//!
//! Each datagram is cut off the front of a larger block. The block lives as long as any payload
//! cut from it: who keeps a small payload for long should copy it.

use std::io;

use bytes::{Bytes, BytesMut};

/// No UDP datagram is longer; with this much room none is ever cut short.
const LONGEST: usize = 65_536;
/// Size of one block: some three of the longest datagrams, or two thousand usual ones.
const BLOCK: usize = 4 * LONGEST;

/// A block of memory and what is left of it.
#[derive(Debug, Default)]
pub struct Slab {
    free: BytesMut,
}

impl Slab {
    /// A slab that holds no memory before the first datagram.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Lets `read` append one datagram to the free memory and cuts it off.
    ///
    /// # Errors
    /// What `read` returns; the memory stays free then.
    pub(super) fn receive<T>(
        &mut self,
        read: impl FnOnce(&mut BytesMut) -> io::Result<T>,
    ) -> io::Result<(T, Bytes)> {
        if self.free.capacity() < LONGEST {
            self.free.reserve(BLOCK);
        }
        let result = read(&mut self.free);
        let datagram = self.free.split();
        Ok((result?, datagram.freeze()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fill(slab: &mut Slab, octets: &[u8]) -> Bytes {
        slab.receive(|free| {
            assert!(free.is_empty() && free.capacity() >= LONGEST);
            free.extend_from_slice(octets);
            Ok(())
        })
        .unwrap()
        .1
    }

    #[test]
    fn there_is_always_room_for_the_longest_datagram() {
        let mut slab = Slab::new();
        let kept: Vec<Bytes> = (0..20).map(|i| fill(&mut slab, &[i; 20_000])).collect();
        for (i, datagram) in (0_u8..).zip(&kept) {
            assert_eq!(datagram[..], [i; 20_000]);
        }
    }

    #[test]
    fn small_datagrams_share_one_block() {
        let mut slab = Slab::new();
        let first = fill(&mut slab, b"first");
        let second = fill(&mut slab, b"second");
        assert_eq!(
            second.as_ptr() as usize - first.as_ptr() as usize,
            first.len()
        );
    }

    #[test]
    fn a_failed_read_leaves_nothing_behind() {
        let mut slab = Slab::new();
        let failed = slab.receive(|_| Err::<(), _>(io::ErrorKind::WouldBlock.into()));
        assert!(failed.is_err());
        assert_eq!(fill(&mut slab, b"next")[..], b"next"[..]);
    }
}
