//! A serial line with whoever is at its other end. It carries JSerial.
//!
//! Behind the line any number of JAUS ids may live. What is for everyone goes to the line too, as
//! there is nothing else on it. Lines are slow: what the operating system does not take waits,
//! bounded, the urgent first; when there is no more room, the oldest of the least urgent goes.
//!
//! The port must be usable when the link is opened. When it goes away later, as USB ports do, it
//! is opened again, with pauses from [`FIRST_PAUSE`] to [`LONGEST_PAUSE`]; what is sent meanwhile is
//! lost, and counted, since nobody wants old commands when the line is back.
//!
//! The port is driven through `serial2-tokio`, which needs no C library such as libudev.

mod error;
mod settings;

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::{Duration, Instant};

use bytes::{Buf, Bytes};
use serial2_tokio::SerialPort;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::task::{JoinHandle, spawn_blocking};

pub use error::{Ports, SerialError};
pub use settings::{FlowControl, Parity, Settings};

use super::backlog::{Backlog, Bounds};
use crate::endpoint::Transmit;
use crate::wire::Frame;
use crate::wire::jserial::{self, Decoder};

/// The pause before a port that has gone is opened again. It doubles with each failure.
pub const FIRST_PAUSE: Duration = Duration::from_millis(250);
/// The longest pause between two attempts to open a port again.
pub const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// What waits for the line. The octets have room for one message of the usual greatest length.
const OUTBOX: Bounds = Bounds {
    items: 1024,
    octets: 1 << 20,
};

/// Octets read at once. The operating system keeps no more than these for a line.
const CHUNK: usize = 4096;
/// Chunks taken from a line before the other links have their turn.
const BATCH: usize = 8;

/// What a serial link has done since it was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Counters {
    /// What the line has brought: packets, messages, and what could not be used.
    pub received: jserial::Counters,
    /// Packets given to the operating system.
    pub sent: u64,
    /// Packets lost because the line was slower for too long.
    pub send_overflows: u64,
    /// Packets lost because the port was away.
    pub port_away: u64,
    /// How often the port went away.
    pub failures: u64,
}

/// What has happened on a line.
#[derive(Debug)]
pub enum Arrival {
    /// A message came.
    Frame(Frame),
    /// The port is gone.
    Lost,
}

/// A serial line. Must be opened within a tokio runtime.
#[derive(Debug)]
pub struct SerialLink {
    settings: Settings,
    port: Result<SerialPort, Away>,
    decoder: Decoder,
    outbox: Backlog<Bytes>,
    /// The packet that is on its way into the operating system.
    leaving: Bytes,
    counters: Counters,
}

/// A port that is gone.
#[derive(Debug)]
struct Away {
    /// When it is opened again; `None` until the clock is known, and while an attempt is under way.
    retry_at: Option<Instant>,
    /// The attempt to open it, on a thread of its own: a driver may take its time.
    opening: Option<JoinHandle<io::Result<SerialPort>>>,
    pause: Duration,
    /// Whether the other side has been told.
    told: bool,
}

impl SerialLink {
    /// Opens the port.
    ///
    /// # Errors
    /// What is wrong with the port, and what to do.
    pub fn open(settings: &Settings) -> Result<Self, SerialError> {
        let port = settings.open();
        let port = port.map_err(|source| SerialError::new(&settings.device, source))?;
        tracing::info!(
            device = settings.device,
            baud = settings.baud,
            "serial link opened"
        );
        Ok(Self {
            settings: settings.clone(),
            port: Ok(port),
            decoder: Decoder::new(),
            outbox: Backlog::new(OUTBOX),
            leaving: Bytes::new(),
            counters: Counters::default(),
        })
    }

    /// How it is set up.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Whether the port is there just now.
    #[must_use]
    pub const fn is_open(&self) -> bool {
        self.port.is_ok()
    }

