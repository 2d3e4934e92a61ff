//! The debug view: serves the traffic of nodes to viewers on this host, over HTTP and WebSocket.
//!
//! | path | content |
//! |---|---|
//! | `/messages` | a WebSocket that sends every message as a JSON object, one per frame; its parameters are the terms of a [`Filter`]: `/messages?message=Velocity&field=velocity_x>1` |
//! | `/tree` | the discovered components, as JSON |
//!
//! It is read-only: input from viewers is ignored. A slow viewer loses messages and receives their
//! number in `{"lost":N}`; the traffic never waits.
//!
//! Its usual address is a Unix socket that other users of the host cannot reach. A TCP port is open
//! to all of them; requests from pages of other sites are refused, because any web page can make a
//! browser connect to this host.

use std::convert::Infallible;
use std::fmt;
use std::net::{AddrParseError, SocketAddr};
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;
use std::time::Duration;

use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Query, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
#[cfg(unix)]
use axum::serve::Listener;
use axum::{Json, Router};
use futures_util::stream::{SplitSink, SplitStream, select_all, unfold};
use futures_util::{SinkExt, StreamExt};
use tokio::net::TcpListener;
#[cfg(unix)]
use tokio::net::UnixStream;
use tokio::sync::Semaphore;

use super::dictionary::Dictionary;
use super::stream::{Filter, Links, MessageStream};
use super::tree;
use jaus::component::Component;
#[cfg(unix)]
use jaus::link::local::OwnerSocket;
use jaus::node::{Node, Tap, Tapped};

/// Limit of simultaneous viewers.
pub const MOST_VIEWERS: usize = 16;
/// Limit of passages that wait for one viewer.
const WAITING: usize = 1024;
/// Limit of waiting messages that are sent together.
const TOGETHER: usize = 64;
/// The longest frame accepted from a viewer, whose input is ignored.
const LONGEST: usize = 1024;
/// Pause after a viewer could not connect.
#[cfg(unix)]
const PAUSE: Duration = Duration::from_millis(100);
/// How long a viewer may read nothing before it is disconnected.
const PATIENCE: Duration = Duration::from_secs(30);

/// A read-only view of the traffic of nodes.
///
/// ```no_run
/// # use jaus::component::Component;
/// # use jaus::node::Node;
/// # use jaus_view::{Dictionary, debug::{DebugAddress, DebugView}};
/// # async fn example(node: Node, component: Component) -> std::io::Result<()> {
/// let view = DebugView::new([node], component, Dictionary::new());
/// let listener = DebugAddress::usual(0).listen().await?;
/// view.serve(listener).await?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct DebugView(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    nodes: Vec<Node>,
    component: Component,
    dictionary: Dictionary,
    viewers: Arc<Semaphore>,
}

impl DebugView {
    /// Creates a view of the traffic of `nodes`, decoded with `dictionary`, and of the directory of
    /// `component`, which is attached to one of them. A message between two of the nodes is shown
    /// once.
    #[must_use]
    pub fn new(
        nodes: impl IntoIterator<Item = Node>,
        component: Component,
        dictionary: Dictionary,
    ) -> Self {
        Self(Arc::new(Inner {
            nodes: nodes.into_iter().collect(),
            component,
            dictionary,
            viewers: Arc::new(Semaphore::new(MOST_VIEWERS)),
        }))
    }

    /// The routes, to serve alone or together with others.
    pub fn router(self) -> Router {
        Router::new()
            .route("/messages", get(messages))
            .route("/tree", get(show_tree))
            .with_state(self)
    }

    /// Serves viewers. Ends only with an error.
    ///
    /// # Errors
    /// The error of the operating system.
    pub async fn serve(self, listener: impl Into<DebugListener>) -> std::io::Result<Infallible> {
        match listener.into() {
            DebugListener::Tcp(listener) => axum::serve(listener, self.router()).await?,
            #[cfg(unix)]
            DebugListener::Unix(socket) => axum::serve(OfOwner(socket), self.router()).await?,
        }
        Err(std::io::ErrorKind::ConnectionAborted.into())
    }
}

async fn show_tree(State(DebugView(view)): State<DebugView>, headers: HeaderMap) -> Response {
    if let Err(refusal) = check_site(&headers) {
        return refusal.into_response();
    }
    let nobody = jaus::address::JausId::new(0, 0, 0);
    Json(tree::json(&view.component.directory(), nobody)).into_response()
}

