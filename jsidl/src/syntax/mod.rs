//! Syntax tree: the content of the XML, with all positions, before references are resolved.
//!
//! [`read`] parses one text into declarations, which it adds to a [`Program`]. Unreadable parts are
//! reported and marked as faulty, so that everything around them is still checked.

mod behaviour;
mod composite;
mod element;
mod field;
mod limits;
mod message;
mod root;

use std::collections::HashSet;
use std::fmt;
use std::sync::Arc;

use crate::behaviour::StateMachine;
use crate::expr::Expression;
use crate::model::{GroupKind, Id, Number, Rounding, Unsigned, Version};
use crate::permission::Permission;
use crate::source::{Span, Spanned};

pub(crate) use element::EXTENSION;
pub(crate) use limits::{LARGEST, excess};
pub(crate) use root::{Strictness, check_strictly, is_definition, read};

/// Declarations of all files.
#[derive(Debug, Default)]
pub(crate) struct Program {
    pub(crate) services: Vec<ServiceDef>,
    pub(crate) type_sets: Vec<TypeSet>,
    pub(crate) const_sets: Vec<ConstSet>,
}

impl Program {
    /// The URNs of all services that others inherit from or are clients of.
    pub(crate) fn referenced(&self) -> HashSet<Arc<str>> {
        let services = self.services.iter();
        let references = services.flat_map(|it| it.inherits_from.iter().chain(&it.client_of));
        references.map(|it| it.urn.clone()).collect()
    }
}

/// Index of a type set in [`Program::type_sets`].
pub(crate) type TypeSetIndex = usize;

/// `service_def`
#[derive(Debug)]
pub(crate) struct ServiceDef {
    pub(crate) span: Span,
    pub(crate) name: String,
    pub(crate) id: Id,
    pub(crate) description: String,
    pub(crate) inherits_from: Option<ServiceRef>,
    pub(crate) client_of: Vec<ServiceRef>,
    /// The `declared_type_set` inside the service; an empty one if it has none.
    pub(crate) types: TypeSetIndex,
    pub(crate) inputs: Vec<Declaration>,
    pub(crate) outputs: Vec<Declaration>,
    pub(crate) events: Vec<Declaration>,
    /// The state machines without errors.
    pub(crate) behaviour: Vec<StateMachine>,
    /// Whether its identity and references are readable. If not, it is checked for further mistakes
    /// and then left out.
    pub(crate) sound: bool,
}

/// A local alias of a service: `inherits_from`, `client_of`.
#[derive(Debug, Clone)]
pub(crate) struct ServiceRef {
    pub(crate) span: Span,
    pub(crate) name: String,
    pub(crate) urn: Arc<str>,
    pub(crate) version: VersionPattern,
}

impl ServiceRef {
    /// Whether it may mean a service with this identity.
    pub(crate) fn admits(&self, id: &Id) -> bool {
        self.urn == id.urn && self.version.admits(id.version)
    }
}

/// The URN and the version as written.
impl fmt::Display for ServiceRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.urn, self.version)
    }
}

/// A version; `None` is `*`, any number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct VersionPattern {
    pub(crate) major: Option<u8>,
    pub(crate) minor: Option<u8>,
}

impl VersionPattern {
    /// The version, without wildcards.
    pub(crate) fn exact(self) -> Option<Version> {
        Some(Version {
            major: self.major?,
            minor: self.minor?,
        })
    }

    fn admits(self, version: Version) -> bool {
        let same = |part: Option<u8>, number| part.is_none_or(|part| part == number);
        same(self.major, version.major) && same(self.minor, version.minor)
    }
}

impl fmt::Display for VersionPattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let part = |part: Option<u8>| part.map_or_else(|| "*".to_owned(), |it| it.to_string());
        write!(f, "{}.{}", part(self.major), part(self.minor))
    }
}

/// A local alias of a set with URN and version: `declared_type_set_ref`,
/// `declared_const_set_ref`.
#[derive(Debug, Clone)]
pub(crate) struct SetRef {
    pub(crate) span: Span,
    pub(crate) name: String,
    pub(crate) id: Id,
}

