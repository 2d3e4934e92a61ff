//! Finds programs beside `jaus` itself, then in the search path; expands paths.

use std::borrow::Cow;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// Folders with programs, in search order.
#[derive(Debug, Clone)]
pub(super) struct Programs {
    folders: Vec<PathBuf>,
}

impl Programs {
    /// The running program's folder, then `PATH`.
    pub(super) fn usual() -> Self {
        let own = std::env::current_exe().ok();
        let beside = own.and_then(|own| own.parent().map(Path::to_owned));
        let path = std::env::var_os("PATH").unwrap_or_default();
        Self::within(beside.into_iter().chain(std::env::split_paths(&path)))
    }

    pub(super) fn within(folders: impl IntoIterator<Item = PathBuf>) -> Self {
        Self {
            folders: folders.into_iter().collect(),
        }
    }

    /// Finds the file of a program, or returns the mistake. A name with a slash is a path relative
    /// to `base`.
    pub(super) fn find(&self, name: &str, base: &Path) -> Result<PathBuf, String> {
        if name.contains('/') {
            let path = base.join(home(name));
            return match is_program(&path) {
                true => Ok(path),
                false => Err(format!("there is no program {}", path.display())),
            };
        }
        let candidates = self.folders.iter().map(|folder| folder.join(name));
        if let Some(found) = candidates.into_iter().find(|path| is_program(path)) {
            return Ok(found);
        }
        let beside = self.folders.first().map(|folder| folder.display());
        let beside = beside.map_or_else(String::new, |folder| format!(" ({folder})"));
        let problem = format!(
            "there is no program `{name}`, neither in the directory of jaus{beside} nor in PATH"
        );
        Err(match self.nearest(name) {
            Some(nearest) => format!("{problem}; did you mean `{nearest}`?"),
            None => problem,
        })
    }

    /// Our own program with the most similar name.
    fn nearest(&self, name: &str) -> Option<String> {
        let files = fs::read_dir(self.folders.first()?).ok()?;
        let paths = files.filter_map(|file| Some(file.ok()?.path()));
        let ours = paths.filter(|path| is_program(path)).filter_map(|path| {
            let name = path.file_name()?.to_str()?;
            name.starts_with("jaus").then(|| name.to_owned())
        });
        let ours: Vec<String> = ours.collect();
        let names = ours.iter().map(String::as_str);
        jaus_cli::settings::nearest(name, names).map(str::to_owned)
    }
}

/// Whether it is an executable file.
fn is_program(path: &Path) -> bool {
    let runs = |it: fs::Metadata| it.is_file() && it.permissions().mode() & 0o111 != 0;
    fs::metadata(path).is_ok_and(runs)
}

/// Expands a leading `~/` to the user's home folder.
pub(super) fn home(path: &str) -> Cow<'_, Path> {
    let own = path.strip_prefix("~/").zip(std::env::home_dir());
    match own {
        Some((rest, home)) => home.join(rest).into(),
        None => Path::new(path).into(),
    }
}
