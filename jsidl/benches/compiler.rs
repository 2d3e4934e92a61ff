//! How long the compiler takes for all services of the catalogue together: what a build script adds
//! to a build, and what `jaus jsidl check` and `rust` take.
//!
//! | | |
//! |---|---|
//! | read | XML to a resolved library, with all rules checked |
//! | rust | the library to Rust source, one module for each set as the build script makes them |
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark")]

use std::collections::BTreeMap;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use jsidl::model::Service;
use jsidl::{Library, Loader};

fn load() -> Library {
    let mut loader = Loader::new();
    loader.catalogue();
    loader.load().library
}

/// The set of a service: the last but one part of its URN.
fn set(service: &Service) -> &str {
    service.id.urn.rsplit(':').nth(1).unwrap()
}

fn rust(library: &Library) -> usize {
    let mut sets: BTreeMap<_, Vec<&Service>> = BTreeMap::new();
    for service in library.services() {
        sets.entry(set(service)).or_default().push(service);
    }
    let modules = sets.into_values();
    modules
        .map(|services| jsidl::rust::module(library, services, "crate::codec").len())
        .sum()
}

fn compiler(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("all services");
    group.sample_size(10);
    group.bench_function("read", |bencher| bencher.iter(load));
    let library = load();
    println!(
        "{} services, {} octets of Rust",
        library.services().count(),
        rust(&library)
    );
    group.bench_function("rust", |bencher| bencher.iter(|| rust(black_box(&library))));
    group.bench_function("read and rust", |bencher| bencher.iter(|| rust(&load())));
    group.finish();
}

criterion_group!(benches, compiler);
criterion_main!(benches);
