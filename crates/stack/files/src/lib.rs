//! Files that services share with people: keys, trusted keys, users, logs, recordings.
//!
//! | item | what it guarantees |
//! |---|---|
//! | [`replace`], [`FileDraft`] | a reader finds the old or the new content; owner, mode and security context stay |
//! | [`create`] | a new file is complete or absent, and replaces none |
//! | [`edit`], [`FileLock`] | of two changes at the same time none is lost |
//! | [`read`], [`read_text`], [`Readers`] | what is secret is not readable, and what is trusted not writable by others |
//! | [`append`], [`options`] | a log or recording is created for its readers; the mode of an existing file stays |
//! | [`FileStamp`] | a change of a file is noticed, also one of its owner or mode |
//! | [`Followed`] | a value from files is read again when they have changed; while they cannot be used it stays, with the reason |
//! | [`FormerContent`] | who changes a file learns whether the services that use it have taken the change |
//!
//! Errors are [`io::Error`](std::io::Error)s whose texts name the remedy. They do not name the file that
//! was passed, which the caller does.

mod draft;
mod edit;
mod followed;
mod lock;
mod log;
mod marks;
mod process;
mod readers;
mod stamp;
mod uptake;

pub use draft::{FileDraft, create, replace};
pub use edit::edit;
pub use followed::{Followed, WeakFollowed};
pub use lock::FileLock;
pub use log::{append, options};
pub use process::FileProcess;
pub use readers::{Readers, read, read_text};
pub use stamp::FileStamp;
pub use uptake::{FormerContent, Uptake};
