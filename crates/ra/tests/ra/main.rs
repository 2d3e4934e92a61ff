//! Reference Architecture: messages against independent encoders, recorded traffic, the gateway.

mod gateway;
mod ra33;
mod ra_captures;
