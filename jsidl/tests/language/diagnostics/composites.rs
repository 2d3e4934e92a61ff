//! Rules of records, lists, variants and their counts.

use super::{check, types};

#[test]
fn names_are_identifiers_and_differ() {
    check(
        &types(r#"<record name="1st R"><fixed_field name="A" field_type="unsigned byte" field_units="one"/>
<fixed_field name="B b" field_type="unsigned byte" field_units="one"/>
</record>"#),
        "
t.xml:3:15: error: `1st R` cannot be a name: use letters, digits and underscores, not starting with a digit
t.xml:4:20: error: `B b` cannot be a name: use letters, digits and underscores, not starting with a digit
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
        "t.xml:3:1: error: the array has at least 1049600 octets, but must not have more than 1048576: use a `list` or a `variable_length_field` for bulk data",
    );
    check(
        &types(
            r#"<array name="A"><dimension name="D" size="131073"/>
<fixed_field name="F" field_type="long float" field_units="one"/></array>"#,
        ),
        "t.xml:3:1: error: the array has at least 1048584 octets, but must not have more than 1048576: use a `list` or a `variable_length_field` for bulk data",
    );
    check(
        &types(
            r#"<array name="A"><dimension name="D" size="1024"/>
<fixed_length_string name="F" string_length="1025"/></array>"#,
        ),
        "t.xml:3:1: error: the array has at least 1049600 octets, but must not have more than 1048576: use a `list` or a `variable_length_field` for bulk data",
    );
}
