//! A node stack for SAE JAUS.
#![forbid(unsafe_code)]
