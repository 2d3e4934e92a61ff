//! Pages of users: login, roles, the end of sessions, and what the audit log has of it.

use std::path::PathBuf;
use std::sync::LazyLock;

use futures_util::StreamExt;
use jaus_audit::{AuditLog, AuditSettings, refusals_of};
use jaus_ocu::Station;
use jaus_ocu::users::{self, PasswordHash, User, UserRole, UsersFile};
use jaus_test_kit::waiting::{until, within_limit};
use serde_json::{Value, json};
use tempfile::TempDir;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::{Error, Message};

use crate::scene::{Page, Scene, driver_of};

/// The password of every user in these tests.
const PASSWORD: &str = "correct horse battery";
/// Its hash: hashing takes long.
static HASH: LazyLock<PasswordHash> = LazyLock::new(|| PasswordHash::of(PASSWORD).unwrap());

/// A station with the users anna (administer), ben (drive) and carl (observe).
struct Guarded {
    scene: Scene,
    folder: TempDir,
}

impl Guarded {
    async fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("users");
        for (name, role) in [
            ("anna", UserRole::Administer),
            ("ben", UserRole::Drive),
            ("carl", UserRole::Observe),
        ] {
            let user = User {
                name: name.to_owned(),
                role,
                password: HASH.clone(),
            };
            users::add(&file, &user).unwrap();
        }
        let log = folder.path().join("audit.jsonl");
        let station = Station {
            users: Some(UsersFile::load(&file).unwrap()),
            state: Some(folder.path().to_owned()),
            audit: Some(AuditLog::open(&log, AuditSettings::default()).unwrap()),
            ..Station::default()
        };
        let scene = Scene::with(station, 0).await;
        Self { scene, folder }
    }

    fn users(&self) -> PathBuf {
        self.folder.path().join("users")
    }

    fn audit(&self) -> String {
        let evidence = self.folder.path().join("audit.jsonl");
        let files = [refusals_of(&evidence), evidence];
        files
            .map(|file| std::fs::read_to_string(file).unwrap())
            .concat()
    }

    /// Whether the audit log has an entry with these words.
    fn has_recorded(&self, words: &[&str]) -> bool {
        let log = self.audit();
        log.lines()
            .any(|line| words.iter().all(|it| line.contains(it)))
    }

    /// Sends a POST request. Returns the head of the response and its body.
    async fn post(&self, path: &str, (name, value): (&str, &str), body: &str) -> (String, String) {
        let mut stream = TcpStream::connect(self.scene.address).await.unwrap();
        let request = format!(
            "POST {path} HTTP/1.1\r\nHost: localhost\r\n{name}: {value}\r\nContent-Length: {}\r\n\
             Connection: close\r\n\r\n{body}",
            body.len()
        );
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = String::new();
        within_limit(stream.read_to_string(&mut answer))
            .await
            .unwrap();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        (head.to_owned(), body.to_owned())
    }

    async fn try_login(&self, name: &str, password: &str) -> (String, String) {
        self.try_login_from("", name, password).await
    }

    /// From a browser with this cookie.
    async fn try_login_from(&self, cookie: &str, name: &str, password: &str) -> (String, String) {
        let body = json!({"name": name, "password": password}).to_string();
        self.post("/login", ("Cookie", cookie), &body).await
    }

    /// Guesses a password until this address is refused.
    async fn guess_until_refused(&self, name: &str) {
        // A slow machine gets another attempt each 10 s.
        for _ in 0..50 {
            let (head, _) = self.try_login(name, "wrong").await;
            if head.starts_with("HTTP/1.1 429") {
                return assert!(head.to_lowercase().contains("retry-after: "), "{head}");
            }
        }
        panic!("it may guess on and on");
    }

    /// Logs in. Returns what shows the session: no cookie, which a browser would send to other ports of the host, too.
    async fn login(&self, name: &str) -> String {
        let (head, body) = self.try_login(name, PASSWORD).await;
        assert!(head.starts_with("HTTP/1.1 200"), "{head}");
        let body: Value = serde_json::from_str(&body).unwrap();
        let secret = body["secret"].as_str().unwrap();
        assert!(!head.contains(secret), "{head}");
        format!("Bearer {secret}")
    }

    async fn get(&self, path: &str, shown: &str) -> (String, Value) {
        let headers = format!("Authorization: {shown}\r\n");
        let (head, body) = self.scene.get(path, &headers).await;
        (head, serde_json::from_slice(&body).unwrap_or_default())
    }

    async fn page(&self, shown: &str) -> Page {
        let page = Page::try_open(self.scene.address, &[("authorization", shown)]).await;
        page.unwrap_or_else(|error| panic!("{error}"))
    }

    /// Status of an attempt to open a page.
    async fn page_status(&self, shown: &str) -> u16 {
        match Page::try_open(self.scene.address, &[("authorization", shown)]).await {
            Ok(_) => 101,
            Err(error) => match *error {
                Error::Http(answer) => answer.status().as_u16(),
                other => panic!("{other}"),
            },
        }
    }
}

