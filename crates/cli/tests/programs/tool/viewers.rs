//! Recordings as MCAP, live viewers and the black box, with the real program.

use std::fs;
use std::net::{Ipv4Addr, UdpSocket};
use std::path::Path;

use crate::support::{Message, RAW, Running, ip_packet, own_group, pcap, run};
use futures_util::{SinkExt, StreamExt};
use jaus_test_kit::waiting::within_limit;
use serde_json::{Value as Json, json};
use socket2::SockRef;
use tokio_tungstenite::connect_async;
use tokio_tungstenite::tungstenite::Message as WebSocketMessage;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::HeaderValue;
use tokio_tungstenite::tungstenite::http::header::SEC_WEBSOCKET_PROTOCOL;

/// ReportStatus: EMERGENCY.
const EMERGENCY: &[u8] = b"\x02\x40\x05\0\0\0\0";

/// The group and the port of a test, as flags of commands that record.
fn recorded(network: &[String]) -> Vec<String> {
    let port = network[4].rsplit(':').next().unwrap();
    ["--interface", "lo", "--group", &network[4], "--port", port]
        .map(str::to_owned)
        .to_vec()
}

fn path(directory: &Path, name: &str) -> String {
    directory.join(name).to_str().unwrap().to_owned()
}

#[test]
fn a_capture_becomes_mcap_and_pcapng_again_and_all_three_read_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let [capture, mcap, back] =
        ["a.pcap", "b.mcap", "c.pcapng"].map(|name| path(folder.path(), name));
    let packets = [EMERGENCY, b"\x02\x22", b"\x00\x2B\x02"];
    let packets = packets.map(|payload| ip_packet(&Message::new(payload).datagram()));
    fs::write(&capture, pcap(RAW, &packets)).unwrap();
    for (from, to) in [(&capture, &mcap), (&mcap, &back)] {
        let converted = run(&["convert", from, to], b"");
        assert!(converted.stdout.contains("3 frames in"), "{converted:?}");
        assert_eq!((converted.status, &*converted.stderr), (0, ""));
    }
    let decoded = [&capture, &mcap, &back].map(|file| run(&["decode", file], b"").json());
    let without_time = |lines: &[Json]| {
        let mut lines = lines.to_vec();
        for line in &mut lines {
            line.as_object_mut().unwrap().remove("time");
        }
        lines
    };
    assert_eq!(decoded[0].len(), 3);
    assert_eq!(decoded[0], decoded[1]);
    // pcapng has nanoseconds where pcap has microseconds.
    assert_eq!(without_time(&decoded[1]), without_time(&decoded[2]));
    let replayed = run(&["replay", &mcap, "--dry-run"], b"");
    assert!(replayed.stdout.contains("3 datagrams over"), "{replayed:?}");
    let watched = run(&["watch", &mcap, "--json"], b"");
    assert_eq!(watched.json()[0]["body"]["Status"], "EMERGENCY");
    let itself = run(&["convert", &mcap, &mcap, "--overwrite"], b"");
    assert!(
        itself.stderr.contains("cannot be converted to itself"),
        "{itself:?}"
    );
    assert_eq!(itself.status, 2);
}

#[cfg(unix)]
#[test]
fn a_recording_that_is_written_over_is_a_file_of_its_own() {
    use std::os::unix::fs::{PermissionsExt as _, symlink};

    let folder = tempfile::tempdir().unwrap();
    let [capture, victim, link, open] =
        ["a.pcap", "victim", "link.pcapng", "open.pcapng"].map(|name| path(folder.path(), name));
    let packet = ip_packet(&Message::new(EMERGENCY).datagram());
    fs::write(&capture, pcap(RAW, &[packet])).unwrap();
    fs::write(&victim, "precious").unwrap();
    symlink(&victim, &link).unwrap();
    fs::write(&open, "").unwrap();
    fs::set_permissions(&open, fs::Permissions::from_mode(0o666)).unwrap();
    for to in [&link, &open] {
        let converted = run(&["convert", &capture, to, "--overwrite"], b"");
        assert_eq!(converted.status, 0, "{converted:?}");
        let written = fs::symlink_metadata(to).unwrap();
        assert!(written.is_file() && written.len() > 0, "{to}");
        let mode = written.permissions().mode();
        assert_eq!(mode & 0o137, 0, "other users have it: {mode:o}");
    }
    assert_eq!(fs::read(&victim).unwrap(), b"precious");
}

