//! One small definition, or a few, for every rule: what is found, where, and in which words.

use jsidl::{Loaded, Loader};

fn load(text: &str) -> Loaded {
    let mut loader = Loader::new();
    loader.text("t.xml", text);
    loader.load()
}

/// Compares the findings with what is expected, a line each.
#[track_caller]
fn check(text: &str, expected: &str) {
    let found = load(text).diagnostics.to_string();
    assert_eq!(found.trim(), expected.trim(), "\nin\n{text}");
}

/// A service whose type set holds these declarations, which begin on line 3.
fn types(declarations: &str) -> String {
    format!(
        r#"<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.0">
<declared_type_set name="T">
{declarations}
</declared_type_set>
<message_set><input_set/><output_set/></message_set>
</service_def>"#
    )
}

/// A service that receives these messages, the first of which begins on line 3.
fn messages(messages: &str) -> String {
    format!(
        r#"<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.0">
<message_set><input_set>
{messages}
</input_set><output_set/></message_set>
</service_def>"#
    )
}

fn text(text: &str) -> String {
    text.to_owned()
}

#[test]
fn a_text_that_is_not_xml_is_reported_where_it_breaks() {
    check(
        &text(
            "<service_def>
  <message_set>
</service_def>",
        ),
        "t.xml:3:1: error: this is not well-formed XML: expected 'message_set' tag, not 'service_def'",
    );
    check(
        &text(
            "<!DOCTYPE a>
<a/>",
        ),
        "t.xml:1:1: error: a document type declaration is not needed in JSIDL and not read: remove it",
    );
    check(
        &text("no definition"),
        "t.xml:1:1: error: this is not well-formed XML: unknown token",
    );
}

