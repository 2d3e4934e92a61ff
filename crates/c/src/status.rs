//! Results of calls: a code, and a text for people that the calling thread can read.

use std::cell::{Cell, RefCell};
use std::ffi::{CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The result of a call. `jaus_last_error` gives the reason in words.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JausStatus {
    /// Success.
    Ok = 0,
    /// A required pointer is null.
    NullPointer = 1,
    /// The handle is zero, was freed, or is of another type.
    InvalidHandle = 2,
    /// A text is not valid UTF-8.
    InvalidText = 3,
    /// A value is out of range or malformed.
    InvalidArgument = 4,
    /// The call does not fit the object's state: for instance a setting after the start.
    WrongState = 5,
    /// The call waits, which is not allowed in a callback.
    WrongThread = 6,
    /// The limit of objects or of waiting requests is reached.
    TooMany = 7,
    /// The node or the component could not be started.
    NotStarted = 8,
    /// A service lacks what makes it safe: Management, a stop callback, or an answer to a query.
    Unsafe = 9,
    /// No component with the service was found in time, or it offers no such service.
    NotFound = 10,
    /// The peer did not answer in time.
    NoAnswer = 11,
    /// The message could not be sent, or its delivery is not confirmed.
    NotSent = 12,
    /// The peer refuses: control, a subscription, or a state.
    Refused = 13,
    /// Control of the peer is lost.
    ControlLost = 14,
    /// The peer is under control, but not ready for commands.
    NotReady = 15,
    /// The component or its node has stopped.
    Stopped = 16,
    /// An error in the library. The call had no effect that can be relied on.
    Internal = 17,
}

/// Why a call fails.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) status: JausStatus,
    pub(crate) text: String,
}

impl Failure {
    pub(crate) fn new(status: JausStatus, text: impl Into<String>) -> Self {
        let text = text.into();
        Self { status, text }
    }

    /// A failure with the text of an error and of its sources.
    pub(crate) fn of(status: JausStatus, error: &dyn std::error::Error) -> Self {
        Self::new(status, jaus_binding::with_sources(error))
    }

    pub(crate) fn argument(text: impl Into<String>) -> Self {
        Self::new(JausStatus::InvalidArgument, text)
    }
}

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::default();
    static IN_CALLBACK: Cell<bool> = const { Cell::new(false) };
}

/// Runs the body of a call. A panic becomes [`JausStatus::Internal`].
pub(crate) fn run(body: impl FnOnce() -> Result<(), Failure>) -> JausStatus {
    match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(())) => JausStatus::Ok,
        Ok(Err(Failure { status, text })) => {
            note(text);
            status
        }
        Err(_) => {
            note("an error in the library: please report it".to_owned());
            JausStatus::Internal
        }
    }
}

fn note(text: String) {
    let mut octets = text.into_bytes();
    octets.retain(|&octet| octet != 0);
    let text = CString::new(octets).unwrap_or_default();
    // A thread that ends has no place for it any more.
    let _ = LAST_ERROR.try_with(|last| last.replace(text));
}

/// Why the last call of this thread that failed did so. Never null; empty before the first failure.
/// The text is UTF-8 and valid until the next failure in this thread.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_last_error() -> *const c_char {
    let text = LAST_ERROR.try_with(|last| last.borrow().as_ptr());
    text.unwrap_or(c"".as_ptr())
}

/// The version of the library, such as `0.1.0`.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    VERSION.as_ptr().cast()
}

/// Marks this thread as running a callback until the result is dropped.
pub(crate) fn begin_callback() -> CallbackMark {
    CallbackMark(IN_CALLBACK.replace(true))
}

/// Restores the mark of the thread when it is dropped.
pub(crate) struct CallbackMark(bool);

impl Drop for CallbackMark {
    fn drop(&mut self) {
        IN_CALLBACK.set(self.0);
    }
}

pub(crate) fn is_in_callback() -> bool {
    IN_CALLBACK.get()
}

/// Fails in a callback, where waiting would hold up the component itself.
pub(crate) fn check_may_wait() -> Result<(), Failure> {
    if is_in_callback() || tokio::runtime::Handle::try_current().is_ok() {
        let text = "this call waits: make it outside of callbacks, on a thread of the program";
        return Err(Failure::new(JausStatus::WrongThread, text));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::ffi::CStr;

    use super::*;

    fn last_error() -> String {
        // SAFETY: the text of this thread is valid until its next failure.
        let text = unsafe { CStr::from_ptr(jaus_last_error()) };
        text.to_str().unwrap().to_owned()
    }

    #[test]
    fn a_failure_leaves_its_text_for_the_thread_and_a_panic_is_a_failure() {
        assert_eq!(last_error(), "");
        let failed = run(|| Err(Failure::argument("7 is too\0 large")));
        assert_eq!(failed, JausStatus::InvalidArgument);
        assert_eq!(last_error(), "7 is too large");
        assert_eq!(run(|| Ok(())), JausStatus::Ok);
        assert_eq!(last_error(), "7 is too large", "success leaves it");
        let elsewhere = std::thread::spawn(last_error).join().unwrap();
        assert_eq!(elsewhere, "");
        let panicked = run(|| panic!("for the test"));
        assert_eq!(panicked, JausStatus::Internal);
    }

    #[test]
    fn a_callback_may_not_wait() {
        assert!(check_may_wait().is_ok());
        let mark = begin_callback();
        assert_eq!(
            check_may_wait().unwrap_err().status,
            JausStatus::WrongThread
        );
        drop(mark);
        assert!(check_may_wait().is_ok());
    }
}
