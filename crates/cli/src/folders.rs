//! Folders of a user's keys, certificates and users.

use std::env;
use std::ffi::OsString;
use std::fs::DirBuilder;
use std::path::{Path, PathBuf};

use super::failure::Failure;

fn set(name: &str) -> Option<OsString> {
    env::var_os(name).filter(|it| !it.is_empty())
}

/// The user's folder of settings and keys, `~/.config/jaus`; `None` without a home directory.
pub fn config_folder() -> Option<PathBuf> {
    let home = || set("HOME").map(|home| Path::new(&home).join(".config"));
    let folder = set("XDG_CONFIG_HOME").map(PathBuf::from).or_else(home)?;
    Some(folder.join("jaus"))
}

/// The folder that a service manager gives to a service, or else the user's.
pub fn service_folder() -> Option<PathBuf> {
    set("STATE_DIRECTORY")
        .map(PathBuf::from)
        .or_else(config_folder)
}

/// Makes the folder of a file, for its owner alone.
///
/// # Errors
/// If it does not exist and cannot be made.
pub fn make_folder_of(file: &Path) -> Result<(), Failure> {
    let Some(folder) = file.parent().filter(|it| !it.as_os_str().is_empty()) else {
        return Ok(());
    };
    let mut builder = DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder
        .create(folder)
        .map_err(|error| Failure::file(folder, &error))
}
