//! Gives the shared library its name for the dynamic linker: the number counts incompatible changes of
//! the interface.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libjaus_c.so.0");
    }
}
