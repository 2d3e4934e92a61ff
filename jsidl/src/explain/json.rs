//! JSON form of explanations.

use serde_json::{Map, Value as Json, json};

use super::{Explanation, Row};
use crate::dynamic::Raw;

impl Row {
    /// An object with the keys `offset`, `octets` (hexadecimal), `kind`, `field`, and where
    /// applicable `raw`, `value` (of a scaled integer), `units`, `name` and `note`.
    pub fn to_json(&self) -> Json {
        let octets: String = self.octets.iter().map(|o| format!("{o:02x}")).collect();
        let mut object = Map::new();
        object.insert("offset".to_owned(), self.offset.into());
        object.insert("octets".to_owned(), octets.into());
        object.insert("kind".to_owned(), self.kind.name().into());
        object.insert("field".to_owned(), self.field.clone().into());
        let optional = [
            ("raw", self.raw.map(raw)),
            ("value", self.real.map(Json::from)),
            ("units", self.units.clone().map(Json::from)),
            ("name", self.name.clone().map(Json::from)),
            ("note", self.note.clone().map(Json::from)),
        ];
        for (key, value) in optional {
            if let Some(value) = value {
                object.insert(key.to_owned(), value);
            }
        }
        Json::Object(object)
    }
}

fn raw(raw: Raw) -> Json {
    match raw {
        Raw::Unsigned(n) => n.into(),
        Raw::Signed(n) => n.into(),
        Raw::F32(n) if n.is_finite() => f64::from(n).into(),
        Raw::F64(n) if n.is_finite() => n.into(),
        other => other.to_string().into(),
    }
}

impl Explanation {
    /// An object with the keys `code` (four hexadecimal digits), `message`, `service`, `version`,
    /// `rows`, and where applicable `error` with `offset` (from the message code), and `others`.
    pub fn to_json(&self) -> Json {
        let mut json = json!({
            "code": format!("{:04X}", self.code),
            "message": self.message,
            "service": &*self.service.urn,
            "version": self.service.version.to_string(),
            "rows": self.rows.iter().map(Row::to_json).collect::<Vec<_>>(),
        });
        if let Some(stop) = &self.stop {
            json["error"] = stop.to_string().into();
            json["offset"] = stop.offset.into();
        }
        if !self.others.is_empty() {
            let others: Vec<_> = self.others.iter().map(ToString::to_string).collect();
            json["others"] = others.into();
        }
        json
    }
}
