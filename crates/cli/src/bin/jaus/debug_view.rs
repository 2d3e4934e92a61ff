//! A client of a communicator's debug view: for `jaus watch` and `jaus view`.

use futures_util::StreamExt;
use jaus_cli::failure::Failure;
use jaus_cli::output::say;
use jaus_view::Filter;
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream};

/// A connection to a debug view.
pub(crate) struct DebugView {
    address: String,
    socket: Box<WebSocketStream<MaybeTlsStream<TcpStream>>>,
}

impl DebugView {
    /// Connects for the messages that match a filter.
    pub(crate) async fn connect(address: &str, filter: &Filter) -> Result<Self, Failure> {
        let connected = tokio_tungstenite::connect_async(url(address, filter)).await;
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

/// The URL of the message stream, with the filter.
fn url(address: &str, filter: &Filter) -> String {
    let place = address.trim_end_matches('/');
    let place = place.strip_suffix("/messages").unwrap_or(place);
    let place = place.strip_prefix("ws://").unwrap_or(place);
    let mut url = format!("ws://{place}/messages");
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
        Error::Url(_) | Error::HttpFormat(_) => {
            format!(
                "`{address}` is not an address of a debug view: write for example 127.0.0.1:8794"
            )
        }
        other => format!(
            "there is no debug view at {address}: {other}. Start jaus-communicator, choose its \
             address with --at, watch the network itself with --interface all, or read a log with \
             `jaus watch FILE`"
        ),
    };
    Failure::new(words)
}