/// `declared_type_set`
#[derive(Debug)]
pub(crate) struct TypeSet {
    pub(crate) span: Span,
    /// A set inside a service has none.
    pub(crate) id: Option<Id>,
    pub(crate) type_sets: Vec<SetRef>,
    pub(crate) const_sets: Vec<SetRef>,
    /// The constant set beside the type set in a service: an index into [`Program::const_sets`].
    pub(crate) constants: Option<usize>,
    pub(crate) declarations: Vec<Declaration>,
}

impl TypeSet {
    fn empty(span: Span) -> Self {
        Self {
            span,
            id: None,
            type_sets: Vec::new(),
            const_sets: Vec::new(),
            constants: None,
            declarations: Vec::new(),
        }
    }
}

/// `declared_const_set`
#[derive(Debug)]
pub(crate) struct ConstSet {
    pub(crate) span: Span,
    pub(crate) name: String,
    /// A set inside a service needs none.
    pub(crate) id: Option<Id>,
    pub(crate) const_sets: Vec<SetRef>,
    pub(crate) definitions: Vec<ConstDef>,
}

/// `const_def`
#[derive(Debug)]
pub(crate) struct ConstDef {
    /// Position of the value.
    pub(crate) span: Span,
    pub(crate) name: String,
    pub(crate) units: Option<Spanned<String>>,
    pub(crate) value: Constant,
}

/// The value of a constant.
#[derive(Debug)]
pub(crate) enum Constant {
    Number(Number, Expr),
    /// A `string`: no number of a definition can refer to it.
    Text,
}

/// A named item of a type set, a message set or an event set.
#[derive(Debug)]
pub(crate) struct Declaration {
    pub(crate) span: Span,
    pub(crate) name: String,
    pub(crate) kind: DeclarationKind,
    /// As [`Node::sound`].
    pub(crate) sound: bool,
}

/// What a declaration declares.
#[derive(Debug)]
pub(crate) enum DeclarationKind {
    Message(MessageDef),
    Event(EventDef),
    /// `header`, `body` or `footer`.
    Section(Construct, Section),
    Node(Node),
    Values(ValueSet),
    /// `declared_message_def`, `declared_event_def`, `declared_header` …
    Reference(Target),
    /// Already reported.
    Faulty,
}

/// Target of a `declared_type_ref`.
#[derive(Debug, Clone)]
pub(crate) struct Target {
    pub(crate) construct: Construct,
    pub(crate) path: Spanned<String>,
}

impl DeclarationKind {
    /// The declared construct; `None` if it was unreadable.
    pub(crate) const fn construct(&self) -> Option<Construct> {
        match self {
            Self::Message(_) => Some(Construct::MessageDef),
            Self::Event(_) => Some(Construct::EventDef),
            Self::Section(construct, _) => Some(*construct),
            Self::Node(node) => node.kind.construct(),
            Self::Values(_) => Some(Construct::ValueSet),
            Self::Reference(target) => Some(target.construct),
            Self::Faulty => None,
        }
    }
}

/// `message_def`
#[derive(Debug)]
pub(crate) struct MessageDef {
    pub(crate) code: u16,
    pub(crate) is_command: bool,
    pub(crate) is_deprecated: bool,
    pub(crate) permission: Option<Permission>,
    pub(crate) stops: bool,
    pub(crate) destination: Option<Spanned<String>>,
    pub(crate) description: String,
    pub(crate) header: Section,
    pub(crate) body: Section,
    pub(crate) footer: Section,
}

/// `event_def`: only checked for mistakes.
#[derive(Debug)]
pub(crate) struct EventDef {
    pub(crate) sections: [Section; 3],
}

/// `header`, `body` or `footer`.
#[derive(Debug)]
pub(crate) struct Section {
    pub(crate) span: Span,
    pub(crate) name: String,
    pub(crate) content: Content,
}

/// Content of a section.
#[derive(Debug)]
pub(crate) enum Content {
    Empty,
    Node(Box<Node>),
    Reference(Target),
    /// Already reported.
    Faulty,
}

