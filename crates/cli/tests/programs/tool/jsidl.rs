//! `jaus jsidl check`, `diff` and `fmt` on correct and incorrect files.

use std::fs;
use std::path::PathBuf;

use crate::support::run;

const TYPES: &str = r#"<declared_type_set name="T" id="urn:me:Types" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<fixed_field name="A" optional="false" field_type="unsigned byte" field_units="one"/>
</declared_type_set>
"#;

/// A test's own directory, with one definition.
fn folder(name: &str, text: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a directory");
    fs::write(folder.join("Types.xml"), text).expect("a file");
    folder
}

#[test]
fn check_shows_mistakes_with_their_lines_and_fails() {
    let wrong = TYPES.replace("unsigned byte", "uint8");
    let said = run(&["jsidl", "check", "-"], wrong.as_bytes());
    assert_eq!(said.status, 1, "{said:?}");
    assert!(
        said.stdout
            .contains("error: `uint8` is not a value of `field_type`"),
        "{said:?}"
    );
    assert!(said.stdout.contains("--> standard input:2:52"), "{said:?}");
    assert!(said.stdout.contains("1 error, no warnings;"), "{said:?}");

    let line = run(&["jsidl", "check", "--json", "-"], wrong.as_bytes()).only_line();
    assert_eq!(
        (&line["severity"], &line["line"]),
        (&"error".into(), &2.into())
    );

    let said = run(&["jsidl", "check", "-"], TYPES.as_bytes());
    assert_eq!(said.status, 0, "{said:?}");
    assert_eq!(run(&["jsidl", "check", "not-there"], b"").status, 2);
    assert_eq!(run(&["jsidl", "check"], b"").status, 2);
}

#[test]
fn a_definition_does_not_differ_from_itself() {
    let said = run(&["jsidl", "diff", "-", "not-there"], TYPES.as_bytes());
    assert_eq!(said.status, 2, "{said:?}");
    let folder = folder("jsidl-diff", TYPES);
    let folder = folder.to_str().expect("UTF-8");
    let said = run(&["jsidl", "diff", folder, folder], b"");
    assert_eq!((said.status, said.stdout.as_str()), (0, "no changes\n"));
}

#[test]
fn convert_writes_the_compact_form_beside_xml_and_back() {
    let folder = folder("jsidl-convert", TYPES);
    let path = folder.to_str().expect("UTF-8");
    let said = run(&["jsidl", "convert", path], b"");
    assert_eq!(said.status, 0, "{said:?}");
    let compact = fs::read_to_string(folder.join("Types.csd")).expect("a file");
    assert_eq!(
        compact,
        "typeset T (id = urn.me.Types, version = 1.0) {\n  field uint8 A one;\n}\n"
    );
    let file = folder.join("Types.csd");
    let file = file.to_str().expect("UTF-8");
    assert_eq!(
        run(&["jsidl", "convert", file], b"").status,
        2,
        "the XML exists"
    );
    let said = run(&["jsidl", "convert", "--force", file], b"");
    assert_eq!(said.status, 0, "{said:?}");
    let xml = fs::read_to_string(folder.join("Types.xml")).expect("a file");
    assert!(xml.contains("\n  <fixed_field name=\"A\""), "{xml}");
    let said = run(
        &["jsidl", "check", "-"],
        compact.replace("one", "bushel").as_bytes(),
    );
    assert_eq!(said.status, 1, "{said:?}");
    assert!(said.stdout.contains("--> standard input:2:17"), "{said:?}");
}

#[test]
fn fmt_lays_files_out_once() {
    let folder = folder("jsidl-fmt", TYPES);
    let path = folder.to_str().expect("UTF-8");
    assert_eq!(run(&["jsidl", "fmt", "--check", path], b"").status, 1);
    assert_eq!(run(&["jsidl", "fmt", path], b"").status, 0);
    assert_eq!(run(&["jsidl", "fmt", "--check", path], b"").status, 0);
    let text = fs::read_to_string(folder.join("Types.xml")).expect("a file");
    assert!(text.contains("\n  <fixed_field name"), "{text}");
    let entries = fs::read_dir(&folder).expect("a directory").count();
    assert_eq!(entries, 1, "nothing is left beside it");
}
