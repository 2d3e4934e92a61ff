//! Service manager notifications of a program: ready, watchdog, stopping (`sd_notify(3)`).
//!
//! A program runs on one thread: its component, its control loops and this watchdog. A hanging loop
//! therefore stops the pings, and systemd restarts the program after `WatchdogSec=`.

#[cfg(unix)]
use std::ffi::OsStr;
use std::time::Duration;

#[cfg(unix)]
use std::os::unix::net::UnixDatagram;

use tokio::time::{MissedTickBehavior, interval};

/// Connection to the service manager, if there is one.
pub(super) struct Systemd {
    #[cfg(unix)]
    socket: Option<UnixDatagram>,
    /// Watchdog timeout, if the watchdog is enabled.
    watchdog: Option<Duration>,
}

impl Systemd {
    /// Reads `NOTIFY_SOCKET`, `WATCHDOG_USEC` and `WATCHDOG_PID` from the environment.
    pub(super) fn from_environment() -> Self {
        let number = |name: &str| std::env::var(name).ok()?.parse::<u64>().ok();
        let is_meant =
            number("WATCHDOG_PID").is_none_or(|pid| pid == u64::from(std::process::id()));
        let watchdog = number("WATCHDOG_USEC").filter(|&time| is_meant && time > 0);
        Self {
            #[cfg(unix)]
            socket: std::env::var_os("NOTIFY_SOCKET").and_then(|name| connect(&name)),
            watchdog: watchdog.map(Duration::from_micros),
        }
    }

    /// Reports that the program is ready, and then feeds the watchdog twice per timeout. Never
    /// returns.
    pub(super) async fn watch(&self) {
        // The part has started when this is polled again.
        tokio::task::yield_now().await;
        self.notify("READY=1");
        let Some(watchdog) = self.watchdog else {
            return std::future::pending().await;
        };
        let mut pings = interval((watchdog / 2).max(Duration::from_millis(1)));
        pings.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            pings.tick().await;
            self.notify("WATCHDOG=1");
        }
    }

    /// Reports that the program is stopping.
    pub(super) fn stopping(&self) {
        self.notify("STOPPING=1");
    }

    #[cfg(unix)]
    fn notify(&self, state: &str) {
        if let Some(socket) = &self.socket
            && let Err(error) = socket.send(state.as_bytes())
        {
            tracing::debug!(%error, state, "cannot notify the service manager");
        }
    }

    #[cfg(not(unix))]
    fn notify(&self, _: &str) {}
}

/// Opens a socket to the service manager; a name that begins with `@` is an abstract socket of
/// Linux. It never blocks: unread notifications are dropped.
#[cfg(unix)]
fn connect(name: &OsStr) -> Option<UnixDatagram> {
    let connect = || {
        let socket = UnixDatagram::unbound()?;
        socket.set_nonblocking(true)?;
        #[cfg(target_os = "linux")]
        if let Some(name) = std::os::unix::ffi::OsStrExt::as_bytes(name).strip_prefix(b"@") {
            use std::os::linux::net::SocketAddrExt as _;
            let address = std::os::unix::net::SocketAddr::from_abstract_name(name)?;
            socket.connect_addr(&address)?;
            return Ok(socket);
        }
        socket.connect(name)?;
        Ok(socket)
    };
    let connected: std::io::Result<UnixDatagram> = connect();
    connected
        .inspect_err(|error| tracing::warn!(%error, "cannot use NOTIFY_SOCKET"))
        .ok()
}
