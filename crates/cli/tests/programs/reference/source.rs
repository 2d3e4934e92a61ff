//! Reads types, their documentation and their serde attributes from the sources.

use std::fs;

use jaus_test_kit::tools::workspace;
use syn::{Attribute, Expr, Fields, GenericArgument, Item, Lit, Meta, PathArguments, Type};

/// A field of a struct.
pub(super) struct Field {
    pub(super) name: String,
    pub(super) about: String,
    pub(super) kind: Kind,
    /// Its attributes as text.
    pub(super) attributes: String,
}

/// The type of a field.
#[derive(Clone, Debug)]
pub(super) enum Kind {
    Plain(String),
    List(Box<Self>),
    Optional(Box<Self>),
    /// A table with keys of the user's choice.
    Map,
}

/// A variant of an enum.
pub(super) struct Variant {
    /// As a settings file names it.
    pub(super) name: String,
    pub(super) about: String,
    /// The content of a variant that is not a word.
    pub(super) content: Option<Kind>,
}

/// A type of the sources.
pub(super) struct Definition {
    pub(super) about: String,
    pub(super) shape: Shape,
    /// Whether serde reads its fields.
    pub(super) is_read: bool,
}

pub(super) enum Shape {
    /// A table with these keys.
    Table(Vec<Field>),
    /// One of these words, or a content.
    Choice(Vec<Variant>),
    /// A text with a syntax of its own.
    Text,
}

/// A source file.
pub(super) struct Source(syn::File);

impl Source {
    pub(super) fn read(path: &str) -> Self {
        let text = fs::read_to_string(workspace(path)).unwrap();
        Self(syn::parse_file(&text).unwrap_or_else(|error| panic!("{path}: {error}")))
    }

    /// The definition of a type.
    pub(super) fn find(&self, name: &str) -> Option<Definition> {
        self.0.items.iter().find_map(|item| {
            let (attrs, shape) = match item {
                Item::Struct(item) if item.ident == name => {
                    let fields = match &item.fields {
                        Fields::Named(fields) => {
                            let fields = fields.named.iter().map(Field::new);
                            // Programs set the others.
                            let is_read = |it: &Field| !it.attributes.contains("(skip)");
                            fields.filter(is_read).collect()
                        }
                        _ => return Some(Definition::text(&item.attrs)),
                    };
                    (&item.attrs, Shape::Table(fields))
                }
                Item::Enum(item) if item.ident == name => {
                    let attributes = attributes(&item.attrs);
                    let variant = |it| Variant::new(it, &attributes);
                    let variants = item.variants.iter().map(variant).collect();
                    (&item.attrs, Shape::Choice(variants))
                }
                Item::Type(item) if item.ident == name => {
                    return Some(Definition::text(&item.attrs));
                }
                _ => return None,
            };
            let shape = match self.is_text(name) {
                true => Shape::Text,
                false => shape,
            };
            Some(Definition {
                about: about(attrs),
                shape,
                is_read: attributes(attrs).contains("Deserialize"),
            })
        })
    }

    /// Whether settings files write a type as its `Display` does.
    fn is_text(&self, name: &str) -> bool {
        self.0.items.iter().any(|item| match item {
            Item::Macro(item) if item.mac.path.is_ident("serde_as_text") => {
                let types = item.mac.tokens.to_string();
                types.split(',').any(|it| {
                    let it = it.trim();
                    it.split([' ', '<']).next() == Some(name)
                })
            }
            _ => false,
        })
    }

    /// The texts of a constant array.
    pub(super) fn texts(&self, name: &str) -> Vec<String> {
        let item = self.0.items.iter().find_map(|item| match item {
            Item::Const(item) if item.ident == name => Some(&*item.expr),
            _ => None,
        });
        let Some(Expr::Array(array)) = item else {
            panic!("there is no array {name}");
        };
        let text = |element: &Expr| match element {
            Expr::Lit(literal) => match &literal.lit {
                Lit::Str(text) => text.value(),
                _ => panic!("{name} does not consist of texts"),
            },
            _ => panic!("{name} does not consist of texts"),
        };
        array.elems.iter().map(text).collect()
    }
}

impl Definition {
    fn text(attributes: &[Attribute]) -> Self {
        Self {
            about: about(attributes),
            shape: Shape::Text,
            is_read: false,
        }
    }
}

