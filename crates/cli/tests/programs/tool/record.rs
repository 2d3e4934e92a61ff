//! `jaus record` and `jaus replay` over the loopback interface.

use std::fs;
use std::net::UdpSocket;
use std::time::Duration;

use crate::support::{own_group, run};
use etherparse::PacketBuilder;
use jaus_view::{CaptureWriter, LinkType, Timestamp};

/// A test's own file, removed when dropped.
struct File(std::path::PathBuf);

impl File {
    fn new(name: &str) -> Self {
        let name = format!("jaus-{}-{name}.pcapng", std::process::id());
        Self(std::env::temp_dir().join(name))
    }

    fn path(&self) -> &str {
        self.0.to_str().unwrap_or_default()
    }
}

impl Drop for File {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

#[test]
fn what_goes_to_the_group_is_recorded_and_can_be_decoded() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let file = File::new("recorded");
    let port = network[4].rsplit(':').next().unwrap();
    let recording = [
        "record",
        file.path(),
        "--interface",
        "lo",
        "--group",
        network[4],
        "--port",
        port,
        "--for",
        "3s",
    ];
    let recording: Vec<_> = recording.iter().map(|&flag| flag.to_owned()).collect();
    let recorder = std::thread::spawn(move || {
        let recording: Vec<_> = recording.iter().map(String::as_str).collect();
        run(&recording, b"")
    });
    // Any traffic during the recording will do; a node sends discovery queries when it starts.
    while !recorder.is_finished() {
        run(&[&["discover", "--for", "300ms"], &*network].concat(), b"");
    }
    let recorded = recorder.join().unwrap();
    assert_eq!(recorded.status, 0, "{recorded:?}");
    assert!(
        recorded.stderr.contains(" packets recorded, "),
        "{recorded:?}"
    );
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = fs::metadata(file.path()).unwrap().permissions().mode();
        assert_eq!(mode & 0o137, 0, "other users cannot read it: {mode:o}");
    }
    let decoded = run(&["decode", file.path(), "--port", port], b"");
    assert!(
        decoded.stdout.contains("QueryIdentification"),
        "{decoded:?}"
    );
    assert_eq!(decoded.status, 0, "{decoded:?}");
}

#[test]
fn an_existing_file_is_not_written_over_unless_told_so() {
    let file = File::new("precious");
    fs::write(file.path(), "precious").unwrap();
    let refused = run(
        &["record", file.path(), "--interface", "lo", "--for", "100ms"],
        b"",
    );
    assert!(refused.stderr.contains("add --overwrite"), "{refused:?}");
    assert_eq!(refused.status, 2);
    assert_eq!(fs::read(file.path()).unwrap(), b"precious");
}

#[test]
fn an_interface_that_is_not_there_is_refused_with_those_that_are() {
    let file = File::new("nowhere");
    let refused = run(&["record", file.path(), "--interface", "eth77"], b"");
    assert!(
        refused.stderr.contains("no network interface `eth77`"),
        "{refused:?}"
    );
    assert!(refused.stderr.contains("lo 127.0.0.1"), "{refused:?}");
    assert_eq!(refused.status, 2);
    assert!(!file.0.exists());
}

/// 42.1.1 queries the heartbeat of 101.1.1.
const QUERY: &[u8] = b"\x02\x00\x10\x00\x01\x01\x01\x65\x00\x01\x01\x2A\x00\x02\x22\x07\x00";

/// A capture with a query, a datagram that is not JAUS, and the query again.
#[expect(clippy::unwrap_used, reason = "writing to memory")]
fn capture() -> Vec<u8> {
    let mut file = Vec::new();
    let mut writer = CaptureWriter::new(&mut file, "test").unwrap();
    let on = writer.add_interface("eth0", LinkType::RAW).unwrap();
    for (i, payload) in [QUERY, b"noise", QUERY].into_iter().enumerate() {
        let mut packet = Vec::new();
        PacketBuilder::ipv4([10, 0, 0, 1], [10, 0, 0, 2], 16)
            .udp(3794, 3794)
            .write(&mut packet, payload)
            .unwrap();
        let time = Timestamp::new(1_000_000, i as u32 * 20_000_000, 9);
        writer.write(on, time, &packet).unwrap();
    }
    file
}

#[test]
fn a_capture_is_sent_again_to_where_it_is_told_and_nowhere_else() {
    let file = File::new("replayed");
    fs::write(file.path(), capture()).unwrap();
    let receiver = UdpSocket::bind("127.0.0.1:0").unwrap();
    receiver
        .set_read_timeout(Some(Duration::from_secs(10)))
        .unwrap();
    let to = receiver.local_addr().unwrap().to_string();
    let replayed = run(&["replay", file.path(), "--to", &to, "--loop", "2"], b"");
    assert!(
        replayed.stdout.contains("2 datagrams over 0.0 s"),
        "{replayed:?}"
    );
    assert!(replayed.stdout.contains("2 from 42.1.1"), "{replayed:?}");
    assert!(
        replayed.stdout.contains("left out: 1 that are not JAUS"),
        "{replayed:?}"
    );
    assert!(
        replayed.stdout.contains("4 datagrams sent to 127.0.0.1:"),
        "{replayed:?}"
    );
    assert_eq!((replayed.status, &*replayed.stderr), (0, ""));
    for _ in 0..4 {
        let mut datagram = [0; 100];
        let length = receiver.recv(&mut datagram).unwrap();
        assert_eq!(&datagram[..length], QUERY);
    }

    let nowhere = run(&["replay", file.path()], b"");
    assert!(nowhere.stderr.contains("--to <ADDRESS>"), "{nowhere:?}");
    let others = run(
        &["replay", file.path(), "--dry-run", "--from", "7.255.255"],
        b"",
    );
    assert!(
        others.stdout.contains("left out: 2 from other ids"),
        "{others:?}"
    );
    assert_eq!(others.status, 1);
}

#[test]
fn a_part_of_a_capture_is_chosen_by_time_and_filter_and_sent_from_other_ids() {
    let file = File::new("chosen");
    fs::write(file.path(), capture()).unwrap();
    let stdout = |flags: &[&str]| {
        let replayed = run(
            &[&["replay", file.path(), "--dry-run"], flags].concat(),
            b"",
        );
        assert_eq!(replayed.stderr, "");
        replayed.stdout
    };
    let first = stdout(&["--for", "10ms"]);
    assert!(first.contains("1 datagrams over"), "{first}");
    assert!(first.contains("2 before --start or after --for"), "{first}");
    let last = stdout(&["--start", "30ms", "--filter", "message=QueryHeartbeatPulse"]);
    assert!(last.contains("1 datagrams over"), "{last}");
    let none = stdout(&["--filter", "message=ReportStatus"]);
    assert!(none.contains("2 that do not match the filter"), "{none}");
    let renamed = stdout(&["--map", "42.1.1=43.7.9"]);
    assert!(renamed.contains("2 from 43.7.9"), "{renamed}");
    let wrong = run(&["replay", file.path(), "--dry-run", "--map", "42"], b"");
    assert!(
        wrong.stderr.contains("write 101.2.33=201.2.33 or 101=201"),
        "{wrong:?}"
    );
    assert_eq!(wrong.status, 2);
}
