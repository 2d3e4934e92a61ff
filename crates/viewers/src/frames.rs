//! Captured frames as samples of a channel of their own.
//!
//! Each is an object with `interface`, `link` (the number of the link type), `octets` in base64 and
//! the `time` of the capture; `length` if the capture cut the frame short, and `lost` if frames were
//! lost before it.

use std::sync::LazyLock;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use jaus_view::{Frame, LinkType, Timestamp};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::schema::Schema;

/// The topic of the frames in a recording.
pub const FRAMES_TOPIC: &str = "/jaus/frames";

/// The schema of the frames.
pub(crate) static SCHEMA: LazyLock<Schema> = LazyLock::new(|| {
    let text = json!({
        "title": "jaus.Frame",
        "description": "A frame as captured, from its link header on.",
        "type": "object",
        "properties": {
            "time": { "type": "string", "description": "Time of the capture (UTC)." },
            "interface": { "type": "string" },
            "link": { "type": "integer", "description": "Link type: 1 Ethernet, 101 IP." },
            "length": {
                "type": "integer",
                "description": "Octets on the link, if more than there are here.",
            },
            "lost": { "type": "integer", "description": "Frames lost before this one." },
            "octets": { "type": "string", "contentEncoding": "base64" },
        },
    });
    Schema {
        name: "jaus.Frame".to_owned(),
        text: text.to_string(),
    }
});

/// A frame that owns its octets.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct OwnedFrame {
    time: Option<Timestamp>,
    interface: String,
    link: LinkType,
    octets: Vec<u8>,
    length: u32,
    lost: u64,
}

impl OwnedFrame {
    pub(crate) fn borrow(&self) -> Frame<'_> {
        Frame {
            time: self.time,
            link: self.link,
            octets: &self.octets,
            lost: self.lost,
            length: self.length,
            interface: &self.interface,
        }
    }
}

#[derive(Serialize, Deserialize)]
struct Form {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    time: Option<String>,
    #[serde(default)]
    interface: String,
    link: u16,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    length: Option<u32>,
    #[serde(default, skip_serializing_if = "is_zero")]
    lost: u64,
    octets: String,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde demands it")]
fn is_zero(number: &u64) -> bool {
    *number == 0
}

/// The sample of a frame.
pub(crate) fn to_json(frame: &Frame<'_>) -> Vec<u8> {
    let is_cut = usize::try_from(frame.length) != Ok(frame.octets.len());
    let form = Form {
        time: frame.time.map(|time| time.to_string()),
        interface: frame.interface.to_owned(),
        link: frame.link.0,
        length: is_cut.then_some(frame.length),
        lost: frame.lost,
        octets: STANDARD.encode(frame.octets),
    };
    // Serialising to memory fails only for non-text map keys, which do not occur.
    serde_json::to_vec(&form).unwrap_or_default()
}

/// The frame of a sample.
///
/// # Errors
/// What is wrong with the sample.
pub(crate) fn from_json(sample: &[u8]) -> Result<OwnedFrame, String> {
    let form: Form = serde_json::from_slice(sample).map_err(|error| error.to_string())?;
    let octets = STANDARD
        .decode(form.octets)
        .map_err(|error| error.to_string())?;
    let captured = u32::try_from(octets.len()).map_err(|error| error.to_string())?;
    let time = form.time.map(|time| time.parse()).transpose();
    Ok(OwnedFrame {
        time: time.map_err(|error: jaus_view::InvalidTime| error.to_string())?,
        interface: form.interface,
        link: LinkType(form.link),
        length: form.length.unwrap_or(captured),
        octets,
        lost: form.lost,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_comes_back_with_all_that_a_capture_says_of_it() {
        let whole = Frame {
            time: Some(Timestamp::new(1_790_000_000, 5_000, 6)),
            link: LinkType::ETHERNET,
            octets: &[0, 1, 255],
            lost: 0,
            length: 3,
            interface: "eth0",
        };
        let cut = Frame {
            time: None,
            lost: 7,
            length: 1500,
            interface: "",
            ..whole
        };
        for frame in [whole, cut] {
            let back = from_json(&to_json(&frame)).unwrap();
            assert_eq!(back.borrow(), frame);
        }
    }

    #[test]
    fn an_invalid_sample_is_refused_with_the_reason() {
        for (sample, reason) in [
            ("{}", "missing field"),
            (r#"{"link":1,"octets":"*"}"#, "Invalid"),
            (r#"{"link":1,"octets":"","time":"noon"}"#, "write a time"),
        ] {
            let error = from_json(sample.as_bytes()).unwrap_err();
            assert!(error.contains(reason), "{error}");
        }
    }
}
