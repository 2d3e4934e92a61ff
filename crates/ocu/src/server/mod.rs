//! The web server: the page's files, the WebSocket to the session, and access protection. It holds
//! no vehicle state: snapshots and requests just pass through.

mod attempts;
mod base_map;
pub(super) mod bounds;
mod connections;
mod gate;
mod guard;
mod login;
mod logins;
mod looks;
mod socket;
mod stop_socket;
mod trail;
mod view;
mod visitor;

use std::net::SocketAddr;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{ConnectInfo, Path, Query, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use jaus_view::places::{NoPlace, Places, Source};
use serde::Serialize;
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, oneshot};
use tokio::time::interval;

use self::attempts::Attempts;
pub(super) use self::gate::{Gate, UserGate};
use self::socket::Introduction;
pub(super) use self::trail::Trail;
use super::base_map::BaseMap;
use super::orders::{Access, Order};
use super::page::{self, File};
use super::tls::Tls;
use super::users::UserRole;
use jaus::address::JausId;
use jaus::node::Node;
use jaus_view::Dictionary;

/// Access rules, and the identity shown to pages.
pub(super) struct Admission {
    pub(super) operator: JausId,
    pub(super) authority: u8,
    pub(super) gate: Gate,
    pub(super) trail: Trail,
    pub(super) hosts: Vec<String>,
    /// The geographic map behind the vehicle.
    pub(super) base_map: Option<BaseMap>,
    /// The station's node, if it runs in this process. Enables the message view.
    pub(super) node: Option<Node>,
}

/// The server, not yet listening.
pub(super) struct Server {
    shared: Arc<Shared>,
}

/// State shared by all connections.
struct Shared {
    admission: Admission,
    access: Access,
    dictionary: Dictionary,
    /// Limits the number of pages.
    places: Places,
    /// Limits the number of connections for stops.
    stop_places: Places,
    /// Limits failed logins.
    attempts: Mutex<Attempts>,
    /// Limits the number of tiles of the map file that are read at once.
    readers: Arc<Semaphore>,
    pages: AtomicU64,
    counters: Counters,
}

/// Counts of rejected requests since the start.
#[derive(Default)]
struct Counters {
    /// Pages beyond the limit.
    no_place: AtomicU64,
    /// Cross-site requests, and requests with an unknown host name.
    strangers: AtomicU64,
    wrong_tokens: AtomicU64,
    /// Logins with a wrong name or password, and those that came too soon after others.
    failed_logins: AtomicU64,
    /// Pages that exceeded the frame size or rate.
    too_much: AtomicU64,
}