#[test]
fn a_recording_of_another_kind_is_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let [text, mcap] = ["a.txt", "b.mcap"].map(|name| path(folder.path(), name));
    fs::write(&text, "no recording").unwrap();
    let refused = run(&["convert", &text, &mcap], b"");
    assert!(
        refused.stderr.contains("not a pcap or pcapng file"),
        "{refused:?}"
    );
    assert_eq!(refused.status, 2);
    assert!(!Path::new(&mcap).exists());
    let cut = [b"\x89MCAP0\r\n".as_slice(), b"\x01\x10"].concat();
    fs::write(&mcap, cut).unwrap();
    let cut = run(&["decode", &mcap], b"");
    assert!(cut.stdout.contains("truncated"), "{cut:?}");
    assert_eq!(cut.status, 1);
}

/// Runs a black box in a directory until an operator's file is written, and kills it at once.
fn file_of_a_killed_black_box(directory: &Path, format: &str) -> String {
    let network = own_group();
    let recorded = recorded(&network);
    let place = directory.to_str().unwrap();
    let black_box = [
        place, "--last", "1min", "--after", "1h", "--json", "--format", format,
    ];
    let recorded = recorded.iter().map(String::as_str);
    let flags: Vec<&str> = black_box.into_iter().chain(recorded).collect();
    let mut running = Running::command("record", &flags);
    running.read_until("keeping");
    let network: Vec<&str> = network.iter().map(String::as_str).collect();
    // A node queries the group when it starts.
    run(&[&["discover", "--for", "300ms"], &*network].concat(), b"");
    running.signal("-USR1");
    let written = running.read_until("\"written\"");
    running.signal("-KILL");
    let written: Json = serde_json::from_str(written.lines().last().unwrap()).unwrap();
    assert!(written["packets"].as_u64().unwrap() > 0, "{written}");
    written["file"].as_str().unwrap().to_owned()
}

#[test]
fn a_file_of_the_black_box_is_whole_even_if_the_program_is_killed_at_once() {
    for format in ["pcapng", "mcap"] {
        let folder = tempfile::tempdir().unwrap();
        let file = file_of_a_killed_black_box(folder.path(), format);
        assert!(file.ends_with(&format!("-operator.{format}")), "{file}");
        let names = fs::read_dir(folder.path()).unwrap();
        let names = names.map(|it| it.unwrap().file_name());
        let names = names.filter(|name| name != ".black-box.lock");
        assert_eq!(names.count(), 1, "nothing half-written remains");
        let decoded = run(&["decode", &file], b"");
        assert!(
            decoded.stdout.contains("QueryIdentification"),
            "{decoded:?}"
        );
        // Other tests send what is no message; each frame must be readable to the end of the file.
        let copy = path(folder.path(), "copy.pcapng");
        let converted = run(&["convert", &file, &copy], b"");
        assert_eq!((converted.status, &*converted.stderr), (0, ""));
    }
}

/// Sends a query of each of these components of 66.1 to a group on loopback.
fn send_from(components: &[u32], group: &str) {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let loopback = Ipv4Addr::LOCALHOST;
    SockRef::from(&socket)
        .set_multicast_if_v4(&loopback)
        .unwrap();
    for component in components {
        let message = Message {
            source: 66 << 16 | 0x0100 | component,
            ..Message::new(b"\x02\x22")
        };
        socket.send_to(&message.datagram(), group).unwrap();
    }
}