/// A field or a composite.
#[derive(Debug)]
pub(crate) struct Node {
    pub(crate) span: Span,
    pub(crate) name: String,
    /// Absent in some older definitions, which means `false`; a reference without it inherits the
    /// target's value.
    pub(crate) optional: Option<bool>,
    pub(crate) interpretation: Option<String>,
    pub(crate) kind: Kind,
    /// Whether it was read without findings. If not, it is checked for further mistakes and then
    /// left out.
    pub(crate) sound: bool,
}

impl Node {
    /// Collects its name and those of everything in it, references included.
    pub(crate) fn names<'n>(&'n self, names: &mut Vec<&'n str>) {
        names.push(&self.name);
        let (several, one) = match &self.kind {
            Kind::Group { members, .. } => (members.as_slice(), None),
            Kind::Variant { alternatives, .. } => (alternatives.as_slice(), None),
            Kind::List { element, .. } | Kind::Array { element, .. } => {
                (&[][..], Some(element.as_ref()))
            }
            _ => (&[][..], None),
        };
        for inner in several.iter().chain(one) {
            inner.names(names);
        }
    }
}

/// The constructs, as written.
#[derive(Debug)]
pub(crate) enum Kind {
    Group {
        kind: GroupKind,
        presence: Option<Spanned<Unsigned>>,
        members: Vec<Node>,
    },
    List {
        count: CountField,
        element: Box<Node>,
    },
    Variant {
        tag: CountField,
        alternatives: Vec<Node>,
    },
    Array {
        dimensions: Vec<Dimension>,
        element: Box<Node>,
    },
    Scalar(ScalarField),
    Bits {
        base: Unsigned,
        fields: Vec<SubField>,
    },
    FixedString {
        length: Expr,
    },
    VariableString {
        count: CountField,
    },
    Blob {
        count: CountField,
        format: String,
    },
    FormattedBlob {
        formats: Vec<FormatEnum>,
        count: CountField,
    },
    Measure {
        choices: Vec<ChoiceEnum>,
    },
    Reference(Target),
    /// Already reported.
    Faulty,
}

impl Kind {
    const fn construct(&self) -> Option<Construct> {
        Some(match self {
            Self::Group { kind, .. } => match kind {
                GroupKind::Record => Construct::Record,
                GroupKind::Sequence => Construct::Sequence,
            },
            Self::List { .. } => Construct::List,
            Self::Variant { .. } => Construct::Variant,
            Self::Array { .. } => Construct::Array,
            Self::Scalar(_) => Construct::FixedField,
            Self::Bits { .. } => Construct::BitField,
            Self::FixedString { .. } => Construct::FixedLengthString,
            Self::VariableString { .. } => Construct::VariableLengthString,
            Self::Blob { .. } => Construct::VariableLengthField,
            Self::FormattedBlob { .. } => Construct::VariableFormatField,
            Self::Measure { .. } => Construct::VariableField,
            Self::Reference(target) => target.construct,
            Self::Faulty => return None,
        })
    }
}

/// An expression with its position.
pub(crate) type Expr = Spanned<Expression>;

/// `count_field` or `vtag_field`
#[derive(Debug)]
pub(crate) struct CountField {
    pub(crate) span: Span,
    pub(crate) unsigned: Unsigned,
    pub(crate) min: Option<Expr>,
    pub(crate) max: Option<Expr>,
}

/// `dimension`
#[derive(Debug)]
pub(crate) struct Dimension {
    pub(crate) span: Span,
    pub(crate) name: String,
    pub(crate) size: Expr,
}

/// `fixed_field`, or the value of a `type_and_units_enum`
#[derive(Debug)]
pub(crate) struct ScalarField {
    pub(crate) number: Number,
    pub(crate) units: Spanned<String>,
    pub(crate) scale: Option<ScaleRange>,
    pub(crate) values: Option<Values>,
}

/// `value_set` or `declared_value_set` of a field
#[derive(Debug)]
pub(crate) enum Values {
    Here(ValueSet),
    Declared(Target),
}

/// `scale_range`
#[derive(Debug)]
pub(crate) struct ScaleRange {
    pub(crate) span: Span,
    pub(crate) lower: Expr,
    pub(crate) upper: Expr,
    pub(crate) rounding: Rounding,
    /// The centre of the range is the number's zero.
    pub(crate) centred: bool,
}

