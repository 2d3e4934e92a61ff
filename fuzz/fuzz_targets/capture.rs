//! Capture files: frames and errors do not depend on how the file is read, the frames hold no more
//! octets than the file, and frames written to a file read back unchanged.
//!
//! The first octet is the length of the pieces in which the file is read the second time.
#![no_main]

use std::io::Read;

use jaus_view::{Capture, CaptureWriter, LinkType, Timestamp};
use libfuzzer_sys::fuzz_target;

/// A frame's description and its octets.
#[derive(Debug, PartialEq)]
struct Kept {
    time: Option<Timestamp>,
    link: LinkType,
    length: u32,
    lost: u64,
    octets: Vec<u8>,
}

/// A reader that returns at most this number of octets per call.
struct Pieces<'a>(&'a [u8], usize);

impl Read for Pieces<'_> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let most = out.len().min(self.1);
        self.0.read(&mut out[..most])
    }
}

fuzz_target!(|input: &[u8]| {
    let Some((&piece, file)) = input.split_first() else {
        return;
    };
    let whole = read(file, file.len());
    let pieces = usize::from(piece).max(1);
    assert_eq!(whole, read(Pieces(file, pieces), file.len()));
    come_back(&whole.0);
});

/// The frames and the errors, in order.
fn read(file: impl Read, length: usize) -> (Vec<Kept>, Vec<String>) {
    let (mut frames, mut errors) = (Vec::new(), Vec::new());
    let mut capture = match Capture::new(file) {
        Ok(capture) => capture,
        Err(error) => return (frames, vec![error.to_string()]),
    };
    let mut octets = 0;
    while let Some(next) = capture.next_frame() {
        match next {
            Ok(frame) => {
                octets += frame.octets.len();
                frames.push(Kept {
                    time: frame.time,
                    link: frame.link,
                    length: frame.length,
                    lost: frame.lost,
                    octets: frame.octets.to_vec(),
                });
            }
            Err(error) => {
                assert!(error.offset() <= length as u64, "{error}");
                errors.push(error.to_string());
            }
        }
        // A packet or block takes at least eight octets of the file.
        assert!(frames.len() + errors.len() <= 1 + length / 8);
    }
    assert!(octets <= length, "{octets} octets out of {length}");
    (frames, errors)
}

fn come_back(frames: &[Kept]) {
    let mut file = Vec::new();
    let mut writer = CaptureWriter::new(&mut file, "fuzz").expect("memory");
    let zero = Timestamp::new(0, 0, 9);
    for frame in frames {
        let on = writer.add_interface("", frame.link).expect("memory");
        let time = frame.time.unwrap_or(zero);
        let written = writer.write_after_loss(on, time, &frame.octets, frame.lost);
        written.expect("memory");
    }
    drop(writer);
    let (again, errors) = read(&file[..], file.len());
    assert_eq!(errors, [""; 0]);
    assert_eq!(again.len(), frames.len());
    for (again, frame) in again.iter().zip(frames) {
        assert_eq!((again.link, again.lost), (frame.link, frame.lost));
        assert_eq!(again.octets, frame.octets);
    }
}
