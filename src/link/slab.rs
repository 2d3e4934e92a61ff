//! The shared receive buffer. Datagrams are copied out of it, so that keeping a datagram never
//! keeps more memory than the datagram.

/// No UDP datagram is longer, so none is ever truncated.
pub(super) const LONGEST: usize = 65_536;

/// The receive buffer, shared by the sockets of a node. It allocates at the first datagram.
#[derive(Debug, Default)]
pub struct Slab {
    free: Vec<u8>,
}

impl Slab {
    /// Room for several datagrams. Untouched memory takes no pages.
    pub(super) fn room_for(&mut self, datagrams: usize) -> &mut [u8] {
        let wanted = datagrams * LONGEST;
        if self.free.len() < wanted {
            // Not resized: fresh zeroed pages come from the system without being written.
            self.free = vec![0; wanted];
        }
        self.free.split_at_mut(wanted).0
    }
}
