//! Callbacks of the program: called one at a time, and never after they are closed.

use std::ffi::c_void;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, TryLockError};

use crate::event::Event;
use crate::status::{begin_callback, is_in_callback};
use crate::types::{JausAnswer, JausEvent};
use crate::watchdog::{Stop, Watchdog};
use jaus_binding::lock;

pub(crate) type EventFunction = unsafe extern "C" fn(*mut c_void, *const JausEvent);
pub(crate) type AnswerFunction =
    unsafe extern "C" fn(*mut c_void, *const JausEvent, *mut JausAnswer);
pub(crate) type StopFunction = unsafe extern "C" fn(*mut c_void);

/// A function of the program and the pointer that it gets.
struct Target<F> {
    function: F,
    user: *mut c_void,
}

// SAFETY: the program hands the pointer over for use on the library's threads; only its function
// reads it.
unsafe impl<F: Send> Send for Target<F> {}
// SAFETY: as above; and calls are one at a time.
unsafe impl<F: Sync> Sync for Target<F> {}

/// A callback.
pub(crate) struct Callback<F> {
    target: Target<F>,
    is_closed: AtomicBool,
    /// Held during a call.
    running: Mutex<()>,
    watchdog: Arc<Watchdog>,
}

impl<F: Copy> Callback<F> {
    /// # Safety
    /// Until it is closed, `function` can be called on any thread with `user`.
    pub(crate) unsafe fn new(function: F, user: *mut c_void, watchdog: Arc<Watchdog>) -> Self {
        Self {
            target: Target { function, user },
            is_closed: AtomicBool::new(false),
            running: Mutex::new(()),
            watchdog,
        }
    }

    /// Ends the callback. Waits for a call that runs on another thread, but not in a callback.
    pub(crate) fn close(&self) {
        self.is_closed.store(true, Ordering::SeqCst);
        if !is_in_callback() {
            drop(lock(&self.running));
        }
    }

    /// Calls the function on the library's thread, under the eyes of the watchdog.
    fn call(&self, invoke: impl FnOnce(F, *mut c_void)) {
        let _running = lock(&self.running);
        if self.is_closed.load(Ordering::SeqCst) {
            return;
        }
        let _mark = begin_callback();
        let _watch = self.watchdog.watch();
        invoke(self.target.function, self.target.user);
    }
}

impl Callback<EventFunction> {
    pub(crate) fn tell(&self, event: &Event) {
        let view = event.view();
        // SAFETY: as promised to `new`; the view lives during the call.
        self.call(|function, user| unsafe { function(user, &raw const view) });
    }
}

impl Callback<AnswerFunction> {
    pub(crate) fn answer(&self, query: &Event) -> JausAnswer {
        let view = query.view();
        let mut answer = JausAnswer::default();
        // SAFETY: as promised to `new`; view and answer live during the call.
        self.call(|function, user| unsafe { function(user, &raw const view, &raw mut answer) });
        answer
    }
}

impl Callback<StopFunction> {
    pub(crate) fn stop(&self) {
        // SAFETY: as promised to `new`.
        self.call(|function, user| unsafe { function(user) });
    }
}

impl Stop for Callback<StopFunction> {
    /// Calls the function, unless it is what hangs.
    fn stop_beside_a_hung_callback(&self) {
        let running = match self.running.try_lock() {
            Ok(running) => running,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return,
        };
        if !self.is_closed.load(Ordering::SeqCst) {
            let _mark = begin_callback();
            // SAFETY: as promised to `new`.
            unsafe { (self.target.function)(self.target.user) };
        }
        drop(running);
    }
}
