//! Hostile viewers: each has a defined end, and the others get their samples.

use futures_util::{SinkExt, StreamExt};
use jaus_test_kit::evidence::{not_tested, this_test};
use jaus_test_kit::waiting::{until, within_limit};
use jaus_viewers::MOST_CLIENTS;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio_tungstenite::client_async;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::HeaderValue;
use tokio_tungstenite::tungstenite::http::header::SEC_WEBSOCKET_PROTOCOL;

use crate::scene::{Scene, Viewer};

/// Sends octets, and returns all that comes back until the server closes the connection.
async fn answer_to(scene: &Scene, octets: &[u8]) -> String {
    let mut stream = TcpStream::connect(scene.address).await.unwrap();
    stream.write_all(octets).await.unwrap();
    let mut answer = Vec::new();
    // It may be reset instead of closed.
    let _ = within_limit(stream.read_to_end(&mut answer)).await;
    String::from_utf8_lossy(&answer).into_owned()
}

fn request(headers: &str) -> Vec<u8> {
    format!(
        "GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\n{headers}\r\n"
    )
    .into_bytes()
}

/// That the server still serves.
async fn assert_alive(scene: &Scene) {
    let mut viewer = Viewer::connect(scene).await;
    assert_eq!(viewer.text().await["op"], "serverInfo");
}

#[tokio::test]
async fn an_invalid_handshake_is_refused_with_the_reason() {
    let scene = Scene::new().await;
    let no_subprotocol = answer_to(&scene, &request("")).await;
    assert!(
        no_subprotocol.starts_with("HTTP/1.1 400"),
        "{no_subprotocol}"
    );
    assert!(
        no_subprotocol.contains("foxglove.websocket.v1"),
        "{no_subprotocol}"
    );
    let origin =
        "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\nOrigin: https://evil.example\r\n";
    let foreign = answer_to(&scene, &request(origin)).await;
    assert!(foreign.starts_with("HTTP/1.1 403"), "{foreign}");
    answer_to(&scene, b"\x16\x03\x01 no HTTP at all \r\n\r\n").await;
    answer_to(&scene, b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n").await;
    let endless = [&b"GET / HTTP/1.1\r\n"[..], &b"X: y\r\n".repeat(100_000)].concat();
    answer_to(&scene, &endless).await;
    assert_alive(&scene).await;
}

#[tokio::test(start_paused = true)]
async fn a_handshake_that_does_not_end_frees_its_place() {
    let scene = Scene::new().await;
    let mut open = Vec::new();
    for _ in 0..MOST_CLIENTS / 2 {
        let mut stream = TcpStream::connect(scene.address).await.unwrap();
        stream.write_all(b"GET / HT").await.unwrap();
        open.push(stream);
    }
    let refused = answer_to(&scene, b"").await;
    assert!(refused.starts_with("HTTP/1.1 503"), "{refused}");
    // Virtual time: the deadline passes while the server waits.
    for mut stream in open {
        let mut rest = Vec::new();
        let _ = within_limit(stream.read_to_end(&mut rest)).await;
    }
    tokio::time::resume();
    assert_alive(&scene).await;
}

#[tokio::test]
async fn a_huge_frame_ends_the_connection_that_sent_it() {
    let scene = Scene::new().await;
    let mut channels = scene.channels();
    scene.publish(&mut channels, "101.1.1", 0);
    let mut giant = Viewer::connect(&scene).await;
    until(|| scene.sharing.clients() == 1).await;
    // The server may end the connection before all of it is sent.
    let text = Message::text("x".repeat(8 << 20));
    let _ = within_limit(giant.socket.send(text)).await;
    while let Some(Ok(_)) = within_limit(giant.socket.next()).await {}
    until(|| scene.sharing.clients() == 0).await;
    assert_alive(&scene).await;
}

#[tokio::test]
async fn invalid_requests_get_a_warning_and_change_nothing() {
    let scene = Scene::new().await;
    let mut channels = scene.channels();
    scene.publish(&mut channels, "101.1.1", 0);
    let mut viewer = Viewer::subscribed(&scene).await;
    for octets in [&b"\x01"[..], &[], &[0xFF; 1000]] {
        let binary = Message::binary(octets.to_vec());
        within_limit(viewer.socket.send(binary)).await.unwrap();
    }
    let deep = "[".repeat(10_000);
    within_limit(viewer.socket.send(Message::text(deep)))
        .await
        .unwrap();
    assert_eq!(viewer.text().await["op"], "status");
    scene.publish(&mut channels, "101.1.1", 9);
    assert_eq!(viewer.sample().await.2["Reserved"], 9);
}

/// A viewer whose kernel takes little for it, so that not reading shows soon.
async fn unread(scene: &Scene) -> Viewer {
    let socket = TcpSocket::new_v4().unwrap();
    socket.set_recv_buffer_size(4096).unwrap();
    let stream = socket.connect(scene.address).await.unwrap();
    let url = format!("ws://{}", scene.address);
    let mut request = url.into_client_request().unwrap();
    let subprotocol = HeaderValue::from_static("foxglove.sdk.v1");
    request
        .headers_mut()
        .insert(SEC_WEBSOCKET_PROTOCOL, subprotocol);
    let (socket, _) = client_async(request, stream).await.unwrap();
    Viewer { socket }
}

#[tokio::test]
async fn a_viewer_that_never_reads_loses_samples_and_others_lose_none() {
    let scene = Scene::new().await;
    let mut channels = scene.channels();
    scene.publish(&mut channels, "101.1.1", 0);
    let mut lazy = unread(&scene).await;
    let subscription = serde_json::json!({ "id": 1, "channelId": 0 });
    lazy.say(&serde_json::json!({ "op": "subscribe", "subscriptions": [subscription] }))
        .await;
    let mut good = Viewer::subscribed(&scene).await;
    let mut number = 0;
    while scene.sharing.lost() == 0 {
        number += 1;
        scene.publish(&mut channels, "101.1.1", number);
        let (_, _, value) = good.sample().await;
        assert_eq!(value["Reserved"], number);
    }
    // Publishing has not waited. The lazy one gets a warning when it reads.
    loop {
        let message = within_limit(lazy.socket.next()).await.unwrap().unwrap();
        let is_told = message
            .to_text()
            .is_ok_and(|it| it.contains("messages lost"));
        if is_told {
            break;
        }
    }
}

/// They reach the port of loopback, although the debug view is closed to them.
#[cfg(target_os = "linux")]
#[tokio::test]
async fn another_user_of_the_host_sees_nothing_and_takes_no_place() {
    let scene = Scene::new().await;
    let port = scene.address.port();
    let ask = format!(
        "for _ in $(seq {MOST_CLIENTS}); do exec {{c}}<>/dev/tcp/127.0.0.1/{port}; head -1 <&$c; done"
    );
    let nobody = ["--reuid=65534", "--regid=65534", "--clear-groups"];
    let mut command = tokio::process::Command::new("setpriv");
    let asked = command.args(nobody).args(["bash", "-c", &ask]).output();
    match within_limit(asked).await {
        Ok(output) if output.status.success() => {
            let answers = String::from_utf8_lossy(&output.stdout).into_owned();
            assert_eq!(answers.lines().count(), MOST_CLIENTS, "{answers}");
            let is_refused = |it: &str| it.starts_with("HTTP/1.1 403");
            assert!(answers.lines().all(is_refused), "{answers}");
        }
        _ => not_tested(&this_test(), "it takes root, setpriv and bash"),
    }
    assert_alive(&scene).await;
}
