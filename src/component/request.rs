//! Requests with a number, which the peer confirms or rejects.

use std::sync::atomic::Ordering;
use std::time::Duration;

use tokio::time::timeout;

use super::{Component, Messages, RequestError};
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::Received;
use crate::service::OWN_REQUESTS;

/// Time limit of a confirmation.
const LIMIT: Duration = Duration::from_secs(3);

impl Component {
    /// A number for a request. It differs from those of the requests just before it, and from those of
    /// subscriptions.
    pub(super) fn next_request(&self) -> u8 {
        OWN_REQUESTS | self.shared.requests.fetch_add(1, Ordering::Relaxed)
    }

    /// Delivers a request, and waits until `read` finds its answer in a message of the peer.
    pub(super) async fn confirm<M: Message, T>(
        &self,
        messages: &mut Messages,
        peer: JausId,
        request: &M,
        mut read: impl FnMut(&Received) -> Option<Result<T, String>>,
    ) -> Result<T, RequestError> {
        self.deliver(peer, request).await?;
        let answered = async {
            loop {
                let message = messages.next().await.ok_or(RequestError::Stopped)?;
                if message.source != peer {
                    continue;
                }
                match read(&message) {
                    Some(Ok(answer)) => return Ok(answer),
                    Some(Err(reason)) => {
                        return Err(RequestError::Rejected {
                            peer,
                            request: M::NAME,
                            reason,
                        });
                    }
                    None => {}
                }
            }
        };
        let unconfirmed = RequestError::Unconfirmed {
            peer,
            request: M::NAME,
            waited: LIMIT,
        };
        timeout(LIMIT, answered).await.unwrap_or(Err(unconfirmed))
    }
}