/// Waits until the station closes the page at the end of its session.
async fn session_ends(page: &mut Page) {
    loop {
        match within_limit(page.socket.next()).await {
            Some(Ok(Message::Close(Some(frame)))) => {
                return assert_eq!(u16::from(frame.code), 4001, "{frame}");
            }
            Some(Ok(_)) => {}
            other => panic!("no close frame: {other:?}"),
        }
    }
}

#[tokio::test]
async fn without_a_login_nothing_is_shown_but_the_form() {
    let guarded = Guarded::new().await;
    for shown in ["", "Bearer x", "Bearer 0123456789abcdef0123456789abcdef"] {
        assert_eq!(guarded.page_status(shown).await, 401);
        let (head, _) = guarded.get("/map/101/1", shown).await;
        assert!(head.starts_with("http/1.1 401"), "{head}");
        let (_, mut session) = guarded.get("/session", shown).await;
        assert_eq!(session["run"].take().as_str().unwrap().len(), 32);
        let nobody = json!({"users": true, "run": null, "user": null, "role": null});
        assert_eq!(session, nobody);
    }
    let (head, _) = guarded.get("/", "").await;
    assert!(head.starts_with("http/1.1 200"), "{head}");
}

#[tokio::test]
async fn a_wrong_password_and_an_unknown_user_get_the_same_answer() {
    let guarded = Guarded::new().await;
    let (head, wrong) = guarded.try_login("anna", "correct horse batterz").await;
    assert!(head.starts_with("HTTP/1.1 401"), "{head}");
    let (head, unknown) = guarded.try_login("dora", PASSWORD).await;
    assert!(head.starts_with("HTTP/1.1 401"), "{head}");
    assert_eq!(wrong, unknown);
    let (_, health) = guarded.get("/health", "").await;
    assert_eq!(health["failed_logins"], 2);
}

#[tokio::test]
async fn after_five_failures_an_address_has_to_wait_even_with_the_right_password() {
    let guarded = Guarded::new().await;
    guarded.guess_until_refused("anna").await;
    until(|| guarded.has_recorded(&["too many failed logins", "refused"])).await;
}

#[tokio::test]
async fn a_browser_from_which_a_user_has_logged_in_is_not_locked_out_by_guesses_at_its_address() {
    let guarded = Guarded::new().await;
    let (head, _) = guarded.try_login("anna", PASSWORD).await;
    let cookie = head.lines().find(|it| it.contains("-device=")).unwrap();
    for attribute in ["; HttpOnly", "; SameSite=Strict", "; Max-Age=15552000"] {
        assert!(cookie.contains(attribute), "{cookie}");
    }
    let cookie = cookie.strip_prefix("set-cookie: ").unwrap();
    let device = cookie.split(';').next().unwrap();
    guarded.guess_until_refused("anna").await;
    let (head, _) = guarded.try_login_from(device, "anna", PASSWORD).await;
    assert!(head.starts_with("HTTP/1.1 200"), "{head}");
    let again = head.lines().any(|it| it.contains(device));
    assert!(again, "it keeps its secret: {head}");
    let (head, _) = guarded.try_login_from(device, "ben", PASSWORD).await;
    assert!(head.starts_with("HTTP/1.1 429"), "of another user: {head}");
    let port = guarded.scene.address.port();
    let file = guarded.folder.path().join(format!("page-{port}.devices"));
    let (_, secret) = device.split_once('=').unwrap();
    let kept = std::fs::read_to_string(file).unwrap();
    assert!(kept.contains(" anna\n") && !kept.contains(secret), "{kept}");
}

