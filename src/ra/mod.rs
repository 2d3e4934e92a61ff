//! Speaking the Reference Architecture 3.2 and 3.3, JAUS as it was before the SAE standards, without
//! I/O and without a clock.

pub mod ids;

pub use crate::wire::ra::RaId;
