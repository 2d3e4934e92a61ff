//! `jaus keys rotate`: another key for this host's node, which need not stop for it.

use std::path::Path;

use clap::Args;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::{Output, say};
use jaus_cli::secure::KeyFiles;
use jaus_secure::Key;

use crate::uptake::with_uptake;

/// Replace the key without stopping the node: first make the next one, then use it
///
/// Without --finish it makes the next key and prints its public key, which each peer trusts beside
/// the present one. With --finish the next key replaces the present one; a running node notices it
/// and connects again within seconds.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus keys rotate\n  \
    jaus keys rotate --finish")]
pub(super) struct Rotate {
    /// Replace the present key by the next one
    #[arg(long)]
    finish: bool,

    #[command(flatten)]
    files: KeyFiles,
}

impl Rotate {
    pub(super) fn run(&self) -> Result<Outcome, Failure> {
        let path = self.files.key()?;
        if Key::is_in_token(&path) {
            return Err(Failure::new(
                "a key in a token is replaced by another one: make it with `jaus keys new` and another \
                 `object`, let the peers trust it, and start the node with its URI",
            ));
        }
        if self.finish {
            finish(&path)
        } else {
            begin(&path)
        }
    }
}

fn begin(path: &Path) -> Result<Outcome, Failure> {
    // There is something to replace.
    Key::load(path).map_err(Failure::of)?;
    let next = Key::next_path(path);
    let key = Key::create(&next).map_err(Failure::of)?.public();
    say(format_args!(
        "the next key is in {}; on each peer run: jaus keys trust NAME {key} IDS --also; then, here: \
         jaus keys rotate --finish",
        next.display(),
    ));
    Output::new().line(key)?;
    Ok(Outcome::Done)
}

fn finish(path: &Path) -> Result<Outcome, Failure> {
    let old = Key::load(path).map_err(Failure::of)?.public();
    if !Key::next_path(path).exists() {
        return Err(Failure::new(
            "there is no next key: `jaus keys rotate` makes one, which peers then trust",
        ));
    }
    with_uptake(path, || {
        let key = Key::replace_by_next(path).map_err(Failure::of)?.public();
        say(format_args!(
            "the key is replaced; on each peer run: jaus keys revoke NAME {old}"
        ));
        Output::new().line(key)
    })
}