#[cfg(target_os = "linux")]
#[tokio::test]
async fn guesses_from_three_addresses_keep_the_right_password_from_a_fresh_one_out_for_no_more_than_a_second()
 {
    let guarded = Guarded::new().await;
    let log_in = async |last: u8, password: &str| {
        let socket = tokio::net::TcpSocket::new_v4().unwrap();
        socket.bind(([127, 0, 0, last], 0).into()).unwrap();
        let mut stream = socket.connect(guarded.scene.address).await.unwrap();
        let body = json!({"name": "anna", "password": password}).to_string();
        let head = "POST /login HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n";
        let request = format!("{head}Content-Length: {}\r\n\r\n{body}", body.len());
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = String::new();
        within_limit(stream.read_to_string(&mut answer))
            .await
            .unwrap();
        answer
    };
    for guess in 0..12 {
        log_in(2 + guess % 3, "wrong").await;
    }
    let answer = log_in(9, PASSWORD).await;
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
}

#[tokio::test]
async fn one_who_observes_sees_the_vehicle_and_stops_it_and_does_nothing_else() {
    let guarded = Guarded::new().await;
    let shown = guarded.login("carl").await;
    let mut page = guarded.page(&shown).await;
    page.until(|state| driver_of(state)["state"] == "standby")
        .await;
    for request in [
        json!({"type": "control", "on": true}),
        json!({"type": "emergency", "on": false}),
        json!({"type": "emergency_all", "on": false}),
        json!({"type": "drive", "forward": 1, "turn": 0}),
        json!({"type": "stop"}),
    ] {
        let refused = page.ask(request).await.unwrap_err();
        assert!(refused.contains("requires the role drive"), "{refused}");
    }
    assert!(!guarded.scene.is_controlled());
    page.ask(json!({"type": "emergency", "on": true}))
        .await
        .unwrap();
    page.until(|state| state["vehicle"]["emergency"] == true)
        .await;
    let (head, _) = guarded.get("/sessions", &shown).await;
    assert!(head.starts_with("http/1.1 403"), "{head}");
    until(|| guarded.has_recorded(&["carl", "control requested", "refused", "role drive"])).await;
}

#[tokio::test]
async fn the_emergencies_of_others_are_cleared_by_an_administrator_alone() {
    let guarded = Guarded::new().await;
    let clear_any = json!({"type": "clear_any_emergency"});
    let mut page = guarded.page(&guarded.login("ben").await).await;
    let refused = page.ask(clear_any.clone()).await.unwrap_err();
    assert!(
        refused.contains("requires the role administer"),
        "{refused}"
    );
    let mut page = guarded.page(&guarded.login("anna").await).await;
    page.until(|state| driver_of(state)["state"] == "standby")
        .await;
    page.ask(clear_any).await.unwrap();
}

#[tokio::test]
async fn all_pages_see_the_name_of_the_user_who_drives() {
    let guarded = Guarded::new().await;
    let mut watching = guarded.page(&guarded.login("carl").await).await;
    let mut driving = guarded.page(&guarded.login("ben").await).await;
    driving.select(101).await;
    driving
        .until(|state| !state["vehicle"]["pose"].is_null())
        .await;
    watching
        .until(|state| state["control"]["user"].is_null())
        .await;
    let control = json!({"type": "control", "on": true});
    driving.ask(control).await.unwrap();
    watching
        .until(|state| state["control"]["user"] == "ben")
        .await;
    driving
        .ask(json!({"type": "control", "on": false}))
        .await
        .unwrap();
    watching
        .until(|state| state["control"]["user"].is_null())
        .await;
    until(|| guarded.has_recorded(&["ben", "control released", "allowed"])).await;
    assert!(guarded.has_recorded(&["ben", "control requested", "allowed"]));
}

#[tokio::test]
async fn an_administrator_sees_who_is_logged_in_and_ends_a_session() {
    let guarded = Guarded::new().await;
    let ben = guarded.login("ben").await;
    let anna = guarded.login("anna").await;
    let mut page = guarded.page(&ben).await;
    let (_, sessions) = guarded.get("/sessions", &anna).await;
    let users: Vec<_> = sessions
        .as_array()
        .unwrap()
        .iter()
        .map(|it| &it["user"])
        .collect();
    assert_eq!(users, ["ben", "anna"]);
    assert_eq!(sessions[1]["own"], true);
    let end = format!("/sessions/{}/end", sessions[0]["id"]);
    let (head, _) = guarded.post(&end, ("Authorization", &ben), "").await;
    assert!(head.starts_with("HTTP/1.1 403"), "{head}");
    let (head, _) = guarded.post(&end, ("Authorization", &anna), "").await;
    assert!(head.starts_with("HTTP/1.1 204"), "{head}");
    session_ends(&mut page).await;
    assert_eq!(guarded.page_status(&ben).await, 401);
    until(|| guarded.has_recorded(&["ben", "session ended", "ended by anna"])).await;
}

