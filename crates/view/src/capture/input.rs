//! A reader that knows where it is and never takes more memory than the file has octets.

use std::io::{self, Read};

use super::CaptureError;

/// No link has frames near this; a length beyond it is taken for damage.
pub(super) const LONGEST: u32 = 16 << 20;

/// The file, the offset of the next octet in it, and the packet or block at hand.
pub(super) struct Input<R> {
    reader: R,
    offset: u64,
    buffer: Vec<u8>,
}

impl<R: Read> Input<R> {
    pub(super) fn new(reader: R) -> Self {
        Self {
            reader,
            offset: 0,
            buffer: Vec::new(),
        }
    }

    /// Octets read so far.
    pub(super) fn offset(&self) -> u64 {
        self.offset
    }

    /// Fills `octets` as far as the file reaches, and says how far that is.
    pub(super) fn fill(&mut self, octets: &mut [u8]) -> Result<usize, CaptureError> {
        let mut held = 0;
        while held < octets.len() {
            match self.reader.read(&mut octets[held..]) {
                Ok(0) => break,
                Ok(read) => held += read,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(source) => return Err(self.failed(source)),
            }
        }
        self.offset += held as u64;
        Ok(held)
    }

    /// Reads `length` octets, or as many as the file still has, and says how many. The buffer
    /// grows with what arrives, not with what was announced.
    pub(super) fn take(&mut self, length: u32) -> Result<u32, CaptureError> {
        self.buffer.clear();
        let read = (&mut self.reader)
            .take(u64::from(length))
            .read_to_end(&mut self.buffer);
        self.offset += self.buffer.len() as u64;
        match read {
            // At most `length`, so it fits.
            Ok(read) => Ok(u32::try_from(read).unwrap_or(length)),
            Err(source) => Err(self.failed(source)),
        }
    }

    /// What [`take`](Self::take) read last.
    pub(super) fn taken(&self) -> &[u8] {
        &self.buffer
    }

    fn failed(&self, source: io::Error) -> CaptureError {
        CaptureError::Read {
            offset: self.offset,
            source,
        }
    }
}
