//! Closes a `cargo test` with the tests that proved nothing because evidence or a tool was missing.
//! It is its own harness, so that the summary shows.

use jaus_test_kit::evidence::take_not_tested;

fn main() {
    let tests = take_not_tested();
    if tests.is_empty() {
        println!("\nEvery test of this run had what it needs.\n");
        return;
    }
    println!("\n*** NOT TESTED, {} in all:", tests.len());
    for test in tests {
        println!("  {test}");
    }
    println!("With JAUS_EVIDENCE=required they fail.\n");
}
