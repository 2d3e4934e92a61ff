//! The headers of `jsidl::cpp`, compiled.

use std::path::{Path, PathBuf};
use std::process::Command;

use jaus_test_kit::evidence;
use jaus_test_kit::tools::{has_program, workspace};
use jsidl::model::Service;
use jsidl::{Library, Loader, cpp};

use super::cases::{self, Case};
use super::{beside, check, directory, run, write_all};
use crate::support::{catalogue, golden};

/// Compilers, by default g++; separated by commas.
const COMPILERS: &str = "JAUS_CXX";

/// Further options, such as `-fsanitize=address,undefined`.
const OPTIONS: &str = "JAUS_CXXFLAGS";

fn compilers() -> Vec<String> {
    let named = std::env::var(COMPILERS).unwrap_or_else(|_| "g++".to_owned());
    named.split(',').map(str::to_owned).collect()
}

/// A program of a file beside this one and the headers in a directory.
fn compile(compiler: &str, directory: &Path, source: &str) -> PathBuf {
    let options = std::env::var(OPTIONS).unwrap_or_default();
    let program = directory.join(Path::new(source).with_extension(""));
    let mut command = Command::new(compiler);
    command
        .args(["-std=c++17", "-Wall", "-Wextra", "-Werror", "-pedantic"])
        .args(["-fno-exceptions", "-fno-rtti"])
        .args(options.split_whitespace())
        .arg("-I")
        .arg(directory)
        .arg(beside(source))
        .arg("-o")
        .arg(&program);
    run(&mut command, "");
    program
}

/// Writes the headers of a library, and a header that includes all sets.
fn write(directory: &Path, library: &Library, wanted: impl Fn(&Service) -> bool) {
    let files = cpp::files(library, wanted);
    write_all(directory, &files);
    let sets = files.iter().filter_map(|(path, _)| {
        let set = path.strip_prefix("jaus/")?.strip_suffix(".hpp")?;
        (!["codec", "codec/values", "json"].contains(&set)).then_some(set)
    });
    let sets: Vec<_> = sets.collect();
    let includes = sets
        .iter()
        .map(|set| format!("#include \"jaus/{set}.hpp\"\n"));
    let types = sets.iter().map(|set| format!("jaus::{set}::messages"));
    let types: Vec<_> = types.collect();
    let text = format!(
        "#include <tuple>\n{}using Sets = std::tuple<{}>;\n",
        includes.collect::<String>(),
        types.join(", ")
    );
    write_all(directory, &[("sets.hpp".to_owned(), text)]);
}

/// Sends cases through a program with the messages of a library.
fn pass(test: &str, library: &Library, wanted: impl Fn(&Service) -> bool, cases: &[Case]) {
    for compiler in compilers() {
        let directory = directory(&format!("{test}-{compiler}"));
        write(&directory, library, &wanted);
        let program = compile(&compiler, &directory, "run.cpp");
        check(&mut Command::new(program), cases);
    }
}

fn has_compilers() -> bool {
    compilers().iter().all(|compiler| has_program(compiler))
}

/// The golden vectors of our own definitions.
fn golden_cases(library: &Library, wanted: impl Fn(&Service) -> bool) -> Vec<Case> {
    let rows = golden::sources().into_iter().flat_map(|(_, rows)| rows);
    let mut cases = Vec::new();
    for row in rows {
        let id = golden::id_of(&row);
        let Some(service) = library.service(&id).filter(|service| wanted(service)) else {
            continue;
        };
        let code = u16::from_str_radix(row["message_id"].as_str().unwrap(), 16).unwrap();
        let mut messages = service.messages();
        let declared = messages.find(|it| it.code == code && row["message"] == it.name);
        if let Some(message) = declared {
            let octets = golden::octets_of(&row["hex"]);
            cases.extend(cases::around("", &id, message, &octets));
        }
    }
    cases
}

fn is_core_or_mobility(service: &Service) -> bool {
    let urn = &service.id.urn;
    urn.starts_with("urn:jaus:jss:core:") || urn.starts_with("urn:jaus:jss:mobility:")
}

