//! CAN buses of Linux (SocketCAN).

use std::io;

use socketcan::{
    CanFrame as RawFrame, CanSocket, EmbeddedFrame, ExtendedId, Frame, Id, Socket, SocketOptions,
};

use super::{CanBus, CanFrame};

/// A network interface for a CAN bus, such as `can0`.
#[derive(Debug)]
pub struct SocketCan(CanSocket);

impl SocketCan {
    /// Opens an interface, which must be up.
    ///
    /// # Errors
    /// If there is no such interface, or the kernel has no CAN.
    pub fn open(interface: &str) -> io::Result<Self> {
        let socket = CanSocket::open(interface)?;
        socket.set_nonblocking(true)?;
        socket.set_error_filter_accept_all()?;
        Ok(Self(socket))
    }
}

impl CanBus for SocketCan {
    fn send(&mut self, frame: &CanFrame) -> io::Result<()> {
        let id = ExtendedId::new(frame.id()).map(Id::Extended);
        let raw = id.and_then(|id| RawFrame::new(id, frame.data()));
        // A frame always has a valid identifier and length.
        self.0.write_frame(&raw.ok_or(io::ErrorKind::InvalidInput)?)
    }

    /// Errors of single frames are corrected by the bus itself. Frames with standard identifiers are
    /// skipped.
    fn receive(&mut self) -> io::Result<Option<CanFrame>> {
        loop {
            match self.0.read_frame() {
                Ok(RawFrame::Data(raw)) if raw.is_extended() => {
                    return Ok(Some(CanFrame::new(raw.raw_id(), raw.data())));
                }
                Ok(RawFrame::Error(error)) => {
                    let error = error.into_error();
                    if error.is_bus_off() {
                        return Err(io::Error::other("bus-off"));
                    }
                    tracing::debug!("CAN: {error}");
                }
                Ok(_) => {}
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(None),
                Err(error) => return Err(error),
            }
        }
    }
}
