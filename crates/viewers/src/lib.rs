//! JAUS traffic for the viewers that people already use: Foxglove, PlotJuggler and others that read
//! MCAP.
//!
//! [`Channels`] turns messages into samples: a channel for each source and message, with a JSON
//! schema made from the definition, and Foxglove's own schemas for poses, positions, points and
//! images. A [`McapRecorder`] writes them to a file together with the frames themselves, so that an
//! MCAP recording loses nothing against pcapng. A [`Recording`] reads the frames of either. A
//! [`Server`] sends the samples to live viewers over Foxglove's WebSocket protocol. A
//! [`BlackBox`] keeps the latest traffic until a [`Trigger`] asks for it.
//!
//! The library `jaus` does not depend on this crate.
#![forbid(unsafe_code)]

mod black_box;
mod channels;
mod frames;
mod mcap;
mod protocol;
mod recorder;
mod recording;
mod schema;
mod server;
mod topic;
mod well_known;

pub use black_box::{
    BlackBox, BlackBoxFiles, BlackBoxLimits, BlackBoxNames, Kept, Snapshot, Trigger, TriggerKind,
    Triggers,
};
pub use channels::{Channel, Channels, MOST_CHANNELS, Sample, nanoseconds};
pub use frames::FRAMES_TOPIC;
pub use mcap::{McapRecorder, McapSummary};
pub use recorder::{Recorder, RecordingFormat};
pub use recording::{Recording, RecordingError};
pub use schema::Schema;
pub use server::{MOST_CLIENTS, Server, ServerSettings, Sharing};
