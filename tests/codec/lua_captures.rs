//! Recorded traffic of other JAUS stacks in Wireshark: with our dissector, `tshark` reports the
//! same message names and the same errors as our own decoder.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use jaus_test_kit::evidence;
use jaus_test_kit::tools::has_tshark;
use jaus_view::{Capture, Content, Dictionary, JAUS_PORT, Line, MessageLog, Network};

/// Messages by packet number, and whether one of them has an error.
type Packets = BTreeMap<u64, (Vec<String>, bool)>;

/// Our own log's messages for the datagrams of a capture.
fn ours(dictionary: &Dictionary, path: &Path) -> Packets {
    let mut capture = Capture::new(File::open(path).unwrap()).unwrap();
    let mut network = Network::new([JAUS_PORT]);
    let mut log = MessageLog::new(dictionary);
    let mut packets = Packets::new();
    let mut number = 0;
    while let Some(frame) = capture.next_frame() {
        number += 1;
        let frame = frame.unwrap();
        let [datagram] = &network.handle_frame(&frame)[..] else {
            continue;
        };
        if datagram.by_tcp {
            continue;
        }
        let lines = log.read(frame.time, datagram);
        let mut messages = Vec::new();
        for line in &lines {
            let is_whole = header(line).is_some_and(|header| header.data == "whole");
            if is_whole && !matches!(line.content, Content::Octets(_)) {
                // Wireshark has one item for the last fragment and the complete message.
                messages.pop();
            }
            messages.extend(summary(line));
        }
        let wrong = lines.iter().any(Line::is_error);
        packets.insert(number, (messages, wrong));
    }
    packets
}

fn header<'l>(line: &'l Line<'_>) -> Option<&'l jaus_view::Header> {
    line.envelope.as_ref()?.header.as_ref()
}

/// A line in the form of the dissector's summary.
fn summary(line: &Line<'_>) -> Option<String> {
    let header = header(line)?;
    let code = line.code.map_or_else(
        || "no message".to_owned(),
        |code| format!("message {code:04X}h"),
    );
    let name = match &line.content {
        Content::Empty => header.flags.acknowledgement().name().to_uppercase(),
        Content::Fragment(_) => format!("{} fragment", header.data),
        Content::Octets(_) if header.data == "whole" => return None,
        Content::Octets(_) => format!("RA {code}"),
        _ => line.message.map_or(code, str::to_owned),
    };
    Some(name)
}

/// The output of tshark with the dissector in `script`.
fn theirs(script: &Path, path: &Path) -> Packets {
    let home = script.parent().unwrap();
    let fields = [
        "frame.number",
        "_ws.col.Info",
        "jaus.malformed",
        "jaus.unknown",
        "jaus.fault",
    ];
    let output = Command::new("tshark")
        .env("HOME", home)
        .env("XDG_CONFIG_HOME", home)
        // ICMP quotes datagrams that could not be delivered.
        .args(["-n", "-Y", "udp && jaus && !icmp", "-T", "fields", "-X"])
        .arg(format!("lua_script:{}", script.display()))
        .args(fields.iter().flat_map(|field| ["-e", field]))
        .arg("-r")
        .arg(path)
        .output()
        .unwrap();
    let complaints = String::from_utf8_lossy(&output.stderr);
    let complaint = complaints.lines().find(|line| line.contains("Lua"));
    assert_eq!(complaint, None, "{}", path.display());
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(packet).collect()
}

fn packet(line: &str) -> (u64, (Vec<String>, bool)) {
    let columns: Vec<_> = line.split('\t').collect();
    let [number, info, malformed, unknown, fault]: [&str; 5] = columns[..].try_into().unwrap();
    assert_eq!(fault, "", "a fault of the script: {line}");
    let name = |message: &str| {
        // `Name (from 3 fragments) 1.1.1 -> 2.1.1`
        let (message, _) = message.split_once(" -> ")?;
        let (name, _source) = message.rsplit_once(' ')?;
        Some(name.split(" (").next().unwrap_or_default().to_owned())
    };
    let messages = info.split("; ").filter_map(name).collect();
    let wrong = !malformed.is_empty() || !unknown.is_empty();
    (number.parse().unwrap(), (messages, wrong))
}

/// All captures below a directory.
fn captures(directory: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            captures(&path, found);
        } else if path.to_string_lossy().contains(".pcap") {
            found.push(path);
        }
    }
}

#[test]
fn tshark_finds_the_messages_and_faults_that_our_own_reading_finds() {
    if !has_tshark() {
        return;
    }
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("lua_captures");
    fs::create_dir_all(&directory).unwrap();
    let script = directory.join("jaus.lua");
    let mut loader = jsidl::Loader::new();
    loader.catalogue().reference_architecture();
    fs::write(&script, jsidl::lua::dissector(&loader.load().library)).unwrap();

    let dictionary = Dictionary::new()
        .with_reference_architecture(jaus_ra::messages::registry(), jaus_ra::forgiving::decode)
        .with_catalogue();
    let (mut files, mut total) = (Vec::new(), 0);
    captures(evidence::captures(), &mut files);
    // Captures outside the repository, if available.
    evidence::outside("captures/igvc2015")
        .iter()
        .for_each(|folder| captures(folder, &mut files));
    files.extend(evidence::outside(
        "captures/SAE_Management_PacketCapture.pcap",
    ));
    files.sort();
    for file in files {
        let (ours, theirs) = (ours(&dictionary, &file), theirs(&script, &file));
        total += ours
            .values()
            .map(|(messages, _)| messages.len())
            .sum::<usize>();
        for (number, said) in &ours {
            let place = format!("{}, packet {number}", file.display());
            assert_eq!(theirs.get(number), Some(said), "{place}: tshark, we");
        }
        assert_eq!(theirs.len(), ours.len(), "{}", file.display());
    }
    println!("{total} messages in all");
    assert!(total > 1000, "the captures have more messages than {total}");
}
