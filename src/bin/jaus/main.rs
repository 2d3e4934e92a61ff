//! The command line tool `jaus`.

fn main() {}
