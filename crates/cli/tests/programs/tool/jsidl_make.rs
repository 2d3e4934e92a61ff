//! `jaus jsidl lua`, `rust`, `cpp`, `typescript`, `python` and `msg`: output files, and errors.

use std::fs;
use std::path::{Path, PathBuf};

use jaus_test_kit::tools::workspace;

use crate::support::{Run, run};

/// The definitions of the example crate.
const LAMP: &str = "examples/own-service/services";

/// An empty directory of one test.
fn directory(test: &str) -> PathBuf {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("jsidl_make")
        .join(test);
    let _ = fs::remove_dir_all(&directory);
    fs::create_dir_all(&directory).unwrap();
    directory
}

/// Runs `jaus jsidl` with these arguments.
fn jsidl(arguments: &[&str]) -> Run {
    run(&[&["jsidl"], arguments].concat(), b"")
}

fn lamp() -> String {
    let path = workspace(LAMP);
    path.to_str().unwrap().to_owned()
}

/// Definitions of which one refers to a missing type.
fn broken(directory: &Path) -> String {
    let services = directory.join("services");
    fs::create_dir(&services).unwrap();
    for name in ["Lamp.xml", "LampMessages.xml"] {
        let text = fs::read_to_string(workspace(LAMP).join(name)).unwrap();
        let text = text.replacen("types.Header", "types.Haeder", 1);
        fs::write(services.join(name), text).unwrap();
    }
    services.to_str().unwrap().to_owned()
}

#[test]
fn a_dissector_has_the_users_messages_and_the_built_in_ones_unless_only_theirs_are_wanted() {
    let directory = directory("lua");
    let (all, only) = (directory.join("all"), directory.join("only.lua"));
    let [all_path, only_path] = [&all, &only].map(|path| path.to_str().unwrap());
    let ran = jsidl(&["lua", &lamp(), "-o", all_path]);
    assert_eq!(ran.status, 0);
    let begins = format!("{all_path}/jaus.lua: ");
    assert!(ran.stdout.starts_with(&begins), "{ran:?}");
    let ran = jsidl(&["lua", &lamp(), "--only", "-o", only_path]);
    assert_eq!(ran.status, 0);
    assert_eq!(
        ran.stdout,
        format!("{only_path}: 1 service with 3 messages\n")
    );
    let all = fs::read_to_string(all.join("jaus.lua")).unwrap();
    let only = fs::read_to_string(only).unwrap();
    for script in [&all, &only] {
        assert!(script.contains("\"jaus.setlamp.brightness\""));
    }
    let built_in = "\"jaus.reportidentification.identification\"";
    assert!(all.contains(built_in) && !only.contains(built_in));
}

#[test]
fn a_dissector_leaves_out_what_has_errors_and_a_rust_module_is_not_written() {
    let directory = directory("broken");
    let (path, out) = (broken(&directory), directory.to_str().unwrap());
    let ran = jsidl(&["lua", &path]);
    assert_eq!(ran.status, 1);
    assert!(ran.stderr.contains("Haeder"), "{ran:?}");
    assert!(ran.stdout.contains("jaus.reportidentification"));

    let ran = jsidl(&["rust", &path, "-o", out]);
    assert_eq!(ran.status, 1);
    assert!(
        ran.stderr.contains("Haeder") && ran.stderr.contains("nothing was written"),
        "{ran:?}"
    );
    assert!(!directory.join("messages.rs").exists());
}

#[test]
fn a_rust_module_has_the_users_messages_alone() {
    let directory = directory("rust");
    let arguments = [
        "rust",
        &lamp(),
        "-o",
        directory.to_str().unwrap(),
        "--module",
        "lamps",
    ];
    let ran = jsidl(&arguments);
    assert_eq!(ran.status, 0);
    assert!(
        ran.stdout
            .ends_with("lamps.rs: 1 service with 3 messages\n"),
        "{ran:?}"
    );
    let text = fs::read_to_string(directory.join("lamps.rs")).unwrap();
    assert!(text.contains("pub struct SetLamp") && !text.contains("QueryIdentification"));
}

