//! The thread that reads a stop input, independent of delays in the rest of the program.
#![expect(
    clippy::disallowed_methods,
    reason = "reads the line in real time, on its own thread"
)]

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use tokio::sync::watch;

use crate::actuator::{Interlock, StopInput};

/// A monitored stop input. An open line opens the interlock directly.
#[derive(Debug)]
pub(super) struct StopLine {
    pressed: watch::Receiver<Option<String>>,
    interlock: Interlock,
    /// Time of the last reading.
    read_at: Arc<Mutex<Instant>>,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl StopLine {
    /// Interval between two readings.
    const PERIOD: Duration = Duration::from_millis(10);
    /// Without a reading for this time, the line counts as open.
    const STUCK: Duration = Duration::from_millis(500);

    /// Starts the thread.
    ///
    /// # Errors
    /// If the thread cannot be created.
    pub(super) fn start(mut input: Box<dyn StopInput>, interlock: Interlock) -> io::Result<Self> {
        let first = read(input.as_mut(), &interlock);
        let (tell, pressed) = watch::channel(first);
        let ends = Arc::new(AtomicBool::new(false));
        let end = Arc::clone(&ends);
        let read_at = Arc::new(Mutex::new(Instant::now()));
        let (reading, opens) = (Arc::clone(&read_at), interlock.clone());
        let thread = std::thread::Builder::new().name("stop input".to_owned());
        let thread = thread.spawn(move || {
            while !end.load(Ordering::Relaxed) {
                let open = read(input.as_mut(), &opens);
                *reading.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
                tell.send_if_modified(|before| {
                    let is_news = *before != open;
                    *before = open;
                    is_news
                });
                std::thread::sleep(Self::PERIOD);
            }
        })?;
        Ok(Self {
            pressed,
            interlock,
            read_at,
            ends,
            thread: Some(thread),
        })
    }

    /// Why the line is open; `None` while it is closed.
    pub(super) fn pressed(&mut self) -> Option<String> {
        // The thread has ended or is blocked in its driver, so there are no readings.
        if self.pressed.has_changed().is_err() || self.is_stuck() {
            self.interlock.open();
            return Some("the stop input is no longer read".to_owned());
        }
        self.pressed.borrow_and_update().clone()
    }

    fn is_stuck(&self) -> bool {
        let read_at = *self.read_at.lock().unwrap_or_else(PoisonError::into_inner);
        read_at.elapsed() > Self::STUCK
    }

    /// Waits for a change of the line.
    pub(super) async fn changed(&mut self) {
        if self.pressed.changed().await.is_err() {
            // `pressed` reports the end of the thread.
            std::future::pending::<()>().await;
        }
    }
}

impl Drop for StopLine {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take().filter(|_| !self.is_stuck()) {
            // A panicked thread reads nothing either.
            let _ = thread.join();
        }
    }
}

/// Why the line is open, if it is. An open line opens the interlock. The component closes it again
/// after it has handled the stop.
fn read(input: &mut dyn StopInput, interlock: &Interlock) -> Option<String> {
    let why = match input.is_closed() {
        Ok(true) => return None,
        Ok(false) => "the stop input is pressed".to_owned(),
        Err(error) => format!("cannot read the stop input: {error}"),
    };
    interlock.open();
    Some(why)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::actuator::SimulatedStop;

    struct Broken;

    impl StopInput for Broken {
        fn is_closed(&mut self) -> io::Result<bool> {
            Err(io::Error::other("the chip is gone"))
        }
    }

    /// Its driver panics at the second reading.
    #[derive(Default)]
    struct Panics(bool);

    impl StopInput for Panics {
        fn is_closed(&mut self) -> io::Result<bool> {
            assert!(!std::mem::replace(&mut self.0, true), "a broken driver");
            Ok(true)
        }
    }

    fn until(line: &mut StopLine, is_so: impl Fn(Option<&str>) -> bool) {
        for _ in 0..2000 {
            if is_so(line.pressed().as_deref()) {
                return;
            }
            std::thread::sleep(StopLine::PERIOD);
        }
        panic!("in vain");
    }

    #[test]
    fn an_open_line_opens_the_interlock() {
        let (button, interlock) = (SimulatedStop::default(), Interlock::default());
        let mut line = StopLine::start(Box::new(button.clone()), interlock.clone()).unwrap();
        assert!(line.pressed().is_none() && !interlock.is_open());
        button.press();
        until(&mut line, |pressed| {
            pressed == Some("the stop input is pressed")
        });
        assert!(interlock.is_open());
        button.release();
        until(&mut line, |pressed| pressed.is_none());
        assert!(interlock.is_open(), "it does not close by itself");
    }

    #[test]
    fn a_line_that_cannot_be_read_is_open() {
        let mut line = StopLine::start(Box::new(Broken), Interlock::default()).unwrap();
        until(&mut line, |pressed| {
            pressed.is_some_and(|why| why.contains("the chip is gone"))
        });
        let mut line = StopLine::start(Box::new(Panics::default()), Interlock::default()).unwrap();
        until(&mut line, |pressed| {
            pressed.is_some_and(|why| why.contains("no longer read"))
        });
    }
}
