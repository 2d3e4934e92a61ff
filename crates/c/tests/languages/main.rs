//! Programs in C and C++ over the interface: compiled by the system's compilers, against each other and
//! against components in Rust. The compilers are gcc and g++.

mod compiler;
mod safety;
mod scene;
mod system;
