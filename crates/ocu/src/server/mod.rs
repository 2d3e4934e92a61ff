//! The web server: the page's files, the WebSocket to the session, and access protection. It holds
//! no vehicle state: snapshots and requests just pass through.

mod attempts;
mod base_map;
mod bounds;
mod connections;
mod devices;
mod gate;
mod guard;
mod introduction;
mod login;
mod logins;
mod looks;
mod proof;
mod socket;
mod stop_socket;
mod trail;
mod view;
mod visitor;

use std::net::SocketAddr;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{ConnectInfo, Path, Query, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use jaus_limits::{NoPlace, Place, Places, Source};
use serde::Serialize;
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, oneshot};
use tokio::time::{interval, sleep};

use self::attempts::Attempts;
pub(super) use self::connections::MemoryBrowsers;
pub(super) use self::devices::Devices;
pub(super) use self::gate::{Gate, UserGate};
use self::introduction::Introduction;
pub(super) use self::proof::Proofs;
pub(super) use self::trail::Trail;
use self::visitor::Visitor;
use super::base_map::BaseMap;
use super::orders::{Access, Order};
use super::page::{self, File};
use super::tls::Tls;
use super::token::Token;
use super::users::{UserRole, UsersFile};
use jaus::address::JausId;
use jaus::node::{Node, now};
use jaus_view::Dictionary;

