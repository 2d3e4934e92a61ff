//! Memory that datagrams are received into, so that large payloads are shared, not copied.
//!
//! A large datagram takes the receive buffer with it and the next one gets a new buffer; a small
//! one is copied out. So a payload that somebody keeps never holds on to more than four times
//! its datagram's size.

use std::io;

use bytes::{Bytes, BytesMut};

/// No UDP datagram is longer; with this much room none is ever cut short.
pub(super) const LONGEST: usize = 65_536;
/// Up to this length copying (under a microsecond) is cheaper than a new buffer.
const SMALL: usize = LONGEST / 4;

/// The receive buffer.
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

    /// Lets `read` write one datagram into the free memory and takes it out.
    ///
    /// # Errors
    /// What `read` returns; the memory stays free then.
    pub(super) fn receive<T>(
        &mut self,
        read: impl FnOnce(&mut BytesMut) -> io::Result<T>,
    ) -> io::Result<(T, Bytes)> {
        self.free.clear();
        self.free.reserve(LONGEST);
        let result = read(&mut self.free)?;
        let datagram = if self.free.len() <= SMALL {
            Bytes::copy_from_slice(&self.free)
        } else {
            std::mem::take(&mut self.free).freeze()
        };
        Ok((result, datagram))
    }

    /// Room for several datagrams, to copy them out of. Memory that nothing was ever written to
    /// costs nothing.
    #[cfg(all(feature = "udp-batch", target_os = "linux"))]
    pub(super) fn room_for(&mut self, datagrams: usize) -> &mut [u8] {
        if self.free.len() != datagrams * LONGEST {
            self.free = BytesMut::zeroed(datagrams * LONGEST);
        }
        &mut self.free
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fill(slab: &mut Slab, octets: &[u8]) -> (*const u8, Bytes) {
        slab.receive(|free| {
            assert!(free.is_empty() && free.capacity() >= LONGEST);
            free.extend_from_slice(octets);
            Ok(free.as_ptr())
        })
        .unwrap()
    }

    #[test]
    fn datagrams_of_all_lengths_come_out_as_they_came_in() {
        let mut slab = Slab::new();
        let lengths = [0, 1, SMALL, SMALL + 1, 65_507, 9];
        let kept: Vec<Bytes> = lengths.map(|n| fill(&mut slab, &vec![n as u8; n]).1).into();
        for (n, datagram) in lengths.into_iter().zip(&kept) {
            assert_eq!(datagram[..], vec![n as u8; n]);
        }
    }

    #[test]
    fn a_large_datagram_is_not_copied() {
        let (written, datagram) = fill(&mut Slab::new(), &[7; 60_000]);
        assert_eq!(written, datagram.as_ptr());
    }

    #[test]
    fn a_small_datagram_does_not_hold_on_to_the_buffer() {
        let mut slab = Slab::new();
        let (first, datagram) = fill(&mut slab, b"small");
        let (second, _) = fill(&mut slab, b"next");
        assert_eq!(first, second);
        assert_ne!(first, datagram.as_ptr());
    }

    #[test]
    fn a_failed_read_leaves_nothing_behind() {
        let mut slab = Slab::new();
        let failed = slab.receive(|free| {
            free.extend_from_slice(b"half");
            Err::<(), _>(io::ErrorKind::WouldBlock.into())
        });
        assert!(failed.is_err());
        assert_eq!(fill(&mut slab, b"next").1[..], b"next"[..]);
    }
}
