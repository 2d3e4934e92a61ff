//! Rules of messages, references, services and constants.

use super::{check, messages, text, types};

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
        "t.xml:4:1: error: the header is empty: a message starts with its code, so the header \
         must be a `record` whose first field is an `unsigned short integer`",
    );
    check(
        &messages(
            r#"<message_def name="A" message_id="2B00" is_command="false">
<header name="H"><record name="R"><fixed_field name="A" field_type="unsigned byte" field_units="one"/></record></header><body name="B"/><footer name="F"/></message_def>"#,
        ),
        "t.xml:4:1: error: the header does not start with the message code: a message starts with \
         its code, so the header must be a `record` whose first field is an `unsigned short \
         integer`",
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
  t.xml:2:1: note: the type set searched for `rec`
",
    );
    check(
        &types(
            r#"<list name="L"><count_field field_type_unsigned="unsigned byte"/>
<declared_record name="X" declared_type_ref="other.Rec"/></list>"#,
        ),
        "
t.xml:4:46: error: `other.Rec` is not declared: there is no `declared_type_set_ref` named `other`
  t.xml:2:1: note: the type set searched
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
t.xml:6:44: error: `A` contains itself, which makes it infinite: break the cycle
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
t.xml:8:1: error: `A` is omitted from `urn:s 1.0`, because a definition it refers to is missing or has errors
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
t.xml:3:13: error: `urn:A 1.0` is omitted: it inherits from `urn:B 1.0`, which needs `urn:C 2.0`, which is not loaded
t.xml:6:13: error: the base service `urn:C 2.0` is not loaded: only its version 1.0 is loaded
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
        "t.xml:3:13: error: `urn:A 1.0` inherits from itself: break the cycle",
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
t.xml:3:13: error: `urn:A 1.0` inherits from itself: break the cycle
t.xml:6:13: error: `urn:B 1.0` inherits from itself: break the cycle
t.xml:9:13: error: `urn:C 1.0` is omitted: it inherits from more than 32 services, or from a cycle of them
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
t.xml:3:13: error: the base service `urn:B 1.0` is not loaded: load the file that declares it as well
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
        "t.xml:3:13: error: the base service `urn:B *.*` is not loaded: load the file that declares it as well",
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
t.xml:3:13: warning: this service is a client of `urn:B 1.0`, which is not loaded: load the file that declares it as well
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
t.xml:1:27: warning: the id `urn:s` has surrounding spaces: remove them
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
fn the_nearest_urn_is_suggested_for_one_that_is_not_there() {
    let service = |urn: &str| {
        format!(
            r#"<p:service_set xmlns:p="urn:jaus:jsidl:plus" xmlns="urn:jaus:jsidl:1.1" name="Set" id="urn:set" version="1.0">
<service_def name="Discovery" id="urn:jaus:jss:core:Discovery" version="1.0"><message_set><input_set/><output_set/></message_set></service_def>
<service_def name="B" id="urn:B" version="1.0"><references>
<inherits_from name="base" id="{urn}"/></references><message_set><input_set/><output_set/></message_set></service_def>
</p:service_set>"#
        )
    };
    check(
        &service("urn:jaus:jss:core:Discvery\" version=\"1.0"),
        "t.xml:4:1: error: the base service `urn:jaus:jss:core:Discvery 1.0` is not loaded: did you mean `urn:jaus:jss:core:Discovery`?",
    );
    check(
        &service("urn:jaus:jss:core:Discovery\" version=\"2.*"),
        "t.xml:4:1: error: the base service `urn:jaus:jss:core:Discovery 2.*` is not loaded: only its version 1.0 is loaded",
    );
    check(&service("urn:jaus:jss:core:Discovery\" version=\"*.*"), "");
}

#[test]
fn a_constant_that_is_a_text_is_no_number() {
    check(
        &text(
            r#"<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<declared_const_set name="C">
<const_def name="T" const_type="string" const_value="some text" field_units="one"/></declared_const_set>
<declared_type_set name="T">
<fixed_length_string name="F" string_length="T"/></declared_type_set>
<message_set><input_set/><output_set/></message_set></service_def>"#,
        ),
        "
t.xml:5:46: error: the constant `T` is a text: use a number here
  t.xml:3:54: note: declared here
",
    );
}
