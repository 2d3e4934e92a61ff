//! The web server: the page's files, the WebSocket to the session, and access protection. It holds
//! no vehicle state: snapshots and requests just pass through.

mod base_map;
mod bounds;
mod connections;
mod guard;
mod socket;
mod view;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Path, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use axum::{Json, Router};
use serde::Serialize;
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, oneshot};

use self::connections::Connections;
use super::base_map::BaseMap;
use super::page::{self, File};
use super::session::{Access, Order};
use super::token::Token;
use jaus::address::JausId;
use jaus::node::Node;
use jaus_view::Dictionary;

/// Access rules, and the identity shown to pages.
pub(super) struct Admission {
    pub(super) operator: JausId,
    pub(super) authority: u8,
    pub(super) token: Option<Token>,
    pub(super) token_to_read: bool,
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
    places: Arc<Semaphore>,
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
    /// Pages that exceeded the frame size or rate.
    too_much: AtomicU64,
}

/// Health report for monitoring.
#[derive(Serialize)]
struct Health {
    ok: bool,
    pages: usize,
    no_place: u64,
    strangers: u64,
    wrong_tokens: u64,
    too_much: u64,
}

impl Server {
    /// Maximum number of pages served at once.
    const PAGES: usize = 32;

    pub(super) fn new(admission: Admission, access: Access) -> Self {
        let shared = Shared {
            admission,
            access,
            dictionary: Dictionary::of(jaus_vehicle::messages::registry()),
            places: Arc::new(Semaphore::new(Self::PAGES)),
            readers: Arc::new(Semaphore::new(base_map::READERS)),
            pages: AtomicU64::new(0),
            counters: Counters::default(),
        };
        Self {
            shared: Arc::new(shared),
        }
    }

    /// Serves pages for as long as the listener accepts connections.
    pub(super) async fn run(self, listener: TcpListener) -> std::io::Error {
        let files = page::FILES.iter().fold(Router::new(), |router, file| {
            router.route(file.path, get(move || serve_file(file)))
        });
        let router = files
            .route("/ws", get(serve_page))
            .route("/map/{vehicle}/{map}", get(serve_map))
            .route("/base-map", get(base_map::describe))
            .route("/base-map/{zoom}/{x}/{y}", get(base_map::serve))
            .route("/health", get(health))
            .layer(middleware::from_fn_with_state(self.shared.clone(), admit))
            .with_state(self.shared);
        match axum::serve(Connections::new(listener), router).await {
            Ok(()) => std::io::Error::other("the listener failed"),
            Err(error) => error,
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
        headers.insert(name, HeaderValue::from_static(value));
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
        pages: Server::PAGES - shared.places.available_permits(),
        no_place: counters.no_place.load(Relaxed),
        strangers: counters.strangers.load(Relaxed),
        wrong_tokens: counters.wrong_tokens.load(Relaxed),
        too_much: counters.too_much.load(Relaxed),
    })
}

/// The cells of a vehicle's map, one octet each, row by row. The snapshot states the revision; the one in the
/// URL only separates the entries in browser caches.
async fn serve_map(
    State(shared): State<Arc<Shared>>,
    Path((vehicle, map)): Path<(u16, u16)>,
    headers: HeaderMap,
) -> Response {
    if !shared.lets_read(&headers) {
        let words = "the map requires the token: send Authorization: Bearer TOKEN\n";
        return (StatusCode::UNAUTHORIZED, words).into_response();
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

async fn serve_page(State(shared): State<Arc<Shared>>, upgrade: WebSocketUpgrade) -> Response {
    let Ok(place) = shared.places.clone().try_acquire_owned() else {
        shared.counters.no_place.fetch_add(1, Relaxed);
        let words = format!(
            "the limit of {} pages is reached; close one of them\n",
            Server::PAGES
        );
        return (StatusCode::SERVICE_UNAVAILABLE, words).into_response();
    };
    upgrade
        .max_message_size(bounds::LARGEST_FRAME)
        .max_frame_size(bounds::LARGEST_FRAME)
        .on_upgrade(async move |socket| {
            socket::serve(socket, shared).await;
            drop(place);
        })
}

impl Shared {
    /// Whether changing the vehicle requires a token.
    fn needs_token(&self) -> bool {
        self.admission.token.is_some()
    }

    /// Whether the shown token is right. Wrong tokens are counted.
    fn admits(&self, shown: &str) -> bool {
        let right = self
            .admission
            .token
            .as_ref()
            .is_none_or(|token| token.is(shown));
        if !right {
            self.counters.wrong_tokens.fetch_add(1, Relaxed);
        }
        right
    }

    /// Whether a request may read vehicle data.
    fn lets_read(&self, headers: &HeaderMap) -> bool {
        let shown = headers.get(header::AUTHORIZATION);
        let shown = shown.and_then(|it| it.to_str().ok()?.strip_prefix("Bearer "));
        !self.admission.token_to_read || shown.is_some_and(|it| self.admits(it))
    }
}
