//! Writing capture files in pcapng format, for Wireshark and tcpdump.
//!
//! A recording starts with a section header, describes each interface in a separate block, and
//! contains one enhanced packet block per frame, with time stamps in nanoseconds. Every block is
//! written as a whole, so all data flushed before a crash is readable. The layout follows the
//! pcapng draft of the IETF's opsawg working group.

use std::io::{self, Write};

use super::{Frame, LinkType, Timestamp};

const SECTION_HEADER: u32 = 0x0A0D_0D0A;
const INTERFACE_DESCRIPTION: u32 = 1;
const ENHANCED_PACKET: u32 = 6;
/// Identifies this writer's byte order.
const BYTE_ORDER: u32 = 0x1A2B_3C4D;

/// Option codes of blocks.
const END: u16 = 0;
const COMMENT: u16 = 1;
/// Number of packets lost since the previous packet, 8 octets.
pub(super) const LOST: u16 = 4;
const PROGRAM: u16 = 4;
const INTERFACE_NAME: u16 = 2;
const TIME_RESOLUTION: u16 = 9;

/// Writes frames to a pcapng file.
///
/// ```
/// use jaus_view::{Capture, CaptureWriter, LinkType, Timestamp};
///
/// let mut file = Vec::new();
/// let mut writer = CaptureWriter::new(&mut file, "an example")?;
/// let eth0 = writer.add_interface("eth0", LinkType::ETHERNET)?;
/// writer.write(eth0, Timestamp::new(1_790_000_000, 5, 9), &[0x55; 60])?;
///
/// let mut capture = Capture::new(&file[..])?;
/// let frame = capture.next_frame().expect("a frame")?;
/// assert_eq!((frame.link, frame.octets), (LinkType::ETHERNET, &[0x55; 60][..]));
/// assert_eq!(frame.time, Some(Timestamp::new(1_790_000_000, 5, 9)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct CaptureWriter<W> {
    out: W,
    interfaces: u32,
    written: u64,
    block: Vec<u8>,
}

/// An interface of a capture being written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct InterfaceNumber(u32);

impl<W: Write> CaptureWriter<W> {
    /// Starts a capture. `program` names the writing application in the file.
    ///
    /// # Errors
    /// I/O errors of the writer.
    pub fn new(out: W, program: &str) -> io::Result<Self> {
        let mut writer = Self {
            out,
            interfaces: 0,
            written: 0,
            block: Vec::new(),
        };
        writer.begin(SECTION_HEADER);
        writer.put(&BYTE_ORDER.to_ne_bytes());
        // Version 1.0, with unknown section length.
        writer.put(&1_u16.to_ne_bytes());
        writer.put(&0_u16.to_ne_bytes());
        writer.put(&u64::MAX.to_ne_bytes());
        writer.option(PROGRAM, program.as_bytes());
        writer.option(END, &[]);
        writer.end()?;
        Ok(writer)
    }

    /// Adds an interface. All its frames have the same link type.
    ///
    /// # Errors
    /// I/O errors of the writer.
    pub fn add_interface(&mut self, name: &str, link: LinkType) -> io::Result<InterfaceNumber> {
        self.begin(INTERFACE_DESCRIPTION);
        self.put(&link.0.to_ne_bytes());
        self.put(&[0; 2]);
        // Frames are never truncated.
        self.put(&0_u32.to_ne_bytes());
        self.option(INTERFACE_NAME, name.as_bytes());
        // Resolution of 10^-9 seconds.
        self.option(TIME_RESOLUTION, &[9]);
        self.option(END, &[]);
        self.end()?;
        self.interfaces += 1;
        Ok(InterfaceNumber(self.interfaces - 1))
    }

    /// Writes a frame.
    ///
    /// # Errors
    /// I/O errors of the writer; [`io::ErrorKind::InvalidInput`] for a frame of 4 GiB or more.
    pub fn write(&mut self, on: InterfaceNumber, time: Timestamp, frame: &[u8]) -> io::Result<()> {
        self.put_frame(on, time, frame, None)?;
        self.end()
    }

