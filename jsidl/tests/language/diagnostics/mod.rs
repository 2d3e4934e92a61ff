//! One small definition, or a few, for every rule: what is found, where, and in which words.

mod composites;
mod fields;
mod services;
mod text;

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