fn is_core(service: &Service) -> bool {
    service.id.urn.starts_with("urn:jaus:jss:core:")
}

#[test]
fn golden_messages_of_the_core_set_pass_through_cpp() {
    if !has_compilers() {
        return;
    }
    let library = catalogue();
    let cases = golden_cases(&library, is_core);
    assert!(cases.len() > 1000, "{} cases", cases.len());
    pass("golden-cpp", &library, is_core, &cases);
}

#[test]
fn messages_with_every_construct_pass_through_cpp() {
    if !has_compilers() {
        return;
    }
    let mut loader = Loader::new();
    loader.path(workspace("jsidl/tests/rust"));
    let library = loader.load().library;
    let cases = cases::random("", &library, 8);
    pass("constructs-cpp", &library, |_| true, &cases);
}

#[test]
fn texts_that_look_like_code_and_extreme_values_pass_through_cpp() {
    if !has_compilers() {
        return;
    }
    let library = super::awkward();
    let cases = cases::random("", &library, 8);
    pass("awkward-cpp", &library, |_| true, &cases);
}

#[test]
fn random_octets_are_refused_or_come_back_in_cpp() {
    if !has_compilers() {
        return;
    }
    let mut loader = Loader::new();
    loader.path(workspace("jsidl/tests/rust"));
    let library = loader.load().library;
    for compiler in compilers() {
        let directory = directory(&format!("random-cpp-{compiler}"));
        write(&directory, &library, |_| true);
        let program = compile(&compiler, &directory, "random_octets.cpp");
        let output = run(&mut Command::new(program), "");
        let (read, _) = output.split_once(" of ").unwrap();
        assert!(read.parse::<u32>().unwrap() > 10_000, "{output}");
    }
}

#[test]
fn cpp_reads_sets_and_checks_values_in_units() {
    if !has_compilers() {
        return;
    }
    for compiler in compilers() {
        let directory = directory(&format!("values-cpp-{compiler}"));
        write(&directory, &catalogue(), is_core_or_mobility);
        let program = compile(&compiler, &directory, "own_values.cpp");
        assert_eq!(run(&mut Command::new(program), ""), "done\n");
        // The example of the documentation.
        let program = compile(&compiler, &directory, "pose.cpp");
        let expected = "53.100000 31 0\n\
            Latitude: 91 is not in -90 to 90 degree\n\
            ReportGlobalPose: Latitude: octets needed: 4, left: 2 at octet 4\n";
        assert_eq!(run(&mut Command::new(program), ""), expected);
    }
}

#[test]
fn a_member_with_the_name_of_the_parameter_is_what_a_setter_sets() {
    let files = cpp::files(&catalogue(), |service| service.id.urn.contains(":iop:"));
    let (_, header) = files.last().unwrap();
    let setter = "{ return codec::assign(this->value, Value::of(value)); }";
    assert!(header.contains(setter));
}

#[test]
#[ignore = "it compiles all definitions, which takes minutes: `.ci/foreign` runs it"]
fn all_golden_messages_and_every_built_in_type_pass_through_cpp() {
    if !has_compilers() {
        return;
    }
    let library = catalogue();
    pass(
        "all-cpp",
        &library,
        |_| true,
        &cases::random("", &library, 2),
    );
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    let mut vectors = 0;
    for (source, rows) in golden::sources() {
        let library = golden::load(&corpus, &source);
        let cases = rows.iter().flat_map(|row| {
            let (id, octets) = (golden::id_of(row), golden::octets_of(&row["hex"]));
            cases::around("", &id, golden::message_of(&library, row), &octets)
        });
        let cases: Vec<_> = cases.collect();
        vectors += rows.len();
        // A source may have no vectors of its own.
        if !cases.is_empty() {
            pass(&format!("{source}-cpp"), &library, |_| true, &cases);
        }
    }
    assert!(vectors > 2000, "the golden data have 2116 vectors");
}
