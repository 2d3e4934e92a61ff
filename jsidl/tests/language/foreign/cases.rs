//! Octets for generated code, with the answer of the dynamic codec.

use jsidl::Library;
use jsidl::dynamic::{arbitrary, decode, encode, to_json};
use jsidl::model::{Id, Message};
use serde_json::{Map, Value as Json};

/// Octets for one message type.
pub(super) struct Case {
    module: String,
    service: String,
    message: String,
    code: u16,
    octets: Vec<u8>,
    /// The JSON view, if it is to be compared, or the text of the error.
    expected: Result<Option<Json>, String>,
}

impl Case {
    fn new(module: &str, id: &Id, message: &Message, octets: Vec<u8>, is_viewed: bool) -> Self {
        let expected = match decode(message, &octets) {
            Ok(value) => Ok(is_viewed.then(|| plain(to_json(message, &value).unwrap()))),
            Err(error) => Err(error.to_string()),
        };
        Self {
            module: module.to_owned(),
            service: id.to_string(),
            message: message.name.clone(),
            code: message.code,
            octets,
            expected,
        }
    }

    /// The line for a program: module, service, message, code, octets.
    pub(super) fn line(&self) -> String {
        format!(
            "{}\t{}\t{}\t{:04x}\t{}\n",
            self.module,
            self.service,
            self.message,
            self.code,
            hex(&self.octets)
        )
    }

    /// Compares a program's answer, `{"hex": …, "view": …}` or `{"error": …}`.
    pub(super) fn check(&self, answer: &str) -> Result<(), String> {
        let wrong = |problem: String| Err(format!("{}: {problem}", self.line().trim()));
        let Ok(answer) = serde_json::from_str::<Json>(answer) else {
            return wrong(format!("not JSON: {answer}"));
        };
        match &self.expected {
            Err(error) if answer["error"] == error.as_str() => Ok(()),
            Err(error) => wrong(format!("{answer} instead of {error}")),
            Ok(_) if answer["hex"] != hex(&self.octets).as_str() => {
                wrong(format!("other octets: {answer}"))
            }
            Ok(None) => Ok(()),
            Ok(Some(view)) if agree(view, &answer["view"]) => Ok(()),
            Ok(Some(view)) => wrong(format!("{} instead of {view}", answer["view"])),
        }
    }
}

fn hex(octets: &[u8]) -> String {
    octets.iter().map(|octet| format!("{octet:02x}")).collect()
}

/// A view with integers from 2^53 as text.
fn plain(view: Json) -> Json {
    match view {
        Json::Array(views) => views.into_iter().map(plain).collect(),
        Json::Object(members) => {
            let members = members.into_iter();
            Json::Object(members.map(|(name, view)| (name, plain(view))).collect())
        }
        Json::Number(number) => {
            let magnitude = number.as_u64().or(number.as_i64().map(i64::unsigned_abs));
            if magnitude.is_some_and(|it| it >= 1 << 53) {
                number.to_string().into()
            } else {
                Json::Number(number)
            }
        }
        other => other,
    }
}

/// Whether views are equal, where 1 and 1.0 are the same number.
fn agree(ours: &Json, theirs: &Json) -> bool {
    let same_keys = |a: &Map<String, Json>, b: &Map<String, Json>| a.keys().eq(b.keys());
    match (ours, theirs) {
        (Json::Array(a), Json::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| agree(a, b))
        }
        (Json::Object(a), Json::Object(b)) => {
            same_keys(a, b) && a.iter().all(|(key, a)| agree(a, &b[key]))
        }
        (Json::Number(a), Json::Number(b)) => {
            a == b || a.as_f64() == b.as_f64() || same_float(a, b)
        }
        (a, b) => a == b,
    }
}

/// Whether both are the shortest decimals of one `float`: halfway between two decimals with as many digits
/// one language takes the lower, another the upper.
fn same_float(a: &serde_json::Number, b: &serde_json::Number) -> bool {
    let is_short = |number: &serde_json::Number| {
        let text = number.to_string();
        let mantissa = text.split(['e', 'E']).next().unwrap_or_default();
        mantissa.chars().filter(char::is_ascii_digit).count() <= 9
    };
    let float = |number: &serde_json::Number| number.as_f64().map(|it| it as f32);
    is_short(a) && is_short(b) && float(a) == float(b)
}

/// A valid message with its view, and octets that are made from it: beginnings, one octet more, and
/// single octets changed.
pub(super) fn around(module: &str, id: &Id, message: &Message, octets: &[u8]) -> Vec<Case> {
    let places = || (0..octets.len()).step_by(octets.len().div_ceil(8).max(1));
    let changed = |place: usize, to: fn(u8) -> u8| {
        let mut octets = octets.to_vec();
        octets[place] = to(octets[place]);
        octets
    };
    let case = |octets, is_viewed| Case::new(module, id, message, octets, is_viewed);
    let mut others = vec![[octets, &[0]].concat()];
    others.extend(places().map(|place| octets[..place].to_vec()));
    others.extend(places().map(|place| changed(place, |_| 0xFF)));
    others.extend(places().map(|place| changed(place, |octet| octet ^ 0x81)));
    let mut cases = vec![case(octets.to_vec(), true)];
    cases.extend(others.into_iter().map(|octets| case(octets, false)));
    cases
}

/// Pseudorandom valid messages of every type of a library.
pub(super) fn random(module: &str, library: &Library, each: u64) -> Vec<Case> {
    let mut cases = Vec::new();
    for service in library.services() {
        for message in service.messages() {
            for seed in 0..each {
                let seed = seed << 16 | u64::from(message.code);
                let value = arbitrary(message, &entropy(seed));
                // Some definitions of the tests cannot be satisfied.
                if let Ok(octets) = encode(message, &value) {
                    cases.extend(around(module, &service.id, message, &octets));
                }
            }
        }
    }
    cases
}

/// Reproducible pseudorandom octets (an xorshift generator).
fn entropy(seed: u64) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut octet = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state.to_le_bytes()[3]
    };
    (0..200).map(|_| octet()).collect()
}
