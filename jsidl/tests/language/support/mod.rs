//! Hand-written definitions that use every construct of the language.

pub(crate) mod golden;

use std::path::Path;
use std::sync::Arc;

use jsidl::model::*;
use jsidl::{Library, Loader};

/// The definitions embedded in the crate.
pub(crate) fn catalogue() -> Library {
    let mut loader = Loader::new();
    loader.catalogue();
    loader.load().library
}

pub(crate) fn message(code: u16, name: &str, body: Option<Item>) -> Message {
    Message {
        name: name.to_owned(),
        code,
        is_command: false,
        is_deprecated: false,
        permission: None,
        stops: false,
        destination: None,
        description: String::new(),
        header: None,
        body,
        footer: None,
        location: location(),
    }
}

pub(crate) fn item(name: &str, shape: Shape) -> Item {
    Item {
        name: name.to_owned(),
        optional: false,
        interpretation: String::new(),
        shape,
        location: location(),
    }
}

pub(crate) fn optional(name: &str, shape: Shape) -> Item {
    Item {
        optional: true,
        ..item(name, shape)
    }
}

fn location() -> Location {
    Location {
        file: Arc::from(Path::new("hand-made")),
        line: 1,
        column: 1,
    }
}

pub(crate) fn group(members: Vec<Item>) -> Shape {
    with_presence(None, members)
}

pub(crate) fn with_presence(presence: Option<Unsigned>, members: Vec<Item>) -> Shape {
    Shape::Group(Group {
        kind: GroupKind::Record,
        presence,
        members,
    })
}

pub(crate) fn list(count: Count, element: Item) -> Shape {
    Shape::List(List {
        count,
        element: Box::new(element),
    })
}

pub(crate) fn variant(alternatives: Vec<Item>) -> Shape {
    Shape::Variant(Variant {
        tag: Unsigned::U8,
        alternatives,
    })
}

pub(crate) fn array(dimensions: &[u32], element: Shape) -> Shape {
    let element = Box::new(item("Element", element));
    Shape::Array(Array {
        dimensions: dimensions.to_vec(),
        element,
    })
}

pub(crate) fn count(unsigned: Unsigned, min: u64, max: u64) -> Count {
    Count { unsigned, min, max }
}

pub(crate) fn plain(number: Number) -> Scalar {
    Scalar {
        number,
        units: "one".to_owned(),
        meaning: Meaning::Plain,
    }
}

pub(crate) fn number(number: Number) -> Shape {
    Shape::Scalar(plain(number))
}

pub(crate) fn byte() -> Shape {
    number(Number::Unsigned(Unsigned::U8))
}

pub(crate) fn scaled(width: Unsigned, lower: f64, upper: f64, units: &str) -> Scalar {
    let meaning = Meaning::Scaled(Scale {
        lower,
        upper,
        rounding: Rounding::Round,
    });
    Scalar {
        number: Number::Unsigned(width),
        units: units.to_owned(),
        meaning,
    }
}

pub(crate) fn values(names: &[(u64, &str)]) -> ValueSet {
    let named = |&(index, name): &(u64, &str)| NamedValue {
        index: index.into(),
        name: name.to_owned(),
        interpretation: String::new(),
    };
    ValueSet {
        ranges: Vec::new(),
        values: names.iter().map(named).collect(),
    }
}

fn sub_field(name: &str, from: u8, to: u8, names: &[(u64, &str)]) -> SubField {
    SubField {
        name: name.to_owned(),
        from,
        to,
        values: values(names),
        interpretation: String::new(),
    }
}

fn numbers() -> Shape {
    use Number::{F32, F64, Signed as S, Unsigned as U};
    let all = [
        ("U8", U(Unsigned::U8)),
        ("U16", U(Unsigned::U16)),
        ("U32", U(Unsigned::U32)),
        ("U64", U(Unsigned::U64)),
        ("I8", S(Signed::I8)),
        ("I16", S(Signed::I16)),
        ("I32", S(Signed::I32)),
        ("I64", S(Signed::I64)),
        ("F32", F32),
        ("F64", F64),
    ];
    group(
        all.into_iter()
            .map(|(name, n)| item(name, number(n)))
            .collect(),
    )
}

