//! Another user of the host takes the page's port while the station restarts.

use std::io::{Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::{self, Receiver};
use std::thread;

use tokio_tungstenite::tungstenite::handshake::derive_accept_key;

use super::browser::{Browser, SCREENS};
use super::by_hand::Running;

/// The number of this test's multicast group.
const TEST: u8 = 26;

/// The open page shows the stranger nothing of use and believes nothing that it says. When the station is back, the
/// page goes on by itself, and also when it is loaded again without the token in its address.
pub(crate) fn run() {
    let (_vehicle, _) = Running::start(TEST, "jaus", &["vehicle", "--name", "G-Bat"], "Ctrl-C");
    let (station, address) = Running::station(TEST, &["--listen", "127.0.0.1:0"]);
    let (place, token) = address.split_once("/#token=").unwrap();
    let listen = place.strip_prefix("http://").unwrap();
    let mut page = Browser::start(None);
    page.look_on(SCREENS[0]);
    page.open(&address);
    page.wait("document.body.dataset.link === 'live'");

    drop(station);
    let heard = stranger(listen);
    page.wait("!document.querySelector('#token-sheet').hidden");
    let said = page.text("#token-text");
    assert!(said.contains("does not prove"), "{said}");
    page.screenshot("stranger");
    page.wait("document.body.dataset.link === 'lost'");
    let heard: Vec<String> = heard.try_iter().collect();
    assert!(heard.iter().any(|it| it.starts_with("GET /ws?")));
    let shown = heard.join("\n");
    assert!(!shown.contains(token), "{shown}");
    let kept = page.value("JSON.stringify({ ...sessionStorage, ...localStorage })");
    assert!(!kept.to_string().contains(token), "{kept}");
    // The stranger goes with this.
    let quit = TcpStream::connect(listen)
        .unwrap()
        .write_all(b"QUIT\r\n\r\n");
    quit.unwrap();

    let (_station, _) = Running::station(TEST, &["--listen", listen]);
    for _ in 0..2 {
        page.wait("document.body.dataset.link === 'live'");
        page.wait("document.querySelector('#token-sheet').hidden");
        page.wait("!document.querySelector('#by-hand').hidden");
        page.open(place);
    }
}

/// A program that listens in place of the station, and says what a page wants to hear. Returns what it is told.
fn stranger(listen: &str) -> Receiver<String> {
    let listener = TcpListener::bind(listen).unwrap();
    let (sender, heard) = mpsc::channel();
    thread::spawn(move || {
        let mut open = Vec::new();
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let head = head_of(&mut stream);
            if head.starts_with("QUIT") {
                return;
            }
            // The browser may have gone.
            let _ = stream.write_all(&answer(&head));
            let _ = sender.send(head);
            open.push(stream);
            open.drain(..open.len().saturating_sub(16));
        }
    });
    heard
}

fn head_of(stream: &mut TcpStream) -> String {
    let mut head = Vec::new();
    let mut octet = [0];
    while !head.ends_with(b"\r\n\r\n") && stream.read(&mut octet).is_ok_and(|it| it > 0) {
        head.push(octet[0]);
    }
    String::from_utf8(head).unwrap()
}

fn answer(head: &str) -> Vec<u8> {
    let header = |name: &str| {
        let line = head.lines().find_map(|it| it.strip_prefix(name));
        line.map(str::trim)
    };
    let Some(key) = header("Sec-WebSocket-Key:") else {
        let body = r#"{"users":false,"run":"00112233445566778899aabbccddeeff"}"#;
        let length = body.len();
        return format!(
            "HTTP/1.1 200 OK\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{body}"
        )
        .into_bytes();
    };
    let accept = derive_accept_key(key.as_bytes());
    let mut answer = format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Accept: {accept}\r\nSec-WebSocket-Protocol: jaus.4\r\n\r\n"
    )
    .into_bytes();
    let hello = r#"{"type":"hello","page":1,"token_needed":false,"watch":true}"#;
    answer.extend([0x81, u8::try_from(hello.len()).unwrap()]);
    answer.extend(hello.as_bytes());
    answer
}