async fn messages(
    State(DebugView(view)): State<DebugView>,
    Query(terms): Query<Vec<(String, String)>>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    if let Err(refusal) = check_site(&headers) {
        return refusal.into_response();
    }
    let mut filter = Filter::default();
    for (key, value) in &terms {
        if let Err(error) = filter.add(key, value) {
            return (StatusCode::BAD_REQUEST, error.to_string()).into_response();
        }
    }
    let Ok(place) = view.viewers.clone().try_acquire_owned() else {
        let words = format!("the limit of {MOST_VIEWERS} viewers is reached: close one");
        return (StatusCode::SERVICE_UNAVAILABLE, words).into_response();
    };
    let upgrade = upgrade.max_message_size(LONGEST).max_frame_size(LONGEST);
    upgrade.on_upgrade(async move |socket| {
        let (sender, receiver) = socket.split();
        tokio::select! {
            () = show(&view, filter, sender) => {}
            () = until_gone(receiver) => {}
        }
        drop(place);
    })
}

/// Sends what passes, until the viewer or all nodes have gone.
async fn show(view: &Inner, filter: Filter, mut sender: SplitSink<WebSocket, Message>) {
    let mut links: Vec<_> = view.nodes.iter().cloned().map(Links::of).collect();
    let mut stream = MessageStream::new(&view.dictionary, filter);
    let taps = view.nodes.iter().enumerate().map(|(node, it)| {
        let tapped = |mut tap: Tap| async { Some((tap.next().await?, tap)) };
        unfold(it.tap(WAITING), tapped)
            .map(move |tapped| (node, tapped))
            .boxed()
    });
    let mut tapped = select_all(taps).ready_chunks(TOGETHER);
    while let Some(passed) = tapped.next().await {
        let mut texts = Vec::new();
        for (node, tapped) in passed {
            match tapped {
                Tapped::Lost(count) => texts.push(format!("{{\"lost\":{count}}}")),
                Tapped::Passage(passage) => {
                    let entries = stream.read_passage(&passage, &mut links[node]);
                    texts.extend(entries.iter().map(super::Entry::to_json));
                }
            }
        }
        if texts.is_empty() {
            // There may be much that does not pass the filter: others have their turn.
            tokio::task::yield_now().await;
            continue;
        }
        let send = async {
            for text in texts {
                sender.feed(Message::text(text)).await?;
            }
            sender.flush().await
        };
        #[expect(clippy::disallowed_methods, reason = "viewers run in real time")]
        let sent = tokio::time::timeout(PATIENCE, send).await;
        if !matches!(sent, Ok(Ok(()))) {
            return;
        }
    }
    // It has gone, at worst.
    let _ = sender.close().await;
}

/// Waits until the viewer has gone; whatever it says is passed over.
async fn until_gone(mut receiver: SplitStream<WebSocket>) {
    while let Some(Ok(message)) = receiver.next().await {
        if matches!(message, Message::Close(_)) {
            return;
        }
    }
}

/// Refuses what another site's page has asked a browser to do.
///
/// A browser names the page's site in `Origin`; that must be where it connects to. And a name that leads
/// to this host by a foreign name server is none of ours: the host must be an address or `localhost`.
fn check_site(headers: &HeaderMap) -> Result<(), (StatusCode, &'static str)> {
    let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
    let Some(origin) = text(header::ORIGIN) else {
        return Ok(());
    };
    let host = text(header::HOST).unwrap_or_default();
    let name = host.rsplit_once(':').map_or(host, |(name, _)| name);
    let is_known = name == "localhost"
        || name
            .trim_matches(['[', ']'])
            .parse::<std::net::IpAddr>()
            .is_ok();
    let same = origin
        .split_once("://")
        .is_some_and(|(_, site)| site == host);
    if is_known && same {
        Ok(())
    } else {
        Err((
            StatusCode::FORBIDDEN,
            "requests from other sites' pages are refused",
        ))
    }
}

/// Where a debug view is served: at the path of a Unix socket for the programs of one user, or at a
/// TCP port, which is open to everyone who reaches it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DebugAddress {
    /// A Unix socket.
    Path(PathBuf),
    /// A TCP port.
    Tcp(SocketAddr),
}

impl DebugAddress {
    /// The usual address of this user: of the first view (0) or of further ones. Without Unix
    /// sockets it is a port of loopback from 8794.
    #[must_use]
    pub fn usual(number: u16) -> Self {
        usual_address(number)
    }

