//! What the interfaces of the SAE JAUS node stack [`jaus`] for other languages share.
//!
//! A node of a program in another language has one [thread](NodeThread), on which its links, components and
//! services run. It never runs code of the program that may block. Messages and news wait in an [`EventQueue`],
//! which the program fetches in a loop of its own. The library must not keep alive what the program neglects:
//!
//! - A service whose messages wait in the queue is [`Attended`]: it stops and fails when the program does not
//!   fetch them for [`HUNG`].
//! - [`HeldControl`] is released when the program does not show for a time that it runs.
#![cfg(unix)]

mod attended;
mod control;
mod events;
mod lock;
mod news;
mod publications;
mod running;
mod service;
mod text;
mod thread;

use std::time::Duration;

pub use attended::Attended;
pub use control::{HeldControl, NotUsed};
pub use events::{Attention, Ended, EventQueue, Loss, Notice, ServiceKey};
pub use lock::lock;
pub use news::{NOBODY, Step, follow_discovery, follow_reports, follow_standing};
pub use publications::{NotPublished, Publications};
pub use running::{END, NotStarted, Place, Running};
pub use service::{TooManyServices, kind, service_id};
pub use text::with_sources;
pub use thread::NodeThread;

/// A program that has not run for this time, although it must, hangs.
pub const HUNG: Duration = Duration::from_millis(500);
