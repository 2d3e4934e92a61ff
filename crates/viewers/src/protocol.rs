//! Foxglove's WebSocket protocol, version 1: what a server sends, and the requests of clients.
//!
//! Control messages are JSON objects with a key `op`; samples are binary. The subprotocols
//! `foxglove.websocket.v1` and `foxglove.sdk.v1` share all that is used here. See
//! <https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>.

use bytes::Bytes;
use serde::Deserialize;
use serde_json::{Value as Json, json};

use crate::channels::Channel;

/// The subprotocols, the preferred one first.
pub(crate) const SUBPROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
/// First octet of a sample.
const MESSAGE_DATA: u8 = 1;
/// Octets of a sample before its data.
pub(crate) const MESSAGE_DATA_HEADER: usize = 13;

/// A request of a client.
#[derive(Debug, PartialEq, Eq, Deserialize)]
#[serde(tag = "op", rename_all = "camelCase")]
pub(crate) enum Request {
    Subscribe {
        subscriptions: Vec<Subscription>,
    },
    #[serde(rename_all = "camelCase")]
    Unsubscribe {
        subscription_ids: Vec<u32>,
    },
    /// Anything else: the server offers none of it.
    #[serde(other)]
    Other,
}

/// A subscription that a client requests.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Subscription {
    /// The number that samples are sent with.
    pub(crate) id: u32,
    pub(crate) channel_id: u64,
}

/// Reads a request.
///
/// # Errors
/// If it is no request.
pub(crate) fn read(text: &str) -> Result<Request, serde_json::Error> {
    serde_json::from_str(text)
}

/// The first message to a client: the server's name, and that it offers no more than channels.
pub(crate) fn server_info(name: &str, session: &str) -> String {
    let info = json!({
        "op": "serverInfo",
        "name": name,
        "capabilities": [],
        "supportedEncodings": [],
        "metadata": {},
        "sessionId": session,
    });
    info.to_string()
}

/// Announces channels.
pub(crate) fn advertise<'c>(channels: impl IntoIterator<Item = &'c Channel>) -> String {
    let channel = |it: &Channel| {
        json!({
            "id": it.index,
            "topic": it.topic,
            "encoding": "json",
            "schemaName": it.schema.name,
            "schemaEncoding": "jsonschema",
            "schema": it.schema.text,
        })
    };
    let channels: Vec<Json> = channels.into_iter().map(channel).collect();
    json!({ "op": "advertise", "channels": channels }).to_string()
}

/// Announces that channels are closed.
pub(crate) fn unadvertise(channels: &[usize]) -> String {
    json!({ "op": "unadvertise", "channelIds": channels }).to_string()
}

/// A warning that the client shows its user.
pub(crate) fn warning(message: &str) -> String {
    json!({ "op": "status", "level": 1, "message": message }).to_string()
}

/// A sample for a subscription.
pub(crate) fn message_data(subscription: u32, time: u64, data: &[u8]) -> Bytes {
    let mut octets = Vec::with_capacity(MESSAGE_DATA_HEADER + data.len());
    octets.push(MESSAGE_DATA);
    octets.extend_from_slice(&subscription.to_le_bytes());
    octets.extend_from_slice(&time.to_le_bytes());
    octets.extend_from_slice(data);
    octets.into()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::schema::Schema;

    #[test]
    fn requests_are_read_and_those_of_other_capabilities_ignored() {
        let subscribe = read(r#"{"op":"subscribe","subscriptions":[{"id":7,"channelId":3}]}"#);
        let subscription = Subscription {
            id: 7,
            channel_id: 3,
        };
        let expected = Request::Subscribe {
            subscriptions: vec![subscription],
        };
        assert_eq!(subscribe.unwrap(), expected);
        let unsubscribe = read(r#"{"op":"unsubscribe","subscriptionIds":[7]}"#);
        let expected = Request::Unsubscribe {
            subscription_ids: vec![7],
        };
        assert_eq!(unsubscribe.unwrap(), expected);
        let other = read(r#"{"op":"getParameters","parameterNames":[],"id":"x"}"#);
        assert_eq!(other.unwrap(), Request::Other);
        assert!(read(r#"{"op":"subscribe"}"#).is_err());
        assert!(read("[]").is_err());
    }

    #[test]
    fn a_sample_is_its_subscription_its_time_and_its_octets() {
        let octets = message_data(0x0102_0304, 5, b"{}");
        assert_eq!(&octets[..], b"\x01\x04\x03\x02\x01\x05\0\0\0\0\0\0\0{}");
    }

    #[test]
    fn a_channel_is_announced_with_its_schema() {
        let channel = Channel {
            index: 4,
            topic: "/jaus/1/1/1/X".to_owned(),
            schema: Arc::new(Schema {
                name: "a.X".to_owned(),
                text: "{}".to_owned(),
            }),
        };
        let announced: Json = serde_json::from_str(&advertise([&channel])).unwrap();
        let expected = json!({ "op": "advertise", "channels": [{
            "id": 4, "topic": "/jaus/1/1/1/X", "encoding": "json", "schemaName": "a.X",
            "schemaEncoding": "jsonschema", "schema": "{}",
        }] });
        assert_eq!(announced, expected);
    }
}
