//! Explains messages of the Reference Architecture by its own definitions, with the tolerance for
//! peers' deviations that decoding has elsewhere.

use bytes::Bytes;
use jaus_ra::forgiving::forgiving;
use jaus_ra::messages;
use jsidl::dynamic::Raw;
use jsidl::explain::{Explanation, Kind, Row, ServiceName, Unexplained, explain};
use jsidl::{Library, Loader};

/// The definitions of the Reference Architecture.
pub(super) struct ReferenceArchitecture {
    library: Library,
}

impl ReferenceArchitecture {
    pub(super) fn load() -> Self {
        let mut loader = Loader::new();
        loader.reference_architecture();
        Self {
            library: loader.load().library,
        }
    }

    /// Explains a whole message, beginning with its code.
    pub(super) fn explain(
        &self,
        octets: &Bytes,
        service: Option<&ServiceName>,
    ) -> Result<Explanation, Unexplained> {
        let mended = mended(octets);
        let mut explanation = explain(&self.library, &mended, service)?;
        for row in &mut explanation.rows {
            restore(row, octets);
        }
        Ok(explanation)
    }
}

/// Corrects tolerated deviations; returns the octets unchanged if there are other errors.
fn mended(octets: &Bytes) -> Bytes {
    let code = octets.first_chunk().map(|&code| u16::from_le_bytes(code));
    let info = code.and_then(|code| messages::registry().by_code(code).next());
    let read = info.map(|info| {
        forgiving(octets, |tried| {
            (info.decode)(tried).map(|_message| tried.clone())
        })
    });
    match read {
        Some(Ok(mended)) => mended,
        _ => octets.clone(),
    }
}

/// Restores the received octets in a row, with a note.
fn restore(row: &mut Row, came: &[u8]) {
    let length = row.octets.len();
    let start = row.offset.min(came.len());
    let came = &came[start..came.len().min(start + length)];
    if came == row.octets {
        return;
    }
    let missing = length - came.len();
    row.note = Some(if missing > 0 {
        format!("{missing} of its {length} octets are missing")
    } else {
        "bits without a field are ignored".to_owned()
    });
    row.octets = came.to_vec();
    if matches!(row.kind, Kind::Presence | Kind::Tag) {
        let number = came.iter().rev();
        let number = number.fold(0, |number, octet| number << 8 | u64::from(*octet));
        row.raw = Some(Raw::Unsigned(number));
    }
}
