//! The committed header is what cbindgen makes of the sources.

use std::path::Path;

use jaus_test_kit::snapshot;

#[test]
fn the_header_is_that_of_the_sources() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).unwrap();
    let bindings = cbindgen::Builder::new()
        .with_crate(folder)
        .with_config(config);
    let mut header = Vec::new();
    bindings.generate().unwrap().write(&mut header);
    // The heading that rustdoc knows, in words for programmers in C.
    let header = String::from_utf8(header)
        .unwrap()
        .replace("# Safety", "Contract:");
    snapshot::check(folder.join("include/jaus.h"), &header);
}
