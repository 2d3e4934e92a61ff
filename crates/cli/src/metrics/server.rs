//! The HTTP server of the metrics: one request for each connection, and bounds for everything that
//! a client chooses.
#![expect(
    clippy::disallowed_methods,
    reason = "the server's deadlines and the age of its answers"
)]

use std::io;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use jaus_limits::{Source, Yielding};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpListener;
use tokio::task::{AbortHandle, JoinSet};
use tokio::time::{Instant, sleep, timeout};

use super::exposition::Format;

/// Connections at once. If there are more, one of the address with the most gives way.
const MOST: usize = 16;
/// Time for a whole connection, from its first octet to its last.
const DEADLINE: Duration = Duration::from_secs(5);
/// Largest request header in octets.
const LARGEST_HEADER: usize = 4096;
/// For how long an answer is given again, so that no client makes the program compute more than ten
/// times a second.
const AGE: Duration = Duration::from_millis(100);
/// Delay before the next attempt after a failed accept.
const PAUSE: Duration = Duration::from_millis(100);

/// Computes the metrics in a format.
pub(super) type Render = dyn Fn(Format) -> String + Send + Sync;

/// Answers requests for the metrics.
pub(super) struct Server {
    render: Box<Render>,
    /// Whether requests must name this host by address or as `localhost`.
    checks_host: bool,
    /// The latest answer in each format.
    latest: Mutex<[Option<Answer>; 2]>,
}

/// Metrics, and when they were computed.
struct Answer {
    at: Instant,
    text: Arc<str>,
}

impl Server {
    /// A server that only this host can reach checks the header `Host`: a page whose name resolves
    /// to the loopback address must not read the metrics through the user's browser.
    pub(super) fn new(render: Box<Render>, is_loopback: bool) -> Self {
        Self {
            render,
            checks_host: is_loopback,
            latest: Mutex::default(),
        }
    }

    /// Serves for as long as the program runs.
    pub(super) async fn run(self, listener: TcpListener) {
        let mut open = Yielding::new(MOST);
        let server = Arc::new(self);
        let mut tasks = JoinSet::new();
        loop {
            let accepted = tokio::select! {
                accepted = listener.accept() => accepted,
                Some(_) = tasks.join_next() => continue,
            };
            let (stream, address) = match accepted {
                Ok(accepted) => accepted,
                Err(error) => {
                    tracing::warn!(%error, "cannot accept connections for metrics");
                    sleep(PAUSE).await;
                    continue;
                }
            };
            let server = server.clone();
            let task = tasks.spawn(async move {
                if let Err(error) = server.serve(stream).await {
                    tracing::debug!(%address, %error, "no metrics sent");
                }
            });
            let oldest = open.add(Source::of(address), task, AbortHandle::is_finished);
            if let Some(oldest) = oldest {
                tracing::debug!(%address, "too many connections for metrics: one is closed");
                oldest.abort();
            }
        }
    }

    /// Serves one connection within the deadline.
    async fn serve(&self, mut stream: impl AsyncRead + AsyncWrite + Unpin) -> io::Result<()> {
        let serving = async {
            let answer = match read_header(&mut stream).await? {
                Some(header) => self.answer(&header),
                None => refusal(
                    "431 Request Header Fields Too Large",
                    "the header is too long",
                ),
            };
            stream.write_all(answer.as_bytes()).await?;
            stream.shutdown().await
        };
        match timeout(DEADLINE, serving).await {
            Ok(served) => served,
            Err(_) => Err(io::ErrorKind::TimedOut.into()),
        }
    }

    fn answer(&self, header: &str) -> String {
        let Some(request) = Request::parse(header) else {
            return refusal("400 Bad Request", "this is no HTTP request");
        };
        if self.checks_host && !request.names_this_host() {
            let words = "name this host by its address or as localhost";
            return refusal("421 Misdirected Request", words);
        }
        match (request.method, request.path) {
            ("GET" | "HEAD", "/metrics") => self.metrics(&request),
            ("GET" | "HEAD", _) => refusal("404 Not Found", "the metrics are at /metrics"),
            _ => refusal("405 Method Not Allowed", "only GET and HEAD are served"),
        }
    }

