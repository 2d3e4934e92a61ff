//! The serial link: one serial line, carrying JSerial.
//!
//! Any number of JAUS ids may be reached over the line. Broadcasts go to the line too. Lines are
//! slow: data that the operating system does not take yet waits in a bounded queue, most urgent
//! first. When the queue is full, the oldest packet of the lowest priority is dropped.
//!
//! The port must be usable when the link is opened. If it disappears later, as USB ports do, it is
//! reopened, with pauses from [`FIRST_PAUSE`] to [`LONGEST_PAUSE`], ± 25 % at random. Packets sent
//! meanwhile are dropped and counted, because old commands are useless when the line is back.
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
use tokio::task::spawn_blocking;

pub use error::SerialError;
pub use settings::{FlowControl, Parity, Settings};

use super::backlog::{Backlog, Bounds};
use super::redial::Redial;
use crate::endpoint::Transmit;
use crate::wire::Frame;
use crate::wire::jserial::{self, Decoder};

/// The pause before a lost port is reopened. It doubles with each failure.
pub const FIRST_PAUSE: Duration = Duration::from_millis(250);
/// The longest pause between attempts to reopen a port.
pub const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// Limits of the queue to the line. The octets leave room for one message of the default maximum
/// length.
const OUTBOX: Bounds = Bounds {
    items: 1024,
    octets: 1 << 20,
};

/// Octets per read. The operating system buffers no more than this for a line.
const CHUNK: usize = 4096;
/// Chunks read from a line before the other links have their turn.
const BATCH: usize = 8;

/// Counts of a serial link since it was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Counters {
    /// Received packets and messages, and errors.
    pub received: jserial::Counters,
    /// Packets passed to the operating system.
    pub sent: u64,
    /// Packets dropped because the line was too slow.
    pub send_overflows: u64,
    /// Packets dropped because the port was away.
    pub port_away: u64,
    /// How often the port went away.
    pub failures: u64,
}

/// An event on a line.
#[derive(Debug)]
pub enum Arrival {
    /// A message was received.
    Frame(Frame),
    /// The port is gone.
    Lost,
}

/// A serial line. Must be opened within a tokio runtime.
#[derive(Debug)]
pub struct SerialLink {
    settings: Settings,
    /// `None` while it is gone.
    port: Option<SerialPort>,
    redial: Redial<SerialPort>,
    decoder: Decoder,
    outbox: Backlog<Bytes>,
    /// The packet that is being written.
    leaving: Bytes,
    counters: Counters,
}

impl SerialLink {
    /// Opens the port.
    ///
    /// # Errors
    /// [`SerialError`] names the problem and a remedy.
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
            port: Some(port),
            // A driver may take its time.
            redial: Redial::new(true, Duration::MAX, FIRST_PAUSE..=LONGEST_PAUSE),
            decoder: Decoder::new(),
            outbox: Backlog::new(OUTBOX),
            leaving: Bytes::new(),
            counters: Counters::default(),
        })
    }

    /// Its settings.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Whether the port is open at present.
    #[must_use]
    pub const fn is_open(&self) -> bool {
        self.port.is_some()
    }

    /// Its counters so far.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        Counters {
            received: *self.decoder.counters(),
            ..self.counters
        }
    }

    /// Queues a packet from the endpoint, for [`poll_flush`](Self::poll_flush).
    pub fn transmit(&mut self, transmit: &Transmit) {
        if self.port.is_none() {
            self.counters.port_away += 1;
            return;
        }
        let octets = transmit.payload.len();
        let payload = transmit.payload.clone();
        self.counters.send_overflows += self.outbox.push(transmit.priority, octets, payload);
    }

    /// Writes queued packets, as fast as the line takes them; ready when none is left.
    pub fn poll_flush(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        while let Some(port) = &mut self.port {
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
            if self.port.is_none() {
                // For the next `receive`, which reports the loss and reopens the port.
                cx.waker().wake_by_ref();
            }
        }
        Poll::Ready(())
    }

    /// When to call [`receive`](Self::receive) even if nothing arrives.
    #[must_use]
    pub const fn poll_timeout(&self) -> Option<Instant> {
        self.redial.deadline()
    }

    /// Receives data, and reopens a lost port. Returns whether there was more than the line's
    /// share.
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
        if self.port.is_none() && self.redial.is_up() {
            self.redial.lost(now, true);
            arrived(Arrival::Lost);
        }
        more
    }

    /// Ready when there are new octets.
    fn poll_read(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        let Some(port) = &mut self.port else {
            return Poll::Pending;
        };
        let mut chunk = [0; CHUNK];
        let mut buffer = ReadBuf::new(&mut chunk);
        match ready!(Pin::new(port).poll_read(cx, &mut buffer)) {
            Ok(()) if !buffer.filled().is_empty() => {
                self.decoder.push(buffer.filled());
                return Poll::Ready(());
            }
            Ok(()) => self.lose(&io::ErrorKind::UnexpectedEof.into()),
            Err(error) => self.lose(&error),
        }
        Poll::Pending
    }

    /// Handles the loss of the port.
    fn lose(&mut self, error: &io::Error) {
        tracing::warn!(device = self.settings.device, %error, "serial port lost; retrying");
        self.counters.failures += 1;
        self.counters.port_away += self.outbox.len() as u64 + u64::from(!self.leaving.is_empty());
        self.outbox = Backlog::new(OUTBOX);
        self.leaving = Bytes::new();
        let port = self.port.take();
        // Closing blocks until the driver has written its buffer.
        spawn_blocking(move || drop(port));
    }

    fn open_again(&mut self, cx: &mut Context<'_>, now: Instant) {
        let device = &self.settings.device;
        let reopened = self.redial.poll(cx, now, |attempt| {
            let settings = self.settings.clone();
            attempt.spawn_blocking(move || settings.open());
        });
        match reopened {
            Poll::Pending => {}
            Poll::Ready(Ok(port)) => {
                tracing::info!(device, "serial port is back");
                self.port = Some(port);
            }
            Poll::Ready(Err(error)) => {
                tracing::debug!(device, %error, "serial port still unavailable");
            }
        }
    }
}