    /// Writes a frame of another capture, with its length on the link and the number of frames lost
    /// before it. A frame without a time gets the beginning of 1970.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn write_frame(&mut self, on: InterfaceNumber, frame: &Frame<'_>) -> io::Result<()> {
        let time = frame.time.unwrap_or_else(|| Timestamp::new(0, 0, 9));
        self.put_frame(on, time, frame.octets, Some(frame.length))?;
        self.put_loss(frame.lost);
        self.end()
    }

    /// Writes a frame with a comment that Wireshark displays.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn write_with_comment(
        &mut self,
        on: InterfaceNumber,
        time: Timestamp,
        frame: &[u8],
        comment: &str,
    ) -> io::Result<()> {
        self.put_frame(on, time, frame, None)?;
        if !comment.is_empty() {
            self.option(COMMENT, comment.as_bytes());
            self.option(END, &[]);
        }
        self.end()
    }

    /// Writes a frame together with the number of frames lost before it, as drop count and as
    /// comment.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn write_after_loss(
        &mut self,
        on: InterfaceNumber,
        time: Timestamp,
        frame: &[u8],
        lost: u64,
    ) -> io::Result<()> {
        self.put_frame(on, time, frame, None)?;
        self.put_loss(lost);
        self.end()
    }

    /// Adds the number of lost frames, if there are any.
    fn put_loss(&mut self, lost: u64) {
        if lost > 0 {
            self.option(LOST, &lost.to_ne_bytes());
            self.option(COMMENT, format!("{lost} lost before this one").as_bytes());
            self.option(END, &[]);
        }
    }

    /// Starts the block of a frame, which had `on_link` octets on the link if that is known. Options
    /// may follow.
    fn put_frame(
        &mut self,
        on: InterfaceNumber,
        time: Timestamp,
        frame: &[u8],
        on_link: Option<u32>,
    ) -> io::Result<()> {
        let length = u32::try_from(frame.len()).map_err(|_| io::ErrorKind::InvalidInput)?;
        let nanos = i128::from(time.seconds()) * 1_000_000_000 + i128::from(time.subsec_nanos());
        // pcapng cannot represent times before 1970 or after 2554.
        let nanos = u64::try_from(nanos).unwrap_or(0);
        self.begin(ENHANCED_PACKET);
        self.put(&on.0.to_ne_bytes());
        self.put(&((nanos >> 32) as u32).to_ne_bytes());
        self.put(&(nanos as u32).to_ne_bytes());
        self.put(&length.to_ne_bytes());
        self.put(&on_link.unwrap_or(length).to_ne_bytes());
        self.put_padded(frame);
        Ok(())
    }

    /// Octets written so far.
    pub const fn written(&self) -> u64 {
        self.written
    }

    /// Flushes the writer.
    ///
    /// # Errors
    /// I/O errors of the writer.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    fn begin(&mut self, kind: u32) {
        self.block.clear();
        self.put(&kind.to_ne_bytes());
        // Placeholder for the length, which is set at the end.
        self.put(&[0; 4]);
    }

    fn put(&mut self, octets: &[u8]) {
        self.block.extend_from_slice(octets);
    }

    /// All fields are padded to a multiple of four octets.
    fn put_padded(&mut self, octets: &[u8]) {
        self.put(octets);
        self.block.resize(self.block.len().next_multiple_of(4), 0);
    }

    fn option(&mut self, code: u16, value: &[u8]) {
        let value = &value[..value.len().min(usize::from(u16::MAX))];
        self.put(&code.to_ne_bytes());
        self.put(&(value.len() as u16).to_ne_bytes());
        self.put_padded(value);
    }

    /// Sets the length at both ends and writes the block.
    fn end(&mut self) -> io::Result<()> {
        let length = self.block.len() + 4;
        let length = u32::try_from(length).map_err(|_| io::ErrorKind::InvalidInput)?;
        self.block[4..8].copy_from_slice(&length.to_ne_bytes());
        self.put(&length.to_ne_bytes());
        self.written += u64::from(length);
        self.out.write_all(&self.block)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Capture;
    use super::*;

    #[test]
    fn frames_of_several_interfaces_come_back_with_their_times() {
        let mut file = Vec::new();
        let mut writer = CaptureWriter::new(&mut file, "test").unwrap();
        let one = writer.add_interface("eth0", LinkType::ETHERNET).unwrap();
        let two = writer.add_interface("wg0", LinkType::RAW).unwrap();
        for (i, on) in [one, two, one].into_iter().enumerate() {
            let time = Timestamp::new(100 + i as i64, 999_999_999, 9);
            writer.write(on, time, &vec![i as u8; 61 + i]).unwrap();
        }
        assert_eq!(writer.written(), file.len() as u64);
        let mut capture = Capture::new(&file[..]).unwrap();
        for (i, link) in [LinkType::ETHERNET, LinkType::RAW, LinkType::ETHERNET]
            .into_iter()
            .enumerate()
        {
            let frame = capture.next_frame().unwrap().unwrap();
            assert_eq!(frame.link, link);
            assert_eq!(frame.octets, vec![i as u8; 61 + i]);
            let time = Timestamp::new(100 + i as i64, 999_999_999, 9);
            assert_eq!(frame.time, Some(time));
        }
        assert!(capture.next_frame().is_none());
    }

    #[test]
    fn a_frame_of_another_capture_keeps_its_interface_its_length_and_the_loss_before_it() {
        let frame = Frame {
            time: Some(Timestamp::new(7, 9, 9)),
            link: LinkType::RAW,
            octets: b"cut",
            lost: 3,
            length: 1500,
            interface: "wlan0",
        };
        let mut file = Vec::new();
        let mut writer = CaptureWriter::new(&mut file, "test").unwrap();
        let on = writer.add_interface(frame.interface, frame.link).unwrap();
        writer.write_frame(on, &frame).unwrap();
        let mut capture = Capture::new(&file[..]).unwrap();
        assert_eq!(capture.next_frame().unwrap().unwrap(), frame);
    }

    #[test]
    fn what_was_lost_is_told_with_the_frame_behind_it() {
        let mut file = Vec::new();
        let mut writer = CaptureWriter::new(&mut file, "test").unwrap();
        let on = writer.add_interface("lo", LinkType::RAW).unwrap();
        let time = Timestamp::new(0, 0, 9);
        writer.write_after_loss(on, time, b"12345", 7).unwrap();
        writer.write(on, time, b"678").unwrap();
        let mut capture = Capture::new(&file[..]).unwrap();
        let mut next = || {
            let frame = capture.next_frame().unwrap().unwrap();
            (frame.octets.to_vec(), frame.lost)
        };
        assert_eq!(next(), (b"12345".to_vec(), 7));
        assert_eq!(next(), (b"678".to_vec(), 0));
    }
}
