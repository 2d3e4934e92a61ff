//! Runs the real binary, and generates captures.

#![allow(
    dead_code,
    unreachable_pub,
    reason = "every test file uses its own part"
)]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "these helpers contain tests"
)]

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use etherparse::PacketBuilder;
use jaus_test_kit::group;
use serde_json::Value as Json;

/// Output and exit status of a run of `jaus`.
#[derive(Debug)]
pub struct Run {
    pub status: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Run {
    /// Standard output as JSON lines.
    #[track_caller]
    pub fn json(&self) -> Vec<Json> {
        let parse =
            |line: &str| serde_json::from_str(line).unwrap_or_else(|e| panic!("{line}: {e}"));
        self.stdout.lines().map(parse).collect()
    }

    /// The only JSON line.
    #[track_caller]
    pub fn only_line(&self) -> Json {
        let mut lines = self.json();
        assert_eq!(lines.len(), 1, "{self:?}");
        lines.remove(0)
    }
}

pub fn jaus() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_jaus"));
    command.env_remove("JAUS_LOG");
    command
}

/// Flags for loopback and a multicast group of this test alone.
pub fn own_group() -> Vec<String> {
    let group = group::own_group().to_string();
    ["--loopback", "--port", "0", "--group", &group]
        .map(str::to_owned)
        .to_vec()
}

/// Runs `jaus` with arguments and standard input.
pub fn run(arguments: &[&str], input: &[u8]) -> Run {
    let mut child = jaus()
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_vec();
    // Both pipes must be served at once, or one of them fills up. The run may end before it has
    // read all input.
    let writer = std::thread::spawn(move || drop(stdin.write_all(&input)));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    Run {
        status: output.status.code().expect("ended by itself"),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

/// A `jaus node`, or another command that runs until it is stopped.
pub struct Running {
    child: Child,
    stdout: BufReader<ChildStdout>,
}

impl Running {
    pub fn node(flags: &[&str]) -> Self {
        Self::command("node", flags)
    }

    pub fn command(name: &str, flags: &[&str]) -> Self {
        Self::endless(name, &[flags, &["--for", "60s"]].concat())
    }

    /// A command without a limit of its time.
    pub fn endless(name: &str, flags: &[&str]) -> Self {
        let mut child = jaus()
            .arg(name)
            .args(flags)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        Self { child, stdout }
    }

    /// Reads up to the line that contains `text`, and returns everything read.
    #[track_caller]
    pub fn read_until(&mut self, text: &str) -> String {
        let mut read = String::new();
        while !read.contains(text) {
            assert_ne!(
                self.stdout.read_line(&mut read).unwrap(),
                0,
                "no `{text}` in {read}"
            );
        }
        read
    }

    /// Sends a signal, such as `-TERM`.
    pub fn signal(&self, signal: &str) {
        let pid = self.child.id().to_string();
        let kill = Command::new("kill").args([signal, &pid]).status();
        assert!(kill.unwrap().success());
    }

    /// Asks it to terminate, and returns the exit status.
    pub fn terminate(mut self) -> Option<i32> {
        self.signal("-TERM");
        self.child.wait().unwrap().code()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The octets of every golden vector in a file, one per line.
pub fn vectors(file: &Path) -> String {
    let text = std::fs::read_to_string(file).unwrap();
    let hex = |line: &str| {
        serde_json::from_str::<Json>(line).unwrap()["hex"]
            .as_str()
            .unwrap()
            .to_owned()
    };
    text.lines().map(|line| hex(line) + "\n").collect()
}

/// An AS5669A message, without the version octet.
pub struct Message {
    pub source: u32,
    pub destination: u32,
    pub flags: u8,
    pub sequence: u16,
    pub payload: Vec<u8>,
}

impl Message {
    /// From 42.1.1 to 105.1.255, as in the competitions' judging tool.
    pub fn new(payload: &[u8]) -> Self {
        Self {
            source: 42 << 16 | 0x0101,
            destination: 105 << 16 | 0x01FF,
            flags: 0x09,
            sequence: 1,
            payload: payload.to_vec(),
        }
    }

    pub fn octets(&self) -> Vec<u8> {
        let size = u16::try_from(self.payload.len() + 14).unwrap();
        [
            &[0][..],
            &size.to_le_bytes(),
            &[self.flags],
            &self.destination.to_le_bytes(),
            &self.source.to_le_bytes(),
            &self.payload,
            &self.sequence.to_le_bytes(),
        ]
        .concat()
    }

    /// A datagram with only this message.
    pub fn datagram(&self) -> Vec<u8> {
        [vec![2], self.octets()].concat()
    }
}

/// An IPv4 packet from 192.168.1.42 to 239.255.0.1, port 3794 at both ends.
pub fn ip_packet(datagram: &[u8]) -> Vec<u8> {
    let mut packet = Vec::new();
    PacketBuilder::ipv4([192, 168, 1, 42], [239, 255, 0, 1], 16)
        .udp(3794, 3794)
        .write(&mut packet, datagram)
        .unwrap();
    packet
}

/// Link type of frames that are bare IP packets.
pub const RAW: u16 = 101;

/// A pcap file, little-endian, with microseconds: the frames at 2015-06-08T16:36:58.436918Z.
pub fn pcap(link: u16, frames: &[Vec<u8>]) -> Vec<u8> {
    let mut file = [
        &[0xd4, 0xc3, 0xb2, 0xa1, 2, 0, 4, 0][..],
        &[0; 8],
        &65_535_u32.to_le_bytes(),
        &u32::from(link).to_le_bytes(),
    ]
    .concat();
    for frame in frames {
        let length = u32::try_from(frame.len()).unwrap();
        for word in [1_433_781_418, 436_918, length, length] {
            file.extend_from_slice(&word.to_le_bytes());
        }
        file.extend_from_slice(frame);
    }
    file
}

/// A pcap file whose frames are bare IP packets around the datagrams.
pub fn pcap_of(datagrams: &[Vec<u8>]) -> Vec<u8> {
    let packets: Vec<_> = datagrams.iter().map(|d| ip_packet(d)).collect();
    pcap(RAW, &packets)
}

/// A pcapng block.
pub fn block(kind: u32, body: &[u8]) -> Vec<u8> {
    let padding = vec![0; body.len().next_multiple_of(4) - body.len()];
    let length = (12 + body.len() + padding.len()) as u32;
    let length = length.to_le_bytes();
    [&kind.to_le_bytes()[..], &length, body, &padding, &length].concat()
}

pub fn section_header() -> Vec<u8> {
    let body = [&[0x4d, 0x3c, 0x2b, 0x1a, 1, 0, 0, 0][..], &[0xff; 8]].concat();
    block(0x0A0D_0D0A, &body)
}

pub fn interface(link: u16, options: &[u8]) -> Vec<u8> {
    block(1, &[&link.to_le_bytes()[..], &[0; 6], options].concat())
}

pub fn enhanced_packet(interface: u32, ticks: u64, frame: &[u8]) -> Vec<u8> {
    let length = frame.len() as u32;
    let words = [
        interface,
        (ticks >> 32) as u32,
        ticks as u32,
        length,
        length,
    ];
    let body: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    block(6, &[&body, frame].concat())
}

/// A pcapng file with one interface, and its frames.
pub fn pcapng(link: u16, frames: &[Vec<u8>]) -> Vec<u8> {
    let packets = frames
        .iter()
        .map(|frame| enhanced_packet(0, 1_433_781_418_436_918, frame));
    let blocks = [section_header(), interface(link, &[])];
    blocks.into_iter().chain(packets).flatten().collect()
}
