//! Rotation, size limit and readability of the journal.

use std::fs;
use std::time::SystemTime;

use super::*;
use crate::{Capture, CaptureError, Dictionary, Entry, MessageStream, Network};
use jaus::address::JausId;
use jaus::endpoint::Outgoing;
use jaus::node::{Config, Content, Passage, Way};
use jaus::wire::Frame;

/// A test directory, removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let name = format!("jaus-journal-{}-{name}", std::process::id());
        Self(std::env::temp_dir().join(name))
    }

    fn files(&self) -> Vec<PathBuf> {
        let mut files: Vec<_> = fs::read_dir(&self.0)
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .collect();
        files.sort();
        files
    }

    fn octets(&self) -> u64 {
        let files = self.files().into_iter();
        files.map(|file| fs::metadata(file).unwrap().len()).sum()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn settings(scratch: &Scratch, format: JournalFormat) -> JournalSettings {
    JournalSettings {
        format,
        limit: 512 << 10,
        file_limit: LEAST_FILE,
        ..JournalSettings::new(&scratch.0)
    }
}

/// A message with an undefined code, followed by a number.
fn payload(number: u32) -> Vec<u8> {
    [&[0xEE, 0xFF][..], &number.to_le_bytes(), &[7; 1000]].concat()
}

fn number_in(entry: &Entry) -> u32 {
    let octets = crate::from_hex(entry.text("octets").unwrap()).unwrap();
    u32::from_le_bytes(octets[2..6].try_into().unwrap())
}

/// All messages of a capture, and the result of reading it.
fn read(octets: &[u8]) -> (Vec<Entry>, Option<CaptureError>) {
    let dictionary = Dictionary::new();
    let mut stream = MessageStream::new(&dictionary, Filter::default());
    let (mut capture, mut network) = (Capture::new(octets).unwrap(), Network::of_any_port());
    let mut entries = Vec::new();
    while let Some(frame) = capture.next_frame() {
        match frame {
            Ok(frame) => {
                let datagram = network.handle_frame(&frame).remove(0);
                entries.extend(stream.read_datagram(frame.time, &datagram));
            }
            Err(error) => return (entries, Some(error)),
        }
    }
    (entries, None)
}

async fn log_messages(settings: &JournalSettings, count: u32) -> JournalCounters {
    let node = Node::start(Config::loopback(101, 1)).unwrap();
    let (from, to) = (node.attach(1).unwrap(), node.attach(2).unwrap());
    let journal = Journal::start(&node, settings, Dictionary::new()).unwrap();
    for number in 0..count {
        let message = Outgoing::new(from.id(), to.id(), payload(number).into());
        from.send(message).unwrap();
    }
    let numbers = journal.numbers.clone();
    node.shutdown().await;
    drop(journal);
    JournalCounters {
        written: numbers.written.load(Ordering::Relaxed),
        lost: numbers.lost.load(Ordering::Relaxed),
    }
}

#[cfg(unix)]
#[tokio::test]
async fn no_other_user_of_the_host_reads_the_log() {
    use std::os::unix::fs::PermissionsExt as _;

    for format in [JournalFormat::Packets, JournalFormat::JsonLines] {
        let scratch = Scratch::new(&format!("mode-{format:?}"));
        log_messages(&settings(&scratch, format), 1).await;
        let files = scratch.files();
        assert_eq!(files.len(), 1);
        let mode = fs::metadata(&files[0]).unwrap().permissions().mode();
        assert_eq!(mode & 0o137, 0, "{mode:o}");
    }
}

#[tokio::test]
async fn the_oldest_files_go_before_the_directory_holds_more_than_it_may() {
    let scratch = Scratch::new("bound");
    let settings = settings(&scratch, JournalFormat::Packets);
    let counters = log_messages(&settings, 2000).await;
    assert_eq!((counters.written, counters.lost), (2000, 0));
    assert!(scratch.octets() <= settings.limit);
    assert!(
        scratch.octets() > settings.limit / 2,
        "and holds what it may"
    );
    let files = scratch.files();
    let mut numbers = Vec::new();
    for file in &files {
        let octets = fs::read(file).unwrap();
        assert!(octets.len() as u64 <= settings.file_limit);
        let (entries, error) = read(&octets);
        assert!(error.is_none(), "{error:?}");
        numbers.extend(entries.iter().map(number_in));
    }
    let first = numbers[0];
    assert_eq!(
        numbers,
        (first..2000).collect::<Vec<_>>(),
        "the latest, all of them"
    );

    // Another run continues after it, within the same limit.
    log_messages(&settings, 100).await;
    assert!(scratch.octets() <= settings.limit);
    assert!(scratch.files().last() > files.last());
}

#[tokio::test]
async fn lines_are_bounded_alike_and_each_is_whole() {
    let scratch = Scratch::new("lines");
    let settings = settings(&scratch, JournalFormat::JsonLines);
    log_messages(&settings, 1000).await;
    assert!(scratch.octets() <= settings.limit);
    let dictionary = Dictionary::new();
    let stream = MessageStream::new(&dictionary, Filter::default());
    let text: String = scratch
        .files()
        .iter()
        .map(|file| fs::read_to_string(file).unwrap())
        .collect();
    let mut numbers = text
        .lines()
        .map(|line| number_in(&stream.read_json(line).unwrap().unwrap()));
    assert_eq!(numbers.next_back(), Some(999));
    assert!(numbers.is_sorted(), "each of them whole");
}

#[tokio::test]
async fn a_log_that_was_cut_anywhere_is_read_up_to_there() {
    let scratch = Scratch::new("cut");
    log_messages(&settings(&scratch, JournalFormat::Packets), 5).await;
    let octets = fs::read(&scratch.files()[0]).unwrap();
    let (all, _) = read(&octets);
    assert_eq!(all.len(), 5);
    let begin = octets
        .windows(4)
        .position(|w| w == 6_u32.to_ne_bytes())
        .unwrap();
    let mut most = 0;
    for length in begin..octets.len() {
        let (entries, error) = read(&octets[..length]);
        assert_eq!(entries, all[..entries.len()]);
        assert!(entries.len() >= most, "more octets, no fewer messages");
        most = entries.len();
        let at_a_boundary = error.is_none();
        assert!(at_a_boundary || matches!(error, Some(CaptureError::CutShort { .. })));
    }
    assert_eq!(most, 4);
}

fn passage(seconds: u64, octets: Vec<u8>) -> Passage {
    let own = JausId::new(101, 1, 1);
    Passage {
        time: SystemTime::UNIX_EPOCH + Duration::from_secs(seconds),
        way: Way::Local(own),
        content: Content::Frame(Frame::new(own, own, octets.into())),
    }
}

fn sink(node: &Node, settings: &JournalSettings) -> Sink {
    let directory = Directory::open(settings).unwrap();
    Sink::new(directory, settings, Links::of(node.clone()))
}

#[tokio::test]
async fn the_log_says_where_how_much_was_lost() {
    let node = Node::start(Config::loopback(101, 1)).unwrap();
    let scratch = Scratch::new("lost");
    let mut packets = sink(&node, &settings(&scratch, JournalFormat::Packets));
    packets.lose(7);
    packets.write_packets(&passage(1, payload(1))).unwrap();
    packets.end().unwrap();
    let written = fs::read(&scratch.files()[0]).unwrap();
    let said = b"7 lost before this one";
    assert!(written.windows(said.len()).any(|window| window == said));

    let scratch = Scratch::new("lost-lines");
    let mut lines = sink(&node, &settings(&scratch, JournalFormat::JsonLines));
    let dictionary = Dictionary::new();
    let mut stream = MessageStream::new(&dictionary, Filter::default());
    lines.lose(3);
    lines
        .write_lines(&passage(1, payload(1)), &mut stream)
        .unwrap();
    lines.end().unwrap();
    let written = fs::read_to_string(&scratch.files()[0]).unwrap();
    assert!(written.starts_with("{\"lost\":3}\n"), "{written}");
}

#[tokio::test]
async fn a_file_that_has_its_age_is_ended_and_a_clock_set_back_does_no_harm() {
    let node = Node::start(Config::loopback(101, 1)).unwrap();
    let scratch = Scratch::new("age");
    let mut sink = sink(&node, &settings(&scratch, JournalFormat::Packets));
    for seconds in [10_000, 13_599, 5, 13_600] {
        sink.write_packets(&passage(seconds, payload(1))).unwrap();
    }
    sink.end().unwrap();
    assert_eq!(scratch.files().len(), 2);
}

#[tokio::test]
async fn a_message_larger_than_a_packet_is_read_back_whole() {
    let node = Node::start(Config::loopback(101, 1)).unwrap();
    let scratch = Scratch::new("large");
    let bounds = settings(&scratch, JournalFormat::Packets);
    let bounds = JournalSettings {
        limit: 4 << 20,
        file_limit: 1 << 20,
        ..bounds
    };
    let mut sink = sink(&node, &bounds);
    let large = [&payload(5)[..], &[9; 200_000]].concat();
    sink.write_packets(&passage(1, large.clone())).unwrap();
    sink.end().unwrap();
    let (entries, error) = read(&fs::read(&scratch.files()[0]).unwrap());
    assert!(error.is_none());
    assert_eq!(entries[0].text("octets"), Some(&*crate::to_hex(&large)));
}

#[tokio::test]
async fn bounds_and_directories_that_cannot_be_are_refused() {
    let node = Node::start(Config::loopback(101, 1)).unwrap();
    let scratch = Scratch::new("refused");
    let bounds = settings(&scratch, JournalFormat::Packets).limited_to(100_000);
    let error = Journal::start(&node, &bounds, Dictionary::new())
        .unwrap_err()
        .to_string();
    assert!(error.contains("100000 octets"), "{error}");
    let no_directory = JournalSettings::new("/dev/null/log");
    let error = Journal::start(&node, &no_directory, Dictionary::new())
        .unwrap_err()
        .to_string();
    assert!(error.contains("/dev/null/log"), "{error}");
}
