//! CAN buses: frames, the trait [`CanBus`], and a bus in memory.

use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A data frame with an extended identifier (29 bits).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CanFrame {
    id: u32,
    length: usize,
    data: [u8; 8],
}

impl CanFrame {
    /// Creates a frame of the lower 29 bits of an identifier and the first eight octets of data.
    #[must_use]
    pub fn new(id: u32, data: &[u8]) -> Self {
        let mut frame = Self {
            id: id & 0x1FFF_FFFF,
            length: data.len().min(8),
            data: [0; 8],
        };
        for (to, from) in frame.data.iter_mut().zip(data) {
            *to = *from;
        }
        frame
    }

    /// The identifier.
    #[must_use]
    pub const fn id(&self) -> u32 {
        self.id
    }

    /// The octets of data, at most eight.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        self.data.get(..self.length).unwrap_or_default()
    }
}

/// A node's access to a CAN bus. No call waits.
pub trait CanBus: Send + 'static {
    /// Sends a frame.
    ///
    /// # Errors
    /// If the bus is off, or its queue is full.
    fn send(&mut self, frame: &CanFrame) -> io::Result<()>;

    /// The next received frame; `None` if there is none yet. Own frames are not received.
    ///
    /// # Errors
    /// If the bus is off.
    fn receive(&mut self) -> io::Result<Option<CanFrame>>;
}

/// A bus in memory, for simulations and tests. Each [`join`](Self::join) is a node.
#[derive(Debug, Default)]
pub struct VirtualBus {
    bus: Arc<Mutex<Nodes>>,
    node: usize,
}

#[derive(Debug, Default)]
struct Nodes {
    /// What each node has yet to receive.
    queues: Vec<VecDeque<CanFrame>>,
    is_off: bool,
}

impl VirtualBus {
    /// Frames that a node may leave unread. Then the oldest one is lost.
    const MOST: usize = 1024;

    /// Another node on this bus.
    #[must_use]
    pub fn join(&self) -> Self {
        let mut nodes = self.lock();
        nodes.queues.push(VecDeque::new());
        Self {
            bus: Arc::clone(&self.bus),
            node: nodes.queues.len(),
        }
    }

    /// Makes the bus fail for all its nodes, as after too many errors, or work again.
    pub fn set_off(&self, is_off: bool) {
        self.lock().is_off = is_off;
    }

    fn lock(&self) -> MutexGuard<'_, Nodes> {
        self.bus.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The nodes of a bus that works.
    fn on(&self) -> io::Result<MutexGuard<'_, Nodes>> {
        let nodes = self.lock();
        if nodes.is_off {
            return Err(io::Error::other("bus-off"));
        }
        Ok(nodes)
    }
}

impl CanBus for VirtualBus {
    fn send(&mut self, frame: &CanFrame) -> io::Result<()> {
        let mut nodes = self.on()?;
        let others = (1..).zip(&mut nodes.queues);
        for (_, queue) in others.filter(|(node, _)| *node != self.node) {
            if queue.len() >= Self::MOST {
                queue.pop_front();
            }
            queue.push_back(*frame);
        }
        Ok(())
    }

    fn receive(&mut self) -> io::Result<Option<CanFrame>> {
        let mut nodes = self.on()?;
        let own = self.node.checked_sub(1);
        let queue = own.and_then(|own| nodes.queues.get_mut(own));
        Ok(queue.and_then(VecDeque::pop_front))
    }
}
