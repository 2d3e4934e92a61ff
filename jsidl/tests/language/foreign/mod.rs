//! Generated code of other languages against the dynamic codec: the same octets give the same
//! values, errors and octets.
//!
//! A small program in each language reads cases from standard input and answers one line for each.

mod cases;
mod cpp;
mod typescript;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::{env, fs, thread};

use jsidl::{Library, Loader};

use self::cases::Case;

/// A new directory for a test.
fn directory(test: &str) -> PathBuf {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("foreign")
        .join(test);
    let _ = fs::remove_dir_all(&directory);
    fs::create_dir_all(&directory).unwrap();
    directory
}

fn write_all(directory: &Path, files: &[(String, String)]) {
    for (name, text) in files {
        let path = directory.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
}

/// Definitions with texts that look like code, and the least and the greatest named values.
pub(crate) fn awkward() -> Library {
    let value = |index: &str, name: &str, text: &str| {
        format!(r#"<value_enum enum_index="{index}" enum_const="{name}" interpretation="{text}"/>"#)
    };
    let texts = [
        "ends with a backslash \\",
        "a trigraph ??/",
        "*/ /* // ${{x}} `x`",
        "\u{202E}turned and never turned back",
        "zero\u{200B}width \u{2066}isolated",
    ];
    let texts = texts.iter().enumerate();
    let texts: String = texts
        .map(|(number, text)| value(&number.to_string(), &format!("T{number}"), text))
        .collect();
    let limits = [
        ("long integer", i64::MIN.to_string(), i64::MAX.to_string()),
        (
            "unsigned long integer",
            "5".to_owned(),
            u64::MAX.to_string(),
        ),
        ("byte", "-128".to_owned(), "127".to_owned()),
    ];
    let turn = '\u{202E}';
    let fields = limits.map(|(number, least, most)| {
        let (name, least, most) = (number.replace(' ', ""), value(&least, "Least", ""), value(&most, "Most", ""));
        format!(
            r#"<fixed_field name="{name}" optional="false" field_type="{number}" field_units="one"><value_set offset_to_lower_limit="false">{least}{most}{texts}</value_set></fixed_field>"#
        )
    });
    let text = format!(
        r#"<service_def name="Awkward" id="urn:example:Awkward" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<description/><assumptions/><message_set><input_set><message_def name="SetAwkward" message_id="D001" is_command="false">
<description>ends with {turn}a turn ??/</description><header name="Header"><record name="HeaderRec" optional="false"><fixed_field name="MessageID" optional="false" field_type="unsigned short integer" field_units="one"/></record></header>
<body name="Body"><record name="BodyRec" optional="false">{}</record></body><footer name="Footer"/></message_def></input_set><output_set/></message_set></service_def>"#,
        fields.concat()
    );
    let mut loader = Loader::new();
    loader.text("awkward.xml", &text);
    let loaded = loader.load();
    assert!(!loaded.diagnostics.has_errors(), "{}", loaded.diagnostics);
    loaded.library
}

/// A file beside this one.
fn beside(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/language/foreign")
        .join(name)
}

/// Runs a command to its end; it must succeed.
fn run(command: &mut Command, input: &str) -> String {
    let piped = command.stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = piped.stderr(Stdio::piped()).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let output = thread::scope(|scope| {
        // A program that ends early does not read everything.
        scope.spawn(move || drop(stdin.write_all(input.as_bytes())));
        child.wait_with_output().unwrap()
    });
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {errors}");
    assert_eq!(errors, "", "{command:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Gives a program all cases, and compares its answers with those of the dynamic codec.
fn check(program: &mut Command, cases: &[Case]) {
    let input: String = cases.iter().map(Case::line).collect();
    let output = run(program, &input);
    let answers: Vec<_> = output.lines().collect();
    assert_eq!(answers.len(), cases.len());
    let compared = cases.iter().zip(answers);
    let wrong = compared.filter_map(|(case, answer)| case.check(answer).err());
    let wrong: Vec<_> = wrong.collect();
    let shown = wrong.iter().take(10);
    let shown: Vec<_> = shown
        .map(|it| it.chars().take(800).collect::<String>())
        .collect();
    assert!(
        wrong.is_empty(),
        "{} wrong:\n{}",
        wrong.len(),
        shown.join("\n")
    );
    println!("{} cases", cases.len());
}
