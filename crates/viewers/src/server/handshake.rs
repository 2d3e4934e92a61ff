//! The handshake of a connection: subprotocol and origin.

use std::net::IpAddr;
use std::time::Duration;

use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::handshake::server::{
    Callback, ErrorResponse, Request, Response,
};
use tokio_tungstenite::tungstenite::http::{HeaderMap, HeaderValue, StatusCode, header};
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::{WebSocketStream, accept_hdr_async_with_config};

use crate::protocol::SUBPROTOCOLS;

/// Time limit of the handshake.
const DEADLINE: Duration = Duration::from_secs(10);
/// Limit of a message from a client, in octets: subscriptions to all channels.
const LONGEST: usize = 256 << 10;
/// The pages of Foxglove. Desktop programs and files name themselves `file://`.
const PAGES: [&str; 3] = [
    "https://app.foxglove.dev",
    "https://studio.foxglove.dev",
    "file://",
];

/// Completes the handshake.
///
/// # Errors
/// Why there is no connection.
pub(super) async fn accept(
    stream: TcpStream,
    origins: &[String],
) -> Result<WebSocketStream<TcpStream>, String> {
    let config = WebSocketConfig::default()
        .max_message_size(Some(LONGEST))
        .max_frame_size(Some(LONGEST));
    let handshake = accept_hdr_async_with_config(stream, RequestCheck { origins }, Some(config));
    #[expect(clippy::disallowed_methods, reason = "clients connect in real time")]
    let accepted = tokio::time::timeout(DEADLINE, handshake).await;
    match accepted {
        Ok(accepted) => accepted.map_err(|error| error.to_string()),
        Err(_) => Err("the handshake was not completed in time".to_owned()),
    }
}

/// Accepts or refuses a request.
struct RequestCheck<'o> {
    origins: &'o [String],
}

impl Callback for RequestCheck<'_> {
    fn on_request(
        self,
        request: &Request,
        mut response: Response,
    ) -> Result<Response, ErrorResponse> {
        if !is_allowed(request.headers(), self.origins) {
            return Err(refusal(
                StatusCode::FORBIDDEN,
                "pages of this site may not connect; `jaus view --origin` allows it",
            ));
        }
        let Some(chosen) = subprotocol(request.headers()) else {
            return Err(refusal(
                StatusCode::BAD_REQUEST,
                "this server speaks foxglove.websocket.v1 and foxglove.sdk.v1: open it in Foxglove as \
                 a Foxglove WebSocket connection",
            ));
        };
        let name = header::SEC_WEBSOCKET_PROTOCOL;
        response
            .headers_mut()
            .insert(name, HeaderValue::from_static(chosen));
        Ok(response)
    }
}

/// The preferred one of the subprotocols that a client offers.
fn subprotocol(headers: &HeaderMap) -> Option<&'static str> {
    let offered = headers.get_all(header::SEC_WEBSOCKET_PROTOCOL).iter();
    let offered = offered.filter_map(|it| it.to_str().ok());
    let offered: Vec<&str> = offered
        .flat_map(|it| it.split(','))
        .map(str::trim)
        .collect();
    SUBPROTOCOLS.into_iter().find(|it| offered.contains(it))
}

/// Whether the page that made the browser connect may do so; programs name no page.
///
/// Without this check, any page that a browser of this host shows could read the traffic.
fn is_allowed(headers: &HeaderMap, origins: &[String]) -> bool {
    let Some(origin) = headers.get(header::ORIGIN) else {
        return true;
    };
    let Ok(origin) = origin.to_str() else {
        return false;
    };
    PAGES.contains(&origin) || origins.iter().any(|it| it == origin) || is_of_this_host(origin)
}

/// Whether a page was served by this host: `http://localhost:8080`.
fn is_of_this_host(origin: &str) -> bool {
    let Some((_, site)) = origin.split_once("://") else {
        return false;
    };
    let is_port = |port: &str| port.bytes().all(|it| it.is_ascii_digit());
    let name = match site.rsplit_once(':') {
        Some((name, port)) if is_port(port) => name,
        _ => site,
    };
    let address = name.trim_matches(['[', ']']).parse::<IpAddr>();
    name == "localhost" || address.is_ok_and(|address| address.is_loopback())
}

fn refusal(status: StatusCode, sentence: &str) -> ErrorResponse {
    let mut response = ErrorResponse::new(Some(format!("{sentence}\n")));
    *response.status_mut() = status;
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(name: header::HeaderName, value: &'static str) -> HeaderMap {
        HeaderMap::from_iter([(name, HeaderValue::from_static(value))])
    }

    #[test]
    fn pages_of_other_sites_may_not_connect() {
        let may = |origin| is_allowed(&headers(header::ORIGIN, origin), &[]);
        assert!(is_allowed(&HeaderMap::new(), &[]), "a program");
        for origin in [
            "https://app.foxglove.dev",
            "file://",
            "http://localhost:8080",
            "http://localhost",
            "http://127.0.0.1:8080",
            "http://[::1]:8080",
        ] {
            assert!(may(origin), "{origin}");
        }
        for origin in [
            "https://evil.example",
            "null",
            "http://localhost.evil.example",
            "http://127.0.0.1.evil.example:80",
            "https://app.foxglove.dev.evil.example",
            "http://10.0.0.7",
        ] {
            assert!(!may(origin), "{origin}");
        }
        let allowed = ["https://viewer.example".to_owned()];
        let origin = headers(header::ORIGIN, "https://viewer.example");
        assert!(is_allowed(&origin, &allowed));
    }

    #[test]
    fn a_subprotocol_that_both_know_is_chosen() {
        let chosen = |offered| subprotocol(&headers(header::SEC_WEBSOCKET_PROTOCOL, offered));
        assert_eq!(
            chosen("foxglove.websocket.v1"),
            Some("foxglove.websocket.v1")
        );
        let both = "other, foxglove.websocket.v1, foxglove.sdk.v1";
        assert_eq!(chosen(both), Some("foxglove.sdk.v1"));
        assert_eq!(chosen("foxglove.sdk.v1.1"), None);
        assert_eq!(subprotocol(&HeaderMap::new()), None);
    }
}
