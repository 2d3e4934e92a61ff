//! Rules of fields: scales, values, bits, units and formats.

use super::{check, types};

#[test]
fn scales_need_an_integer_and_two_limits_in_order() {
    check(
        &types(
            r#"<fixed_field name="F" field_type="short integer" field_units="one">
<scale_range real_lower_limit="0" real_upper_limit="1" integer_function="round"/>
</fixed_field>"#,
        ),
        "t.xml:4:1: warning: the standard has no rule for a `scale_range` of a signed integer: 0 is taken as the centre of the range, but other tools may differ; use an unsigned `field_type`",
    );
    check(
        &types(
            r#"<fixed_field name="F" field_type="float" field_units="one">
<scale_range real_lower_limit="0" real_upper_limit="1" integer_function="round"/>
</fixed_field>"#,
        ),
        "t.xml:4:1: error: a `scale_range` needs an integer: change the `field_type`, or remove the range",
    );
    check(
        &types(
            r#"<fixed_field name="F" field_type="unsigned long integer" field_units="one">
<scale_range real_lower_limit="0" real_upper_limit="1" integer_function="round"/>
</fixed_field>"#,
        ),
        "t.xml:4:1: error: a floating-point number cannot resolve the steps of a scaled `unsigned long integer`: use `unsigned integer`",
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
t.xml:4:32: error: `real_lower_limit` must be a number or a constant expression: it is incomplete
t.xml:4:55: error: `real_upper_limit` must be a number or a constant expression: `$` is not recognised
t.xml:4:77: error: `truncate` is not a value of `integer_function`: use `round`, `floor`, `ceiling`
",
    );
    check(
        &types(r#"<fixed_field name="F" field_type="unsigned byte" field_units="one">
<scale_range real_lower_limit="1/0" real_upper_limit="constants.E" integer_function="round"/>
</fixed_field>"#),
        "
t.xml:4:32: error: cannot evaluate this: the result is not a finite number
t.xml:4:55: error: the constant `constants.E` is not declared: declare it in a `declared_const_set` and refer to that with `declared_const_set_ref`
",
    );
}

#[test]
fn a_range_around_zero_needs_a_signed_integer_of_at_most_four_octets() {
    let range = |field_type: &str, bias: &str| {
        types(&format!(
            r#"<fixed_field name="F" field_type="{field_type}" field_units="one">
<scale_range xmlns:own="urn:jaus-rs:jsidl" own:bias="{bias}" real_lower_limit="0" real_upper_limit="1" integer_function="round"/>
</fixed_field>"#
        ))
    };
    check(&range("short integer", "centre"), "");
    check(
        &range("unsigned short integer", "centre"),
        "t.xml:4:1: error: only a signed integer's range is centred on zero: change the \
         `field_type`, or remove the attribute `bias`",
    );
    check(
        &range("long integer", "centre"),
        "t.xml:4:1: error: a floating-point number cannot resolve the steps of a scaled `long integer`: use `integer`",
    );
    check(
        &range("short integer", "lower"),
        "t.xml:4:54: error: `lower` is not a value of `bias`: use `centre`",
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
        "
t.xml:6:25: error: the value `b` is 256, but the `field_type` holds 0 to 255
t.xml:7:25: error: the value `c` is -1, but the `field_type` holds 0 to 255
",
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
        "t.xml:4:82: error: `fixed_field` has a `scale_range` or a `value_set`, not both: remove one",
    );
}

#[test]
fn values_are_not_counted_from_another_one_than_0() {
    let set = |values: &str| {
        types(&format!(
            r#"<fixed_field name="F" field_type="unsigned byte" field_units="one">
<value_set offset_to_lower_limit="true">{values}</value_set>
</fixed_field>"#
        ))
    };
    let refused = |lowest: u32| {
        format!(
            "t.xml:4:1: error: `offset_to_lower_limit` would count the values from {lowest} on the wire, \
             but the code of the JAUS Tool Set sends them as they are, so that peers disagree: set it to \
             `false`, and state the numbers that are on the wire"
        )
    };
    check(
        &set(
            r#"<value_enum enum_index="1000" enum_const="a"/><value_enum enum_index="1255" enum_const="b"/>"#,
        ),
        &refused(1000),
    );
    check(
        &set(
            r#"<value_range lower_limit="10" lower_limit_type="inclusive" upper_limit="20" upper_limit_type="inclusive" interpretation=""/>"#,
        ),
        &refused(10),
    );
    check(
        &set(
            r#"<value_enum enum_index="0" enum_const="a"/><value_enum enum_index="255" enum_const="b"/>"#,
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
t.xml:10:44: error: the bits 7 to 8 of `D` are outside the `bit_field`, whose bits are 0 to 7
t.xml:13:44: error: the bits of `E` range from 2 to 1: swap them
t.xml:16:44: error: the bits -1 to 0 of `G` are outside the `bit_field`, whose bits are 0 to 7
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
fn units_are_those_of_the_standard() {
    check(
        &types(r#"<fixed_field name="F" field_type="float" field_units="meters"/>"#),
        "t.xml:3:55: error: `meters` is not a unit: did you mean `meter`?",
    );
    check(
        &types(r#"<fixed_field name="F" field_type="float" field_units="parsec"/>"#),
        "t.xml:3:55: error: `parsec` is not a unit: write one of the standard, or `one`",
    );
    check(
        &types(r#"<fixed_field name="F" field_type="float" field_units="rotations per minute"/>"#),
        "",
    );
}

#[test]
fn a_named_value_set_fits_every_field_that_refers_to_it() {
    check(
        &types(
            r#"<value_set name="Moods" offset_to_lower_limit="false"><value_enum enum_index="-1" enum_const="Low"/></value_set>
<fixed_field name="A" field_type="byte" field_units="one"><declared_value_set name="Moods"/></fixed_field>
<fixed_field name="B" field_type="unsigned byte" field_units="one"><declared_value_set name="M" declared_type_ref="Moods"/></fixed_field>
<fixed_field name="C" field_type="byte" field_units="one"><declared_value_set name="M" declared_type_ref="A"/></fixed_field>"#,
        ),
        "
t.xml:5:116: error: the value `Low` is -1, but the `field_type` holds 0 to 255
t.xml:6:107: error: `A` is a `fixed_field`: refer to it with `declared_fixed_field`, or name a `value_set`
  t.xml:4:1: note: declared here
",
    );
}
