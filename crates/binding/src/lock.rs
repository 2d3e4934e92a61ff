//! Locks of the library's own state, which is whole after a panic, too.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Locks state that is whole after a panic, too.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