fn scaled_numbers() -> Shape {
    let scaled = |width, lower, upper| Shape::Scalar(scaled(width, lower, upper, "meter"));
    with_presence(
        Some(Unsigned::U16),
        vec![
            item("Speed", scaled(Unsigned::U8, 0.0, 100.0)),
            optional("Angle", scaled(Unsigned::U16, -7.5, 7.5)),
            optional("Latitude", scaled(Unsigned::U32, -90.0, 90.0)),
        ],
    )
}

fn flags() -> Shape {
    let bits = BitField {
        base: Unsigned::U16,
        fields: vec![
            sub_field("High", 12, 15, &[]),
            sub_field("Low", 0, 3, &[(0, "Off"), (1, "On")]),
        ],
    };
    let state = Scalar {
        meaning: Meaning::Values(values(&[(0, "Initialise"), (1, "Ready for use")])),
        ..plain(Number::Unsigned(Unsigned::U8))
    };
    group(vec![
        item("Bits", Shape::Bits(bits)),
        item("State", Shape::Scalar(state)),
    ])
}

fn texts() -> Shape {
    let formats = vec![Format {
        index: 3,
        name: "JPEG".to_owned(),
    }];
    let format = "JAUS MESSAGE".to_owned();
    group(vec![
        item("Fixed", Shape::FixedString { length: 4 }),
        item(
            "Name",
            Shape::VariableString {
                count: count(Unsigned::U8, 0, 10),
            },
        ),
        item(
            "Blob",
            Shape::Blob {
                count: count(Unsigned::U16, 0, 100),
                format,
            },
        ),
        item(
            "Image",
            Shape::FormattedBlob {
                formats,
                count: count(Unsigned::U32, 0, 100),
            },
        ),
    ])
}

fn measure() -> Shape {
    let choice = |index, scalar| Choice {
        index,
        name: None,
        scalar,
    };
    Shape::Measure {
        choices: vec![
            choice(1, scaled(Unsigned::U16, -10.0, 10.0, "radian")),
            choice(4, plain(Number::F64)),
        ],
    }
}

/// A message with every construct.
pub(crate) fn everything() -> Message {
    let point = || group(vec![item("X", byte()), item("Y", byte())]);
    let members = vec![
        item("Numbers", numbers()),
        item("Scaled", scaled_numbers()),
        item("Flags", flags()),
        item("Texts", texts()),
        item("Measured", group(vec![item("Joint", measure())])),
        item("Matrix", group(vec![item("Cells", array(&[2, 3], byte()))])),
        item(
            "Points",
            list(count(Unsigned::U8, 1, 3), item("Point", point())),
        ),
        item(
            "Choice",
            variant(vec![item("One", point()), item("Other", numbers())]),
        ),
        item("Nothing", variant(Vec::new())),
        optional(
            "More",
            list(
                count(Unsigned::U16, 0, 9),
                item("Bytes", group(vec![item("B", byte())])),
            ),
        ),
    ];
    message(
        0xF0A1,
        "Everything",
        Some(item("Body", with_presence(Some(Unsigned::U8), members))),
    )
}

/// A message whose list elements take no octets.
pub(crate) fn emptiness() -> Message {
    let element = item("Empty", group(Vec::new()));
    let elements = list(count(Unsigned::U32, 0, u32::MAX.into()), element);
    message(0xF0A2, "Emptiness", Some(item("Elements", elements)))
}

/// A message with its own header and footer.
pub(crate) fn framed() -> Message {
    Message {
        header: Some(item("Head", group(vec![item("Length", byte())]))),
        footer: Some(item("Foot", group(vec![item("Checksum", byte())]))),
        ..message(
            0xF0A3,
            "Framed",
            Some(item("Body", group(vec![item("Load", byte())]))),
        )
    }
}
