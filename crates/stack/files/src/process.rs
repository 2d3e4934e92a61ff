//! Processes that have marked a file.

use std::fmt;
use std::fs::File;
use std::path::Path;

/// A process that uses a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileProcess {
    /// Its number.
    pub id: u32,
    /// The name of its program, as `ps` shows it.
    pub name: String,
}

impl fmt::Display for FileProcess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (process {})", self.name, self.id)
    }
}

/// The processes that have marked contents of a file, as far as this user may see them.
#[derive(Debug, Default)]
pub(crate) struct Marked {
    pub(crate) present: Vec<FileProcess>,
    pub(crate) former: Vec<FileProcess>,
}

#[cfg(not(target_os = "linux"))]
impl Marked {
    pub(crate) fn of(_: &Path, _: Option<&File>) -> Self {
        Self::default()
    }
}

#[cfg(target_os = "linux")]
mod linux {
    use std::collections::BTreeSet;
    use std::fs::{self, Metadata};
    use std::os::unix::fs::MetadataExt as _;
    use std::path::PathBuf;

    use super::{File, FileProcess, Marked, Path};

    /// Major and minor number of the device, and inode.
    type Inode = (u32, u32, u64);

    impl Marked {
        /// Finds the processes that have marked a file's present content, `former`, or a content before that.
        pub(crate) fn of(path: &Path, former: Option<&File>) -> Self {
            let present = path.metadata().ok().map(|it| inode(&it));
            let former = former.and_then(|it| it.metadata().ok());
            let former = former.map(|it| inode(&it));
            let marks = marks();
            // What everybody may see.
            let is_named = |(_, inode): &&(u32, Inode)| [present, former].contains(&Some(*inode));
            let mut found: BTreeSet<_> = marks.iter().filter(is_named).copied().collect();
            // What shows contents whose inode is not known.
            let names = names(path);
            let processes: BTreeSet<_> = marks.iter().map(|(process, _)| *process).collect();
            for process in processes {
                let inodes = marks_of_process(process, &names);
                found.extend(inodes.map(|inode| (process, inode)));
            }
            let is_present = |(_, inode): &(u32, Inode)| Some(*inode) == present;
            let (present, former) = found.into_iter().partition::<Vec<_>, _>(is_present);
            let [present, former] = [present, former].map(processes_of);
            Self { present, former }
        }
    }

    fn inode(metadata: &Metadata) -> Inode {
        use rustix::fs::{major, minor};

        let device = metadata.dev();
        (major(device), minor(device), metadata.ino())
    }

    /// The shared locks of all processes, with their files.
    fn marks() -> Vec<(u32, Inode)> {
        let locks = fs::read_to_string("/proc/locks").unwrap_or_default();
        locks.lines().filter_map(mark).collect()
    }

    /// A line such as `1: FLOCK  ADVISORY  READ 812 fe:00:5242881 0 EOF`.
    fn mark(line: &str) -> Option<(u32, Inode)> {
        let mut words = line.split_whitespace().skip(1);
        if words.next() != Some("FLOCK") || words.nth(1) != Some("READ") {
            return None;
        }
        let process = words.next()?.parse().ok()?;
        let mut parts = words.next()?.split(':');
        let mut device = || u32::from_str_radix(parts.next()?, 16).ok();
        let (major, minor) = (device()?, device()?);
        Some((process, (major, minor, parts.next()?.parse().ok()?)))
    }

    /// How the system names the file behind an open one: a content that was replaced is called deleted.
    fn names(path: &Path) -> [PathBuf; 2] {
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let mut deleted = path.clone().into_os_string();
        deleted.push(" (deleted)");
        [path, deleted.into()]
    }

    /// The marked files with these names that a process has open; none if this user may not look into it.
    fn marks_of_process(process: u32, names: &[PathBuf]) -> impl Iterator<Item = Inode> {
        let folder = PathBuf::from(format!("/proc/{process}"));
        let files = fs::read_dir(folder.join("fd")).into_iter().flatten();
        files.flatten().filter_map(move |file| {
            if !names.contains(&fs::read_link(file.path()).ok()?) {
                return None;
            }
            let info = folder.join("fdinfo").join(file.file_name());
            let info = fs::read_to_string(info).ok()?;
            let mut locks = info.lines().filter_map(|line| line.strip_prefix("lock:"));
            locks.find_map(mark)?;
            file.path().metadata().ok().map(|it| inode(&it))
        })
    }

    fn processes_of(marks: Vec<(u32, Inode)>) -> Vec<FileProcess> {
        let ids: BTreeSet<_> = marks.into_iter().map(|(process, _)| process).collect();
        let process = |id| {
            let name = fs::read_to_string(format!("/proc/{id}/comm"));
            let name = name.map_or_else(|_| "a program".to_owned(), |it| it.trim_end().to_owned());
            FileProcess { id, name }
        };
        ids.into_iter().map(process).collect()
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn a_shared_lock_of_a_file_is_a_mark() {
            let line = "12: FLOCK  ADVISORY  READ 812 fe:0a:5242881 0 EOF";
            assert_eq!(mark(line), Some((812, (0xfe, 0x0a, 5_242_881))));
            for other in [
                "1: FLOCK  ADVISORY  WRITE 812 fe:00:5242881 0 EOF",
                "1: POSIX  ADVISORY  READ 812 fe:00:5242881 0 EOF",
                "1: -> FLOCK  ADVISORY  READ 812 fe:00:5242881 0 EOF",
                "1: FLOCK  ADVISORY  READ -1 <none>:0 0 EOF",
                "1: FLOCK  ADVISORY  READ 812",
                "",
            ] {
                assert_eq!(mark(other), None, "{other}");
            }
        }
    }
}
