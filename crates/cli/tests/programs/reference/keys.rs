//! The keys of settings files, from the types that they are read into: values and descriptions from
//! the sources, defaults and ranges from what the library does.

use std::collections::BTreeMap;

use jaus::node::Config;
use serde_json::{Value as Json, json};

use super::source::{Definition, Kind, Shape, Source, Variant};

/// The sources of the settings.
const FILES: [&str; 21] = [
    "src/node/config/mod.rs",
    "src/node/config/local_user.rs",
    "src/node/config/delivery.rs",
    "src/node/config/tcp.rs",
    "src/node/config/peer.rs",
    "src/node/mailbox.rs",
    "src/endpoint/access.rs",
    "src/rights/accept.rs",
    "src/endpoint/egress/mod.rs",
    "src/endpoint/forward.rs",
    "src/endpoint/rate.rs",
    "crates/stack/limits/src/lib.rs",
    "src/link/group.rs",
    "src/link/interface/choice.rs",
    "src/link/local/address.rs",
    "src/link/udp/settings.rs",
    "src/peer/mod.rs",
    "src/address.rs",
    "crates/cli/src/identity.rs",
    "crates/cli/src/log_level.rs",
    "crates/cli/src/metrics/mod.rs",
];

/// Where the type `SerialLine` of a configuration is, and its name there.
const SERIAL: (&str, &str) = ("src/link/serial/settings.rs", "Settings");

/// A key with all that a reader wants to know.
pub(super) struct Key {
    /// Within its section.
    pub(super) name: String,
    /// Type and range.
    pub(super) value: String,
    pub(super) default: String,
    pub(super) about: String,
}

/// A table of a settings file.
pub(super) struct Section {
    /// The name; empty for the keys before the first section.
    pub(super) name: String,
    /// Whether it may appear several times.
    pub(super) is_list: bool,
    pub(super) about: String,
    pub(super) keys: Vec<Key>,
}

/// All types of settings, and the values that the sections refer to.
pub(super) struct Types {
    sources: Vec<(&'static str, Source)>,
    /// Descriptions of texts with a syntax, and of inline tables, by type.
    pub(super) values: BTreeMap<String, (String, Vec<Key>)>,
}

/// A configuration with an entry in every list, all valid.
fn example() -> Json {
    let given = json!({
        "subsystem": 101,
        "node": 1,
        "tcp": { "listen": "0.0.0.0" },
        "serial": [{ "device": "/dev/ttyUSB0" }],
        "profile": [{ "id": "7.255.255", "profile": "jaus++" }],
    });
    let config: Config = serde_json::from_value(given).unwrap();
    assert_eq!(config.validate(), Ok(()));
    serde_json::to_value(config).unwrap()
}

impl Types {
    pub(super) fn read() -> Self {
        let files = FILES.into_iter().chain([SERIAL.0]);
        Self {
            sources: files.map(|file| (file, Source::read(file))).collect(),
            values: BTreeMap::new(),
        }
    }

    /// The sections of a node's settings file; the first has the keys before any section.
    pub(super) fn sections(&mut self) -> Vec<Section> {
        let (identity, at) = self.find("Identity", "");
        let mut top = Section {
            name: String::new(),
            is_list: false,
            about: String::new(),
            keys: self.keys(identity, at, "/"),
        };
        let mut sections = Vec::new();
        let (config, at) = self.find("Config", "");
        for field in fields(config) {
            let (inner, is_list) = match &field.kind {
                Kind::List(inner) => (&**inner, true),
                kind => (kind, false),
            };
            let pointer = format!("/{}", field.name);
            match self.table(inner, at) {
                Some((definition, at)) => sections.push(Section {
                    about: definition.about.clone(),
                    is_list,
                    keys: match is_list {
                        true => self.keys(definition, at, &format!("{pointer}/0/")),
                        false => self.keys(definition, at, &format!("{pointer}/")),
                    },
                    name: field.name,
                }),
                None => top.keys.push(self.key(field, at, &pointer)),
            }
        }
        sections.insert(0, top);
        sections
    }

    /// A type, preferably of the file that refers to it.
    fn find(&self, name: &str, from: &str) -> (Definition, &'static str) {
        self.lookup(name, from)
            .unwrap_or_else(|| panic!("no file of the list defines {name}"))
    }

    fn lookup(&self, name: &str, from: &str) -> Option<(Definition, &'static str)> {
        let (from, name) = match name {
            "SerialLine" => SERIAL,
            _ => (from, name),
        };
        let near = self.sources.iter().filter(|(file, _)| *file == from);
        // Others have a type `Settings` as well.
        let far = self.sources.iter().filter(|(file, _)| *file != SERIAL.0);
        near.chain(far)
            .find_map(|(file, source)| Some((source.find(name)?, *file)))
    }