/// Status and text for a request that may not see what it asks for.
type Refusal = (StatusCode, &'static str);

/// Health report for monitoring.
#[derive(Serialize)]
struct Health {
    ok: bool,
    pages: usize,
    no_place: u64,
    strangers: u64,
    wrong_tokens: u64,
    failed_logins: u64,
    too_much: u64,
}

impl Server {
    /// Maximum number of pages served at once.
    const PAGES: usize = 32;
    /// Maximum number of pages of one address.
    const PAGES_OF_ADDRESS: usize = 8;
    /// Connections for stops of one page.
    const STOPS_OF_PAGE: usize = 2;
    /// Interval of checking sessions and the users file.
    const CHECK: Duration = Duration::from_secs(1);

    pub(super) fn new(admission: Admission, access: Access) -> Self {
        let shared = Shared {
            admission,
            access,
            dictionary: Dictionary::of(jaus_vehicle::messages::registry()),
            places: Places::new(Self::PAGES, Self::PAGES_OF_ADDRESS),
            stop_places: Places::new(
                Self::PAGES * Self::STOPS_OF_PAGE,
                Self::PAGES_OF_ADDRESS * Self::STOPS_OF_PAGE,
            ),
            attempts: Mutex::new(Attempts::new()),
            readers: Arc::new(Semaphore::new(base_map::READERS)),
            pages: AtomicU64::new(0),
            counters: Counters::default(),
        };
        Self {
            shared: Arc::new(shared),
        }
    }

    /// Serves pages for as long as the listener accepts connections, which has no end.
    pub(super) async fn run(self, listener: TcpListener, tls: Option<Tls>) {
        let serving = connections::serve(listener, tls, self.router());
        tokio::select! {
            () = serving => {}
            () = self.check_sessions() => {}
        }
    }

    fn router(&self) -> Router {
        let files = page::FILES.iter().fold(Router::new(), |router, file| {
            router.route(file.path, get(move || serve_file(file)))
        });
        files
            .route("/ws", get(serve_page))
            .route("/stop", get(serve_stops))
            .route("/map/{vehicle}/{map}", get(serve_map))
            .route("/overlay/{vehicle}", get(looks::serve_overlay))
            .route("/events", get(looks::serve_events))
            .route("/base-map", get(base_map::describe))
            .route("/base-map/{zoom}/{x}/{y}", get(base_map::serve))
            .route("/session", get(login::session))
            .route("/login", post(login::log_in))
            .route("/logout", post(login::log_out))
            .route("/sessions", get(login::list))
            .route("/sessions/{id}/end", post(login::end))
            .route("/health", get(health))
            .layer(middleware::from_fn_with_state(self.shared.clone(), admit))
            .with_state(self.shared.clone())
    }

    /// Ends the sessions of users that are over.
    async fn check_sessions(&self) {
        let mut checks = interval(Self::CHECK);
        loop {
            checks.tick().await;
            if let Some(gate) = self.shared.admission.gate.users() {
                gate.handle_time(Instant::now());
            }
        }
    }
}

/// Rejects cross-site requests, and adds the security headers to responses.
async fn admit(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response {
    if let Err(refusal) = guard::check(request.headers(), &shared.admission.hosts) {
        shared.counters.strangers.fetch_add(1, Relaxed);
        tracing::debug!(%refusal, "not admitted");
        return (refusal.status(), format!("{refusal}\n")).into_response();
    }
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    for (name, value) in HEADERS {
        // A handler may forbid caching altogether.
        headers
            .entry(name)
            .or_insert(HeaderValue::from_static(value));
    }
    response
}

const HEADERS: [(HeaderName, &str); 4] = [
    (header::CONTENT_SECURITY_POLICY, page::POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::CACHE_CONTROL, "no-cache"),
    (header::REFERRER_POLICY, "no-referrer"),
];

async fn serve_file(file: &'static File) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, file.content_type)], file.body)
}

async fn health(State(shared): State<Arc<Shared>>) -> Json<Health> {
    let counters = &shared.counters;
    Json(Health {
        ok: true,
        pages: shared.places.taken(),
        no_place: counters.no_place.load(Relaxed),
        strangers: counters.strangers.load(Relaxed),
        wrong_tokens: counters.wrong_tokens.load(Relaxed),
        failed_logins: counters.failed_logins.load(Relaxed),
        too_much: counters.too_much.load(Relaxed),
    })
}

/// The cells of a vehicle's map, one octet each, row by row. The snapshot states the revision; the one in the
/// URL only separates the entries in browser caches.
async fn serve_map(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(address): ConnectInfo<SocketAddr>,
    Path((vehicle, map)): Path<(u16, u16)>,
    headers: HeaderMap,
) -> Response {
    if let Err(refusal) = shared.check_reader(&headers, address) {
        return refusal.into_response();
    }
    let (reply, cells) = oneshot::channel();
    let reply = Box::new(move |result| {
        // Fails only if the request has been dropped.
        let _ = reply.send(result);
    });
    let order = Order::Cells {
        vehicle,
        map,
        reply,
    };
    // On failure the reply end is dropped as well, which is handled below.
    let _ = shared.access.orders.send(order).await;
    match cells.await {
        Ok(Ok(cells)) => {
            ([(header::CONTENT_TYPE, "application/octet-stream")], cells).into_response()
        }
        Ok(Err(reason)) => (StatusCode::NOT_FOUND, reason + "\n").into_response(),
        Err(_) => (StatusCode::SERVICE_UNAVAILABLE, "the session has ended\n").into_response(),
    }
}

async fn serve_page(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(address): ConnectInfo<SocketAddr>,
    Query(introduction): Query<Introduction>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    let Some(visitor) = shared.admission.gate.visitor(&headers, address) else {
        return (StatusCode::UNAUTHORIZED, "log in first\n").into_response();
    };
    let place = match shared.places.take(Source::of(address)) {
        Ok(place) => place,
        Err(why) => {
            shared.counters.no_place.fetch_add(1, Relaxed);
            let words = match why {
                NoPlace::Full => format!("the limit of {} pages is reached", Server::PAGES),
                NoPlace::Share => format!(
                    "the limit of {} pages of one address is reached",
                    Server::PAGES_OF_ADDRESS
                ),
            };
            let words = words + "; close one of them\n";
            return (StatusCode::SERVICE_UNAVAILABLE, words).into_response();
        }
    };
    upgrade
        .max_message_size(bounds::LARGEST_FRAME)
        .max_frame_size(bounds::LARGEST_FRAME)
        .on_upgrade(async move |socket| {
            socket::serve(socket, shared, visitor, introduction).await;
            drop(place);
        })
}

async fn serve_stops(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(address): ConnectInfo<SocketAddr>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    let Some(visitor) = shared.admission.gate.visitor(&headers, address) else {
        return (StatusCode::UNAUTHORIZED, "log in first\n").into_response();
    };
    let Ok(place) = shared.stop_places.take(Source::of(address)) else {
        shared.counters.no_place.fetch_add(1, Relaxed);
        return (StatusCode::SERVICE_UNAVAILABLE, "too many connections\n").into_response();
    };
    upgrade
        .max_message_size(bounds::LARGEST_FRAME)
        .max_frame_size(bounds::LARGEST_FRAME)
        .on_upgrade(async move |socket| {
            stop_socket::serve(socket, shared, visitor).await;
            drop(place);
        })
}

impl Shared {
    fn attempts(&self) -> MutexGuard<'_, Attempts> {
        self.attempts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether the shown token is right. Wrong tokens are counted, and slow down their address.
    fn admits(&self, shown: &str, address: SocketAddr) -> Result<(), &'static str> {
        let Some(token) = self.admission.gate.token() else {
            return Ok(());
        };
        let source = Source::of(address);
        let begun = self.attempts().begin(Instant::now(), source, None);
        if begun.is_ok() && token.is(shown) {
            self.attempts().succeeded(source, None);
            return Ok(());
        }
        self.counters.wrong_tokens.fetch_add(1, Relaxed);
        Err(match begun {
            Ok(()) => "wrong token",
            Err(_) => "too many wrong tokens; try again in 10 s",
        })
    }

    /// Counts and records a login that was refused. The name is recorded only if it is a user's: it
    /// may be a password in the wrong field.
    fn note_refused_login(&self, name: &str, address: SocketAddr, why: &str) {
        self.counters.failed_logins.fetch_add(1, Relaxed);
        let users = self.admission.gate.users().map(UserGate::users);
        let is_known = users.is_some_and(|it| it.find(name).is_some());
        let who = if is_known { name } else { "unknown user" };
        tracing::warn!("login of {who} from {} refused: {why}", address.ip());
        self.admission.trail.login(who, address, Some(why));
    }

    /// Checks that a request may read vehicle data.
    fn check_reader(&self, headers: &HeaderMap, address: SocketAddr) -> Result<(), Refusal> {
        let Some(visitor) = self.admission.gate.visitor(headers, address) else {
            return Err((StatusCode::UNAUTHORIZED, "log in first\n"));
        };
        if visitor.may(UserRole::Observe) {
            return Ok(());
        }
        let shown = headers.get(header::AUTHORIZATION);
        let shown = shown.and_then(|it| it.to_str().ok()?.strip_prefix("Bearer "));
        match shown.map(|it| self.admits(it, address)) {
            Some(Ok(())) => Ok(()),
            _ => {
                let words = "this requires the token: send Authorization: Bearer TOKEN\n";
                Err((StatusCode::UNAUTHORIZED, words))
            }
        }
    }
}
