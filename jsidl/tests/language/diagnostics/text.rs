//! Texts that are not JSIDL, and misspelt names.

use super::{check, text, types};

#[test]
fn a_text_that_is_not_xml_is_reported_where_it_breaks() {
    check(
        &text(
            "<service_def>
  <message_set>
</service_def>",
        ),
        "t.xml:3:1: error: not well-formed XML: expected 'message_set' tag, not 'service_def'",
    );
    check(
        &text(
            "<!DOCTYPE a>
<a/>",
        ),
        "t.xml:1:1: error: a document type declaration is ignored and not needed in JSIDL: remove \
         it",
    );
    check(
        &text("no definition"),
        "t.xml:1:1: error: not well-formed XML: unknown token",
    );
}

#[test]
fn a_root_that_is_no_definition_is_reported() {
    check(
        &text(r#"<project xmlns="urn:maven"/>"#),
        "t.xml:1:1: error: `project` is not the root element of a JSIDL file: expected one of `service_def`, `declared_type_set`, `declared_const_set`, `service_set`",
    );
    check(
        &text(r#"<service_def name="S"/>"#),
        r#"t.xml:1:1: error: `service_def` is not in the namespace of JSIDL: add `xmlns="urn:jaus:jsidl:1.1"`"#,
    );
    check(
        &text(r#"<record xmlns="urn:jaus:jsidl:1.0" name="R"/>"#),
        "t.xml:1:1: error: `record` is not the root element of a JSIDL file: expected one of `service_def`, `declared_type_set`, `declared_const_set`, `service_set`",
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
t.xml:5:3: error: `fixedfield` is not allowed in `record`, which holds fields: put composites into a `sequence` instead
t.xml:6:3: error: `list` is not allowed in `record`, which holds fields: put composites into a `sequence` instead
",
    );
    check(
        &types(
            r#"<sequence name="Q"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></sequence>"#,
        ),
        "t.xml:3:20: error: `fixed_field` is not allowed in `sequence`, which holds composites: put fields into a `record`",
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
  t.xml:2:1: note: the type set searched
"#,
    );
}