    fn table(&self, kind: &Kind, from: &str) -> Option<(Definition, &'static str)> {
        let Kind::Plain(name) = kind else {
            return None;
        };
        let found = self.lookup(name, from)?;
        let is_table = matches!(found.0.shape, Shape::Table(_)) && found.0.is_read;
        is_table.then_some(found)
    }

    fn keys(&mut self, table: Definition, at: &'static str, prefix: &str) -> Vec<Key> {
        let fields = fields(table).into_iter();
        fields
            .map(|field| {
                let pointer = format!("{prefix}{}", field.name);
                self.key(field, at, &pointer)
            })
            .collect()
    }

    fn key(&mut self, field: super::source::Field, at: &'static str, pointer: &str) -> Key {
        assert!(!field.about.is_empty(), "{pointer} has no description");
        let value = match &field.attributes {
            it if it.contains("read_size") => Value::Size,
            _ => self.value(&field.kind, at, pointer),
        };
        let range = value.range(pointer);
        let mut about = field.about.replace('\n', " ");
        if let Value::Choice(choice) = &value {
            about.push_str(choice);
        }
        Key {
            value: match &range {
                Some(range) => format!("{}, {range}", value.words(&field.kind)),
                None => value.words(&field.kind),
            },
            default: default(pointer, &value, range.as_deref()),
            name: field.name,
            about,
        }
    }

    /// The kind of value of a type, which is described with the other values if need be.
    fn value(&mut self, kind: &Kind, at: &'static str, pointer: &str) -> Value {
        let name = match kind {
            Kind::Plain(name) => name.as_str(),
            Kind::List(inner) | Kind::Optional(inner) => return self.value(inner, at, pointer),
            Kind::Map => return Value::Word("table"),
        };
        match name {
            "bool" => return Value::Word("`true` or `false`"),
            "String" => return Value::Word("text"),
            "PathBuf" => return Value::Word("path"),
            "SocketAddr" => return Value::Word("address"),
            "Duration" => return Value::Time,
            "u8" => return Value::Number(u8::MAX.into()),
            "u16" => return Value::Number(u16::MAX.into()),
            "u32" => return Value::Number(u32::MAX.into()),
            "usize" => return Value::Number(1 << 50),
            _ => {}
        }
        let (definition, at) = self.find(name, at);
        match definition.shape {
            Shape::Choice(variants) => self.choice(&variants, at),
            Shape::Table(_) if definition.is_read => {
                let name = readable(name);
                let about = definition.about.clone();
                if example().pointer(pointer).is_some_and(Json::is_object) {
                    let keys = self.keys(definition, at, &format!("{pointer}/"));
                    self.values.entry(name.clone()).or_insert((about, keys));
                }
                Value::Text(name)
            }
            Shape::Table(_) | Shape::Text => {
                let mut name = readable(name);
                let known = self.values.get(&name);
                if known.is_some_and(|(about, _)| *about != definition.about) {
                    // Two types have this name.
                    let (_, key) = pointer.rsplit_once('/').unwrap();
                    key.clone_into(&mut name);
                }
                let entry = (definition.about, Vec::new());
                self.values.entry(name.clone()).or_insert(entry);
                Value::Text(name)
            }
        }
    }

    fn choice(&mut self, variants: &[Variant], at: &'static str) -> Value {
        let mut about = String::new();
        for variant in variants {
            let word = match &variant.content {
                None => format!("`\"{}\"`", variant.name),
                Some(content) => {
                    let value = self.value(content, at, "");
                    format!("a {}", value.words(content))
                }
            };
            let description = variant.about.replace('\n', " ");
            about.push_str(&format!("<br>{word}: {description}"));
        }
        Value::Choice(about)
    }
}

fn fields(table: Definition) -> Vec<super::source::Field> {
    match table.shape {
        Shape::Table(fields) => fields,
        _ => panic!("settings are a table"),
    }
}

/// `OwnId` as `own id`.
fn readable(name: &str) -> String {
    let mut words = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.push(c.to_ascii_lowercase());
    }
    words
}

