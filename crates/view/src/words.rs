//! Text for people: the fields of a message, with units and names of values.

use bytes::Bytes;
use jsidl::explain::{Kind, Row, explain_as};

use super::definition::{Body, Definition, Unreadable};
use super::dictionary::Dictionary;

/// A field and its value for people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FieldText {
    /// The path of the field, for example `NodeList[0].NodeID`.
    pub field: String,
    /// The value, for example `0.5 m/s` or `READY`. Text from the message is quoted, with control
    /// characters escaped.
    pub value: String,
}

impl Dictionary {
    /// The fields of a message that are present, in their order.
    ///
    /// # Errors
    /// If no definition fits the message.
    pub fn fields_in_words(&self, octets: &Bytes) -> Result<Vec<FieldText>, Unreadable> {
        let reading = self.read(octets);
        let body = reading.body?;
        let fitting = |it: &&Definition| it.decode(octets).is_ok();
        let definition = reading
            .code
            .and_then(|code| self.candidates(code).find(fitting));
        let Some(model) = definition.and_then(|it| self.model(it)) else {
            return Ok(vec![as_json(&body)]);
        };
        let (rows, _) = explain_as(model, octets);
        Ok(of_rows(&rows))
    }
}

/// The body of a message whose definition is not in the library.
fn as_json(body: &Body) -> FieldText {
    FieldText {
        field: String::new(),
        // Serialising to memory fails only for non-text map keys, which do not occur.
        value: serde_json::to_string(body).unwrap_or_default(),
    }
}

fn of_rows(rows: &[Row]) -> Vec<FieldText> {
    let mut fields = Vec::new();
    for (place, row) in rows.iter().enumerate() {
        let of_time = |row: &Row| row.field.contains("TimeStamp.");
        let value = match row.kind {
            Kind::Value => value(row),
            Kind::Bits => match time_stamp(&rows[place + 1..]) {
                Some(time) if row.field.ends_with("TimeStamp") => time,
                _ => continue,
            },
            Kind::SubField if !of_time(row) => value(row),
            _ => continue,
        };
        fields.push(FieldText {
            field: row.field.clone(),
            value,
        });
    }
    fields
}

fn value(row: &Row) -> String {
    let number = row.real.map(|real| real.to_string());
    let text = row.name.clone().or(number);
    let text = text.or_else(|| row.raw.map(|raw| raw.to_string()));
    match (&row.units, text) {
        (Some(units), Some(text)) => format!("{text} {}", symbol(units)),
        (None, Some(text)) => text,
        (_, None) => row.note.clone().unwrap_or_default(),
    }
}

/// `HH:MM:SS.mmm` from the sub-fields of a time stamp.
fn time_stamp(sub_fields: &[Row]) -> Option<String> {
    let part = |name: &str| {
        let mut rows = sub_fields
            .iter()
            .take_while(|row| row.kind == Kind::SubField);
        let row = rows.find(|row| {
            row.field
                .rsplit('.')
                .next()
                .is_some_and(|it| it.starts_with(name))
        })?;
        Some(row.raw?.to_string())
    };
    let (hour, minute, second) = (part("Hour")?, part("Minute")?, part("Second")?);
    let millisecond = part("Millisecond")?;
    Some(format!(
        "{hour:0>2}:{minute:0>2}:{second:0>2}.{millisecond:0>3} UTC"
    ))
}

/// The symbol of a unit; its name if it has none.
#[must_use]
pub fn symbol(units: &str) -> &str {
    match units {
        "meter" => "m",
        "radian" => "rad",
        "degree" => "°",
        "meter per second" => "m/s",
        "meter per second squared" => "m/s²",
        "radian per second" => "rad/s",
        "radian per second squared" => "rad/s²",
        "percent" => "%",
        "second" => "s",
        "millisecond" => "ms",
        "minute" => "min",
        "hour" => "h",
        "hertz" => "Hz",
        "degree Celsius" => "°C",
        "newton" => "N",
        "newton meter" => "N·m",
        "volt" => "V",
        "ampere" => "A",
        "kilogram" => "kg",
        "rotations per minute" => "rpm",
        "liter" => "l",
        other => other,
    }
}
