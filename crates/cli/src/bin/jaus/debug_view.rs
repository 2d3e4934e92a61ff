//! A client of a communicator's debug view: for `jaus watch` and `jaus view`.

use std::io;

use futures_util::StreamExt;
use jaus_cli::failure::Failure;
use jaus_cli::output::say;
use jaus_view::Filter;
use jaus_view::debug::DebugAddress;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{WebSocketStream, client_async};

/// A connection to a debug view.
pub(crate) struct DebugView {
    address: String,
    socket: Box<WebSocketStream<Box<dyn Stream>>>,
}

/// A connection of either kind.
trait Stream: AsyncRead + AsyncWrite + Send + Unpin {}

impl<S: AsyncRead + AsyncWrite + Send + Unpin> Stream for S {}

/// The usual address of this user's debug view.
pub(crate) fn usual_address() -> String {
    DebugAddress::usual(0).to_string()
}

impl DebugView {
    /// Connects for the messages that match a filter.
    pub(crate) async fn connect(address: &str, filter: &Filter) -> Result<Self, Failure> {
        let (place, is_path) = place(address);
        let stream = connect(place, is_path).await;
        let stream = stream.map_err(|error| no_view(address, &Error::Io(error)))?;
        let host = if is_path { "localhost" } else { place };
        let connected = client_async(url(host, filter), stream).await;
        let (socket, _) = connected.map_err(|error| no_view(address, &error))?;
        Ok(Self {
            address: address.to_owned(),
            socket: Box::new(socket),
        })
    }

    /// The next message, as JSON; `None` at the end of the connection.
    pub(crate) async fn next(&mut self) -> Option<String> {
        loop {
            match self.socket.next().await? {
                Ok(Message::Text(text)) => return Some(text.to_string()),
                Ok(Message::Close(_)) => return None,
                Ok(_) => {}
                Err(error) => {
                    say(format_args!("{}: {error}", self.address));
                    return None;
                }
            }
        }
    }
}

/// The path of a socket, or the host and port of a URL or an address; and whether it is a path.
fn place(address: &str) -> (&str, bool) {
    if address.contains('/') && !address.contains("://") {
        return (address, true);
    }
    let place = address.trim_end_matches('/');
    let place = place.strip_suffix("/messages").unwrap_or(place);
    (place.strip_prefix("ws://").unwrap_or(place), false)
}

async fn connect(place: &str, is_path: bool) -> io::Result<Box<dyn Stream>> {
    match is_path {
        true => connect_to_socket(place).await,
        false => Ok(Box::new(TcpStream::connect(place).await?)),
    }
}

#[cfg(unix)]
async fn connect_to_socket(path: &str) -> io::Result<Box<dyn Stream>> {
    Ok(Box::new(tokio::net::UnixStream::connect(path).await?))
}

#[cfg(not(unix))]
async fn connect_to_socket(_: &str) -> io::Result<Box<dyn Stream>> {
    Err(io::ErrorKind::Unsupported.into())
}

/// The URL of the message stream, with the filter.
fn url(host: &str, filter: &Filter) -> String {
    let mut url = format!("ws://{host}/messages");
    if !filter.is_empty() {
        url.push_str("?filter=");
        for octet in filter.to_string().bytes() {
            match octet {
                b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'.' | b'-' | b'_' => {
                    url.push(char::from(octet));
                }
                other => url.push_str(&format!("%{other:02X}")),
            }
        }
    }
    url
}

fn no_view(address: &str, error: &Error) -> Failure {
    let words = match error {
        Error::Http(response) => {
            let body = response.body().as_deref().unwrap_or_default();
            let said = String::from_utf8_lossy(body);
            format!(
                "{address} refused the request: {} {said}",
                response.status()
            )
        }
        Error::Url(_) | Error::HttpFormat(_) => not_an_address(address),
        Error::Io(error) if error.kind() == io::ErrorKind::InvalidInput => not_an_address(address),
        other => format!(
            "there is no debug view at {address}: {other}. Start jaus-communicator, choose its \
             address with --at, watch the network itself with --interface all, or read a log with \
             `jaus watch FILE`"
        ),
    };
    Failure::new(words)
}

fn not_an_address(address: &str) -> String {
    format!(
        "`{address}` is not an address of a debug view: write the path of its socket, or for example \
         127.0.0.1:8794"
    )
}
