//! Browser connections: their number, and the deadlines of handshakes,
//! request headers and silence.

use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::extract::ConnectInfo;
use axum::http::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use jaus_limits::{Source, Yielding};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, DuplexStream, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;
use tokio::task::{AbortHandle, JoinSet};
use tokio::time::{Instant, Sleep, sleep, timeout};
use tower::ServiceExt;

use crate::tls::Tls;

/// Connections with requests, besides the sockets of pages: more than all pages need, and far below the usual
/// limit of open files. If there are more, one of the address with the most gives way, so that no number of
/// addresses keeps a browser out.
const MOST: usize = 256;
/// Deadline of a TLS handshake.
const HANDSHAKE: Duration = Duration::from_secs(10);
/// Deadline of a request's header, also of the next one on the same connection.
const HEADER: Duration = Duration::from_secs(10);
/// Idle timeout. Pages answer pings more often than this.
const SILENCE: Duration = Duration::from_secs(30);
/// Delay before the next attempt after a failed accept.
const PAUSE: Duration = Duration::from_millis(100);
/// First octet of a TLS handshake.
const TLS_HANDSHAKE: u8 = 22;
/// Response to a request without TLS on a port with TLS.
const NO_TLS: &[u8] = b"HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain\r\n\
    Content-Length: 43\r\nConnection: close\r\n\r\nthis page requires https:// in its address\n";

/// Connections of browsers that are simulated in this process, with their addresses.
pub(crate) type MemoryBrowsers = mpsc::Receiver<(DuplexStream, SocketAddr)>;

/// Serves connections for as long as the listener works.
pub(super) async fn serve(listener: TcpListener, tls: Option<Tls>, router: Router) {
    let mut requesting = Yielding::new(MOST);
    let mut tasks = JoinSet::new();
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            Some(_) = tasks.join_next() => continue,
        };
        let (stream, address) = match accepted {
            Ok(accepted) => accepted,
            Err(error) => {
                tracing::warn!(%error, "cannot accept connections");
                sleep(PAUSE).await;
                continue;
            }
        };
        let connection = Connection::new(stream);
        let serving = serve_one(connection, address, tls.clone(), router.clone());
        // The task ends when a socket begins, which has a limit of its own.
        let task = tasks.spawn(serving);
        let source = Source::of(address);
        if let Some(oldest) = requesting.add(source, task, AbortHandle::is_finished) {
            tracing::debug!(%address, "too many connections: one of those with requests is closed");
            oldest.abort();
        }
    }
}

/// Serves connections that are made in this process, for as long as it makes them.
pub(super) async fn serve_in_memory(mut browsers: MemoryBrowsers, router: Router) {
    let mut tasks = JoinSet::new();
    loop {
        tokio::select! {
            Some((stream, address)) = browsers.recv() => {
                tasks.spawn(serve_http(stream, address, router.clone()));
            }
            Some(_) = tasks.join_next() => {}
            else => return,
        }
    }
}

async fn serve_one(
    mut connection: Connection,
    address: SocketAddr,
    tls: Option<Tls>,
    router: Router,
) {
    let Some(tls) = tls else {
        return serve_http(connection, address, router).await;
    };
    let handshake = async {
        if !connection.begins_with_tls().await? {
            connection.refuse(NO_TLS).await?;
            return Err(io::Error::other("a request without TLS"));
        }
        tls.accept(connection).await
    };
    match timeout(HANDSHAKE, handshake).await {
        Ok(Ok(stream)) => serve_http(stream, address, router).await,
        Ok(Err(error)) => tracing::debug!(%address, %error, "no TLS handshake"),
        Err(_) => tracing::debug!(%address, "the TLS handshake was not completed in time"),
    }
}

/// Serves the requests of a connection, which know its address.
async fn serve_http<S>(stream: S, address: SocketAddr, router: Router)
where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let service = service_fn(move |request: Request<Incoming>| {
        let mut request = request.map(Body::new);
        request.extensions_mut().insert(ConnectInfo(address));
        router.clone().oneshot(request)
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEADER)
        .serve_connection(TokioIo::new(stream), service)
        .with_upgrades();
    if let Err(error) = connection.await {
        tracing::debug!(%address, %error, "connection ended");
    }
}

/// A connection with an idle timeout.
struct Connection {
    stream: TcpStream,
    silence: Pin<Box<Sleep>>,
}

impl Connection {
    fn new(stream: TcpStream) -> Self {
        // Send small snapshots and commands without delay. A failure only adds latency.
        let _ = stream.set_nodelay(true);
        Self {
            stream,
            silence: Box::pin(sleep(SILENCE)),
        }
    }

