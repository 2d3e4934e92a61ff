//! Conversion of recordings, with the captures of other stacks.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};

use jaus_test_kit::evidence;
use jaus_view::{Frame, Network, Timestamp};
use jaus_viewers::{McapRecorder, Recorder, Recording, RecordingFormat};

use crate::scene::dictionary;

/// A frame with all that a recording keeps of it.
#[derive(Debug, PartialEq)]
struct Kept {
    time: Option<(i64, u32)>,
    link: u16,
    octets: Vec<u8>,
    length: u32,
    lost: u64,
    interface: String,
}

impl From<Frame<'_>> for Kept {
    fn from(frame: Frame<'_>) -> Self {
        let time = |it: Timestamp| (it.seconds(), it.subsec_nanos());
        Self {
            time: frame.time.map(time),
            link: frame.link.0,
            octets: frame.octets.to_vec(),
            length: frame.length,
            lost: frame.lost,
            interface: frame.interface.to_owned(),
        }
    }
}

fn frames(recording: &[u8]) -> Vec<Kept> {
    let mut recording = Recording::new(recording).unwrap();
    let mut frames = Vec::new();
    while let Some(frame) = recording.next_frame() {
        frames.extend(frame.ok().map(Kept::from));
    }
    frames
}

fn convert(recording: &[u8], format: RecordingFormat) -> Vec<u8> {
    let dictionary = dictionary();
    let mut file = Vec::new();
    let network = Network::by_content();
    let mut recorder = Recorder::new(&mut file, format, &dictionary, network).unwrap();
    let mut recording = Recording::new(recording).unwrap();
    while let Some(frame) = recording.next_frame() {
        if let Ok(frame) = frame {
            recorder.write_frame(&frame).unwrap();
        }
    }
    recorder.finish().unwrap();
    file
}

/// The captures in a folder and those below.
fn captures_in(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            captures_in(&path, found);
        } else if path
            .extension()
            .is_some_and(|it| it == "pcap" || it == "pcapng")
        {
            found.push(path);
        }
    }
}

#[test]
fn captures_of_other_stacks_come_back_from_mcap_with_every_frame() {
    let mut captures = Vec::new();
    captures_in(evidence::captures(), &mut captures);
    assert!(captures.len() > 3, "{captures:?}");
    for path in captures {
        let capture = fs::read(&path).unwrap();
        let before = frames(&capture);
        let mcap = convert(&capture, RecordingFormat::Mcap);
        assert_eq!(frames(&mcap), before, "{}", path.display());
        let pcapng = convert(&mcap, RecordingFormat::Pcapng);
        assert_eq!(frames(&pcapng), before, "{}", path.display());
    }
}

#[test]
fn the_messages_of_a_capture_are_samples_of_channels_with_their_schemas() {
    let mut captures = Vec::new();
    captures_in(&evidence::captures().join("jauspp"), &mut captures);
    let path = captures.first().unwrap();
    let dictionary = dictionary();
    let mut file = Vec::new();
    let mut recorder = McapRecorder::new(&mut file, &dictionary, Network::by_content()).unwrap();
    let mut recording = Recording::new(BufReader::new(File::open(path).unwrap())).unwrap();
    while let Some(Ok(frame)) = recording.next_frame() {
        recorder.write_frame(&frame).unwrap();
    }
    let summary = recorder.finish().unwrap();
    assert!(summary.samples > 0, "{summary:?}");
    assert_eq!(summary.octets, file.len() as u64);
    let read = mcap::Summary::read(&file).unwrap().unwrap();
    let statistics = read.stats.unwrap();
    assert_eq!(statistics.message_count, summary.frames + summary.samples);
    for channel in read.channels.values() {
        assert_eq!(channel.message_encoding, "json");
        let schema = channel.schema.as_ref().unwrap();
        assert_eq!(schema.encoding, "jsonschema");
        let text: serde_json::Value = serde_json::from_slice(&schema.data).unwrap();
        assert_eq!(text["type"], "object", "{}", channel.topic);
    }
}

#[test]
fn samples_beyond_the_limit_are_left_out_and_frames_are_not() {
    let mut captures = Vec::new();
    captures_in(evidence::captures(), &mut captures);
    let capture = fs::read(&captures[0]).unwrap();
    let dictionary = dictionary();
    let mut file = Vec::new();
    let mut recorder = McapRecorder::new(&mut file, &dictionary, Network::by_content()).unwrap();
    recorder.limit_samples(0);
    let mut recording = Recording::new(&capture[..]).unwrap();
    while let Some(Ok(frame)) = recording.next_frame() {
        recorder.write_frame(&frame).unwrap();
    }
    let summary = recorder.finish().unwrap();
    assert_eq!(summary.samples, 0);
    assert!(summary.left_out > 0, "{summary:?}");
    assert_eq!(frames(&file), frames(&capture));
}