/// `value_set`
#[derive(Debug)]
pub(crate) struct ValueSet {
    pub(crate) span: Span,
    pub(crate) offset_to_lower_limit: bool,
    pub(crate) ranges: Vec<ValueRange>,
    pub(crate) values: Vec<ValueEnum>,
}

/// `value_range`
#[derive(Debug)]
pub(crate) struct ValueRange {
    pub(crate) span: Span,
    pub(crate) lower: Expr,
    pub(crate) upper: Expr,
    pub(crate) lower_exclusive: bool,
    pub(crate) upper_exclusive: bool,
    pub(crate) interpretation: String,
}

/// `value_enum`
#[derive(Debug)]
pub(crate) struct ValueEnum {
    pub(crate) span: Span,
    pub(crate) index: Expr,
    pub(crate) name: String,
    pub(crate) interpretation: String,
}

/// `sub_field`
#[derive(Debug)]
pub(crate) struct SubField {
    pub(crate) span: Span,
    pub(crate) name: String,
    pub(crate) from: Expr,
    pub(crate) to: Expr,
    pub(crate) values: Values,
    pub(crate) interpretation: String,
}

/// `format_enum`
#[derive(Debug)]
pub(crate) struct FormatEnum {
    pub(crate) span: Span,
    pub(crate) index: Expr,
    pub(crate) name: String,
}

/// `type_and_units_enum`
#[derive(Debug)]
pub(crate) struct ChoiceEnum {
    pub(crate) span: Span,
    pub(crate) index: Expr,
    pub(crate) name: Option<String>,
    pub(crate) scalar: ScalarField,
}

/// Elements that a `declared_…` element may refer to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Construct {
    Record,
    Sequence,
    List,
    Variant,
    Array,
    FixedField,
    BitField,
    VariableField,
    FixedLengthString,
    VariableLengthString,
    VariableLengthField,
    VariableFormatField,
    Header,
    Body,
    Footer,
    MessageDef,
    EventDef,
    ValueSet,
}

impl Construct {
    const ALL: [Self; 18] = [
        Self::Record,
        Self::Sequence,
        Self::List,
        Self::Variant,
        Self::Array,
        Self::FixedField,
        Self::BitField,
        Self::VariableField,
        Self::FixedLengthString,
        Self::VariableLengthString,
        Self::VariableLengthField,
        Self::VariableFormatField,
        Self::Header,
        Self::Body,
        Self::Footer,
        Self::MessageDef,
        Self::EventDef,
        Self::ValueSet,
    ];

    /// The element's name.
    pub(crate) const fn element(self) -> &'static str {
        match self {
            Self::Record => "record",
            Self::Sequence => "sequence",
            Self::List => "list",
            Self::Variant => "variant",
            Self::Array => "array",
            Self::FixedField => "fixed_field",
            Self::BitField => "bit_field",
            Self::VariableField => "variable_field",
            Self::FixedLengthString => "fixed_length_string",
            Self::VariableLengthString => "variable_length_string",
            Self::VariableLengthField => "variable_length_field",
            Self::VariableFormatField => "variable_format_field",
            Self::Header => "header",
            Self::Body => "body",
            Self::Footer => "footer",
            Self::MessageDef => "message_def",
            Self::EventDef => "event_def",
            Self::ValueSet => "value_set",
        }
    }

    /// The construct of an element, and whether it is a reference to a declaration (`declared_…`).
    pub(crate) fn of(element: &str) -> Option<(Self, bool)> {
        let bare = element.strip_prefix("declared_");
        let name = bare.unwrap_or(element);
        let construct = Self::ALL.into_iter().find(|c| c.element() == name)?;
        Some((construct, bare.is_some()))
    }

    /// Composites consist of other constructs.
    pub(crate) const fn is_composite(self) -> bool {
        matches!(
            self,
            Self::Record | Self::Sequence | Self::List | Self::Variant
        )
    }

    /// Fields are what records hold.
    pub(crate) const fn is_field(self) -> bool {
        matches!(
            self,
            Self::Array
                | Self::FixedField
                | Self::BitField
                | Self::VariableField
                | Self::FixedLengthString
                | Self::VariableLengthString
                | Self::VariableLengthField
                | Self::VariableFormatField
        )
    }
}