impl Field {
    fn new(field: &syn::Field) -> Self {
        Self {
            name: field.ident.as_ref().unwrap().to_string(),
            about: about(&field.attrs),
            kind: Kind::new(&field.ty),
            attributes: attributes(&field.attrs),
        }
    }
}

impl Variant {
    fn new(variant: &syn::Variant, of_enum: &str) -> Self {
        let own = attributes(&variant.attrs);
        let ident = variant.ident.to_string();
        let name = match (quoted(&own, "rename = "), quoted(of_enum, "rename_all = ")) {
            (Some(name), _) => name.to_owned(),
            (None, Some("lowercase")) => ident.to_lowercase(),
            _ => kebab(&ident),
        };
        let content = variant.fields.iter().next().map(|it| Kind::new(&it.ty));
        Self {
            name,
            about: about(&variant.attrs),
            content,
        }
    }
}

/// The quoted text after a mark.
fn quoted<'t>(text: &'t str, mark: &str) -> Option<&'t str> {
    let (_, rest) = text.split_once(mark)?;
    let (name, _) = rest.strip_prefix('"')?.split_once('"')?;
    Some(name)
}

fn kebab(name: &str) -> String {
    let mut kebab = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !kebab.is_empty() {
            kebab.push('-');
        }
        kebab.push(c.to_ascii_lowercase());
    }
    kebab
}

impl Kind {
    fn new(it: &Type) -> Self {
        let Type::Path(path) = it else {
            return Self::Plain("other".to_owned());
        };
        let last = path.path.segments.last().unwrap();
        let inner = || match &last.arguments {
            PathArguments::AngleBracketed(arguments) => match arguments.args.first() {
                Some(GenericArgument::Type(inner)) => Box::new(Self::new(inner)),
                _ => panic!("{} has no inner type", last.ident),
            },
            _ => panic!("{} has no inner type", last.ident),
        };
        match last.ident.to_string().as_str() {
            "Vec" => Self::List(inner()),
            "Option" => Self::Optional(inner()),
            "BTreeMap" => Self::Map,
            name => Self::Plain(name.to_owned()),
        }
    }
}

/// The documentation, without links to items of the library.
fn about(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter_map(|attribute| {
        let Meta::NameValue(meta) = &attribute.meta else {
            return None;
        };
        let Expr::Lit(literal) = &meta.value else {
            return None;
        };
        match &literal.lit {
            Lit::Str(text) if meta.path.is_ident("doc") => Some(text.value()),
            _ => None,
        }
    });
    let lines: Vec<_> = lines
        .map(|line| line.strip_prefix(' ').unwrap_or(&line).to_owned())
        .collect();
    without_links(&lines.join("\n"))
}

/// Replaces links to items by their texts: ``[`X`]``, `[x](crate::X)`.
fn without_links(text: &str) -> String {
    let mut result = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('[') {
        result.push_str(before);
        let Some((name, behind)) = after.split_once(']') else {
            rest = after;
            continue;
        };
        let target = behind.strip_prefix('(').and_then(|it| it.split_once(')'));
        let is_item = |target: &str| !target.contains('/') && !target.contains('.');
        match target {
            Some((target, behind)) if is_item(target) => {
                result.push_str(name);
                rest = behind;
            }
            None if name.starts_with('`') && name.ends_with('`') => {
                result.push_str(name);
                rest = behind;
            }
            _ => {
                result.push('[');
                rest = after;
            }
        }
    }
    result.push_str(rest);
    result
}

/// Attributes other than documentation, as text.
fn attributes(attributes: &[Attribute]) -> String {
    let lists = attributes
        .iter()
        .filter_map(|it| it.meta.require_list().ok());
    lists.map(|list| format!("{} ", list.tokens)).collect()
}

#[test]
fn links_to_items_become_their_texts() {
    for (text, expected) in [
        ("see [`Pacing`].", "see `Pacing`."),
        ("[known](crate::peer::Recogniser) peers", "known peers"),
        (
            "a list [\"eth0\"] and [a page](tool.md)",
            "a list [\"eth0\"] and [a page](tool.md)",
        ),
        ("[delivery]", "[delivery]"),
    ] {
        assert_eq!(without_links(text), expected);
    }
}
