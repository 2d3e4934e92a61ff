//! The station's program, and the station's ends of the pages' connections.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::{Arc, Mutex};

use futures_util::{SinkExt, StreamExt};
use jaus::component::Kind;
use jaus::link::custom::CustomLink;
use jaus::node::{Config, Node};
use jaus_ocu::{Station, Token};
use jaus_vehicle::parts::Slot;
use tokio::io::{DuplexStream, duplex};
use tokio::sync::mpsc;
use tokio_tungstenite::client_async;
use tokio_tungstenite::tungstenite::{ClientRequestBuilder, Message};

use crate::browser::TOKEN;
use crate::cable::{Connection, Frame};

/// What the station has to say, with the page's number.
type Said = Arc<Mutex<Vec<(usize, Connection, Frame)>>>;

/// The connections of a running station.
pub(crate) struct StationProgram {
    browsers: mpsc::Sender<(DuplexStream, SocketAddr)>,
    /// What the pages have said, by connection.
    heard: Vec<(usize, Connection, mpsc::UnboundedSender<Frame>)>,
    said: Said,
}

/// Octets that a connection buffers.
const BUFFER: usize = 65_536;

impl StationProgram {
    /// Starts the station's program on the current runtime.
    pub(crate) fn start(vehicles: &[u16], link: Box<dyn CustomLink>) -> Self {
        let node = Node::start_with(Config::new(42, 1).without_udp(), vec![link]).expect("a node");
        let port = node.attach(1).expect("a free id");
        let slot = Slot::new(port, node, Kind::OperatorControlUnit, "Operator");
        let station = Station {
            vehicles: vehicles.to_vec(),
            token: Token::new(TOKEN),
            ..Station::default()
        };
        let (browsers, accepted) = mpsc::channel(64);
        tokio::spawn(async move {
            let Err(error) = station.run_in_memory(slot, accepted).await;
            panic!("the station has ended: {error}");
        });
        Self {
            browsers,
            heard: Vec::new(),
            said: Said::default(),
        }
    }

    /// Takes a frame of a page. Call it on the station's runtime.
    pub(crate) fn handle(&mut self, page: usize, connection: Connection, frame: Frame) {
        if let Frame::Open(path, protocols) = frame {
            let (heard, frames) = mpsc::unbounded_channel();
            self.heard.push((page, connection, heard));
            let (browser, server) = duplex(BUFFER);
            let address = SocketAddr::from((Ipv4Addr::new(10, 0, 0, page as u8 + 1), 9999));
            // There are never as many at once.
            let _ = self.browsers.try_send((server, address));
            let said = Arc::clone(&self.said);
            let say = move |frame| {
                let mut said = said.lock().expect("no panic");
                said.push((page, connection, frame));
            };
            tokio::spawn(carry(browser, request(&path, &protocols), frames, say));
            return;
        }
        self.heard.retain(|(.., heard)| !heard.is_closed());
        let known = |it: &&(usize, Connection, _)| (it.0, it.1) == (page, connection);
        if let Some((.., heard)) = self.heard.iter().find(known) {
            // On error the station has closed the connection.
            let _ = heard.send(frame);
        }
    }

    /// What the station has said to its pages.
    pub(crate) fn take_said(&self) -> Vec<(usize, Connection, Frame)> {
        std::mem::take(&mut *self.said.lock().expect("no panic"))
    }
}

/// The request of a browser for a WebSocket.
fn request(path: &str, protocols: &[String]) -> ClientRequestBuilder {
    let address = format!("ws://localhost{path}");
    let request = ClientRequestBuilder::new(address.parse().expect("a path of the page"));
    let add = |request: ClientRequestBuilder, word: &String| request.with_sub_protocol(word);
    protocols.iter().fold(request, add)
}

/// Carries the frames of one connection between the page's end and the server.
async fn carry(
    browser: DuplexStream,
    request: ClientRequestBuilder,
    mut frames: mpsc::UnboundedReceiver<Frame>,
    say: impl Fn(Frame),
) {
    let Ok((mut socket, _)) = client_async(request, browser).await else {
        return say(Frame::Close);
    };
    say(Frame::Opened);
    loop {
        tokio::select! {
            frame = frames.recv() => match frame {
                Some(Frame::Text(text)) => if socket.send(Message::text(text)).await.is_err() {
                    return say(Frame::Close);
                },
                // Dropping the stream closes the connection.
                _ => return,
            },
            message = socket.next() => match message {
                Some(Ok(Message::Text(text))) => say(Frame::Text(text.as_str().to_owned())),
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                _ => return say(Frame::Close),
            },
        }
    }
}
