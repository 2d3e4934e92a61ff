//! Diagnostics: one or a few small definitions per rule, with the exact finding and its location.

mod composites;
mod fields;
mod machines;
mod services;
mod text;

use jsidl::{Loaded, Loader};

fn load(text: &str) -> Loaded {
    let mut loader = Loader::new();
    loader.text("t.xml", text);
    loader.load()
}

/// Compares the findings with the expected ones, one per line.
#[track_caller]
fn check(text: &str, expected: &str) {
    let found = load(text).diagnostics.to_string();
    assert_eq!(found.trim(), expected.trim(), "\nin\n{text}");
}

/// A service whose type set contains these declarations, from line 3 on.
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

/// A service with these input messages, from line 3 on.
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
