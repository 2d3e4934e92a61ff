//! The table of elements: files, constants, types and messages.

use super::notation::{INTERPRETATION, NAME, beyond, element, empty, one, opt, part, text};
use super::values::{CONSTANTS, NUMBERS, UNSIGNED};
use super::{Attribute, Element, Occurs, Part, Value};

const ID: Attribute = one("id", Value::Text);
const VERSION: Attribute = one("version", Value::Version);
const VERSION_PATTERN: Attribute = one("version", Value::VersionPattern);
const OPTIONAL: Attribute = one("optional", Value::Boolean);
const DEPRECATED: Attribute = opt("deprecated", Value::Boolean).since_1_1();
const TARGET: Attribute = opt("declared_type_ref", Value::Path);
const FIELD_TYPE: Attribute = one("field_type", Value::Word(NUMBERS));
const FIELD_TYPE_UNSIGNED: Attribute = one("field_type_unsigned", Value::Word(UNSIGNED));
const FIELD_UNITS: Attribute = one("field_units", Value::Unit);
const FIELD_FORMAT: Attribute = one("field_format", Value::Text);
const MIN_COUNT: Attribute = opt("min_count", Value::Size);
const MAX_COUNT: Attribute = opt("max_count", Value::Size);
const LIMIT_TYPE: Value = Value::Word(&["inclusive", "exclusive"]);

const FIELDS: &[&str] = &[
    "array",
    "fixed_field",
    "variable_field",
    "bit_field",
    "fixed_length_string",
    "variable_length_string",
    "variable_length_field",
    "variable_format_field",
    "declared_array",
    "declared_fixed_field",
    "declared_variable_field",
    "declared_bit_field",
    "declared_fixed_length_string",
    "declared_variable_length_string",
    "declared_variable_length_field",
    "declared_variable_format_field",
];

const ARRAY_ELEMENTS: &[&str] = &[
    "fixed_field",
    "variable_field",
    "bit_field",
    "fixed_length_string",
    "variable_length_string",
    "variable_length_field",
    "variable_format_field",
    "declared_fixed_field",
    "declared_variable_field",
    "declared_bit_field",
    "declared_fixed_length_string",
    "declared_variable_length_string",
    "declared_variable_length_field",
    "declared_variable_format_field",
];

const COMPOSITES: &[&str] = &[
    "record",
    "declared_record",
    "list",
    "declared_list",
    "variant",
    "declared_variant",
    "sequence",
    "declared_sequence",
];

const DECLARATIONS: &[&str] = &[
    "message_def",
    "header",
    "body",
    "footer",
    "array",
    "record",
    "list",
    "variant",
    "sequence",
    "fixed_field",
    "variable_field",
    "bit_field",
    "fixed_length_string",
    "variable_length_string",
    "variable_length_field",
    "variable_format_field",
    "declared_message_def",
    "declared_event_def",
    "declared_header",
    "declared_body",
    "declared_footer",
    "declared_list",
    "declared_sequence",
    "declared_variant",
    "declared_record",
    "declared_array",
    "declared_fixed_field",
    "declared_variable_field",
    "declared_bit_field",
    "declared_fixed_length_string",
    "declared_variable_length_string",
    "declared_variable_length_field",
    "declared_variable_format_field",
];

const MESSAGES: &[&str] = &["message_def", "declared_message_def"];
const EVENTS: &[&str] = &["event_def", "declared_event_def"];

const DESCRIPTION: Part = part(&["description"], Occurs::Once).dispensable();
const HEADER: Part = part(&["header", "declared_header"], Occurs::Once);
const BODY: Part = part(&["body", "declared_body"], Occurs::Once);
const FOOTER: Part = part(&["footer", "declared_footer"], Occurs::Once);
const SECTION: Part = part(COMPOSITES, Occurs::Optional)
    .surplus("holds one composite: put all of them into a `sequence`");
