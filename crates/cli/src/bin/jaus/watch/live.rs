//! Follows messages through the debug view of a running node.

use std::time::Duration;

use futures_util::StreamExt;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::say;
use jaus_cli::runtime;
use jaus_view::{Filter, MessageStream};
use tokio_tungstenite::tungstenite::{Error, Message};

use super::{Printer, tell_lost};

/// Shows what a debug view sends. What it could not decode is decoded here. `filters_here`: after
/// that, instead of in the debug view.
pub(super) fn watch(
    address: &str,
    filter: &Filter,
    filters_here: bool,
    limit: Option<Duration>,
    printer: &mut Printer<'_>,
) -> Result<Outcome, Failure> {
    let (there, here) = match filters_here {
        true => (Filter::default(), filter.clone()),
        false => (filter.clone(), Filter::default()),
    };
    let url = url(address, &there);
    let stream = MessageStream::new(printer.dictionary, here);
    runtime::run(async {
        let (mut socket, _) = tokio_tungstenite::connect_async(&url)
            .await
            .map_err(|error| no_view(address, &error))?;
        let end = runtime::end(limit);
        tokio::pin!(end);
        loop {
            let message = tokio::select! {
                () = &mut end => return Ok(Outcome::Done),
                message = socket.next() => message,
            };
            match message {
                Some(Ok(Message::Text(text))) => match stream.read_json(&text) {
                    Ok(Some(entry)) => printer.object(&entry)?,
                    Ok(None) => tell_lost(&text, printer)?,
                    Err(_) => {
                        return Err(Failure::new(format!("{address} sends no JSON objects")));
                    }
                },
                Some(Ok(Message::Close(_))) | None => break,
                Some(Ok(_)) => {}
                Some(Err(error)) => {
                    say(format_args!("{address}: {error}"));
                    break;
                }
            }
        }
        say(format_args!("{address} closed the connection"));
        Ok(Outcome::Incomplete)
    })
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