    /// Whether the first octet is one of TLS. Waits for it.
    async fn begins_with_tls(&self) -> io::Result<bool> {
        let mut first = [0];
        self.stream.peek(&mut first).await?;
        Ok(first == [TLS_HANDSHAKE])
    }

    /// Answers a request that is not read further.
    async fn refuse(&mut self, answer: &[u8]) -> io::Result<()> {
        // Closing a socket with unread octets resets the connection, and the answer would be lost.
        let mut request = [0; 4096];
        let _ = self.read(&mut request).await?;
        self.write_all(answer).await?;
        self.shutdown().await
    }
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        match Pin::new(&mut self.stream).poll_read(context, buffer) {
            Poll::Ready(read) => {
                let until = Instant::now() + SILENCE;
                self.silence.as_mut().reset(until);
                Poll::Ready(read)
            }
            Poll::Pending => {
                ready!(self.silence.as_mut().poll(context));
                Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
            }
        }
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        octets: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(context, octets)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        octets: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write_vectored(context, octets)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }
}

#[cfg(test)]
mod tests {
    use axum::routing::get;
    use tokio::io::duplex;

    use super::*;

    fn router() -> Router {
        Router::new().route("/", get(async || "hello"))
    }

    #[tokio::test(start_paused = true)]
    async fn a_header_that_trickles_in_is_not_awaited_beyond_its_deadline() {
        let (mut browser, server) = duplex(1024);
        let start = Instant::now();
        let serving = tokio::spawn(serve_http(server, ([10, 0, 0, 1], 9).into(), router()));
        browser
            .write_all(b"GET / HTTP/1.1\r\nHost: a\r\nX: ")
            .await
            .unwrap();
        while browser.write_all(b"x").await.is_ok() {
            sleep(Duration::from_secs(1)).await;
        }
        serving.await.unwrap();
        assert!(start.elapsed() <= HEADER + Duration::from_secs(1));
    }

    #[tokio::test(start_paused = true)]
    async fn a_connection_without_a_further_request_is_closed() {
        let (mut browser, server) = duplex(1024);
        let serving = tokio::spawn(serve_http(server, ([10, 0, 0, 1], 9).into(), router()));
        browser
            .write_all(b"GET / HTTP/1.1\r\nHost: a\r\n\r\n")
            .await
            .unwrap();
        let mut answer = Vec::new();
        browser.read_to_end(&mut answer).await.unwrap();
        assert!(answer.ends_with(b"hello"), "{answer:?}");
        serving.await.unwrap();
    }

    /// What a browser receives from a server with TLS after these octets, and the time until the
    /// server closes the connection.
    #[cfg(feature = "https")]
    async fn answer_with_tls(octets: &[u8]) -> (Vec<u8>, Duration) {
        let folder = tempfile::tempdir().unwrap();
        let now = std::time::SystemTime::UNIX_EPOCH + Duration::from_secs(1_800_000_000);
        let tls = Tls::load_or_make(folder.path(), &[], now).unwrap();
        let listener = TcpListener::bind(("127.0.0.1", 0)).await.unwrap();
        let mut browser = TcpStream::connect(listener.local_addr().unwrap())
            .await
            .unwrap();
        let serving = tokio::spawn(serve(listener, Some(tls), router()));
        let start = Instant::now();
        browser.write_all(octets).await.unwrap();
        let mut answer = Vec::new();
        browser.read_to_end(&mut answer).await.unwrap();
        serving.abort();
        (answer, start.elapsed())
    }

    #[cfg(feature = "https")]
    #[tokio::test(start_paused = true)]
    async fn a_handshake_that_is_not_completed_is_not_awaited_beyond_its_deadline() {
        let begun = [TLS_HANDSHAKE, 3, 1, 2, 0];
        for octets in [&[][..], &begun] {
            let (_, time) = answer_with_tls(octets).await;
            assert!(time >= HANDSHAKE && time < SILENCE, "{time:?}");
        }
    }

    #[cfg(feature = "https")]
    #[tokio::test]
    async fn a_request_without_tls_is_told_to_use_https() {
        let (answer, _) = answer_with_tls(b"GET / HTTP/1.1\r\n\r\n").await;
        let answer = String::from_utf8(answer).unwrap();
        assert!(answer.starts_with("HTTP/1.1 400 "), "{answer}");
        assert!(answer.contains("https://"), "{answer}");
    }
}