/// Access rules, and the identity shown to pages.
pub(super) struct Admission {
    pub(super) operator: JausId,
    pub(super) authority: u8,
    pub(super) gate: Gate,
    pub(super) proofs: Proofs,
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
    /// Limit those that have not shown the token. They take no place of the others.
    strangers: Places,
    stop_strangers: Places,
    /// Limits failed logins.
    attempts: Mutex<Attempts>,
    /// Limits the number of tiles of the map file that are read at once.
    readers: Arc<Semaphore>,
    pages: AtomicU64,
    /// How many connections for stops were opened.
    stop_connections: AtomicU64,
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

/// Delay of the answer to a wrong token.
const WRONG_TOKEN: Duration = Duration::from_secs(1);

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
    /// Maximum number of pages without the token.
    const STRANGERS: usize = 16;
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
            strangers: Places::new(Self::STRANGERS, Self::PAGES_OF_ADDRESS),
            stop_strangers: Places::new(
                Self::STRANGERS * Self::STOPS_OF_PAGE,
                Self::PAGES_OF_ADDRESS * Self::STOPS_OF_PAGE,
            ),
            attempts: Mutex::new(Attempts::new()),
            readers: Arc::new(Semaphore::new(base_map::READERS)),
            pages: AtomicU64::new(0),
            stop_connections: AtomicU64::new(0),
            counters: Counters::default(),
        };
        Self {
            shared: Arc::new(shared),
        }
    }

    /// Serves pages for as long as the listener accepts connections, which has no end.
    pub(super) async fn run(self, listener: TcpListener, tls: Option<Tls>) {
        self.serve(connections::serve(listener, tls, self.router()))
            .await;
    }

    /// Serves pages that are simulated in this process.
    pub(super) async fn run_in_memory(self, browsers: MemoryBrowsers) {
        self.serve(connections::serve_in_memory(browsers, self.router()))
            .await;
    }

    async fn serve(&self, serving: impl Future<Output = ()>) {
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
        let mut checks = interval(UsersFile::INTERVAL);
        loop {
            checks.tick().await;
            if let Some(gate) = self.shared.admission.gate.users() {
                gate.handle_time(now());
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
    let is_upgraded = response.status() == StatusCode::SWITCHING_PROTOCOLS;
    let headers = response.headers_mut();
    if !is_upgraded {
        // Closing idle connections later costs packets of the link by which a vehicle may be driven
        // then, and a stop would wait behind them.
        headers.insert(header::CONNECTION, HeaderValue::from_static("close"));
    }
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
        pages: shared.places.taken() + shared.strangers.taken(),
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
    if let Err(refusal) = shared.check_reader(&headers, address).await {
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
    Query(mut introduction): Query<Introduction>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    let places = [&shared.places, &shared.strangers];
    match shared.admit_socket(address, &headers, places).await {
        Ok(visitor) => {
            introduction.answer(&shared, &visitor);
            of_page(upgrade, &[SUBPROTOCOL]).on_upgrade(async move |socket| {
                socket::serve(socket, shared, visitor, introduction).await;
            })
        }
        Err(refusal) => refusal.into_response(),
    }
}

async fn serve_stops(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(address): ConnectInfo<SocketAddr>,
    Query(mut introduction): Query<Introduction>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    let places = [&shared.stop_places, &shared.stop_strangers];
    match shared.admit_socket(address, &headers, places).await {
        Ok(visitor) => {
            let upgrade = of_page(upgrade, &[SUBPROTOCOL, OLDER_SUBPROTOCOL]);
            introduction.answer(&shared, &visitor);
            upgrade.on_upgrade(async move |socket| {
                stop_socket::serve(socket, shared, visitor, introduction).await;
            })
        }
        Err(refusal) => refusal.into_response(),
    }
}

/// The upgrade to a WebSocket of a page that names one of these subprotocols, or none.
fn of_page(upgrade: WebSocketUpgrade, subprotocols: &'static [&str]) -> WebSocketUpgrade {
    upgrade
        .protocols(subprotocols.iter().copied())
        .max_message_size(bounds::LARGEST_FRAME)
        .max_frame_size(bounds::LARGEST_FRAME)
}

/// The subprotocol of a page's WebSocket. A browser sets no other header of a WebSocket, so a page
/// names the token, or its ticket, there as well. A page that was loaded from an older station knows no
/// [changes](crate::changes) of states and must not show them: its browser gives a WebSocket up for which the
/// station does not choose one of its subprotocols. It can still stop vehicles.
const SUBPROTOCOL: &str = "jaus.4";
const OLDER_SUBPROTOCOL: &str = "jaus";

impl Shared {
    fn attempts(&self) -> MutexGuard<'_, Attempts> {
        self.attempts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The sender of a request; `None` for one who has to log in first.
    fn visitor(&self, headers: &HeaderMap, address: SocketAddr) -> Option<Visitor> {
        let Admission { gate, proofs, .. } = &self.admission;
        gate.visitor(headers, address, proofs)
    }

    /// Whether the shown token is right, or the ticket of one who has it. Wrong ones are counted, and answered late: with at least 16
    /// characters and the limits of connections, that is enough, and no guess makes others wait.
    async fn admits(&self, visitor: &Visitor, shown: &str) -> bool {
        let Admission { gate, proofs, .. } = &self.admission;
        let is_right = |token: &Token| proofs.is_shown(token, &visitor.host, shown);
        if gate.token().is_none_or(is_right) {
            return true;
        }
        self.counters.wrong_tokens.fetch_add(1, Relaxed);
        sleep(WRONG_TOKEN).await;
        false
    }

    /// The visitor of a new WebSocket, who has taken a place.
    ///
    /// # Errors
    /// If the visitor has not logged in, or there is no place.
    async fn admit_socket(
        &self,
        address: SocketAddr,
        headers: &HeaderMap,
        places: [&Places; 2],
    ) -> Result<Visitor, (StatusCode, String)> {
        let stranger = || (StatusCode::UNAUTHORIZED, "log in first\n".to_owned());
        let visitor = self.visitor(headers, address).ok_or_else(stranger)?;
        match self.seat(&visitor, headers, places).await {
            Ok(()) => Ok(visitor),
            Err(why) => Err((StatusCode::SERVICE_UNAVAILABLE, why + "\n")),
        }
    }

    /// Takes a place for a new connection: one of a user or with the right token takes none of the pages
    /// without.
    ///
    /// # Errors
    /// Why there is no place.
    async fn seat(
        &self,
        visitor: &Visitor,
        headers: &HeaderMap,
        [places, strangers]: [&Places; 2],
    ) -> Result<(), String> {
        if visitor.may(UserRole::Drive) || visitor.login.is_some() {
            visitor.settle(Some(self.place(places, visitor)?));
            return Ok(());
        }
        match gate::shown(headers) {
            Some(shown) if self.admits(visitor, shown).await => self.trust(visitor, places),
            // Hello says that the token is needed, so that the page asks the user for another.
            _ => {
                visitor.settle(Some(self.place(strangers, visitor)?));
                Ok(())
            }
        }
    }

    /// Checks the token that a page shows later.
    ///
    /// # Errors
    /// Why it gains the page nothing.
    async fn admit_later(
        &self,
        visitor: &Visitor,
        shown: &str,
        places: &Places,
    ) -> Result<(), String> {
        if !self.admits(visitor, shown).await {
            return Err("wrong token".to_owned());
        }
        if self.admission.gate.token().is_none() || visitor.may(UserRole::Drive) {
            return Ok(());
        }
        self.trust(visitor, places)
    }

    fn trust(&self, visitor: &Visitor, places: &Places) -> Result<(), String> {
        visitor.settle(Some(self.place(places, visitor)?));
        visitor.trust();
        let Visitor { user, address, .. } = visitor;
        self.admission.trail.login(user, *address, None);
        Ok(())
    }

    fn place(&self, places: &Places, visitor: &Visitor) -> Result<Place, String> {
        places.take(Source::of(visitor.address)).map_err(|why| {
            self.counters.no_place.fetch_add(1, Relaxed);
            let of_address = Server::PAGES_OF_ADDRESS;
            match why {
                NoPlace::Full => "the limit of pages is reached; close one of them".to_owned(),
                NoPlace::Share => format!(
                    "the limit of {of_address} pages of one address is reached; close one of them"
                ),
            }
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
    async fn check_reader(&self, headers: &HeaderMap, address: SocketAddr) -> Result<(), Refusal> {
        let Some(visitor) = self.visitor(headers, address) else {
            return Err((StatusCode::UNAUTHORIZED, "log in first\n"));
        };
        if visitor.may(UserRole::Observe) {
            return Ok(());
        }
        match gate::shown(headers) {
            Some(shown) if self.admits(&visitor, shown).await => Ok(()),
            _ => {
                let words = "this requires the token: send Authorization: Bearer TOKEN\n";
                Err((StatusCode::UNAUTHORIZED, words))
            }
        }
    }
}