const CONST_SET_REFS: Part = part(&["declared_const_set_ref"], Occurs::Any);
const PRESENCE: Part = part(&["presence_vector"], Occurs::Optional);
const COUNT: Part = part(&["count_field"], Occurs::Once);
const MEANING: Part = part(&["scale_range", "value_set"], Occurs::Optional)
    .newer(&["declared_value_set"])
    .surplus("has a `scale_range` or a `value_set`, not both: remove one");

/// From the root inwards, except for what is in `protocol_behavior`.
pub(super) const ELEMENTS: &[Element] = &[
    // Files.
    element(
        "service_set",
        &[NAME, ID, VERSION, beyond("interpretation"), beyond("date")],
        &[
            DESCRIPTION,
            part(&["declared_const_set"], Occurs::Any),
            part(&["declared_type_set"], Occurs::Any),
            part(&["service_def"], Occurs::Any),
        ],
        "a `description`, `declared_const_set`s, `declared_type_set`s and `service_def`s",
    ),
    element(
        "service_def",
        &[NAME, ID, VERSION, DEPRECATED, beyond("interpretation")],
        &[
            DESCRIPTION,
            part(&["assumptions"], Occurs::Once).dispensable(),
            part(&["references"], Occurs::Optional),
            part(&["declared_const_set"], Occurs::Optional),
            part(&["declared_type_set"], Occurs::Optional),
            part(&["message_set"], Occurs::Once),
            part(&["internal_events_set"], Occurs::Once).dispensable(),
            part(&["protocol_behavior"], Occurs::Once).dispensable(),
        ],
        "`description`, `assumptions`, `references`, `declared_const_set`, `declared_type_set`, \
         `message_set`, `internal_events_set` and `protocol_behavior`",
    ),
    text("description"),
    text("assumptions"),
    element(
        "references",
        &[],
        &[
            part(&["inherits_from"], Occurs::Optional),
            part(&["client_of"], Occurs::Any),
        ],
        "`inherits_from` and `client_of`",
    ),
    empty(
        "inherits_from",
        &[NAME, ID, VERSION_PATTERN, INTERPRETATION],
    ),
    empty("client_of", &[NAME, ID, VERSION_PATTERN, INTERPRETATION]),
    // Constants.
    element(
        "declared_const_set",
        &[
            NAME,
            opt("id", Value::Text),
            opt("version", Value::Version),
            beyond("interpretation"),
        ],
        &[CONST_SET_REFS, part(&["const_def"], Occurs::Any)],
        "`const_def`s",
    ),
    empty(
        "declared_const_set_ref",
        &[NAME, ID, VERSION, beyond("interpretation")],
    ),
    empty(
        "const_def",
        &[
            NAME,
            one("const_type", Value::Word(CONSTANTS)),
            one("const_value", Value::Text),
            FIELD_UNITS,
            INTERPRETATION,
        ],
    ),
    // Types.
    element(
        "declared_type_set",
        &[
            NAME,
            opt("id", Value::Text),
            opt("version", Value::Version),
            beyond("interpretation"),
        ],
        &[
            CONST_SET_REFS,
            part(&["declared_type_set_ref"], Occurs::Any),
            part(DECLARATIONS, Occurs::Any).newer(&["value_set"]),
            part(&["event_def"], Occurs::Never),
        ],
        "declarations of messages, sections, composites, fields and value sets",
    ),
    empty(
        "declared_type_set_ref",
        &[NAME, ID, VERSION, beyond("interpretation")],
    ),
    empty(
        "declared_message_def",
        &[NAME, TARGET, beyond("deprecated"), INTERPRETATION],
    ),
    empty(
        "declared_event_def",
        &[NAME, TARGET, beyond("deprecated"), INTERPRETATION],
    ),
    empty(
        "declared_header",
        &[NAME, TARGET, beyond("deprecated"), INTERPRETATION],
    ),
    empty(
        "declared_body",
        &[NAME, TARGET, beyond("deprecated"), INTERPRETATION],
    ),
    empty(
        "declared_footer",
        &[NAME, TARGET, beyond("deprecated"), INTERPRETATION],
    ),
    empty(
        "declared_variant",
        &[NAME, OPTIONAL.since_1_1(), TARGET, INTERPRETATION],
    ),
    empty("declared_sequence", DECLARED),
    empty("declared_record", DECLARED),
    empty("declared_list", DECLARED),
    empty("declared_array", DECLARED),
    empty("declared_fixed_field", DECLARED),
    empty("declared_variable_field", DECLARED),
    empty("declared_bit_field", DECLARED),
    empty("declared_fixed_length_string", DECLARED),
    empty("declared_variable_length_string", DECLARED),
    empty("declared_variable_length_field", DECLARED),
    empty("declared_variable_format_field", DECLARED),
    empty("declared_value_set", &[NAME, TARGET, INTERPRETATION]),
    // Messages.
    element(
        "message_set",
        &[INTERPRETATION],
        &[
            part(&["input_set"], Occurs::Once),
            part(&["output_set"], Occurs::Once),
        ],
        "an `input_set` and an `output_set`",
    ),
    element(
        "input_set",
        &[INTERPRETATION],
        &[part(MESSAGES, Occurs::Any)],
        "messages",
    ),
    element(
        "output_set",
        &[INTERPRETATION],
        &[part(MESSAGES, Occurs::Any)],
        "messages",
    ),
    element(
        "internal_events_set",
        &[INTERPRETATION],
        &[part(EVENTS, Occurs::Any)],
        "events",
    ),
    element(
        "message_def",
        &[
            NAME,
            one("message_id", Value::Octets),
            opt("is_command", Value::Boolean).in_1_0(Occurs::Once),
            DEPRECATED,
            beyond("interpretation"),
        ],
        &[DESCRIPTION, HEADER, BODY, FOOTER],
        "a `description`, a `header`, a `body` and a `footer`",
    ),
    element(
        "event_def",
        &[NAME, DEPRECATED, beyond("interpretation")],
        &[DESCRIPTION, HEADER, BODY, FOOTER],
        "a `description`, a `header`, a `body` and a `footer`",
    ),
    element(
        "header",
        &[NAME, INTERPRETATION],
        &[SECTION],
        ONLY_COMPOSITES,
    ),
    element("body", &[NAME, INTERPRETATION], &[SECTION], ONLY_COMPOSITES),
    element(
        "footer",
        &[NAME, INTERPRETATION],
        &[SECTION],
        ONLY_COMPOSITES,
    ),
    // Composites.
    element(
        "array",
        COMMON,
        &[
            part(ARRAY_ELEMENTS, Occurs::Once)
                .surplus("has one element type only: put the others elsewhere")
                .missing("has no element type: add a field"),
            part(&["dimension"], Occurs::Some),
        ],
        "one field and its `dimension`s",
    ),
    empty(
        "dimension",
        &[NAME, one("size", Value::Size), INTERPRETATION],
    ),
    element(
        "record",
        COMMON,
        &[PRESENCE, part(FIELDS, Occurs::Some).dispensable()],
        "fields: put composites into a `sequence` instead",
    ),
    element(
        "list",
        COMMON,
        &[
            COUNT,
            part(COMPOSITES, Occurs::Once)
                .surplus("has one element type only: put the others elsewhere")
                .missing("has no element type: add a composite"),
        ],
        ONLY_COMPOSITES,
    ),
    element(
        "variant",
        COMMON,
        &[
            part(&["vtag_field"], Occurs::Once),
            part(COMPOSITES, Occurs::Any),
        ],
        ONLY_COMPOSITES,
    ),
    element(
        "sequence",
        COMMON,
        &[PRESENCE, part(COMPOSITES, Occurs::Some).dispensable()],
        ONLY_COMPOSITES,
    ),
    empty("presence_vector", &[FIELD_TYPE_UNSIGNED]),
    empty(
        "count_field",
        &[FIELD_TYPE_UNSIGNED, MIN_COUNT, MAX_COUNT, INTERPRETATION],
    ),
    empty(
        "vtag_field",
        &[FIELD_TYPE_UNSIGNED, MIN_COUNT, MAX_COUNT, INTERPRETATION],
    ),
    // Fields.
    element(
        "fixed_field",
        &[NAME, OPTIONAL, FIELD_TYPE, FIELD_UNITS, INTERPRETATION],
        &[MEANING],
        "a `scale_range` or a `value_set`",
    ),
    element(
        "variable_field",
        COMMON,
        &[part(&["type_and_units_field"], Occurs::Once)],
        "one `type_and_units_field`",
    ),
    element(
        "type_and_units_field",
        &[],
        &[part(&["type_and_units_enum"], Occurs::Some)],
        "`type_and_units_enum`s",
    ),
    element(
        "type_and_units_enum",
        &[
            NAME.since_1_1(),
            one("index", Value::Octet),
            FIELD_TYPE,
            FIELD_UNITS,
            INTERPRETATION.since_1_1(),
        ],
        &[MEANING],
        "a `scale_range` or a `value_set`",
    ),
    element(
        "bit_field",
        &[NAME, OPTIONAL, FIELD_TYPE_UNSIGNED, INTERPRETATION],
        &[part(&["sub_field"], Occurs::Some)],
        "`sub_field`s",
    ),
    element(
        "sub_field",
        &[NAME, INTERPRETATION],
        &[
            part(&["bit_range"], Occurs::Once),
            part(&["value_set"], Occurs::Once).newer(&["declared_value_set"]),
        ],
        "a `bit_range` and a `value_set`",
    ),
    empty(
        "bit_range",
        &[
            one("from_index", Value::Octet),
            one("to_index", Value::Octet),
            INTERPRETATION,
        ],
    ),
    empty(
        "fixed_length_string",
        &[
            NAME,
            OPTIONAL,
            one("string_length", Value::Size),
            INTERPRETATION,
        ],
    ),
    element(
        "variable_length_string",
        COMMON,
        &[COUNT],
        "one `count_field`",
    ),
    element(
        "variable_length_field",
        &[NAME, OPTIONAL, FIELD_FORMAT, INTERPRETATION],
        &[COUNT],
        "one `count_field`",
    ),
    element(
        "variable_format_field",
        COMMON,
        &[part(&["format_field"], Occurs::Once), COUNT],
        "a `format_field` and a `count_field`",
    ),
    element(
        "format_field",
        &[],
        &[part(&["format_enum"], Occurs::Some)],
        "`format_enum`s",
    ),
    empty(
        "format_enum",
        &[
            one("index", Value::Octet),
            FIELD_FORMAT,
            beyond("interpretation"),
        ],
    ),
    element(
        "value_set",
        &[
            NAME_OF_SET,
            one("offset_to_lower_limit", Value::Boolean),
            beyond("interpretation"),
        ],
        &[part(&["value_range", "value_enum"], Occurs::Some).dispensable()],
        "`value_range` and `value_enum`",
    ),
    empty(
        "value_range",
        &[
            one("lower_limit", Value::Text),
            one("lower_limit_type", LIMIT_TYPE),
            one("upper_limit", Value::Text),
            one("upper_limit_type", LIMIT_TYPE),
            INTERPRETATION,
        ],
    ),
    empty(
        "value_enum",
        &[
            one("enum_index", Value::Long),
            one("enum_const", Value::Text),
            INTERPRETATION,
        ],
    ),
    empty(
        "scale_range",
        &[
            one("real_lower_limit", Value::Text),
            one("real_upper_limit", Value::Text),
            one(
                "integer_function",
                Value::Word(&["floor", "round", "ceiling"]),
            ),
            INTERPRETATION,
        ],
    ),
];

const COMMON: &[Attribute] = &[NAME, OPTIONAL, INTERPRETATION];
const DECLARED: &[Attribute] = &[NAME, OPTIONAL, TARGET, INTERPRETATION];
const NAME_OF_SET: Attribute = opt("name", Value::Identifier).since_1_1();
const ONLY_COMPOSITES: &str = "composites: put fields into a `record`";
