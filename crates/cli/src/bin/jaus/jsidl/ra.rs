//! Explaining messages of the Reference Architecture: by its own definitions, and with its peers'
//! habits forgiven, as everywhere else.

use bytes::Bytes;
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

    /// Explains a whole message, which begins with its code.
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

/// The octets as they would be without what is forgiven; unchanged if there is more wrong with them.
fn mended(octets: &Bytes) -> Bytes {
    let code = octets.first_chunk().map(|&code| u16::from_le_bytes(code));
    let info = code.and_then(|code| messages::registry().by_code(code).next());
    let read = info.map(|info| {
        messages::forgiving(octets, |tried| {
            (info.decode)(tried).map(|_message| tried.clone())
        })
    });
    match read {
        Some(Ok(mended)) => mended,
        _ => octets.clone(),
    }
}

/// Puts the octets into a row that came in place of the mended ones, and says so.
fn restore(row: &mut Row, came: &[u8]) {
    let length = row.octets.len();
    let start = row.offset.min(came.len());
    let came = &came[start..came.len().min(start + length)];
    if came == row.octets {
        return;
    }
    let missing = length - came.len();
    row.note = Some(if missing > 0 {
        format!("{missing} of its {length} octets did not come")
    } else {
        "bits without a field are passed over".to_owned()
    });
    row.octets = came.to_vec();
    if matches!(row.kind, Kind::Presence | Kind::Tag) {
        let number = came.iter().rev();
        let number = number.fold(0, |number, octet| number << 8 | u64::from(*octet));
        row.raw = Some(Raw::Unsigned(number));
    }
}