    fn metrics(&self, request: &Request<'_>) -> String {
        let format = Format::accepted(request.field("accept").unwrap_or_default());
        let body = self.rendered(format);
        let shown = if request.method == "HEAD" { "" } else { &*body };
        format!(
            "HTTP/1.1 200 OK\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n\
             Cache-Control: no-store\r\n\r\n{shown}",
            format.content_type(),
            body.len()
        )
    }

    /// The metrics at present, or of a moment ago.
    fn rendered(&self, format: Format) -> Arc<str> {
        let now = Instant::now();
        let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        let latest = &mut latest[format as usize];
        match latest {
            Some(answer) if now.duration_since(answer.at) < AGE => answer.text.clone(),
            _ => {
                let text: Arc<str> = (self.render)(format).into();
                *latest = Some(Answer {
                    at: now,
                    text: text.clone(),
                });
                text
            }
        }
    }
}

/// Reads a request up to the end of its header; `None` if the header is too long.
async fn read_header(stream: &mut (impl AsyncRead + Unpin)) -> io::Result<Option<String>> {
    let mut header = Vec::with_capacity(512);
    while !header.windows(4).any(|it| it == b"\r\n\r\n") {
        if header.len() >= LARGEST_HEADER {
            return Ok(None);
        }
        let rest = LARGEST_HEADER - header.len();
        if (&mut *stream)
            .take(rest as u64)
            .read_buf(&mut header)
            .await?
            == 0
        {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
    }
    Ok(Some(String::from_utf8_lossy(&header).into_owned()))
}

/// The answer to a request that gets no metrics.
fn refusal(status: &str, words: &str) -> String {
    let length = words.len() + 1;
    format!(
        "HTTP/1.1 {status}\r\nContent-Type: text/plain\r\nContent-Length: {length}\r\n\
         Connection: close\r\n\r\n{words}\n"
    )
}

/// The header of a request.
struct Request<'h> {
    method: &'h str,
    /// Without the query.
    path: &'h str,
    fields: &'h str,
}

impl<'h> Request<'h> {
    fn parse(header: &'h str) -> Option<Self> {
        let (line, fields) = header.split_once("\r\n")?;
        let mut words = line.split(' ');
        let (method, target, version) = (words.next()?, words.next()?, words.next()?);
        let path = target.split_once('?').map_or(target, |(path, _)| path);
        version.starts_with("HTTP/1.").then_some(Self {
            method,
            path,
            fields,
        })
    }

