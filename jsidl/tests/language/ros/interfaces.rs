//! Reads the files of a package by the rules of ROS 2 (rosidl), and knows nothing of JSIDL.

use std::collections::{BTreeMap, BTreeSet};

/// The fields of each type.
pub(super) type Interfaces = BTreeMap<String, Vec<Field>>;

/// A field of a `.msg` file.
#[derive(Debug, Clone)]
pub(super) struct Field {
    /// Without the count.
    pub(super) ty: String,
    pub(super) count: Count,
    pub(super) name: String,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Count {
    One,
    AtMost(usize),
    Any,
    Exactly(usize),
}

const PRIMITIVE: &[&str] = &[
    "bool", "float32", "float64", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64",
    "uint64", "string",
];

/// Words of C, C++ and Python that definitions are likely to use.
const KEYWORDS: &[&str] = &[
    "and",
    "auto",
    "bool",
    "break",
    "case",
    "char",
    "class",
    "const",
    "continue",
    "default",
    "del",
    "delete",
    "do",
    "double",
    "else",
    "enum",
    "float",
    "for",
    "from",
    "global",
    "goto",
    "if",
    "import",
    "in",
    "int",
    "is",
    "lambda",
    "long",
    "namespace",
    "new",
    "not",
    "operator",
    "or",
    "pass",
    "private",
    "protected",
    "public",
    "raise",
    "register",
    "restrict",
    "return",
    "short",
    "signed",
    "static",
    "struct",
    "switch",
    "template",
    "this",
    "try",
    "union",
    "unsigned",
    "using",
    "virtual",
    "void",
    "while",
    "with",
    "yield",
];

/// `^(?!.*__)(?!.*_$)[a-z][a-z0-9_]*$`
fn is_field_name(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_lowercase())
        && name
            .chars()
            .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
        && !name.contains("__")
        && !name.ends_with('_')
}

/// `^[A-Z]([A-Z0-9_]?[A-Z0-9]+)*$`
fn is_constant_name(name: &str) -> bool {
    is_field_name(&name.to_ascii_lowercase()) && name == name.to_ascii_uppercase()
}

/// `^[A-Z][A-Za-z0-9]*$`
fn is_type_name(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_uppercase())
        && name.chars().all(|c| c.is_ascii_alphanumeric())
}

/// The least and the greatest value of a constant.
fn limits(ty: &str) -> Option<(i128, i128)> {
    let (is_signed, bits) = match ty.strip_prefix("uint") {
        Some(bits) => (false, bits),
        None => (true, ty.strip_prefix("int")?),
    };
    let bits: u32 = bits.parse().ok()?;
    let all = 1_i128 << bits;
    Some(if is_signed {
        (-all / 2, all / 2 - 1)
    } else {
        (0, all - 1)
    })
}

fn field(line: &str) -> Field {
    let (ty, name) = line.split_once(' ').unwrap_or_else(|| panic!("{line}"));
    let (ty, count) = match ty.split_once('[') {
        None => (ty, Count::One),
        Some((ty, "]")) => (ty, Count::Any),
        Some((ty, count)) => {
            let count = count.strip_suffix(']').unwrap();
            let number = |text: &str| text.parse().unwrap();
            let count = match count.strip_prefix("<=") {
                Some(most) => Count::AtMost(number(most)),
                None => Count::Exactly(number(count)),
            };
            assert!(!matches!(count, Count::AtMost(0) | Count::Exactly(0)));
            (ty, count)
        }
    };
    assert!(PRIMITIVE.contains(&ty) || is_type_name(ty), "{line}");
    assert!(is_field_name(name) && !KEYWORDS.contains(&name), "{line}");
    Field {
        ty: ty.to_owned(),
        count,
        name: name.to_owned(),
    }
}

fn constant<'a>(ty: &str, rest: &'a str) -> &'a str {
    let (name, value) = rest.split_once('=').unwrap();
    assert!(is_constant_name(name), "{name}");
    let (least, most) = limits(ty).unwrap_or_else(|| panic!("{ty}"));
    let value: i128 = value.parse().unwrap();
    assert!((least..=most).contains(&value), "{ty} {rest}");
    name
}

/// The fields of a file, of which every line follows the rules.
fn interface(path: &str, text: &str) -> Vec<Field> {
    assert!(text.starts_with("# ") && text.ends_with('\n'), "{path}");
    let mut fields: Vec<Field> = Vec::new();
    let mut constants = BTreeSet::new();
    for line in text.lines() {
        // A backslash begins an escape sequence in the IDL that ROS makes of comments.
        let is_shown = |c: char| !c.is_control() && c != '\\';
        assert!(line.chars().all(is_shown), "{path}: {line}");
        assert!(line == line.trim_end(), "{path}: {line}");
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        assert!(!line.contains('#'), "{path}: {line}");
        match line.split_once(' ') {
            Some((ty, rest)) if rest.contains('=') => {
                assert!(constants.insert(constant(ty, rest)), "{path}: {line}");
            }
            _ => fields.push(field(line)),
        }
    }
    let names: BTreeSet<_> = fields.iter().map(|field| &field.name).collect();
    assert_eq!(names.len(), fields.len(), "{path}");
    fields
}

/// Reads a package; panics at the first violation of a rule.
pub(super) fn read(package: &str, files: &[(String, String)]) -> Interfaces {
    let (first, others) = files.split_at(2);
    assert_eq!(first[0].0, format!("{package}/package.xml"));
    let manifest = roxmltree::Document::parse(&first[0].1).unwrap();
    let elements = manifest.root_element().children();
    let name = elements.clone().find(|node| node.has_tag_name("name"));
    assert_eq!(name.unwrap().text(), Some(package));
    for required in ["version", "description", "maintainer", "license"] {
        let found = elements.clone().find(|node| node.has_tag_name(required));
        assert!(found.unwrap().text().is_some_and(|text| !text.is_empty()));
    }
    assert_eq!(first[1].0, format!("{package}/CMakeLists.txt"));
    let build = &first[1].1;
    assert!(build.contains(&format!("project({package})")));

    let mut interfaces = Interfaces::new();
    for (path, text) in others {
        let name = path.strip_prefix(&format!("{package}/msg/")).unwrap();
        let name = name.strip_suffix(".msg").unwrap();
        assert!(is_type_name(name), "{name}");
        assert!(build.contains(&format!("  \"msg/{name}.msg\"\n")), "{name}");
        interfaces.insert(name.to_owned(), interface(path, text));
    }
    assert_eq!(interfaces.len(), others.len());
    assert_eq!(build.matches("\"msg/").count(), others.len());
    let folded: BTreeSet<_> = interfaces.keys().map(|it| it.to_lowercase()).collect();
    assert_eq!(folded.len(), others.len(), "names that differ in case only");
    for (name, fields) in &interfaces {
        for field in fields {
            let is_known = PRIMITIVE.contains(&&*field.ty) || interfaces.contains_key(&field.ty);
            assert!(is_known, "{name}: {}", field.ty);
        }
        assert!(is_finite(&interfaces, name, 0), "{name} contains itself");
    }
    interfaces
}

fn is_finite(interfaces: &Interfaces, name: &str, depth: usize) -> bool {
    let mut fields = interfaces.get(name).into_iter().flatten();
    depth < 64 && fields.all(|field| is_finite(interfaces, &field.ty, depth + 1))
}