#[tokio::test]
async fn a_logout_ends_the_session_and_its_pages() {
    let guarded = Guarded::new().await;
    let shown = guarded.login("ben").await;
    let mut page = guarded.page(&shown).await;
    let (head, _) = guarded.post("/logout", ("Authorization", &shown), "").await;
    assert!(head.starts_with("HTTP/1.1 204"), "{head}");
    session_ends(&mut page).await;
    assert_eq!(guarded.page_status(&shown).await, 401);
    until(|| guarded.has_recorded(&["ben", "logout"])).await;
}

#[tokio::test]
async fn the_sessions_of_a_removed_user_end_and_those_of_others_go_on() {
    let guarded = Guarded::new().await;
    let mut removed = guarded.page(&guarded.login("ben").await).await;
    let mut other = guarded.page(&guarded.login("carl").await).await;
    assert!(users::remove(&guarded.users(), "ben").unwrap());
    session_ends(&mut removed).await;
    other.state().await;
    until(|| guarded.has_recorded(&["ben", "the user was removed"])).await;
}

#[tokio::test]
async fn with_an_unusable_users_file_nobody_logs_in_and_those_who_have_still_stop_vehicles() {
    let guarded = Guarded::new().await;
    let shown = guarded.login("carl").await;
    let mut page = guarded.page(&shown).await;
    page.until(|state| driver_of(state)["state"] == "standby")
        .await;
    let good = std::fs::read(guarded.users()).unwrap();
    std::fs::write(guarded.users(), "half a line\n").unwrap();
    let answers = async |status: &str| {
        loop {
            let (head, body) = guarded.try_login("ben", PASSWORD).await;
            if head.starts_with(status) {
                return body;
            }
        }
    };
    let refused = within_limit(answers("HTTP/1.1 503")).await;
    assert!(refused.contains("the file of the users"), "{refused}");
    until(|| guarded.has_recorded(&["ben", "login", "refused", "nobody can log in"])).await;

    let stop = json!({"type": "emergency", "on": true});
    page.ask(stop.clone()).await.unwrap();
    page.until(|state| state["vehicle"]["emergency"] == true)
        .await;
    let mut again = guarded.page(&shown).await;
    again.ask(stop).await.unwrap();
    std::fs::write(guarded.users(), good).unwrap();
    within_limit(answers("HTTP/1.1 200")).await;
    again.state().await;
}

#[tokio::test]
async fn the_audit_log_has_no_password_no_cookie_and_no_unknown_name() {
    let guarded = Guarded::new().await;
    let shown = guarded.login("anna").await;
    let (_, secret) = shown.split_once(' ').unwrap();
    guarded.try_login("anna", "a-wrong-password").await;
    guarded.try_login("a-password-as-name", "").await;
    let mut page = guarded.page(&shown).await;
    page.ask(json!({"type": "control", "on": true})).await.ok();
    guarded.post("/logout", ("Authorization", &shown), "").await;
    until(|| guarded.has_recorded(&["anna", "logout"])).await;
    assert!(guarded.has_recorded(&["anna", "login", "allowed", "127.0.0.1"]));
    assert!(guarded.has_recorded(&["unknown user", "login", "refused"]));
    let log = guarded.audit();
    for word in [PASSWORD, "a-wrong-password", "a-password-as-name", secret] {
        assert!(!log.contains(word), "{word} is in {log}");
    }
}

#[tokio::test]
async fn malformed_logins_are_refused() {
    let guarded = Guarded::new().await;
    let long = format!("{{\"name\":\"{}\"", "x".repeat(4000));
    for body in ["", "{}", "[]", "\u{0}", "name=anna", &long] {
        let (head, _) = guarded.post("/login", ("Cookie", ""), body).await;
        assert!(head.starts_with("HTTP/1.1 400"), "{body}: {head}");
    }
}