#[test]
fn triggers_while_a_file_is_pending_are_counted_and_not_printed() {
    let folder = tempfile::tempdir().unwrap();
    let network = own_group();
    let recorded = recorded(&network);
    let place = folder.path().to_str().unwrap();
    let black_box = [place, "--last", "1min", "--after", "1h", "--json"];
    let trigger = ["--on-message", "from=66"];
    let recorded = recorded.iter().map(String::as_str);
    let flags: Vec<&str> = black_box
        .into_iter()
        .chain(trigger)
        .chain(recorded)
        .collect();
    let mut running = Running::command("record", &flags);
    running.read_until("keeping");
    send_from(&[1, 2, 3, 2, 1], &network[4]);
    let mut printed = running.read_until("\"written\"");
    running.signal("-INT");
    printed += &running.read_until("\"triggers\":3");
    let count = |event: &str| printed.matches(&format!("\"event\":\"{event}\"")).count();
    assert_eq!((count("trigger"), count("written")), (1, 2), "{printed}");
    let written: Json = serde_json::from_str(printed.lines().last().unwrap()).unwrap();
    for number in ["lost", "left_out", "deleted"] {
        assert!(written[number].is_u64(), "{written}");
    }
}

#[test]
fn a_second_black_box_in_a_directory_is_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let network = own_group();
    let recorded = recorded(&network);
    let place = folder.path().to_str().unwrap();
    let recorded = recorded.iter().map(String::as_str);
    let flags: Vec<&str> = [place, "--last", "1min"]
        .into_iter()
        .chain(recorded)
        .collect();
    let mut first = Running::command("record", &flags);
    first.read_until("stay in memory");
    let second = run(&[&["record", "--for", "1s"], &*flags].concat(), b"");
    assert!(
        second.stderr.contains("name another directory"),
        "{second:?}"
    );
    assert_eq!(second.status, 2);
}

#[test]
fn flags_of_the_black_box_need_it_and_unknown_triggers_are_refused() {
    let alone = run(&["record", "a.pcapng", "--on", "emergency"], b"");
    assert!(alone.stderr.contains("--last"), "{alone:?}");
    assert_eq!(alone.status, 2);
    let wrong = run(&["record", "a", "--last", "1min", "--on", "fire"], b"");
    assert!(
        wrong.stderr.contains("emergency, fault, control-lost"),
        "{wrong:?}"
    );
    assert_eq!(wrong.status, 2);
}

#[tokio::test]
async fn a_viewer_that_connects_after_the_traffic_gets_its_channels_and_latest_messages() {
    let network = own_group();
    let network: Vec<&str> = network.iter().map(String::as_str).collect();
    let view = ["--interface", "lo", "--group", network[4]];
    // Packets of other tests pass on the interface, too.
    let only = ["--filter", "from=111.1.7", "--listen", "127.0.0.1:0"];
    let mut running = Running::command("view", &[&view[..], &only].concat());
    let said = running.read_until("ws://");
    let mut words = said.split_whitespace();
    let url = words.find(|it| it.starts_with("ws://")).unwrap();
    let discover = ["discover", "--for", "300ms", "--id", "111.1.7"];
    run(&[&discover[..], &network].concat(), b"");
    let mut request = url.into_client_request().unwrap();
    let subprotocol = HeaderValue::from_static("foxglove.sdk.v1");
    request
        .headers_mut()
        .insert(SEC_WEBSOCKET_PROTOCOL, subprotocol);
    let (mut socket, _) = connect_async(request).await.unwrap();
    loop {
        let message = within_limit(socket.next()).await.unwrap().unwrap();
        match message {
            WebSocketMessage::Text(text) => {
                let text: Json = serde_json::from_str(&text).unwrap();
                let channels = text["channels"].as_array().into_iter().flatten();
                for channel in channels.filter(|it| is_query(it)) {
                    let subscription = json!({ "id": 7, "channelId": channel["id"] });
                    let subscribe = json!({ "op": "subscribe", "subscriptions": [subscription] });
                    let subscribe = WebSocketMessage::text(subscribe.to_string());
                    socket.send(subscribe).await.unwrap();
                }
            }
            WebSocketMessage::Binary(sample) => {
                assert_eq!(&sample[..5], b"\x01\x07\0\0\0");
                break;
            }
            _ => {}
        }
    }
}

fn is_query(channel: &Json) -> bool {
    channel["topic"] == "/jaus/111/1/7/QueryIdentification"
}

#[test]
fn an_address_that_is_taken_is_refused_with_the_flag_that_helps() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let refused = run(&["view", "--interface", "lo", "--listen", &address], b"");
    assert!(refused.stderr.contains("--listen"), "{refused:?}");
    assert_eq!(refused.status, 2);
}