    /// What it has done so far.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        Counters {
            received: *self.decoder.counters(),
            ..self.counters
        }
    }

    /// Queues what the endpoint gives out, for [`poll_flush`](Self::poll_flush).
    pub fn transmit(&mut self, transmit: &Transmit) {
        if self.port.is_err() {
            self.counters.port_away += 1;
            return;
        }
        let octets = transmit.payload.len();
        let payload = transmit.payload.clone();
        self.counters.send_overflows += self.outbox.push(transmit.priority, octets, payload);
    }

    /// Writes what waits, as fast as the line takes it; ready when nothing waits any more.
    pub fn poll_flush(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        while let Ok(port) = &mut self.port {
            if self.leaving.is_empty() {
                // One packet at a time, so that an urgent one does not wait behind many.
                let Some(packet) = self.outbox.pop() else {
                    break;
                };
                self.leaving = packet;
                self.counters.sent += 1;
            }
            match ready!(Pin::new(port).poll_write(cx, &self.leaving)) {
                Ok(0) => self.lose(&io::ErrorKind::WriteZero.into()),
                Ok(octets) => self.leaving.advance(octets),
                Err(error) => self.lose(&error),
            }
            if self.port.is_err() {
                // For the next `receive`, which tells and opens it again.
                cx.waker().wake_by_ref();
            }
        }
        Poll::Ready(())
    }

    /// When to call [`receive`](Self::receive) even if nothing arrives.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.port.as_ref().err().and_then(|away| away.retry_at)
    }

    /// Takes in what has arrived, and opens the port again if it was gone; whether there was more
    /// than the line's share.
    pub fn receive(
        &mut self,
        cx: &mut Context<'_>,
        now: Instant,
        mut arrived: impl FnMut(Arrival),
    ) -> bool {
        self.open_again(cx, now);
        let mut more = true;
        for _ in 0..BATCH {
            if self.poll_read(cx).is_pending() {
                more = false;
                break;
            }
            while let Some(frame) = self.decoder.next_frame() {
                arrived(Arrival::Frame(frame));
            }
        }
        if let Err(away) = &mut self.port {
            if away.opening.is_none() {
                away.retry_at.get_or_insert(now + away.pause);
            }
            if !std::mem::replace(&mut away.told, true) {
                arrived(Arrival::Lost);
            }
        }
        more
    }

    /// Ready when there are new octets.
    fn poll_read(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        let Ok(port) = &mut self.port else {
            return Poll::Pending;
        };
        let mut chunk = [0; CHUNK];
        let mut buffer = ReadBuf::new(&mut chunk);
        match ready!(Pin::new(port).poll_read(cx, &mut buffer)) {
            Ok(()) if !buffer.filled().is_empty() => {
                self.decoder.push(buffer.filled());
                Poll::Ready(())
            }
            Ok(()) => {
                self.lose(&io::ErrorKind::UnexpectedEof.into());
                Poll::Pending
            }
            Err(error) => {
                self.lose(&error);
                Poll::Pending
            }
        }
    }

    /// The port is gone.
    fn lose(&mut self, error: &io::Error) {
        tracing::warn!(device = self.settings.device, %error, "serial port lost; it is tried again");
        self.counters.failures += 1;
        self.counters.port_away += self.outbox.len() as u64 + u64::from(!self.leaving.is_empty());
        self.outbox = Backlog::new(OUTBOX);
        self.leaving = Bytes::new();
        let away = Err(Away {
            retry_at: None,
            opening: None,
            pause: FIRST_PAUSE,
            told: false,
        });
        let port = std::mem::replace(&mut self.port, away);
        // Closing waits for what the driver has not written yet.
        spawn_blocking(move || drop(port));
    }

    fn open_again(&mut self, cx: &mut Context<'_>, now: Instant) {
        let Err(away) = &mut self.port else {
            return;
        };
        if away.retry_at.is_some_and(|at| at <= now) {
            away.retry_at = None;
            let settings = self.settings.clone();
            away.opening = Some(spawn_blocking(move || settings.open()));
        }
        let opened = away
            .opening
            .as_mut()
            .map(|opening| Pin::new(opening).poll(cx));
        let Some(Poll::Ready(opened)) = opened else {
            return;
        };
        away.opening = None;
        // An attempt that the runtime gave up has failed too.
        match opened.map_err(io::Error::from).flatten() {
            Ok(port) => {
                tracing::info!(device = self.settings.device, "serial port is back");
                self.port = Ok(port);
            }
            Err(error) => {
                tracing::debug!(device = self.settings.device, %error, "still no serial port");
                away.pause = (away.pause * 2).min(LONGEST_PAUSE);
                away.retry_at = Some(now + away.pause);
            }
        }
    }
}
