//! Compiles programs against the header and the shared library of this build.

use std::collections::BTreeMap;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, OnceLock, PoisonError};

use jaus_test_kit::evidence::{not_tested, this_test};
use jaus_test_kit::example::Example;

const WARNINGS: [&str; 6] = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-g", "-pthread"];

/// Whether there are compilers. Without them the test proves nothing and must return.
pub(crate) fn has_compilers() -> bool {
    let is_there = |name: &str| Command::new(name).arg("--version").output().is_ok();
    let there = is_there("gcc") && is_there("g++");
    if !there {
        not_tested(&this_test(), "there is no gcc or g++; install them");
    }
    there
}

/// Starts a program, which is compiled first: `examples/sensor.cpp`, with arguments.
pub(crate) fn start(source: &'static str, arguments: &[&str]) -> Example {
    let mut command = Command::new(compile(source));
    command.args(arguments);
    Example::start_command(source, command)
}

/// The folder with the compiled programs and with the library under the names that it is installed with.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("languages");
        std::fs::create_dir_all(&folder).unwrap();
        for name in ["libjaus_c.so", "libjaus_c.so.0"] {
            let link = folder.join(name);
            // It may be there from an earlier run.
            let _ = std::fs::remove_file(&link);
            symlink(library(), link).unwrap();
        }
        folder
    })
}

/// The shared library, which cargo has built beside this test.
fn library() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let beside = test.parent().unwrap().join("libjaus_c.so");
    assert!(
        beside.exists(),
        "{}: run cargo build -p jaus-c",
        beside.display()
    );
    beside
}

/// Compiles a program once; returns its path.
pub(crate) fn compile(source: &'static str) -> PathBuf {
    static COMPILED: Mutex<BTreeMap<&str, PathBuf>> = Mutex::new(BTreeMap::new());
    let mut compiled = COMPILED.lock().unwrap_or_else(PoisonError::into_inner);
    let program = compiled.entry(source).or_insert_with(|| {
        let package = Path::new(env!("CARGO_MANIFEST_DIR"));
        let program = folder().join(source.replace(['/', '.'], "-"));
        let (compiler, standard) = match source.ends_with(".c") {
            true => ("gcc", "-std=c11"),
            false => ("g++", "-std=c++17"),
        };
        let mut command = Command::new(compiler);
        command.arg(standard).args(WARNINGS);
        command.arg("-I").arg(package.join("include"));
        command.arg("-I").arg(package.join("examples"));
        command.arg(package.join(source)).arg("-o").arg(&program);
        command.arg("-L").arg(folder()).arg("-ljaus_c");
        command.arg(format!("-Wl,-rpath,{}", folder().display()));
        let output = command.output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{command:?}:\n{errors}");
        program
    });
    program.clone()
}

#[test]
fn each_function_refuses_null_and_invalid_handles_and_a_component_in_c_answers() {
    if has_compilers() {
        assert!(start("tests/programs/contract.c", &[]).end().success());
    }
}

#[test]
fn the_wrapper_in_cpp_moves_its_objects_and_throws_what_the_interface_says() {
    if has_compilers() {
        assert!(start("tests/programs/wrapper.cpp", &[]).end().success());
    }
}

#[test]
fn a_hostile_program_gets_errors_and_no_callback_after_the_end() {
    if has_compilers() {
        assert!(start("tests/programs/attack.cpp", &[]).end().success());
    }
}
