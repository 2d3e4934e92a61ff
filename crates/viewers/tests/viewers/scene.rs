//! A recording, a server with a channel, and clients.

use std::net::{IpAddr, SocketAddr};

use futures_util::{SinkExt, StreamExt};
use jaus_test_kit::waiting::within_limit;
use jaus_view::{Dictionary, Entry, Frame, LinkType, Network, Timestamp};
use jaus_viewers::{Channels, McapRecorder, Server, ServerSettings, Sharing};
use serde_json::{Value as Json, json};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinHandle;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::HeaderValue;
use tokio_tungstenite::tungstenite::http::header::SEC_WEBSOCKET_PROTOCOL;
use tokio_tungstenite::{WebSocketStream, client_async};

pub fn dictionary() -> Dictionary {
    Dictionary::of(jaus_vehicle::messages::registry()).with_catalogue()
}

/// 42.1.1 queries the heartbeat of 101.1.1.
const QUERY: &[u8] = b"\x02\x00\x10\x00\x01\x01\x01\x65\x00\x01\x01\x2A\x00\x02\x22\x07\x00";

/// The time of a status whose reserved field is 0, in nanoseconds since 1970.
pub const TIME: u64 = 1_790_000_000_000_000_000;

/// An MCAP recording of this many frames.
pub fn recording(count: u32) -> Vec<u8> {
    let mut packet = Vec::new();
    etherparse::PacketBuilder::ipv4([10, 0, 0, 1], [10, 0, 0, 2], 16)
        .udp(3794, 3794)
        .write(&mut packet, QUERY)
        .unwrap();
    let dictionary = dictionary();
    let mut file = Vec::new();
    let mut recorder = McapRecorder::new(&mut file, &dictionary, Network::by_content()).unwrap();
    for number in 0..count {
        let frame = Frame {
            time: Some(Timestamp::new(1_790_000_000 + i64::from(number), 0, 9)),
            link: LinkType::RAW,
            octets: &packet,
            lost: 0,
            length: packet.len() as u32,
            interface: "eth0",
        };
        recorder.write_frame(&frame).unwrap();
    }
    recorder.finish().unwrap();
    file
}

/// A server whose channels are those of statuses.
pub struct Scene {
    pub address: SocketAddr,
    pub sharing: Sharing,
    dictionary: Dictionary,
    serving: JoinHandle<()>,
}

impl Scene {
    pub async fn new() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let (server, sharing) = Server::new(ServerSettings::new("test").session("1"));
        Self {
            address,
            sharing,
            dictionary: dictionary(),
            serving: tokio::spawn(async {
                let never = server.serve(listener).await;
                match never {}
            }),
        }
    }

    pub fn channels(&self) -> Channels<'_> {
        Channels::live(&self.dictionary)
    }

    /// Publishes a status of a component, whose time is [`TIME`] plus `reserved`.
    pub fn publish(&self, channels: &mut Channels<'_>, source: &str, reserved: u32) {
        let time = TIME + u64::from(reserved);
        assert!(self.publish_from(channels, (source, None), time, reserved));
    }

    /// The same for a component at a network address, at a time; returns whether it has a channel.
    pub fn publish_from(
        &self,
        channels: &mut Channels<'_>,
        (source, from): (&str, Option<IpAddr>),
        time: u64,
        reserved: u32,
    ) -> bool {
        let status = json!({
            "source": source, "code": "4002", "message": "ReportStatus",
            "service": "urn:jaus:jss:core:Management",
            "body": { "Status": "READY", "Reserved": reserved },
        });
        let Json::Object(object) = status else {
            return false;
        };
        let samples = channels.handle_entry(&Entry::of_object(object), from, time);
        self.sharing.publish(channels, &samples);
        samples.len() == 1
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        self.serving.abort();
    }
}

/// A viewer.
pub struct Viewer {
    pub socket: WebSocketStream<TcpStream>,
}

impl Viewer {
    pub async fn connect(scene: &Scene) -> Self {
        let stream = TcpStream::connect(scene.address).await.unwrap();
        let url = format!("ws://{}", scene.address);
        let mut request = url.into_client_request().unwrap();
        let subprotocol = HeaderValue::from_static("foxglove.websocket.v1");
        request
            .headers_mut()
            .insert(SEC_WEBSOCKET_PROTOCOL, subprotocol);
        let connected = within_limit(client_async(request, stream)).await;
        let (socket, response) = connected.unwrap();
        let chosen = &response.headers()[SEC_WEBSOCKET_PROTOCOL];
        assert_eq!(chosen, "foxglove.websocket.v1");
        Self { socket }
    }

    /// A viewer that has subscribed to the only channel, with the number 7, and has received its
    /// latest sample.
    pub async fn subscribed(scene: &Scene) -> Self {
        let mut viewer = Self::subscribing(scene).await;
        viewer.sample().await;
        viewer
    }

    /// A viewer that subscribes to the only channel, with the number 7.
    pub async fn subscribing(scene: &Scene) -> Self {
        let mut viewer = Self::connect(scene).await;
        assert_eq!(viewer.text().await["op"], "serverInfo");
        let advertised = viewer.text().await;
        assert_eq!(advertised["op"], "advertise");
        let subscription = json!({ "id": 7, "channelId": advertised["channels"][0]["id"] });
        let subscriptions = json!({ "op": "subscribe", "subscriptions": [subscription] });
        viewer.say(&subscriptions).await;
        viewer
    }

    /// Waits until the requests so far are in effect: a mistake is answered after them.
    pub async fn settle(&mut self) {
        self.say(&json!({ "op": "subscribe" })).await;
        while self.text().await["op"] != "status" {}
    }

    pub async fn say(&mut self, request: &Json) {
        let text = Message::text(request.to_string());
        within_limit(self.socket.send(text)).await.unwrap();
    }

    /// The next message that is no ping.
    pub async fn next(&mut self) -> Message {
        loop {
            let message = within_limit(self.socket.next()).await;
            match message.unwrap().unwrap() {
                Message::Ping(_) => {}
                other => return other,
            }
        }
    }

    pub async fn text(&mut self) -> Json {
        match self.next().await {
            Message::Text(text) => serde_json::from_str(&text).unwrap(),
            other => panic!("no text: {other:?}"),
        }
    }

    /// The next sample: its subscription, time and value.
    pub async fn sample(&mut self) -> (u32, u64, Json) {
        loop {
            if let Message::Binary(data) = self.next().await {
                let (head, value) = data.split_at(13);
                assert_eq!(head[0], 1);
                let subscription = u32::from_le_bytes(head[1..5].try_into().unwrap());
                let time = u64::from_le_bytes(head[5..].try_into().unwrap());
                return (subscription, time, serde_json::from_slice(value).unwrap());
            }
        }
    }
}
