//! The map file for pages: its description, and its tiles.

use std::net::SocketAddr;
use std::sync::Arc;

use axum::Json;
use axum::extract::{ConnectInfo, Path, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use tokio::task::spawn_blocking;

use super::{Refusal, Shared};
use crate::base_map::{BaseMap, BaseMapError, Tile};

/// Number of tiles read at once.
pub(super) const READERS: usize = 4;

/// The description of the map file.
pub(super) async fn describe(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(address): ConnectInfo<SocketAddr>,
    headers: HeaderMap,
) -> Response {
    match admitted(&shared, &headers, address).await {
        Ok(map) => Json(map.description()).into_response(),
        Err(refusal) => refusal.into_response(),
    }
}

/// One tile as stored. No content where the file has no tile.
pub(super) async fn serve(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(address): ConnectInfo<SocketAddr>,
    Path((zoom, x, y)): Path<(u8, u32, u32)>,
    headers: HeaderMap,
) -> Response {
    let map = match admitted(&shared, &headers, address).await {
        Ok(map) => map.clone(),
        Err(refusal) => return refusal.into_response(),
    };
    let content_type = map.content_type();
    let takes_gzip = takes_gzip(&headers);
    // The permit fails only if the semaphore is closed, which never happens.
    let permit = shared.readers.clone().acquire_owned().await;
    let read = spawn_blocking(move || {
        let _permit = permit;
        read(&map, (zoom, x, y), takes_gzip)
    });
    match read.await {
        Ok(Ok(Some(tile))) => {
            let mut response = tile.octets.into_response();
            let headers = response.headers_mut();
            headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(content_type));
            headers.insert(header::VARY, HeaderValue::from_static("accept-encoding"));
            if tile.is_gzip {
                headers.insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
            }
            response
        }
        Ok(Ok(None)) => StatusCode::NO_CONTENT.into_response(),
        Ok(Err(error)) => {
            tracing::debug!(zoom, x, y, %error, "map file");
            (StatusCode::INTERNAL_SERVER_ERROR, format!("{error}\n")).into_response()
        }
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, format!("{error}\n")).into_response(),
    }
}

/// The map file, if there is one and the request may read it.
async fn admitted<'s>(
    shared: &'s Shared,
    headers: &HeaderMap,
    address: SocketAddr,
) -> Result<&'s BaseMap, Refusal> {
    shared.check_reader(headers, address).await?;
    let words = "this station has no map file; start jaus-ocu with --map\n";
    let map = shared.admission.base_map.as_ref();
    map.ok_or((StatusCode::NOT_FOUND, words))
}

fn read(
    map: &BaseMap,
    (zoom, x, y): (u8, u32, u32),
    takes_gzip: bool,
) -> Result<Option<Tile>, BaseMapError> {
    match map.tile(zoom, x, y)? {
        Some(tile) if tile.is_gzip && !takes_gzip => Ok(Some(Tile {
            octets: tile.inflated()?,
            is_gzip: false,
        })),
        tile => Ok(tile),
    }
}

/// Whether the client decompresses gzip.
fn takes_gzip(headers: &HeaderMap) -> bool {
    let values = headers.get_all(header::ACCEPT_ENCODING).iter();
    let mut encodings = values
        .filter_map(|it| it.to_str().ok())
        .flat_map(|it| it.split(','))
        .map(|it| it.split_once(';').unwrap_or((it, "")));
    encodings.any(|(name, weight)| {
        let is_refused = matches!(weight.trim(), "q=0" | "q=0.0" | "q=0.00" | "q=0.000");
        name.trim().eq_ignore_ascii_case("gzip") && !is_refused
    })
}
