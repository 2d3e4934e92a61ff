//! Pages that prove that they know the token, and want the station to prove it.

use hmac::{Hmac, Mac as _};
use jaus_ocu::{Listen, Station, Token};
use serde_json::Value;
use sha2::Sha256;
use tokio_tungstenite::tungstenite::Error;

use crate::hostile::get;
use crate::scene::{Page, Scene};

const TOKEN: &str = "correct-horse-battery";
const NONCE: &str = "0123456789abcdef0123456789abcdef";

fn mac(key: &[u8], words: &str) -> Vec<u8> {
    let mut mac = Hmac::<Sha256>::new_from_slice(key).unwrap();
    mac.update(words.as_bytes());
    mac.finalize().into_bytes().to_vec()
}

/// What a page of this host proves or awaits.
fn proof(host: &str, words: &str) -> String {
    let octets = mac(&mac(TOKEN.as_bytes(), &format!("jaus {host}")), words);
    octets.iter().map(|it| format!("{it:02x}")).collect()
}

async fn guarded() -> Scene {
    let station = Station {
        token: Token::new(TOKEN),
        ..Station::default()
    };
    Scene::with(station, 0).await
}

/// The run that a station names.
async fn run_of(scene: &Scene) -> String {
    let (_, body) = scene.get("/session", "").await;
    let session: Value = serde_json::from_slice(&body).unwrap();
    session["run"].as_str().unwrap().to_owned()
}

/// Opens a page that shows a ticket.
async fn page_with(scene: &Scene, host: &str, ticket: &str) -> Result<Page, Box<Error>> {
    let url = format!("ws://{}/ws?nonce={NONCE}", scene.address);
    let shown = format!("jaus.4, token.{ticket}");
    Page::open_at(&url, &[("sec-websocket-protocol", &shown), ("host", host)]).await
}

#[tokio::test]
async fn page_and_station_prove_that_they_know_the_token() {
    let scene = guarded().await;
    let (host, run) = (scene.address.to_string(), run_of(&scene).await);
    let ticket = proof(&host, &format!("page {run}"));
    let mut page = page_with(&scene, &host, &ticket).await.unwrap();
    assert_eq!(page.hello["token_needed"], false);
    let answer = proof(&host, &format!("station {NONCE} {run}"));
    assert_eq!(page.hello["answer"], answer.as_str());
    page.state().await;
    let shown = format!("Host: {host}\r\nAuthorization: Bearer {ticket}\r\n");
    let head = get(&scene, "/events", &shown).await;
    assert!(head.starts_with("HTTP/1.1 200"), "{head}");
}

/// A program that takes the port for a moment gets a ticket for a run of its own, or for an earlier one.
#[tokio::test]
async fn a_ticket_of_another_run_or_port_is_worth_nothing_and_learns_nothing() {
    let scene = guarded().await;
    let (host, run) = (scene.address.to_string(), run_of(&scene).await);
    let other = format!("127.0.0.1:{}", scene.address.port() ^ 1);
    for (host, ticket) in [
        (&host, proof(&host, "page 00112233445566778899aabbccddeeff")),
        (&other, proof(&other, &format!("page {run}"))),
        (&host, proof(&other, &format!("page {run}"))),
    ] {
        let page = page_with(&scene, host, &ticket).await.unwrap();
        assert_eq!(page.hello["token_needed"], true);
        assert_eq!(page.hello["answer"], Value::Null);
    }
}

/// Nobody without the token gets from the station what would let the token be guessed elsewhere.
#[tokio::test]
async fn a_station_answers_nobody_without_the_token() {
    let scene = guarded().await;
    let url = format!("ws://{}/ws?nonce={NONCE}", scene.address);
    let page = Page::open_at(&url, &[]).await.unwrap();
    assert_eq!(page.hello["answer"], Value::Null);
}

#[tokio::test]
async fn where_another_program_has_the_port_a_kept_token_is_not_used() {
    let folder = tempfile::tempdir().unwrap();
    let kept = Token::keep(&folder.path().join("page.token")).unwrap();
    // If it fails, the port belongs to another program already.
    let _other = tokio::net::TcpListener::bind("127.0.0.1:8080").await;
    let station = Station {
        listen: Listen::Loopback,
        state: Some(folder.path().to_owned()),
        ..Station::default()
    };
    let open = station.open().await.unwrap();
    assert_ne!(open.address().port(), 8080);
    assert_eq!(open.token_file(), None);
    let url = open.secret_urls().pop().unwrap();
    assert!(!url.contains(kept.reveal()), "{url}");
}
