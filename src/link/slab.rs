//! Memory that datagrams are received into, and copied out of: what somebody keeps of a datagram
//! never holds on to more than the datagram.

/// No UDP datagram is longer; with this much room none is ever cut short.
pub(super) const LONGEST: usize = 65_536;

/// The receive buffer, shared by the sockets of a node.
#[derive(Debug, Default)]
pub struct Slab {
    free: Vec<u8>,
}

impl Slab {
    /// A slab that holds no memory before the first datagram.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Room for several datagrams. Memory that nothing was ever written to costs nothing.
    pub(super) fn room_for(&mut self, datagrams: usize) -> &mut [u8] {
        let wanted = datagrams * LONGEST;
        if self.free.len() < wanted {
            // Not resized: fresh zeros come from the system without being written.
            self.free = vec![0; wanted];
        }
        self.free.split_at_mut(wanted).0
    }
}
