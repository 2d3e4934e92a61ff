//! Type hashes, version `RIHS01` (REP 2016): the SHA-256 of a description of the type as JSON.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use sha2::{Digest as _, Sha256};

use crate::interface::{Field, Interface, Kind, Primitive, Size, TypeName};

/// The number of the kind of an array is that of its elements and this.
const ARRAY: u32 = 48;
const BOUNDED_SEQUENCE: u32 = 96;
const SEQUENCE: u32 = 144;

impl Interface {
    /// The type hash of ROS 2 (REP 2016), such as `RIHS01_9c45bf16…`.
    #[must_use]
    pub fn hash(&self) -> String {
        let digest = Sha256::digest(description(self));
        let mut hash = "RIHS01_".to_owned();
        for octet in digest {
            // Writing to a `String` does not fail.
            let _ = write!(hash, "{octet:02x}");
        }
        hash
    }
}

/// The JSON text that is hashed: this type, and all that it contains in the order of their names.
fn description(interface: &Interface) -> String {
    let mut contained = BTreeMap::new();
    collect(interface, &mut contained);
    let contained: Vec<_> = contained.into_values().map(one).collect();
    format!(
        "{{\"type_description\": {}, \"referenced_type_descriptions\": [{}]}}",
        one(interface),
        contained.join(", ")
    )
}

fn collect<'a>(interface: &'a Interface, found: &mut BTreeMap<&'a TypeName, &'a Interface>) {
    for field in &interface.fields {
        if let Kind::Message(nested) = &field.kind
            && found.insert(&nested.name, nested).is_none()
        {
            collect(nested, found);
        }
    }
}

fn one(interface: &Interface) -> String {
    let fields: Vec<_> = match interface.fields.is_empty() {
        // ROS adds this field to a message without fields.
        true => vec![field("structure_needs_at_least_one_member", 3, 0, 0, "")],
        false => interface.fields.iter().map(described).collect(),
    };
    format!(
        "{{\"type_name\": \"{}\", \"fields\": [{}]}}",
        interface.name,
        fields.join(", ")
    )
}

fn described(it: &Field) -> String {
    let (element, text, nested) = match &it.kind {
        Kind::Primitive(primitive) => (number(*primitive), 0, String::new()),
        Kind::String { most: None } => (17, 0, String::new()),
        Kind::String { most: Some(most) } => (21, *most, String::new()),
        Kind::Message(nested) => (1, 0, nested.name.to_string()),
    };
    let (array, capacity) = match it.size {
        Size::One => (0, 0),
        Size::Fixed(size) => (ARRAY, size),
        Size::AtMost(size) => (BOUNDED_SEQUENCE, size),
        Size::Any => (SEQUENCE, 0),
    };
    field(&it.name, element + array, capacity, text, &nested)
}

fn field(name: &str, id: u32, capacity: usize, text: usize, nested: &str) -> String {
    format!(
        "{{\"name\": \"{name}\", \"type\": {{\"type_id\": {id}, \"capacity\": {capacity}, \
         \"string_capacity\": {text}, \"nested_type_name\": \"{nested}\"}}}}"
    )
}

/// The number of a primitive type in ROS's descriptions.
const fn number(primitive: Primitive) -> u32 {
    match primitive {
        Primitive::Int8 => 2,
        Primitive::Uint8 => 3,
        Primitive::Int16 => 4,
        Primitive::Uint16 => 5,
        Primitive::Int32 => 6,
        Primitive::Uint32 => 7,
        Primitive::Int64 => 8,
        Primitive::Uint64 => 9,
        Primitive::Float32 => 10,
        Primitive::Float64 => 11,
        Primitive::Bool => 15,
        Primitive::Byte => 16,
    }
}
