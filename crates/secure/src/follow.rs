//! Keeps values that are read from files up to date while a node runs.

use std::fmt;

use jaus_files::{Followed, WeakFollowed};

/// What an unusable file of trust means: it may lack what was revoked.
pub(crate) const REFUSING: &str = "new sessions are refused until it can be used again";
/// What an unusable file of the node itself means.
pub(crate) const KEEPING: &str = "its previous contents stay in use";

/// Reads the files of a value again whenever one of them has changed, and while they cannot be used, as long
/// as the value is in use. Must be called within a tokio runtime. A file that has become unusable is logged,
/// with what this means for the node.
#[expect(
    clippy::disallowed_methods,
    reason = "the task only looks at files, and ends with the value"
)]
pub(crate) fn follow<T, E>(value: &Followed<T, E>, consequence: &'static str)
where
    T: Send + Sync + 'static,
    E: fmt::Display + 'static,
{
    if !value.files().is_empty() {
        tokio::spawn(refresh(value.downgrade(), consequence));
    }
}

#[expect(
    clippy::disallowed_methods,
    reason = "looks at files in real time, also while a test pauses the clock"
)]
async fn refresh<T, E: fmt::Display>(value: WeakFollowed<T, E>, consequence: &str) {
    loop {
        tokio::time::sleep(Followed::<T, E>::INTERVAL).await;
        let Some(value) = value.upgrade() else {
            return;
        };
        let files = value.files().iter().map(|it| it.display().to_string());
        let files = || files.clone().collect::<Vec<_>>().join(", ");
        match value.refresh() {
            Ok(false) => {}
            Ok(true) => tracing::info!(files = files(), "read again after a change"),
            Err(error) => tracing::error!(files = files(), %error, "{consequence}"),
        }
    }
}