/// What a key may be set to.
enum Value {
    Size,
    Time,
    /// A whole number up to this one, as far as the type goes.
    Number(u64),
    /// One of several words, or something else; the text describes them.
    Choice(String),
    /// A value with a description of its own.
    Text(String),
    Word(&'static str),
}

impl Value {
    fn words(&self, kind: &Kind) -> String {
        let words = match self {
            Self::Size => "size".to_owned(),
            Self::Time => "time".to_owned(),
            Self::Number(_) => "number".to_owned(),
            Self::Choice(_) => "choice".to_owned(),
            Self::Text(name) => format!("[{name}](#{})", name.replace(' ', "-")),
            Self::Word(word) => (*word).to_owned(),
        };
        match kind {
            Kind::List(_) if words.contains("s]") => format!("list of {words}"),
            Kind::List(_) => format!("list of {words}s"),
            _ => words,
        }
    }

    /// The range, which the library states when it refuses a value.
    fn range(&self, pointer: &str) -> Option<String> {
        let extremes = match self {
            Self::Size => [json!(0), json!(1_u64 << 50)],
            Self::Number(most) => [json!(0), json!(most)],
            Self::Time => [json!("0s"), json!("8760h")],
            _ => return None,
        };
        let stated = extremes.into_iter().find_map(|it| refusal(pointer, it));
        let range = match (stated, self) {
            (Some(stated), Self::Size) => stated.split(' ').map(size).collect::<Vec<_>>().join(" "),
            (Some(stated), _) => stated,
            (None, Self::Number(most)) if *most <= u16::MAX.into() => format!("0 to {most}"),
            (None, _) => return None,
        };
        Some(range)
    }
}

/// The range in the error about a value, if there is one.
fn refusal(pointer: &str, value: Json) -> Option<String> {
    let mut changed = example();
    *changed.pointer_mut(pointer)? = value;
    let config: Config = serde_json::from_value(changed).ok()?;
    let error = config.validate().err()?.to_string();
    let (_, range) = error.split_once("choose ")?;
    Some(range.strip_prefix("from ").unwrap_or(range).to_owned())
}

/// The default, as it is written in a file.
fn default(pointer: &str, value: &Value, range: Option<&str>) -> String {
    let mut without = example();
    let (table, key) = pointer.rsplit_once('/').unwrap();
    if let Some(table) = without.pointer_mut(table).and_then(Json::as_object_mut) {
        table.remove(key);
    }
    let config = match serde_json::from_value::<Config>(without) {
        Ok(config) => serde_json::to_value(config).unwrap(),
        Err(_) => return "required".to_owned(),
    };
    match config.pointer(pointer) {
        None | Some(Json::Null) => "none".to_owned(),
        // An id must be chosen.
        Some(Json::Number(zero)) if zero.as_u64() == Some(0) && range.is_some_and(needs_more) => {
            "none".to_owned()
        }
        Some(Json::Number(octets)) if matches!(value, Value::Size) => {
            let size = size(&octets.to_string());
            match size.contains(' ') {
                true => format!("`\"{size}\"`"),
                false => format!("`{size}`"),
            }
        }
        Some(Json::Object(table)) => {
            let entries = table.iter().map(|(key, value)| format!("{key} = {value}"));
            format!("`{{ {} }}`", entries.collect::<Vec<_>>().join(", "))
        }
        Some(value) => format!("`{value}`"),
    }
}

fn needs_more(range: &str) -> bool {
    !range.starts_with("0 ")
}

/// A number of octets with the largest unit that fits; other words unchanged.
fn size(word: &str) -> String {
    const UNITS: [(u64, &str); 6] = [
        (1 << 30, "GiB"),
        (1 << 20, "MiB"),
        (1 << 10, "KiB"),
        (1_000_000_000, "GB"),
        (1_000_000, "MB"),
        (1000, "kB"),
    ];
    let Ok(octets) = word.parse::<u64>() else {
        return word.to_owned();
    };
    let unit = UNITS
        .iter()
        .find(|(unit, _)| octets >= *unit && octets % unit == 0);
    match unit {
        Some((unit, name)) => format!("{} {name}", octets / unit),
        None => word.to_owned(),
    }
}

#[test]
fn every_key_that_a_file_may_have_is_described() {
    let known = serde_json::to_value(Config::default()).unwrap();
    let mut described = Vec::new();
    for section in Types::read().sections() {
        for key in &section.keys {
            let name = match section.name.as_str() {
                "" => key.name.clone(),
                section => format!("{section}.{}", key.name),
            };
            described.push(name);
        }
    }
    for (key, value) in known.as_object().unwrap() {
        let keys: Vec<_> = match value {
            Json::Object(table) => table.keys().map(|it| format!("{key}.{it}")).collect(),
            _ => vec![key.clone()],
        };
        for key in keys {
            let start = format!("{key}.");
            let is_there = described
                .iter()
                .any(|it| *it == key || it.starts_with(&start));
            assert!(is_there, "{key} is not described");
        }
    }
}
