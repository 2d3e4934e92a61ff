//! The Transport service: every component lists it; the endpoint does its work.

use std::time::Instant;

use super::{Context, Handled, Service};
use crate::codec::ServiceId;
use crate::endpoint::Received;
use crate::messages::core;

/// Lists Transport among the services of a component. It has no messages.
#[derive(Debug, Clone, Copy, Default)]
pub struct Transport;

impl Service for Transport {
    fn offers(&self) -> Vec<ServiceId> {
        vec![core::transport::V1_1, core::transport::V1_0]
    }

    fn handle_message(&mut self, _: Instant, _: &Received, _: &mut Context<'_>) -> Handled {
        Handled::No
    }
}
