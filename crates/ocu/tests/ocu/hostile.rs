//! Hostile pages: each gets a defined answer, and well-behaved pages are not affected.

use std::net::Ipv4Addr;

use futures_util::{SinkExt, StreamExt};
use jaus_ocu::{Listen, Station, Token};
use jaus_test_kit::waiting::within_limit;
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio_tungstenite::client_async;
use tokio_tungstenite::tungstenite::protocol::CloseFrame;
use tokio_tungstenite::tungstenite::{Error, Message};

use crate::scene::{Page, Scene, driver_of};

const TOKEN: &str = "correct-horse-battery";

async fn guarded(token_to_read: bool) -> Scene {
    Scene::with(
        Station {
            token: Token::new(TOKEN),
            token_to_read,
            ..Station::default()
        },
        0,
    )
    .await
}

/// Sends a plain HTTP request. Returns the complete response.
pub(crate) async fn get(scene: &Scene, path: &str, header: &str) -> String {
    let mut stream = TcpStream::connect(scene.address).await.unwrap();
    let request = format!("GET {path} HTTP/1.1\r\n{header}Connection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).await.unwrap();
    let mut answer = Vec::new();
    within_limit(stream.read_to_end(&mut answer)).await.unwrap();
    String::from_utf8_lossy(&answer).into_owned()
}

async fn health(scene: &Scene) -> Value {
    let answer = get(scene, "/health", "Host: localhost\r\n").await;
    let body = answer.split("\r\n\r\n").nth(1).unwrap();
    serde_json::from_str(body).unwrap()
}

/// The close frame with which the station ends a connection.
async fn parting(page: &mut Page) -> CloseFrame {
    loop {
        match within_limit(page.socket.next()).await {
            Some(Ok(Message::Close(Some(frame)))) => return frame,
            Some(Ok(_)) => {}
            other => panic!("no close frame: {other:?}"),
        }
    }
}

#[tokio::test]
async fn without_the_token_a_page_may_look_and_stop_and_nothing_else_not_even_by_guessing() {
    let scene = guarded(false).await;
    let mut page = scene.page().await;
    assert_eq!(page.hello["token_needed"], true);
    assert_eq!(page.hello["watch"], true);
    page.until(|state| driver_of(state)["state"] == "standby")
        .await;
    for request in [
        json!({"type": "control", "on": true}),
        json!({"type": "emergency", "on": false}),
        json!({"type": "resume"}),
        json!({"type": "emergency_all", "on": false}),
    ] {
        let refused = page.ask(request).await.unwrap_err();
        assert!(refused.contains("token"), "{refused}");
    }
    page.ask(json!({"type": "emergency", "on": true}))
        .await
        .unwrap();
    page.until(|state| state["vehicle"]["emergency"] == true)
        .await;
    let wrong = json!({"type": "token", "token": "correct-horse-batterz"});
    assert_eq!(page.ask(wrong).await.unwrap_err(), "wrong token");
    page.ask(json!({"type": "control", "on": true}))
        .await
        .unwrap_err();
    assert_eq!(health(&scene).await["wrong_tokens"], 1);
    assert!(!scene.is_controlled());

    page.ask(json!({"type": "token", "token": TOKEN}))
        .await
        .unwrap();
    page.ask(json!({"type": "emergency", "on": false}))
        .await
        .unwrap();
    page.until(|state| driver_of(state)["state"] == "standby")
        .await;
    page.ask(json!({"type": "control", "on": true}))
        .await
        .unwrap();
}

#[tokio::test]
async fn who_guesses_five_times_is_shown_the_door() {
    let scene = guarded(false).await;
    let mut page = scene.page().await;
    for _ in 0..5 {
        page.say(&json!({"type": "token", "token": "0123456789abcdef"}))
            .await;
    }
    assert_eq!(
        parting(&mut page).await.reason.as_str(),
        "too many wrong tokens"
    );
    assert_eq!(health(&scene).await["wrong_tokens"], 5);
}

#[tokio::test]
async fn if_looking_needs_the_token_nothing_is_shown_before() {
    let scene = guarded(true).await;
    let mut page = scene.page().await;
    assert_eq!(page.hello["watch"], false);
    for request in [
        json!({"type": "control", "on": true, "id": 1}),
        json!({"type": "emergency", "on": true, "id": 1}),
        json!({"type": "messages", "on": true, "id": 1}),
    ] {
        page.say(&request).await;
        assert_eq!(page.next().await["type"], "refused", "and no state before");
    }
    let tile = get(&scene, "/base-map", "Host: localhost\r\n").await;
    assert!(tile.starts_with("HTTP/1.1 401"), "{tile}");
    let map = get(&scene, "/map/101/1", "Host: localhost\r\n").await;
    assert!(map.starts_with("HTTP/1.1 401"), "{map}");
    let shown = format!("Host: localhost\r\nAuthorization: Bearer {TOKEN}\r\n");
    let map = get(&scene, "/map/101/1", &shown).await;
    assert!(map.starts_with("HTTP/1.1 404"), "{map}");
    page.ask(json!({"type": "token", "token": TOKEN}))
        .await
        .unwrap();
    page.state().await;
}

#[tokio::test]
async fn a_giant_frame_ends_the_connection_that_sent_it_and_no_other() {
    let scene = Scene::new().await;
    let mut good = scene.driver().await;
    let mut giant = scene.page().await;
    // The station may refuse it before all of it is sent.
    let _ = giant.socket.send(Message::text("x".repeat(1 << 20))).await;
    loop {
        match within_limit(giant.socket.next()).await {
            Some(Ok(Message::Close(_)) | Err(_)) | None => break,
            Some(Ok(_)) => {}
        }
    }
    assert_eq!(health(&scene).await["too_much"], 1);
    good.drive_until(&scene, |scene| scene.speed() > 0.3).await;
}

#[tokio::test]
async fn a_page_that_never_stops_talking_is_shown_the_door() {
    let scene = Scene::new().await;
    let mut page = scene.page().await;
    for _ in 0..500 {
        let said = page
            .socket
            .feed(Message::text(r#"{"type":"drive_end"}"#))
            .await;
        if said.is_err() {
            break;
        }
    }
    let _ = page.socket.flush().await;
    let reason = parting(&mut page).await.reason;
    assert_eq!(
        reason.as_str(),
        "too many frames; the limit is 50 per second"
    );
}

#[tokio::test]
async fn an_invalid_request_is_refused_in_words_and_the_page_goes_on() {
    let scene = Scene::new().await;
    let mut page = scene.page().await;
    for text in [
        "",
        "{}",
        "[[[[",
        r#"{"type":"fly","id":3}"#,
        "\u{0}",
        "1e999",
    ] {
        page.socket.send(Message::text(text)).await.unwrap();
    }
    loop {
        let said = page.next().await;
        if said["type"] == "refused" {
            assert!(
                said["reason"]
                    .as_str()
                    .unwrap()
                    .starts_with("not a request")
            );
            break;
        }
    }
    for request in [
        json!({"type": "drive", "forward": 2, "turn": 0}),
        json!({"type": "destination", "x": 1e300, "y": 0, "speed": -1}),
        json!({"type": "approve", "mission": 9}),
    ] {
        page.ask(request).await.unwrap_err();
    }
    page.state().await;
}

#[tokio::test]
async fn of_a_thousand_sockets_most_are_refused_and_the_pages_that_stand_keep_working() {
    let scene = Scene::new().await;
    let mut driver = scene.driver().await;
    let mut taken = Vec::new();
    let mut refused = 0;
    for _ in 0..1000 {
        match Page::try_open(scene.address, &[]).await {
            Ok(page) => taken.push(page),
            Err(error) => match *error {
                Error::Http(answer) => {
                    assert_eq!(answer.status(), 503);
                    refused += 1;
                }
                other => panic!("{other}"),
            },
        }
    }
    // The driver's page has one of the eight places of this address.
    assert_eq!((taken.len(), refused), (7, 993));
    driver
        .drive_until(&scene, |scene| scene.speed() > 0.3)
        .await;
    driver.ask(json!({"type": "drive_end"})).await.unwrap();
    // None of these pages reads. Once they are closed, new pages are accepted again.
    drop(taken);
    within_limit(async {
        while Page::try_open(scene.address, &[]).await.is_err() {
            tokio::task::yield_now().await;
        }
    })
    .await;
}

/// Connects from another address of this computer, on Linux: 127.0.0.2, 127.0.0.3 and so on; `None` if the station
/// has closed the connection at once.
async fn connect_from(host: u8, scene: &Scene, first: &[u8]) -> Option<TcpStream> {
    let socket = TcpSocket::new_v4().unwrap();
    let elsewhere = Ipv4Addr::new(127, 0, 0, host);
    socket.bind((elsewhere, 0).into()).unwrap();
    let mut stream = socket.connect(scene.address).await.unwrap();
    stream.write_all(first).await.ok()?;
    Some(stream)
}

#[cfg(target_os = "linux")]
#[tokio::test]
async fn addresses_that_trickle_headers_take_no_place_of_others() {
    let scene = Scene::new().await;
    let mut trickling = Vec::new();
    for number in (0..=250).cycle().take(600) {
        let begun = b"GET / HTTP/1.1\r\nHost: localhost\r\nX-Slow: ";
        trickling.extend(connect_from(2 + number % 5, &scene, begun).await);
    }
    let mut driver = scene.driver().await;
    driver
        .drive_until(&scene, |scene| scene.speed() > 0.3)
        .await;
    drop(trickling);
}

#[cfg(target_os = "linux")]
#[tokio::test]
async fn an_address_with_many_sockets_and_no_token_takes_no_page_of_others() {
    let scene = guarded(false).await;
    let mut sockets = Vec::new();
    for _ in 0..32 {
        let stream = connect_from(2, &scene, b"").await.unwrap();
        let url = format!("ws://{}/ws", scene.address);
        if let Ok((socket, _)) = within_limit(client_async(url, stream)).await {
            sockets.push(socket);
        }
    }
    assert_eq!(sockets.len(), 8);
    let mut page = scene.page().await;
    page.ask(json!({"type": "token", "token": TOKEN}))
        .await
        .unwrap();
    page.select(101).await;
}

#[tokio::test]
async fn by_default_a_page_on_loopback_needs_the_token_for_everything() {
    let station = Station {
        listen: Listen::At((Ipv4Addr::LOCALHOST, 0).into()),
        ..Station::default()
    };
    let open = station.open().await.unwrap();
    let url = open.secret_urls().pop().unwrap();
    let (_, token) = url.split_once("/#token=").unwrap();
    assert_eq!(token.len(), 32);
    let scene = Scene::with(
        Station {
            token: Token::new(token),
            ..Station::default()
        },
        0,
    )
    .await;
    let mut page = scene.page().await;
    assert_eq!(
        (&page.hello["token_needed"], &page.hello["watch"]),
        (&json!(true), &json!(false))
    );
    page.say(&json!({"type": "emergency", "on": true, "id": 1}))
        .await;
    assert_eq!(page.next().await["type"], "refused", "and no state before");
    let unprotected = Station {
        listen: Listen::At((Ipv4Addr::UNSPECIFIED, 0).into()),
        unprotected: true,
        ..Station::default()
    };
    unprotected.open().await.unwrap_err();
}

/// Opens a page that shows a token as it connects.
async fn page_with(scene: &Scene, token: &str) -> Result<Page, Box<Error>> {
    let protocols = format!("jaus.4, token.{token}");
    Page::try_open(scene.address, &[("sec-websocket-protocol", &protocols)]).await
}

/// They have the address of the operator's browser, and take all the places that they can get.
#[tokio::test]
async fn pages_of_another_user_of_the_host_keep_no_operator_out() {
    let scene = guarded(true).await;
    let mut strangers = Vec::new();
    for _ in 0..40 {
        strangers.extend(Page::try_open(scene.address, &[]).await);
    }
    assert_eq!(strangers.len(), 8);
    for guess in 0..3 {
        let refused = page_with(&scene, &format!("0123456789abcdef{guess}")).await;
        assert!(refused.is_err(), "it is a stranger's, too");
    }
    let mut pages = Vec::new();
    for _ in 0..8 {
        let mut page = page_with(&scene, TOKEN).await.unwrap();
        page.state().await;
        pages.push(page);
    }
    assert!(page_with(&scene, TOKEN).await.is_err(), "the ninth");
    pages.pop();
    // A page that shows it later leaves the places of strangers.
    let mut late = strangers.pop().unwrap();
    within_limit(async {
        let shown = json!({"type": "token", "token": TOKEN});
        while late.ask(shown.clone()).await.is_err() {
            tokio::task::yield_now().await;
        }
    })
    .await;
    late.state().await;
    Page::try_open(scene.address, &[]).await.unwrap();
}

#[tokio::test]
async fn connections_that_say_nothing_leave_the_pages_alone() {
    let scene = Scene::new().await;
    let mut driver = scene.driver().await;
    let mut silent = Vec::new();
    for _ in 0..400 {
        silent.push(TcpStream::connect(scene.address).await.unwrap());
    }
    driver
        .drive_until(&scene, |scene| scene.speed() > 0.3)
        .await;
    drop(silent);
}

#[tokio::test]
async fn pages_of_other_sites_are_refused_and_so_are_names_that_are_not_ours() {
    let scene = Scene::new().await;
    let own = format!("http://{}", scene.address);
    Page::try_open(scene.address, &[("origin", &own)])
        .await
        .unwrap();
    for (header, value, status) in [
        ("origin", "http://evil.example", 403),
        ("origin", "null", 403),
        ("sec-fetch-site", "cross-site", 403),
        ("host", "evil.example", 421),
    ] {
        match Page::try_open(scene.address, &[(header, value)])
            .await
            .err()
            .map(|it| *it)
        {
            Some(Error::Http(answer)) => assert_eq!(answer.status(), status, "{header}: {value}"),
            other => panic!("{header}: {value}: {other:?}"),
        }
    }
    assert_eq!(health(&scene).await["strangers"], 4);
}

#[tokio::test]
async fn every_file_of_the_page_comes_with_what_keeps_the_browser_in_bounds() {
    let scene = Scene::new().await;
    let answer = get(&scene, "/", "Host: localhost\r\n").await;
    let head = answer.split("\r\n\r\n").next().unwrap().to_lowercase();
    assert!(head.starts_with("http/1.1 200"), "{head}");
    for header in [
        "content-security-policy: default-src 'none'",
        "x-content-type-options: nosniff",
        "referrer-policy: no-referrer",
        "content-type: text/html; charset=utf-8",
    ] {
        assert!(head.contains(header), "{header} is not in {head}");
    }
    let answer = get(&scene, "/../../etc/passwd", "Host: localhost\r\n").await;
    assert!(answer.starts_with("HTTP/1.1 404"), "{answer}");
}
