//! The pages' server: the page's files, the WebSocket to the session, and what keeps strangers out.
//! It holds nothing of the vehicle: snapshots pass through, requests are handed to the session.

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
use super::page::{self, File};
use super::session::{Access, Order};
use super::token::Token;
use jaus::address::JausId;
use jaus::node::Node;
use jaus_view::Dictionary;

/// Who may come in, and whom they meet.
pub(super) struct Admission {
    pub(super) operator: JausId,
    pub(super) authority: u8,
    pub(super) token: Option<Token>,
    pub(super) token_to_read: bool,
    pub(super) hosts: Vec<String>,
    /// The station's node, if it is in this process: what passes it can be seen.
    pub(super) node: Option<Node>,
}

/// The server, not yet listening.
pub(super) struct Server {
    shared: Arc<Shared>,
}

/// What all connections share.
struct Shared {
    admission: Admission,
    access: Access,
    dictionary: Dictionary,
    /// Places for pages.
    places: Arc<Semaphore>,
    pages: AtomicU64,
    counters: Counters,
}

/// What was kept out, since the start.
#[derive(Default)]
struct Counters {
    /// Pages that found no place.
    no_place: AtomicU64,
    /// Requests of other sites' pages, or under a name that is not ours.
    strangers: AtomicU64,
    wrong_tokens: AtomicU64,
    /// Pages that said too much at once, or too often.
    too_much: AtomicU64,
}

/// How the server is, for whoever supervises it.
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
    /// How many pages are served at once.
    const PAGES: usize = 32;

    pub(super) fn new(admission: Admission, access: Access) -> Self {
        let shared = Shared {
            admission,
            access,
            dictionary: Dictionary::new().with_messages(jaus_vehicle::messages::registry()),
            places: Arc::new(Semaphore::new(Self::PAGES)),
            pages: AtomicU64::new(0),
            counters: Counters::default(),
        };
        Self {
            shared: Arc::new(shared),
        }
    }

    /// Serves pages for as long as the listener does.
    pub(super) async fn run(self, listener: TcpListener) -> std::io::Error {
        let files = page::FILES.iter().fold(Router::new(), |router, file| {
            router.route(file.path, get(move || serve_file(file)))
        });
        let router = files
            .route("/ws", get(serve_page))
            .route("/map/{id}", get(serve_map))
            .route("/health", get(health))
            .layer(middleware::from_fn_with_state(self.shared.clone(), admit))
            .with_state(self.shared);
        match axum::serve(Connections::new(listener), router).await {
            Ok(()) => std::io::Error::other("the listener has ended"),
            Err(error) => error,
        }
    }
}

/// Lets nobody in who comes by way of another site, and tells the browser how to treat the answer.
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

/// The cells of a map, one octet each, row by row. Which revision they are of the state tells; the
/// one in the address keeps browsers from mixing them up.
async fn serve_map(
    State(shared): State<Arc<Shared>>,
    Path(map): Path<u16>,
    headers: HeaderMap,
) -> Response {
    if !shared.lets_read(&headers) {
        let words = "the map needs the token, as Authorization: Bearer TOKEN\n";
        return (StatusCode::UNAUTHORIZED, words).into_response();
    }
    let (reply, cells) = oneshot::channel();
    let reply = Box::new(move |result| {
        // Nobody waits any more if it can not be sent.
        let _ = reply.send(result);
    });
    let order = Order::Cells { map, reply };
    // If it could not be sent, nobody holds the other end.
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
            "{} pages are open already; close one of them\n",
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
    /// Whether somebody who has shown nothing yet may change the vehicle.
    fn needs_token(&self) -> bool {
        self.admission.token.is_some()
    }

    /// Whether what was shown is the token; what is wrong is counted.
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

    /// Whether a request may look at what the vehicle tells.
    fn lets_read(&self, headers: &HeaderMap) -> bool {
        let shown = headers.get(header::AUTHORIZATION);
        let shown = shown.and_then(|it| it.to_str().ok()?.strip_prefix("Bearer "));
        !self.admission.token_to_read || shown.is_some_and(|it| self.admits(it))
    }
}
