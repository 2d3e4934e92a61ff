//! Requests of users: log in and out, and the list of sessions for those who administer them.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Json;
use axum::body::{Body, to_bytes};
use axum::extract::{ConnectInfo, Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use jaus_limits::Source;
use serde::{Deserialize, Serialize};
use tokio::time::{sleep, timeout};

use super::attempts::Guesser;
use super::gate::{LoginError, UserGate};
use super::logins::{Ending, LoginId};
use super::visitor::Visitor;
use super::{Refusal, Shared};
use crate::users::UserRole;
use jaus::node::now;

/// Deadline of a login's body.
const BODY: Duration = Duration::from_secs(10);
/// The longest body of a login, in octets.
const LONGEST_BODY: usize = 2048;

/// What a user sends to log in.
#[derive(Deserialize)]
struct Credentials {
    name: String,
    password: String,
}

/// The session that a login has begun.
#[derive(Serialize)]
struct Begun {
    /// What the page is to show, or to make its tickets of.
    secret: String,
}

/// Who is logged in.
#[derive(Serialize)]
struct Session {
    /// Whether the page has users, who must log in.
    users: bool,
    /// The run of the station, for which a page makes its ticket.
    run: String,
    user: Option<String>,
    role: Option<UserRole>,
}

/// A session in the list for those who administer them.
#[derive(Serialize)]
struct ListedSession {
    id: LoginId,
    user: String,
    role: UserRole,
    address: String,
    /// Seconds since the login.
    since_s: u64,
    /// Seconds since the user's last request.
    idle_s: u64,
    /// Whether it is the session of the one who asks.
    own: bool,
}

/// For a request that only a station with users serves.
const NO_USERS: Refusal = (
    StatusCode::NOT_FOUND,
    "this station has no users; start jaus-ocu with --users\n",
);

type Peer = ConnectInfo<SocketAddr>;

/// Who is logged in here.
pub(super) async fn session(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(address): Peer,
    headers: HeaderMap,
) -> Response {
    let users = shared.admission.gate.users();
    let visitor = users.and_then(|_| shared.visitor(&headers, address));
    let session = Session {
        users: users.is_some(),
        run: shared.admission.proofs.run().to_owned(),
        user: visitor.as_ref().map(|it| it.user.to_string()),
        role: visitor.as_ref().and_then(Visitor::role),
    };
    ([(header::CACHE_CONTROL, "no-store")], Json(session)).into_response()
}

/// Begins a session if name and password are right.
pub(super) async fn log_in(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(address): Peer,
    headers: HeaderMap,
    body: Body,
) -> Response {
    let Some(gate) = shared.admission.gate.users() else {
        return NO_USERS.into_response();
    };
    let Some(Credentials { name, password }) = read(body).await else {
        let words = "send a JSON object with name and password\n";
        return (StatusCode::BAD_REQUEST, words).into_response();
    };
    if let Err(error) = gate.check_users() {
        return shared.refuse_login(&name, address, error);
    }
    let guesser = match gate.device(&headers, &name) {
        Some(device) => Guesser::Device(device),
        None => Guesser::Address(Source::of(address)),
    };
    let begun = shared.attempts().begin(now(), &guesser, &name);
    match begun {
        Ok(delay) => sleep(delay).await,
        Err(wait) => {
            shared.note_refused_login(&name, address, "too many failed logins");
            return slow_down(wait);
        }
    }
    let is_known_device = matches!(guesser, Guesser::Device(_));
    let login = gate.log_in(&name, password, address, is_known_device);
    let logged_in = login.await.and_then(|secret| {
        let device = gate.remember_device(&headers, &name)?;
        Ok((secret, device))
    });
    match logged_in {
        Ok((secret, device)) => {
            shared.attempts().succeeded(&guesser, &name);
            shared.admission.trail.login(&name, address, None);
            let headers = [
                (header::SET_COOKIE, device),
                (header::CACHE_CONTROL, "no-store".to_owned()),
            ];
            let secret = secret.reveal().to_owned();
            (headers, Json(Begun { secret })).into_response()
        }
        Err(error) => shared.refuse_login(&name, address, error),
    }
}

impl Shared {
    /// Records a login that fails, and answers it.
    fn refuse_login(&self, name: &str, address: SocketAddr, error: LoginError) -> Response {
        let words = error.to_string();
        self.note_refused_login(name, address, &words);
        let status = match error {
            LoginError::Wrong => StatusCode::UNAUTHORIZED,
            LoginError::Busy | LoginError::NoRandomness | LoginError::UnusableUsers => {
                StatusCode::SERVICE_UNAVAILABLE
            }
        };
        (status, words + "\n").into_response()
    }
}

async fn read(body: Body) -> Option<Credentials> {
    let octets = timeout(BODY, to_bytes(body, LONGEST_BODY)).await;
    serde_json::from_slice(&octets.ok()?.ok()?).ok()
}

fn slow_down(wait: Duration) -> Response {
    let seconds = wait.as_secs() + 1;
    let words = format!("too many failed logins; try again in {seconds} s\n");
    let after = [(header::RETRY_AFTER, seconds.to_string())];
    (StatusCode::TOO_MANY_REQUESTS, after, words).into_response()
}

/// Ends the session of the one who asks.
pub(super) async fn log_out(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(address): Peer,
    headers: HeaderMap,
) -> Response {
    let Some(gate) = shared.admission.gate.users() else {
        return NO_USERS.into_response();
    };
    let visitor = shared.visitor(&headers, address);
    if let Some(id) = visitor.and_then(|it| it.login) {
        gate.end(id, &Ending::LoggedOut);
    }
    StatusCode::NO_CONTENT.into_response()
}

/// All sessions, for those who administer them.
pub(super) async fn list(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(address): Peer,
    headers: HeaderMap,
) -> Response {
    let (gate, visitor) = match administrator(&shared, &headers, address) {
        Ok(admitted) => admitted,
        Err(refusal) => return refusal.into_response(),
    };
    let now = now();
    let seconds = |then| now.saturating_duration_since(then).as_secs();
    let logins = gate.logins();
    let listed = logins.all().into_iter().map(|login| ListedSession {
        id: login.id,
        user: login.user.name.clone(),
        role: login.role(),
        address: login.address.ip().to_string(),
        since_s: seconds(login.since),
        idle_s: seconds(login.active),
        own: visitor.login == Some(login.id),
    });
    let listed: Vec<_> = listed.collect();
    ([(header::CACHE_CONTROL, "no-store")], Json(listed)).into_response()
}

/// Ends a session, for those who administer them.
pub(super) async fn end(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(address): Peer,
    Path(id): Path<LoginId>,
    headers: HeaderMap,
) -> Response {
    let (gate, visitor) = match administrator(&shared, &headers, address) {
        Ok(admitted) => admitted,
        Err(refusal) => return refusal.into_response(),
    };
    match gate.end(id, &Ending::EndedBy(visitor.user)) {
        Some(_) => StatusCode::NO_CONTENT.into_response(),
        None => (StatusCode::NOT_FOUND, "this session has ended\n").into_response(),
    }
}

/// The users and the sender of a request that requires the role `administer`.
fn administrator<'s>(
    shared: &'s Shared,
    headers: &HeaderMap,
    address: SocketAddr,
) -> Result<(&'s UserGate, Visitor), Refusal> {
    let gate = shared.admission.gate.users().ok_or(NO_USERS)?;
    match shared.visitor(headers, address) {
        Some(visitor) if visitor.may(UserRole::Administer) => {
            // The session is in use.
            gate.holds(&visitor, true);
            Ok((gate, visitor))
        }
        Some(_) => Err((StatusCode::FORBIDDEN, "this requires the role administer\n")),
        None => Err((StatusCode::UNAUTHORIZED, "log in first\n")),
    }
}
