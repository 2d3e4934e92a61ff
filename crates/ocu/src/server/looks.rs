//! What pages fetch when they show it: the log of events. The snapshot states its latest event, so that a
//! page fetches only what is new to it, and one thing at a time: a slow link is not filled with what
//! waits.

use std::net::SocketAddr;
use std::sync::Arc;

use axum::Json;
use axum::extract::{ConnectInfo, Query, State};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use tokio::sync::oneshot;

use super::Shared;
use crate::orders::Order;

/// What the page has of the log.
#[derive(Deserialize)]
pub(super) struct After {
    /// Number of its latest event.
    #[serde(default)]
    after: u64,
}

/// The events after the page's latest one.
pub(super) async fn serve_events(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(address): ConnectInfo<SocketAddr>,
    Query(After { after }): Query<After>,
    headers: HeaderMap,
) -> Response {
    if let Err(refusal) = shared.check_reader(&headers, address).await {
        return refusal.into_response();
    }
    let (reply, events) = oneshot::channel();
    let _ = shared
        .access
        .orders
        .send(Order::Events { after, reply })
        .await;
    match events.await {
        Ok(events) => Json(events).into_response(),
        Err(_) => ENDED.into_response(),
    }
}

const ENDED: (StatusCode, &str) = (StatusCode::SERVICE_UNAVAILABLE, "the session has ended\n");
