//! The formatter: its output is stable and keeps the meaning, for every available definition.

use std::fs;
use std::path::{Path, PathBuf};

use jaus_test_kit::evidence;
use jsidl::format::{WIDTH, format};
use roxmltree::{Document, Node};

fn files_of(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder exists") {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            files_of(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "xml") {
            found.push(path);
        }
    }
}

fn fold(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The content of a document in order, comments included, with white space folded as the language
/// does.
fn meaning(text: &str) -> Vec<String> {
    let document = Document::parse(text).expect("well-formed");
    let mut said = Vec::new();
    for node in document.root().descendants() {
        if node.is_element() {
            said.push(format!("<{:?} at {}", node.tag_name(), depth(node)));
            let mut attributes: Vec<_> = node
                .attributes()
                .map(|a| format!("{:?} {} = {}", a.namespace(), a.name(), fold(a.value())))
                .collect();
            attributes.sort();
            said.extend(attributes);
        } else if let Some(text) = node.text().map(fold).filter(|text| !text.is_empty()) {
            said.push(format!("{:?} {text}", node.node_type()));
        }
    }
    said
}

fn depth(node: Node<'_, '_>) -> usize {
    node.ancestors().count()
}

#[track_caller]
fn assert_stable_and_faithful(path: &Path) {
    let text = fs::read_to_string(path).expect("UTF-8");
    let text = text.trim_start_matches('\u{feff}');
    let Ok(once) = format(path, text) else {
        return;
    };
    let twice = format(path, &once).expect("still a definition");
    similar(path, &once, &twice);
    assert_eq!(meaning(text), meaning(&once), "{}", path.display());
}

#[track_caller]
fn similar(path: &Path, once: &str, twice: &str) {
    for (number, (a, b)) in once.lines().zip(twice.lines()).enumerate() {
        assert_eq!(a, b, "{}:{}", path.display(), number + 1);
    }
    assert_eq!(once.len(), twice.len(), "{}", path.display());
}

#[test]
fn our_definitions_keep_their_meaning_and_are_laid_out_once() {
    let mut files = Vec::new();
    files_of(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("services"),
        &mut files,
    );
    assert!(files.len() > 30, "{} files", files.len());
    for file in files {
        assert_stable_and_faithful(&file);
    }
}

#[test]
fn published_definitions_keep_their_meaning_and_are_laid_out_once() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    let mut files = Vec::new();
    files_of(&corpus, &mut files);
    assert!(files.len() > 400, "{} files", files.len());
    for file in files {
        assert_stable_and_faithful(&file);
    }
}

const UNTIDY: &str = r#"<service_def version="1.0" xmlns="urn:jaus:jsidl:1.1"
    id='urn:me:Lights' name="Lights"> <!-- not
       aligned
         at all -->

	<description>Switches lights.
	  One
	    after the other.</description><message_set><input_set></input_set>
<output_set/> <!-- nothing -->
</message_set>
  <protocol_behavior><start state_name="On" state_machine_name='M'/><state_machine name="M"><state name="On"><entry><action name="a">
   <argument value="'x &lt; y'"/></action></entry></state></state_machine></protocol_behavior>
  <declared_type_set name="T">
    <fixed_field interpretation="What the lamp draws, measured   at the fuse, which is not where the
       lamp is, so that the current of the wires is part of it as well." field_units="ampere" field_type="unsigned byte" optional="false" name="Current"/></declared_type_set>
</service_def>"#;

const TIDY: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<service_def name="Lights" id="urn:me:Lights" version="1.0" xmlns="urn:jaus:jsidl:1.1">
  <!-- not
       aligned
         at all -->

  <description>
    Switches lights.
    One
      after the other.
  </description>
  <message_set>
    <input_set/>
    <output_set/> <!-- nothing -->
  </message_set>
  <protocol_behavior>
    <start state_machine_name="M" state_name="On"/>
    <state_machine name="M">
      <state name="On">
        <entry>
          <action name="a"><argument value="'x &lt; y'"/></action>
        </entry>
      </state>
    </state_machine>
  </protocol_behavior>
  <declared_type_set name="T">
    <fixed_field name="Current" optional="false" field_type="unsigned byte" field_units="ampere"
        interpretation="What the lamp draws, measured at the fuse, which is not where the lamp is, so that the
        current of the wires is part of it as well."/>
  </declared_type_set>
</service_def>
"#;

#[test]
fn an_untidy_definition_becomes_tidy() {
    let tidy = format("t.xml", UNTIDY).expect("a definition");
    assert_eq!(tidy, TIDY);
    assert_eq!(meaning(UNTIDY), meaning(&tidy));
    assert!(tidy.lines().all(|line| line.chars().count() <= WIDTH));
}

#[test]
fn what_is_no_definition_is_not_laid_out() {
    let said = |text: &str| {
        format("t.xml", text)
            .expect_err("no definition")
            .to_string()
    };
    assert_eq!(
        said("<a>"),
        "t.xml:1:1: error: not well-formed XML: the root node was opened but never closed\n"
    );
    assert_eq!(
        said("<project/>"),
        "t.xml:1:1: error: `project` is not the root element of a JSIDL file: expected one of `service_def`, `declared_type_set`, `declared_const_set`, `service_set`\n"
    );
}

/// Moves `assumptions` behind `message_set`, and removes what says nothing.
#[test]
fn the_strict_form_is_complete_and_in_order() {
    let every = include_str!("grammar/every.xml");
    let laid_out = jsidl::format::strict("every.xml", every).expect("it is a definition");
    assert_eq!(
        laid_out,
        format("every.xml", every).expect("it is a definition")
    );

    let careless = r#"<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.1">
  <message_set>
    <output_set/>
    <!-- What it receives. -->
    <input_set/> <!-- nothing -->
  </message_set>
  <declared_type_set name="T">
    <record name="R"><fixed_field name="F" field_type="byte" field_units="one"/></record>
  </declared_type_set>
</service_def>"#;
    let strict = jsidl::format::strict("s.xml", careless).expect("it is a definition");
    assert_eq!(
        strict,
        r#"<?xml version="1.0" encoding="UTF-8"?>
<service_def name="S" id="urn:s" version="1.0" xmlns="urn:jaus:jsidl:1.1">
  <description/>
  <assumptions/>
  <declared_type_set name="T">
    <record name="R" optional="false">
      <fixed_field name="F" optional="false" field_type="byte" field_units="one"/>
    </record>
  </declared_type_set>
  <message_set>
    <!-- What it receives. -->
    <input_set/> <!-- nothing -->
    <output_set/>
  </message_set>
  <internal_events_set/>
  <protocol_behavior is_stateless="true">
    <start state_machine_name="Stateless" state_name="Ready"/>
    <state_machine name="Stateless">
      <state name="Ready"/>
    </state_machine>
  </protocol_behavior>
</service_def>
"#
    );
    let mut loader = jsidl::Loader::new();
    loader.strict().text("s.xml", &strict);
    let loaded = loader.load();
    assert_eq!(loaded.diagnostics.to_string(), "");
    // The machine that says nothing is none.
    let service = loaded.library.services().next().expect("it is there");
    assert!(service.behaviour.is_empty());
}
