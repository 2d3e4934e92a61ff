//! Packages of all definitions that there are.

use jaus_test_kit::evidence;
use jaus_test_kit::tools::workspace;
use jsidl::ros::{Package, PackageName};
use jsidl::{Library, Loader};

use super::interfaces::{Interfaces, read};
use super::names;
use crate::support::{self, catalogue};

/// The package of all services.
pub(super) fn package(library: &Library) -> Package {
    Package::of(library, |_| true, &PackageName::default())
}

/// The types of a package, which must follow the rules.
pub(super) fn interfaces(package: &Package) -> Interfaces {
    read("jaus_msgs", &package.files())
}

/// The definitions of the tests of the Rust emitter, which use every construct.
pub(super) fn constructs() -> Library {
    let mut loader = Loader::new();
    loader.path(workspace("jsidl/tests/rust"));
    loader.load().library
}

/// Messages that are made by hand, with every construct of the model.
pub(super) fn made() -> Library {
    names::library(vec![
        support::everything(),
        support::emptiness(),
        support::framed(),
    ])
}

/// Requires that the package has a valid type for each message.
pub(super) fn check(library: &Library) -> usize {
    let package = package(library);
    let interfaces = interfaces(&package);
    for service in library.services() {
        for message in service.messages() {
            let interface = package.interface(&service.id, message);
            let name = interface.map_or("", |it| it.name());
            assert!(interfaces.contains_key(name), "{}", message.name);
        }
    }
    interfaces.len()
}

#[test]
fn every_built_in_message_has_a_type_that_follows_the_rules_of_ros() {
    let types = check(&catalogue());
    println!("{types} types");
    let mut loader = Loader::new();
    loader.reference_architecture();
    check(&loader.load().library);
}

#[test]
fn every_construct_has_a_type_that_follows_the_rules_of_ros() {
    check(&constructs());
    check(&crate::foreign::awkward());
    check(&made());
}

#[test]
fn every_message_of_the_corpus_has_a_type_that_follows_the_rules_of_ros() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    for source in ["jts", "fkie", "ffi"] {
        let mut loader = Loader::new();
        loader.path(corpus.join(source));
        let types = check(&loader.load().library);
        println!("{source}: {types} types");
        assert!(types > 100);
    }
}