    /// The value of a field, by its name in lower case.
    fn field(&self, name: &str) -> Option<&'h str> {
        let mut fields = self.fields.lines().filter_map(|line| line.split_once(':'));
        let field = fields.find(|(field, _)| field.eq_ignore_ascii_case(name));
        field.map(|(_, value)| value.trim())
    }

    fn names_this_host(&self) -> bool {
        let host = self.field("host").unwrap_or_default();
        let name = match host.rsplit_once(':') {
            Some((name, port)) if port.bytes().all(|it| it.is_ascii_digit()) => name,
            _ => host,
        };
        let address = name.trim_start_matches('[').trim_end_matches(']');
        address.parse::<IpAddr>().is_ok() || name.eq_ignore_ascii_case("localhost")
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use tokio::io::duplex;

    use super::*;

    fn server(is_loopback: bool) -> Server {
        let computed = AtomicU32::new(0);
        let render = move |format| {
            let number = computed.fetch_add(1, Ordering::Relaxed) + 1;
            format!("{format:?} {number}\n")
        };
        Server::new(Box::new(render), is_loopback)
    }

    async fn ask(server: &Server, request: &[u8]) -> String {
        let (mut client, stream) = duplex(16_384);
        client.write_all(request).await.unwrap();
        // An error shows in the answer.
        let _ = server.serve(stream).await;
        let mut answer = String::new();
        client.read_to_string(&mut answer).await.unwrap();
        answer
    }

    #[tokio::test(start_paused = true)]
    async fn metrics_are_served_in_the_accepted_format() {
        let server = server(true);
        let plain = ask(&server, b"GET /metrics HTTP/1.1\r\nHost: [::1]:9\r\n\r\n").await;
        assert!(plain.starts_with("HTTP/1.1 200 OK\r\n"), "{plain}");
        assert!(plain.contains("version=0.0.4"), "{plain}");
        assert!(plain.ends_with("\r\n\r\nPrometheus 1\n"), "{plain}");
        let open = b"GET /metrics?x HTTP/1.1\r\nhost: localhost\r\n\
            accept: application/openmetrics-text\r\n\r\n";
        let open = ask(&server, open).await;
        assert!(open.ends_with("OpenMetrics 2\n"), "{open}");
        let head = ask(
            &server,
            b"HEAD /metrics HTTP/1.0\r\nHost: 127.0.0.1\r\n\r\n",
        )
        .await;
        assert!(head.contains("Content-Length: 13\r\n"), "{head}");
        assert!(head.ends_with("\r\n\r\n"), "{head}");
    }

    #[tokio::test(start_paused = true)]
    async fn requests_that_get_no_metrics_are_told_why() {
        let server = server(true);
        let long = [b"GET /metrics HTTP/1.1\r\nX: ", &[b'x'; 5000][..]].concat();
        for (request, status) in [
            (&b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"[..], "404 "),
            (b"POST /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n", "405 "),
            (
                b"GET /metrics HTTP/1.1\r\nHost: evil.example\r\n\r\n",
                "421 ",
            ),
            (b"GET /metrics HTTP/1.1\r\n\r\n", "421 "),
            (b"hello\r\n\r\n", "400 "),
            (b"\xff\xfe\r\n\r\n", "400 "),
            (&long, "431 "),
        ] {
            let answer = ask(&server, request).await;
            assert!(answer["HTTP/1.1 ".len()..].starts_with(status), "{answer}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_server_for_other_hosts_has_any_name() {
        let request = b"GET /metrics HTTP/1.1\r\nHost: rover.local:9794\r\n\r\n";
        let answer = ask(&server(false), request).await;
        assert!(answer.starts_with("HTTP/1.1 200 "), "{answer}");
    }

    #[tokio::test(start_paused = true)]
    async fn many_requests_are_computed_once_in_a_tenth_of_a_second() {
        let server = server(true);
        let request = b"GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n";
        for _ in 0..100 {
            assert!(ask(&server, request).await.ends_with("Prometheus 1\n"));
        }
        sleep(AGE).await;
        assert!(ask(&server, request).await.ends_with("Prometheus 2\n"));
    }

    #[tokio::test(start_paused = true)]
    async fn a_slow_client_is_cut_off_at_the_deadline() {
        let server = server(true);
        let (mut client, stream) = duplex(1024);
        let start = Instant::now();
        let trickling = async {
            while client.write_all(b"x").await.is_ok() {
                sleep(Duration::from_secs(1)).await;
            }
        };
        let (served, ()) = tokio::join!(server.serve(stream), trickling);
        assert_eq!(served.unwrap_err().kind(), io::ErrorKind::TimedOut);
        assert!(start.elapsed() <= DEADLINE + Duration::from_secs(1));
    }

    #[tokio::test(start_paused = true)]
    async fn a_client_that_does_not_read_is_cut_off_at_the_deadline() {
        let server = Server::new(Box::new(|_| "x".repeat(100_000)), true);
        let (mut client, stream) = duplex(1024);
        let request = b"GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n";
        client.write_all(request).await.unwrap();
        let start = Instant::now();
        let served = server.serve(stream).await;
        assert_eq!(served.unwrap_err().kind(), io::ErrorKind::TimedOut);
        assert!(start.elapsed() <= DEADLINE + Duration::from_secs(1));
    }
}