    /// Opens the address.
    ///
    /// # Errors
    /// What the operating system says; or others could replace the socket.
    pub async fn listen(&self) -> std::io::Result<DebugListener> {
        match self {
            #[cfg(unix)]
            Self::Path(path) => OwnerSocket::listen(path)
                .map(DebugListener::Unix)
                .map_err(std::io::Error::other),
            #[cfg(not(unix))]
            Self::Path(_) => Err(std::io::ErrorKind::Unsupported.into()),
            Self::Tcp(address) => TcpListener::bind(address).await.map(DebugListener::Tcp),
        }
    }
}

#[cfg(unix)]
fn usual_address(number: u16) -> DebugAddress {
    let name = match number {
        0 => "debug.sock".to_owned(),
        _ => format!("debug-{number}.sock"),
    };
    DebugAddress::Path(OwnerSocket::default_path(&name))
}

#[cfg(not(unix))]
fn usual_address(number: u16) -> DebugAddress {
    DebugAddress::Tcp((std::net::Ipv4Addr::LOCALHOST, 8794 + number).into())
}

impl FromStr for DebugAddress {
    type Err = AddrParseError;

    fn from_str(text: &str) -> Result<Self, AddrParseError> {
        if text.contains('/') {
            return Ok(Self::Path(text.into()));
        }
        text.parse().map(Self::Tcp)
    }
}

impl fmt::Display for DebugAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Path(path) => path.display().fmt(f),
            Self::Tcp(address) => address.fmt(f),
        }
    }
}

/// The open address of a debug view.
#[derive(Debug)]
pub enum DebugListener {
    /// A Unix socket.
    #[cfg(unix)]
    Unix(OwnerSocket),
    /// A TCP port.
    Tcp(TcpListener),
}

impl DebugListener {
    /// Its address.
    #[must_use]
    pub fn address(&self) -> Option<DebugAddress> {
        match self {
            #[cfg(unix)]
            Self::Unix(socket) => Some(DebugAddress::Path(socket.path().to_owned())),
            Self::Tcp(listener) => listener.local_addr().ok().map(DebugAddress::Tcp),
        }
    }
}

impl From<TcpListener> for DebugListener {
    fn from(listener: TcpListener) -> Self {
        Self::Tcp(listener)
    }
}

/// Serves the owner of a socket alone.
#[cfg(unix)]
struct OfOwner(OwnerSocket);

#[cfg(unix)]
impl Listener for OfOwner {
    type Io = UnixStream;
    type Addr = ();

    async fn accept(&mut self) -> (UnixStream, ()) {
        loop {
            match self.0.accept().await {
                Ok(stream) => return (stream, ()),
                Err(error) => {
                    tracing::warn!("debug view: {error}");
                    #[expect(clippy::disallowed_methods, reason = "viewers run in real time")]
                    tokio::time::sleep(PAUSE).await;
                }
            }
        }
    }

    fn local_addr(&self) -> std::io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_allowed(host: &'static str, origin: Option<&'static str>) -> bool {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, host.parse().unwrap());
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, origin.parse().unwrap());
        }
        check_site(&headers).is_ok()
    }

    #[cfg(unix)]
    #[tokio::test]
    async fn a_socket_is_for_its_owner_alone_and_gone_with_its_view() {
        use std::os::unix::fs::PermissionsExt as _;

        let folder = std::env::temp_dir().join(format!("jaus-debug-{}", std::process::id()));
        std::fs::create_dir(&folder).unwrap();
        let path = folder.join("debug.sock");
        let address: DebugAddress = path.to_str().unwrap().parse().unwrap();
        let listener = address.listen().await.unwrap();
        assert_eq!(listener.address(), Some(address.clone()));
        let mode = std::fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        assert!(address.listen().await.is_err(), "it is in use");
        drop(listener);
        assert!(!path.exists());
        std::fs::remove_dir(&folder).unwrap();
    }

    #[test]
    fn pages_of_other_sites_are_refused() {
        assert!(is_allowed("127.0.0.1:8794", None), "no browser");
        assert!(is_allowed("127.0.0.1:8794", Some("http://127.0.0.1:8794")));
        assert!(is_allowed("localhost:8794", Some("http://localhost:8794")));
        assert!(is_allowed("[::1]:8794", Some("http://[::1]:8794")));
        assert!(!is_allowed("127.0.0.1:8794", Some("http://evil.example")));
        assert!(!is_allowed("127.0.0.1:8794", Some("null")));
        let rebound = "http://evil.example:8794";
        assert!(!is_allowed("evil.example:8794", Some(rebound)));
    }
}
