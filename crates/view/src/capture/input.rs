//! A reader that tracks its offset and never allocates more than the file contains.

use std::io::{self, Read};

use super::CaptureError;

/// Frames on real links are far shorter. A greater length counts as damage.
pub(super) const LONGEST: u32 = 16 << 20;

/// The file, the offset of its next octet, and the current packet or block.
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

    /// Fills `octets` as far as the file reaches. Returns the number of octets read.
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

    /// Reads up to `length` octets. Returns how many the file still had. The buffer grows with the
    /// data read, not with the announced length.
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

    /// The octets of the last [`take`](Self::take).
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