#[test]
fn a_root_that_is_no_definition_is_reported() {
    check(
        &text(r#"<project xmlns="urn:maven"/>"#),
        "t.xml:1:1: error: `project` is not the root of a JSIDL file: expected one of `service_def`, `declared_type_set`, `declared_const_set`, `service_set`",
    );
    check(
        &text(r#"<service_def name="S"/>"#),
        r#"t.xml:1:1: error: `service_def` is not in the namespace of JSIDL: add `xmlns="urn:jaus:jsidl:1.1"`"#,
    );
    check(
        &text(r#"<record xmlns="urn:jaus:jsidl:1.0" name="R"/>"#),
        "t.xml:1:1: error: `record` is not the root of a JSIDL file: expected one of `service_def`, `declared_type_set`, `declared_const_set`, `service_set`",
    );
}

#[test]
fn unknown_elements_attributes_and_text_are_reported() {
    check(
        &types(r#"<record name="R" optinal="true">
  stray
  <fixedfield name="F"/>
  <list name="L"/>
<fixed_field name="A" field_type="unsigned byte" field_units="one"/>
</record>"#),
        "
t.xml:3:18: error: `record` has no attribute `optinal`: it has `name`, `optional`, `interpretation`
t.xml:3:33: error: text has no meaning inside `record`: remove it, or make it a comment
t.xml:5:3: error: `fixedfield` may not stand in `record`, which holds fields: put composites into a `sequence` instead
t.xml:6:3: error: `list` may not stand in `record`, which holds fields: put composites into a `sequence` instead
",
    );
    check(
        &types(
            r#"<sequence name="Q"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></sequence>"#,
        ),
        "t.xml:3:20: error: `fixed_field` may not stand in `sequence`, which holds composites: put fields into a `record`",
    );
    check(
        &types(r#"<x:record xmlns:x="urn:else" name="R"/>"#),
        "t.xml:3:1: error: `record` is not an element of JSIDL: its namespace must be `urn:jaus:jsidl:1.0` or `urn:jaus:jsidl:1.1`",
    );
}

#[test]
fn missing_and_empty_attributes_are_reported() {
    check(
        &types(r#"<record name="R"><fixed_field optional="false" field_units=""/></record>"#),
        "
t.xml:3:18: error: `fixed_field` lacks the attribute `name`: add it
t.xml:3:18: error: `fixed_field` lacks the attribute `field_type`: add it
t.xml:3:61: error: the attribute `field_units` of `fixed_field` is empty: give it a value
",
    );
    check(
        &types(r#"<list name="L" optional="maybe"><count_field field_type_unsigned="byte"/><record name="R"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record></list>"#),
        "
t.xml:3:26: error: `maybe` is not a value of `optional`: use `true`, `false`, `1`, `0`
t.xml:3:67: error: `byte` is not a value of `field_type_unsigned`: use `unsigned byte`, `unsigned short integer`, `unsigned integer`, `unsigned long integer`
",
    );
}

#[test]
fn white_space_within_an_attribute_is_folded() {
    check(
        &types(
            r#"<record name=" R "><fixed_field name="A" optional=" false" field_type="unsigned
   short     integer" field_units="one"/></record>"#,
        ),
        "",
    );
}

#[test]
fn names_are_identifiers_and_differ() {
    check(
        &types(r#"<record name="1st R"><fixed_field name="A" field_type="unsigned byte" field_units="one"/>
<fixed_field name="B b" field_type="unsigned byte" field_units="one"/>
</record>"#),
        "
t.xml:3:15: error: `1st R` cannot be a name: use letters, digits and underscores, not beginning with a digit
t.xml:4:20: error: `B b` cannot be a name: use letters, digits and underscores, not beginning with a digit
",
    );
    check(
        &types(
            r#"<record name="R"><fixed_field name="A" field_type="unsigned byte" field_units="one"/>
<fixed_field name="A" field_type="unsigned byte" field_units="one"/>
</record>"#,
        ),
        "
t.xml:4:1: error: there are two members named `A`: rename one
  t.xml:3:18: note: the other one
",
    );
    check(
        &types(
            r#"<record name="R"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record>
<record name="R"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record>"#,
        ),
        "
t.xml:4:1: error: there are two declarations named `R`: rename one
  t.xml:3:1: note: the other one
",
    );
}

#[test]
fn a_presence_vector_has_a_bit_for_each_optional_member() {
    check(
        &types(
            r#"<record name="R">
<presence_vector field_type_unsigned="unsigned byte"/><fixed_field name="M0" optional="true" field_type="unsigned byte" field_units="one"/><fixed_field name="M1" optional="true" field_type="unsigned byte" field_units="one"/><fixed_field name="M2" optional="true" field_type="unsigned byte" field_units="one"/><fixed_field name="M3" optional="true" field_type="unsigned byte" field_units="one"/><fixed_field name="M4" optional="true" field_type="unsigned byte" field_units="one"/><fixed_field name="M5" optional="true" field_type="unsigned byte" field_units="one"/><fixed_field name="M6" optional="true" field_type="unsigned byte" field_units="one"/><fixed_field name="M7" optional="true" field_type="unsigned byte" field_units="one"/><fixed_field name="M8" optional="true" field_type="unsigned byte" field_units="one"/></record>"#,
        ),
        "t.xml:4:1: error: the record `R` has 9 optional members, but its `presence_vector` has only 8 bits: use a wider `field_type_unsigned`",
    );
    check(
        &types(
            r#"<record name="R">
<fixed_field name="A" field_type="unsigned byte" field_units="one"/><fixed_field name="B" optional="true" field_type="unsigned byte" field_units="one"/></record>"#,
        ),
        r#"t.xml:4:69: error: `B` is optional, but the record `R` has no `presence_vector`: add one, or set `optional="false"`"#,
    );
    check(
        &types(
            r#"<record name="R">
<presence_vector field_type_unsigned="unsigned byte"/><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record>"#,
        ),
        "t.xml:4:1: error: the record `R` has a `presence_vector` but no optional member: remove it",
    );
    check(
        &types(r#"<record name="R"/>"#),
        "t.xml:3:1: error: the record `R` has no members: add one, or remove the record",
    );
}

#[test]
fn only_members_of_records_and_sequences_are_optional() {
    check(
        &types(
            r#"<list name="L"><count_field field_type_unsigned="unsigned byte"/>
<record name="R" optional="true"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record></list>"#,
        ),
        r#"t.xml:4:1: error: `R` is optional, but the element of a list has no presence vector: set `optional="false"`"#,
    );
    check(
        &types(
            r#"<variant name="V"><vtag_field field_type_unsigned="unsigned byte"/>
<record name="R" optional="true"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record></variant>"#,
        ),
        r#"t.xml:4:1: error: `R` is optional, but an alternative of a variant has no presence vector: set `optional="false"`"#,
    );
    check(
        &types(
            r#"<array name="A"><dimension name="D" size="2"/>
<fixed_field name="F" optional="true" field_type="unsigned byte" field_units="one"/></array>"#,
        ),
        r#"t.xml:4:1: error: `F` is optional, but the element of an array has no presence vector: set `optional="false"`"#,
    );
    check(
        &types(
            r#"<body name="B">
<record name="R" optional="true"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record></body>"#,
        ),
        r#"t.xml:4:1: error: `R` is optional, but the composite at the top of a message has no presence vector: set `optional="false"`"#,
    );
}

#[test]
fn counts_fit_their_type_and_are_in_order() {
    check(
        &types(
            r#"<variable_length_string name="S"><count_field field_type_unsigned="unsigned byte" min_count="2" max_count="256"/></variable_length_string>"#,
        ),
        "t.xml:3:108: error: `max_count` is 256, but the count can be 0 to 255: change it, or use another `field_type_unsigned`",
    );
    check(
        &types(
            r#"<variable_length_string name="S"><count_field field_type_unsigned="unsigned byte" min_count="3" max_count="2"/></variable_length_string>"#,
        ),
        "t.xml:3:34: error: `min_count` is 3, which is more than `max_count`, 2: no count is allowed",
    );
    check(
        &types(
            r#"<variable_length_string name="S"><count_field field_type_unsigned="unsigned byte" min_count="1.5"/></variable_length_string>"#,
        ),
        "t.xml:3:94: error: `min_count` is 1.5, but must be an integer",
    );
    check(
        &types(r#"<variable_length_string name="S"/>"#),
        "t.xml:3:1: error: `variable_length_string` lacks the element `count_field`: add it",
    );
}

#[test]
fn a_list_has_one_element_type_and_a_section_one_composite() {
    check(
        &types(r#"<list name="L"><count_field field_type_unsigned="unsigned byte"/></list>"#),
        "t.xml:3:1: error: `list` has no element type: add a composite",
    );
    check(
        &types(
            r#"<list name="L">
<record name="R"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record>
<record name="Q"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record></list>"#,
        ),
        "
t.xml:3:1: error: `list` lacks the element `count_field`: add it
t.xml:5:1: error: `list` has one element type only: put the others elsewhere
",
    );
    check(
        &types(
            r#"<body name="L">
<record name="R"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record>
<record name="Q"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record></body>"#,
        ),
        "t.xml:5:1: error: `body` holds one composite: put all of them into a `sequence`",
    );
}

#[test]
fn a_tag_can_tell_the_alternatives_apart() {
    check(
        &types(
            r#"<variant name="V"><vtag_field field_type_unsigned="unsigned byte" max_count="1"/>
<record name="R0"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record>
<record name="R1"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record>
<record name="R2"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record></variant>"#,
        ),
        "t.xml:3:19: error: the variant has 3 alternatives, but its tag ends at 1: raise `max_count` or use a wider type",
    );
    check(
        &types(
            r#"<variant name="V"><vtag_field field_type_unsigned="unsigned byte" min_count="1" max_count="1"/>
<record name="R"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record></variant>"#,
        ),
        "t.xml:3:19: error: `min_count` is 1, but the first alternative of a variant has the tag 0: set it to 0",
    );
}

#[test]
fn sizes_are_positive_and_sane() {
    check(
        &types(r#"<fixed_length_string name="S" string_length="0"/>"#),
        "t.xml:3:46: error: `string_length` is 0, but must be from 1 to 1048576",
    );
    check(
        &types(r#"<fixed_length_string name="S" string_length="1048577"/>"#),
        "t.xml:3:46: error: `string_length` is 1048577, but must be from 1 to 1048576",
    );
    check(
        &types(
            r#"<array name="A"><fixed_field name="F" field_type="unsigned byte" field_units="one"/></array>"#,
        ),
        "t.xml:3:1: error: `array` lacks the element `dimension`: add it",
    );
    check(
        &types(
            r#"<array name="A"><dimension name="D" size="0"/>
<fixed_field name="F" field_type="unsigned byte" field_units="one"/></array>"#,
        ),
        "t.xml:3:43: error: `size` is 0, but must be from 1 to 1048576",
    );
    check(
        &types(
            r#"<array name="A"><dimension name="D" size="1024"/><dimension name="E" size="1025"/>
<fixed_field name="F" field_type="unsigned byte" field_units="one"/></array>"#,
        ),
        "t.xml:3:1: error: the array has more than 1048576 elements: use a `list` or a `variable_length_field` for bulk data",
    );
}

#[test]
fn scales_need_an_unsigned_integer_and_two_limits_in_order() {
    check(
        &types(
            r#"<fixed_field name="F" field_type="short integer" field_units="one">
<scale_range real_lower_limit="0" real_upper_limit="1" integer_function="round"/>
</fixed_field>"#,
        ),
        "t.xml:4:1: error: a `scale_range` needs an unsigned integer: change the `field_type`, or remove the range",
    );
    check(
        &types(
            r#"<fixed_field name="F" field_type="float" field_units="one">
<scale_range real_lower_limit="0" real_upper_limit="1" integer_function="round"/>
</fixed_field>"#,
        ),
        "t.xml:4:1: error: a `scale_range` needs an unsigned integer: change the `field_type`, or remove the range",
    );
    check(
        &types(
            r#"<fixed_field name="F" field_type="unsigned long integer" field_units="one">
<scale_range real_lower_limit="0" real_upper_limit="1" integer_function="round"/>
</fixed_field>"#,
        ),
        "t.xml:4:1: error: a real number cannot tell the steps of a scaled `unsigned long integer` apart: use `unsigned integer`",
    );
    check(
        &types(
            r#"<fixed_field name="F" field_type="unsigned byte" field_units="one">
<scale_range real_lower_limit="1" real_upper_limit="1" integer_function="round"/>
</fixed_field>"#,
        ),
        "t.xml:4:1: error: the limits of the scale are 1 and 1: the lower one must be less than the upper one",
    );
    check(
        &types(r#"<fixed_field name="F" field_type="unsigned byte" field_units="one">
<scale_range real_lower_limit="1 +" real_upper_limit="2$" integer_function="truncate"/>
</fixed_field>"#),
        "
t.xml:4:32: error: `real_lower_limit` must be a number or a constant expression: it ends too early
t.xml:4:55: error: `real_upper_limit` must be a number or a constant expression: `$` is not understood
t.xml:4:77: error: `truncate` is not a value of `integer_function`: use `round`, `floor`, `ceiling`
",
    );
    check(
        &types(r#"<fixed_field name="F" field_type="unsigned byte" field_units="one">
<scale_range real_lower_limit="1/0" real_upper_limit="constants.E" integer_function="round"/>
</fixed_field>"#),
        "
t.xml:4:32: error: this cannot be computed: the result is not a finite number
t.xml:4:55: error: the constant `constants.E` is not declared: declare it in a `declared_const_set` and refer to that with `declared_const_set_ref`
",
    );
}

#[test]
fn values_fit_the_field_and_differ() {
    check(
        &types(
            r#"<fixed_field name="F" field_type="unsigned byte" field_units="one">
<value_set offset_to_lower_limit="false">
<value_enum enum_index="255" enum_const="a"/>
<value_enum enum_index="256" enum_const="b"/>
<value_enum enum_index="-1" enum_const="c"/>
</value_set>
</fixed_field>"#,
        ),
        "t.xml:7:25: error: `enum_index` is -1, but must not be negative",
    );
    check(
        &types(
            r#"<fixed_field name="F" field_type="unsigned byte" field_units="one">
<value_set offset_to_lower_limit="false">
<value_enum enum_index="255" enum_const="a"/>
<value_enum enum_index="256" enum_const="b"/>
</value_set>
</fixed_field>"#,
        ),
        "t.xml:6:25: error: the value `b` is 256, but the `field_type` holds 0 to 255",
    );
    check(
        &types(
            r#"<fixed_field name="F" field_type="unsigned byte" field_units="one">
<value_set offset_to_lower_limit="false">
<value_enum enum_index="5" enum_const="a"/>
<value_enum enum_index="5.00" enum_const="b"/>
</value_set>
</fixed_field>"#,
        ),
        "
t.xml:6:25: error: there are two values with the index 5: renumber one
  t.xml:5:25: note: the other one
",
    );
    check(
        &types(
            r#"<fixed_field name="F" field_type="byte" field_units="one">
<value_set offset_to_lower_limit="false">
<value_range lower_limit="-129" lower_limit_type="inclusive" upper_limit="127" upper_limit_type="inclusive"/>
</value_set>
</fixed_field>"#,
        ),
        "t.xml:5:1: error: the range is -129 to 127, but the `field_type` holds -128 to 127",
    );
    check(
        &types(
            r#"<fixed_field name="F" field_type="byte" field_units="one">
<value_set offset_to_lower_limit="false">
<value_range lower_limit="3" lower_limit_type="inclusive" upper_limit="2" upper_limit_type="inclusive"/>
<value_range lower_limit="3" lower_limit_type="exclusive" upper_limit="3" upper_limit_type="inclusive"/>
<value_range lower_limit="4" lower_limit_type="inclusive" upper_limit="4" upper_limit_type="inclusive"/>
</value_set>
</fixed_field>"#,
        ),
        "
t.xml:5:1: error: no value lies between 3 and 2: the lower limit must be less than the upper one
t.xml:6:1: error: no value lies between 3 and 3: the lower limit must be less than the upper one
",
    );
    check(
        &types(
            r#"<fixed_field name="F" field_type="byte" field_units="one">
<value_set offset_to_lower_limit="false">
<value_range lower_limit="3" lower_limit_type="included" upper_limit="2" upper_limit_type="inclusive"/>
</value_set>
</fixed_field>"#,
        ),
        "t.xml:5:48: error: `included` is not a value of `lower_limit_type`: use `inclusive`, `exclusive`",
    );
    check(
        &types(
            r#"<fixed_field name="F" field_type="byte" field_units="one">
<value_set/>
</fixed_field>"#,
        ),
        "t.xml:4:1: error: the `value_set` is empty: add a `value_range` or a `value_enum`, or remove it",
    );
    check(
        &types(
            r#"<fixed_field name="F" field_type="unsigned byte" field_units="one">
<scale_range real_lower_limit="0" real_upper_limit="1" integer_function="round"/><value_set offset_to_lower_limit="false">
<value_enum enum_index="5" enum_const="a"/>
</value_set>
</fixed_field>"#,
        ),
        "t.xml:4:1: error: a field has a `scale_range` or a `value_set`, not both: remove one",
    );
    check(
        &types(
            r#"<fixed_field name="F" field_type="unsigned byte" field_units="one">
<value_set offset_to_lower_limit="true">
<value_enum enum_index="1000" enum_const="a"/>
<value_enum enum_index="1255" enum_const="b"/>
</value_set>
</fixed_field>"#,
        ),
        "",
    );
}

#[test]
fn bits_lie_within_the_field_and_belong_to_one_sub_field() {
    check(
        &types(
            r#"<bit_field name="B" field_type_unsigned="unsigned byte">
<sub_field name="A"><bit_range from_index="0" to_index="3"/><value_set offset_to_lower_limit="false">
<value_enum enum_index="0" enum_const="a"/>
</value_set></sub_field>
<sub_field name="C"><bit_range from_index="3" to_index="4"/><value_set offset_to_lower_limit="false">
<value_enum enum_index="0" enum_const="a"/>
</value_set></sub_field>
<sub_field name="D"><bit_range from_index="7" to_index="8"/><value_set offset_to_lower_limit="false">
<value_enum enum_index="0" enum_const="a"/>
</value_set></sub_field>
<sub_field name="E"><bit_range from_index="2" to_index="1"/><value_set offset_to_lower_limit="false">
<value_enum enum_index="0" enum_const="a"/>
</value_set></sub_field>
<sub_field name="G"><bit_range from_index="-1" to_index="0"/><value_set offset_to_lower_limit="false">
<value_enum enum_index="0" enum_const="a"/>
</value_set></sub_field>
</bit_field>"#,
        ),
        "
t.xml:10:44: error: the bits 7 to 8 of `D` do not lie within the `bit_field`, whose bits are 0 to 7
t.xml:13:44: error: the bits of `E` go from 2 to 1: exchange them
t.xml:16:44: error: the bits -1 to 0 of `G` do not lie within the `bit_field`, whose bits are 0 to 7
",
    );
    check(
        &types(
            r#"<bit_field name="B" field_type_unsigned="unsigned byte">
<sub_field name="A"><bit_range from_index="0" to_index="3"/><value_set offset_to_lower_limit="false">
<value_enum enum_index="0" enum_const="a"/>
</value_set></sub_field>
<sub_field name="C"><bit_range from_index="3" to_index="4"/><value_set offset_to_lower_limit="false">
<value_enum enum_index="0" enum_const="a"/>
</value_set></sub_field>
<sub_field name="A"><bit_range from_index="5" to_index="5"/><value_set offset_to_lower_limit="false">
<value_enum enum_index="0" enum_const="a"/>
</value_set></sub_field>
</bit_field>"#,
        ),
        "
t.xml:7:44: error: bit 3 of `C` belongs to `A` already: move one of them
  t.xml:4:44: note: the other one
t.xml:10:1: error: there are two sub-fields named `A`: rename one
  t.xml:4:1: note: the other one
",
    );
    check(
        &types(
            r#"<bit_field name="B" field_type_unsigned="unsigned byte">
<sub_field name="A"><bit_range from_index="0" to_index="1"/><value_set offset_to_lower_limit="false">
<value_enum enum_index="3" enum_const="three"/>
<value_enum enum_index="4" enum_const="four"/>
</value_set></sub_field>
</bit_field>"#,
        ),
        "t.xml:6:25: error: the value `four` is 4, but a sub-field of 2 bits holds 0 to 3",
    );
    check(
        &types(
            r#"<bit_field name="B" field_type_unsigned="unsigned byte">
<sub_field name="A"/>
</bit_field>"#,
        ),
        "
t.xml:4:1: error: `sub_field` lacks the element `bit_range`: add it
t.xml:4:1: error: `sub_field` lacks the element `value_set`: add it
",
    );
    check(
        &types(
            r#"<bit_field name="B" field_type_unsigned="unsigned byte">

</bit_field>"#,
        ),
        "t.xml:3:1: error: `bit_field` lacks the element `sub_field`: add it",
    );
}

#[test]
fn indices_of_units_and_formats_are_octets_and_differ() {
    check(
        &types(
            r#"<variable_field name="V"><type_and_units_field>
<type_and_units_enum index="1" field_type="float" field_units="one"/>
<type_and_units_enum index="1" field_type="byte" field_units="one"/></type_and_units_field></variable_field>"#,
        ),
        "
t.xml:5:29: error: there are two choices of type and units with the index 1: renumber one
  t.xml:4:29: note: the other one
",
    );
    check(
        &types(
            r#"<variable_field name="V"><type_and_units_field>
<type_and_units_enum index="256" field_type="double" field_units="one"/></type_and_units_field></variable_field>"#,
        ),
        "t.xml:4:46: error: `double` is not a value of `field_type`: use `byte`, `short integer`, `integer`, `long integer`, `unsigned byte`, `unsigned short integer`, `unsigned integer`, `unsigned long integer`, `float`, `long float`",
    );
    check(
        &types(
            r#"<variable_format_field name="V"><format_field>
<format_enum index="0" field_format="JPEG"/>
<format_enum index="0" field_format="PNG"/></format_field><count_field field_type_unsigned="unsigned integer"/></variable_format_field>"#,
        ),
        "
t.xml:5:21: error: there are two formats with the index 0: renumber one
  t.xml:4:21: note: the other one
",
    );
    check(
        &types(r#"<variable_format_field name="V"><format_field/></variable_format_field>"#),
        "
t.xml:3:1: error: `variable_format_field` lacks the element `count_field`: add it
t.xml:3:33: error: `format_field` lacks the element `format_enum`: add it
",
    );
}

#[test]
fn a_message_has_an_id_of_two_octets_and_says_whether_it_is_a_command() {
    check(
        &messages(
            r#"<message_def name="A" is_command="perhaps">
<header name="H"><record name="R"><fixed_field name="Code" field_type="unsigned short integer" field_units="one"/></record></header><body name="B"/><footer name="F"/>
</message_def>
<message_def name="B" message_id="2B00">
<header name="H"><record name="R"><fixed_field name="Code" field_type="unsigned short integer" field_units="one"/></record></header><body name="B"/><footer name="F"/>
</message_def>"#,
        ),
        "
t.xml:3:1: error: `message_def` lacks the attribute `message_id`: add it
t.xml:3:35: error: `perhaps` is not a value of `is_command`: use `true`, `false`, `1`, `0`
t.xml:6:1: error: `message_def` lacks the attribute `is_command`: add it
",
    );
    check(
        &messages(
            r#"<message_def name="A" message_id="2B0" is_command="false">
<header name="H"><record name="R"><fixed_field name="Code" field_type="unsigned short integer" field_units="one"/></record></header><body name="B"/><footer name="F"/>
</message_def>"#,
        ),
        "t.xml:3:35: error: `2B0` cannot be a message id: write two octets as four hexadecimal digits, for example `2B00`",
    );
    check(
        &messages(
            r#"<message_def name="A" message_id="2B000" is_command="false">
<header name="H"><record name="R"><fixed_field name="Code" field_type="unsigned short integer" field_units="one"/></record></header><body name="B"/><footer name="F"/>
</message_def>"#,
        ),
        "t.xml:3:35: error: `2B000` cannot be a message id: write two octets as four hexadecimal digits, for example `2B00`",
    );
    check(
        &messages(
            r#"<message_def name="A" message_id="0x2B" is_command="false">
<header name="H"><record name="R"><fixed_field name="Code" field_type="unsigned short integer" field_units="one"/></record></header><body name="B"/><footer name="F"/>
</message_def>"#,
        ),
        "t.xml:3:35: error: `0x2B` cannot be a message id: write two octets as four hexadecimal digits, for example `2B00`",
    );
    check(
        &messages(
            r#"<message_def name="A" message_id="2b00" is_command="false">
<header name="H"><record name="R"><fixed_field name="Code" field_type="unsigned short integer" field_units="one"/></record></header><body name="B"/><footer name="F"/>
</message_def>"#,
        ),
        "",
    );
}

#[test]
fn a_message_begins_with_its_code() {
    check(
        &messages(
            r#"<message_def name="A" message_id="2B00" is_command="false">
<header name="H"/><body name="B"/><footer name="F"/></message_def>"#,
        ),
        "t.xml:4:1: error: the header is empty: a message begins with its code, so the header must be a `record` whose first field is an `unsigned short integer`",
    );
    check(
        &messages(
            r#"<message_def name="A" message_id="2B00" is_command="false">
<header name="H"><record name="R"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record></header><body name="B"/><footer name="F"/></message_def>"#,
        ),
        "t.xml:4:1: error: the header does not begin with the message code: a message begins with its code, so the header must be a `record` whose first field is an `unsigned short integer`",
    );
    check(
        &messages(
            r#"<message_def name="A" message_id="2B00" is_command="false">
<header name="H"><list name="R"><count_field field_type_unsigned="unsigned byte"/><record name="R"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record></list></header>
<body name="B"/></message_def>"#,
        ),
        "t.xml:3:1: error: `message_def` lacks the element `footer`: add it",
    );
}

#[test]
fn messages_of_a_service_are_told_apart() {
    check(
        &messages(
            r#"<message_def name="A" message_id="2B00" is_command="false">
<header name="H"><record name="R"><fixed_field name="Code" field_type="unsigned short integer" field_units="one"/></record></header><body name="B"/><footer name="F"/>
</message_def>
<message_def name="B" message_id="2B00" is_command="false">
<header name="H"><record name="R"><fixed_field name="Code" field_type="unsigned short integer" field_units="one"/></record></header><body name="B"/><footer name="F"/>
</message_def>"#,
        ),
        "t.xml:6:1: warning: `B` has the code 2B00, which is also that of `A`: a receiver cannot tell them apart, so change one `message_id`",
    );
    check(
        &messages(
            r#"<message_def name="A" message_id="2B00" is_command="false">
<header name="H"><record name="R"><fixed_field name="Code" field_type="unsigned short integer" field_units="one"/></record></header><body name="B"/><footer name="F"/>
</message_def>
<message_def name="A" message_id="2B01" is_command="false">
<header name="H"><record name="R"><fixed_field name="Code" field_type="unsigned short integer" field_units="one"/></record></header><body name="B"/><footer name="F"/>
</message_def>"#,
        ),
        "
t.xml:6:1: error: there are two messages named `A`: rename one
  t.xml:3:1: note: the other one
",
    );
    check(
        &text(
            r#"<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.0">
<message_set><input_set>
<message_def name="A" message_id="2B00" is_command="false">
<header name="H"><record name="R"><fixed_field name="Code" field_type="unsigned short integer" field_units="one"/></record></header><body name="B"/><footer name="F"/>
</message_def>
</input_set><output_set>
<message_def name="A" message_id="2B00" is_command="false">
<header name="H"><record name="R"><fixed_field name="Code" field_type="unsigned short integer" field_units="one"/></record></header><body name="B"><record name="R"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record></body><footer name="F"/>
</message_def>
</output_set></message_set><internal_events_set/></service_def><!---->"#,
        ),
        "t.xml:7:1: warning: `A` has the code 2B00, which is also that of another `A` with a different layout: a receiver cannot tell them apart, so change one `message_id`",
    );
}

#[test]
fn references_that_lead_nowhere_are_reported_with_what_is_there() {
    check(
        &types(
            r#"<record name="Rec"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record>
<list name="L"><count_field field_type_unsigned="unsigned byte"/>
<declared_record name="X" declared_type_ref="rec"/></list>"#,
        ),
        "
t.xml:5:46: error: `rec` is not declared: did you mean `Rec`?
  t.xml:2:1: note: the type set in which `rec` was looked for
",
    );
    check(
        &types(
            r#"<list name="L"><count_field field_type_unsigned="unsigned byte"/>
<declared_record name="X" declared_type_ref="other.Rec"/></list>"#,
        ),
        "
t.xml:4:46: error: `other.Rec` is not declared: there is no `declared_type_set_ref` named `other`
  t.xml:2:1: note: the type set in which it was looked for
",
    );
    check(
        &types(
            r#"<declared_type_set_ref name="other" id="urn:other" version="1.0"/>
<list name="L"><count_field field_type_unsigned="unsigned byte"/>
<declared_record name="X" declared_type_ref="other.Rec"/></list>"#,
        ),
        "t.xml:3:1: error: the type set `urn:other 1.0` is not loaded: load the file that declares it as well",
    );
    check(
        &types(
            r#"<sequence name="Q"><record name="P"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record></sequence>
<list name="L"><count_field field_type_unsigned="unsigned byte"/>
<declared_record name="X" declared_type_ref="Q"/></list>"#,
        ),
        "
t.xml:5:46: error: `Q` is a `sequence`: refer to it with `declared_sequence`, or name a `record`
  t.xml:3:1: note: declared here
",
    );
}

#[test]
fn circles_of_references_are_reported() {
    check(
        &types(
            r#"<list name="A"><count_field field_type_unsigned="unsigned byte"/>
<declared_list name="X" declared_type_ref="B"/></list>
<list name="B"><count_field field_type_unsigned="unsigned byte"/>
<declared_list name="X" declared_type_ref="A"/></list>"#,
        ),
        "
t.xml:6:44: error: `A` contains itself: a message must have an end, so break the circle
  t.xml:3:1: note: declared here
",
    );
    check(
        &text(
            r#"<declared_const_set name="C" id="urn:c" version="1.0" xmlns="urn:jaus:jsidl:1.0">
<const_def name="A" const_type="float" const_value="B+1" field_units="one"/>
<const_def name="B" const_type="float" const_value="A+1" field_units="one"/></declared_const_set>"#,
        ),
        "t.xml:3:53: error: the constant `A` is defined by itself",
    );
}

#[test]
fn a_message_that_is_left_out_is_named_by_the_service() {
    check(
        &text(
            r#"<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.0">
<declared_type_set name="T">
<message_def name="A" message_id="2B00" is_command="false">
<header name="H"><record name="R"><fixed_field name="Code" field_type="unsigned short integer" field_units="one"/></record></header><body name="B"><record name="R"/></body><footer name="F"/>
</message_def>
</declared_type_set>
<message_set><input_set>
<declared_message_def name="A" declared_type_ref="A"/></input_set><output_set/></message_set></service_def>"#,
        ),
        "
t.xml:4:148: error: the record `R` has no members: add one, or remove the record
t.xml:8:1: error: `A` is left out of `urn:s 1.0`, because what it refers to is missing or has errors
",
    );
}

#[test]
fn services_inherit_from_what_is_there() {
    check(
        &text(r#"<p:service_set xmlns:p="urn:jaus:jsidl:plus" xmlns="urn:jaus:jsidl:1.1" name="Set" id="urn:set" version="1.0">
<service_def name="A" id="urn:A" version="1.0">
<references><inherits_from name="base" id="urn:B" version="1.0"/></references>
<message_set><input_set/><output_set/></message_set></service_def>
<service_def name="B" id="urn:B" version="1.0">
<references><inherits_from name="base" id="urn:C" version="2.0"/></references>
<message_set><input_set/><output_set/></message_set></service_def>
<service_def name="C" id="urn:C" version="1.0">
<references></references>
<message_set><input_set/><output_set/></message_set></service_def>
</p:service_set>"#),
        "
t.xml:3:13: error: `urn:A 1.0` is left out: it inherits from `urn:B 1.0`, which needs `urn:C 2.0`, which is not loaded
t.xml:6:13: error: the service `urn:C 2.0` to inherit from is not loaded: of it only version 1.0 is loaded
",
    );
    check(
        &text(
            r#"<p:service_set xmlns:p="urn:jaus:jsidl:plus" xmlns="urn:jaus:jsidl:1.1" name="Set" id="urn:set" version="1.0">
<service_def name="A" id="urn:A" version="1.0">
<references><inherits_from name="base" id="urn:A" version="1.0"/></references>
<message_set><input_set/><output_set/></message_set></service_def>
</p:service_set>"#,
        ),
        "t.xml:3:13: error: `urn:A 1.0` inherits from itself: break the circle",
    );
    check(
        &text(r#"<p:service_set xmlns:p="urn:jaus:jsidl:plus" xmlns="urn:jaus:jsidl:1.1" name="Set" id="urn:set" version="1.0">
<service_def name="A" id="urn:A" version="1.0">
<references><inherits_from name="base" id="urn:B" version="1.0"/></references>
<message_set><input_set/><output_set/></message_set></service_def>
<service_def name="B" id="urn:B" version="1.0">
<references><inherits_from name="base" id="urn:A" version="1.0"/></references>
<message_set><input_set/><output_set/></message_set></service_def>
<service_def name="C" id="urn:C" version="1.0">
<references><inherits_from name="base" id="urn:A" version="1.0"/></references>
<message_set><input_set/><output_set/></message_set></service_def>
</p:service_set>"#),
        "
t.xml:3:13: error: `urn:A 1.0` inherits from itself: break the circle
t.xml:6:13: error: `urn:B 1.0` inherits from itself: break the circle
t.xml:9:13: error: `urn:C 1.0` is left out: it inherits from more than 32 services, or from a circle of them
",
    );
    check(
        &text(r#"<p:service_set xmlns:p="urn:jaus:jsidl:plus" xmlns="urn:jaus:jsidl:1.1" name="Set" id="urn:set" version="1.0">
<service_def name="A" id="urn:A" version="1.0">
<references><inherits_from name="base" id="urn:B" version="1.0"/></references>
<message_set><input_set/><output_set/></message_set></service_def>
<service_def name="B" id="urn:B" version="01.0">
<references></references>
<message_set><input_set/><output_set/></message_set></service_def>
</p:service_set>"#),
        "
t.xml:3:13: error: the service `urn:B 1.0` to inherit from is not loaded: load the file that declares it as well
t.xml:5:43: error: `01.0` cannot be a version: write two numbers from 0 to 255, for example `1.0`
",
    );
    check(
        &text(
            r#"<p:service_set xmlns:p="urn:jaus:jsidl:plus" xmlns="urn:jaus:jsidl:1.1" name="Set" id="urn:set" version="1.0">
<service_def name="A" id="urn:A" version="1.0">
<references><inherits_from name="base" id="urn:B" version="*.*"/></references>
<message_set><input_set/><output_set/></message_set></service_def>
</p:service_set>"#,
        ),
        "t.xml:3:60: error: `*.*` cannot be a version: a wild card does not say which definition is meant, so write the version",
    );
    check(
        &text(
            r#"<p:service_set xmlns:p="urn:jaus:jsidl:plus" xmlns="urn:jaus:jsidl:1.1" name="Set" id="urn:set" version="1.0">
<service_def name="A" id="urn:A" version="1.0">
<references><inherits_from name="base" id="urn:B" version="1.0"/><inherits_from name="base" id="urn:C" version="1.0"/></references>
<message_set><input_set/><output_set/></message_set></service_def>
<service_def name="B" id="urn:B" version="1.0">
<references></references>
<message_set><input_set/><output_set/></message_set></service_def>
<service_def name="C" id="urn:C" version="1.0">
<references></references>
<message_set><input_set/><output_set/></message_set></service_def>
</p:service_set>"#,
        ),
        "t.xml:3:66: error: `references` has more than one `inherits_from`: keep one",
    );
    check(
        &text(
            r#"<p:service_set xmlns:p="urn:jaus:jsidl:plus" xmlns="urn:jaus:jsidl:1.1" name="Set" id="urn:set" version="1.0">
<service_def name="A" id="urn:A" version="1.0">
<references><client_of name="x" id="urn:B" version="1.0"/>
<client_of name="x" id="urn:A" version="1.0"/></references>
<message_set><input_set/><output_set/></message_set></service_def>
</p:service_set>"#,
        ),
        "
t.xml:3:13: warning: the service `urn:B 1.0`, of which this one is a client, is not loaded
t.xml:4:1: error: there are two references named `x`: rename one
  t.xml:3:13: note: the other one
",
    );
}

#[test]
fn identities_are_urns_with_versions() {
    check(
        &text(
            r#"<service_def name="S" id="9" version="1" xmlns="urn:jaus:jsidl:1.0"><message_set/></service_def>"#,
        ),
        "
t.xml:1:27: error: `9` cannot be an id: write a URN such as `urn:jaus:jss:core:Discovery`
t.xml:1:39: error: `1` cannot be a version: write two numbers from 0 to 255, for example `1.0`
t.xml:1:69: error: `message_set` lacks the element `input_set`: add it
t.xml:1:69: error: `message_set` lacks the element `output_set`: add it
",
    );
    check(
        &text(r#"<service_def name="S" id=" urn:s" version="1.256" xmlns="urn:jaus:jsidl:1.0"/>"#),
        "
t.xml:1:1: error: `service_def` lacks the element `message_set`: add it
t.xml:1:27: warning: the id `urn:s` is written with blanks around it: remove them
t.xml:1:44: error: `1.256` cannot be a version: write two numbers from 0 to 255, for example `1.0`
",
    );
}

#[test]
fn constants_hold_what_their_type_can() {
    check(
        &text(r#"<declared_const_set name="C" id="urn:c" version="1.0" xmlns="urn:jaus:jsidl:1.0">
<const_def name="A" const_type="byte" const_value="128" field_units="one"/>
<const_def name="B" const_type="integer" const_value="1/2" field_units="one"/>
<const_def name="D" const_type="word" const_value="pi" field_units="one"/></declared_const_set>"#),
        "
t.xml:2:52: error: the value of the constant is not an integer from -128 to 127, as its `const_type` says
t.xml:3:55: error: the value of the constant is not an integer from -2147483648 to 2147483647, as its `const_type` says
t.xml:4:33: error: `word` is not a value of `const_type`: use `byte`, `short integer`, `integer`, `long integer`, `unsigned byte`, `unsigned short integer`, `unsigned integer`, `unsigned long integer`, `float`, `long float`
",
    );
}

#[test]
fn several_mistakes_in_one_file_are_all_reported() {
    check(
        &text(
            r#"<service_def name="S" id="urn:s" version="one" xmlns="urn:jaus:jsidl:1.0" xmlns:n="urn:jaus:jsidl:1.1">
<declared_type_set name="T">
<fixed_field name="F" field_type="unsigned byte" field_units="one">
<scale_range real_lower_limit="2" real_upper_limit="1" integer_function="round"/>
</fixed_field>
<n:record name="R"><fixed_field name="A" optional="true" field_type="unsigned byte" field_units="one"/></n:record>
</declared_type_set>
<message_set><input_set>
<message_def name="A" message_id="XYZ0" is_command="false">
<header name="H"><record name="R"><fixed_field name="Code" field_type="unsigned short integer" field_units="one"/></record></header><body name="B"/><footer name="F"/>
</message_def>
<declared_message_def name="B" declared_type_ref="T.B"/></input_set></message_set></service_def>"#,
        ),
        r#"
t.xml:1:43: error: `one` cannot be a version: write two numbers from 0 to 255, for example `1.0`
t.xml:4:1: error: the limits of the scale are 2 and 1: the lower one must be less than the upper one
t.xml:6:20: error: `A` is optional, but the record `R` has no `presence_vector`: add one, or set `optional="false"`
t.xml:8:1: error: `message_set` lacks the element `output_set`: add it
t.xml:9:35: error: `XYZ0` cannot be a message id: write two octets as four hexadecimal digits, for example `2B00`
t.xml:12:51: error: `T.B` is not declared: there is no `declared_type_set_ref` named `T`
  t.xml:2:1: note: the type set in which it was looked for
"#,
    );
}