#[test]
fn a_rust_module_refers_to_messages_of_other_modules_by_their_paths() {
    let directory = directory("rust-extern");
    let (path, out) = (lamp(), directory.to_str().unwrap());
    let core = "urn:jaus:jss:core:=::jaus::messages::core";
    let ran = jsidl(&["rust", &path, "-o", out, "--extern-path", core]);
    assert_eq!(ran.status, 0, "{ran:?}");
    for malformed in ["urn:jaus:jss:core:", "=::jaus", "urn:jaus:jss:core:="] {
        let ran = jsidl(&["rust", &path, "-o", out, "--extern-path", malformed]);
        assert_eq!(ran.status, 2, "{ran:?}");
        assert!(ran.stderr.contains("expected URN=RUST_PATH"), "{ran:?}");
    }
}

#[test]
fn code_of_other_languages_has_the_users_messages_or_the_built_in_ones() {
    let directory = directory("foreign");
    let out = |name: &str| directory.join(name).to_str().unwrap().to_owned();
    for (command, own, built_in, codec) in [
        (
            "cpp",
            "jaus/example.hpp",
            "jaus/core.hpp",
            Some("jaus/codec.hpp"),
        ),
        ("typescript", "example.d.ts", "core.d.ts", Some("codec.js")),
        ("python", "example.pyi", "core.pyi", None),
        (
            "msg",
            "jaus_msgs/msg/ExampleSetLampV1p0.msg",
            "jaus_msgs/msg/CoreReportStatusV1p0.msg",
            Some("jaus_msgs/package.xml"),
        ),
    ] {
        let (all, only) = (out(&format!("{command}-all")), out(command));
        assert_eq!(jsidl(&[command, "-o", &all]).status, 0);
        let ran = jsidl(&[command, &lamp(), "-o", &only]);
        assert_eq!(ran.status, 0, "{ran:?}");
        assert!(ran.stdout.starts_with(&format!("{only}: ")), "{ran:?}");
        let read = |file: &str| fs::read_to_string(Path::new(&only).join(file)).unwrap();
        assert!(read(own).contains("SetLamp"));
        assert!(codec.is_none_or(|codec| !read(codec).is_empty()));
        assert!(!Path::new(&only).join(built_in).exists());
        assert!(Path::new(&all).join(built_in).is_file());
        assert!(!Path::new(&all).join(own).exists());
    }
}

#[test]
fn code_of_other_languages_is_not_written_if_a_definition_has_errors() {
    let directory = directory("foreign-broken");
    let (path, out) = (broken(&directory), directory.join("out"));
    for command in ["cpp", "typescript", "python", "msg"] {
        let ran = jsidl(&[command, &path, "-o", out.to_str().unwrap()]);
        assert_eq!(ran.status, 1);
        assert!(ran.stderr.contains("nothing was written"), "{ran:?}");
        assert!(!out.exists());
    }
}

#[test]
fn a_ros_package_has_the_name_that_the_user_gives_if_ros_permits_it() {
    let directory = directory("msg-name");
    let (path, out) = (lamp(), directory.to_str().unwrap());
    let ran = jsidl(&["msg", &path, "-o", out, "--package", "lamp_msgs"]);
    assert_eq!(ran.status, 0, "{ran:?}");
    let manifest = fs::read_to_string(directory.join("lamp_msgs/package.xml")).unwrap();
    assert!(manifest.contains("<name>lamp_msgs</name>"), "{manifest}");
    let ran = jsidl(&["msg", &path, "-o", out, "--package", "../lamp"]);
    assert_eq!(ran.status, 2, "{ran:?}");
    assert!(ran.stderr.contains("for example jaus_msgs"), "{ran:?}");
}

#[test]
fn paths_that_are_not_there_are_named() {
    for command in ["lua", "rust", "cpp", "typescript", "python", "msg"] {
        let ran = jsidl(&[command, "nowhere.xml", "-o", "nowhere"]);
        assert_eq!(ran.status, 2);
        assert!(ran.stderr.contains("nowhere.xml: No such file"), "{ran:?}");
    }
    assert!(!Path::new("nowhere").exists());
}
