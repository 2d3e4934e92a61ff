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
    /// Processes that have marked a file of the same file system, of which this user may not see which.
    pub(crate) hidden: Vec<FileProcess>,
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
    use std::io;
    use std::os::fd::AsRawFd as _;
    use std::os::unix::fs::MetadataExt as _;
    use std::path::PathBuf;

    use super::{File, FileProcess, Marked, Path};
    use crate::readers::folder_of;

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
            let mut hidden = BTreeSet::new();
            if let Some(place) = Place::of(path) {
                let processes: BTreeSet<_> = marks.iter().map(|(process, _)| *process).collect();
                for process in processes {
                    match marks_of_process(process, &place) {
                        Ok(inodes) => found.extend(inodes.into_iter().map(|it| (process, it))),
                        Err(_) => drop(hidden.insert(process)),
                    }
                }
                // A process may have ended, may use other file systems only, or may be known to have taken
                // the change.
                let is_near = |it: &(u32, Inode)| (it.1.0, it.1.1) == place.device;
                let marks: Vec<_> = self::marks().into_iter().filter(is_near).collect();
                hidden.retain(|process| {
                    let of_process = |it: &(u32, Inode)| it.0 == *process;
                    marks.iter().any(of_process) && !found.iter().any(of_process)
                });
            }
            let is_present = |(_, inode): &(u32, Inode)| Some(*inode) == present;
            let (present, former) = found.into_iter().partition::<Vec<_>, _>(is_present);
            let ids = |marks: Vec<(u32, Inode)>| marks.into_iter().map(|it| it.0).collect();
            Self {
                present: processes_of(ids(present)),
                former: processes_of(ids(former)),
                hidden: processes_of(hidden),
            }
        }
    }

    /// Where a file is, however the mount namespace of a process calls it.
    #[derive(Debug, PartialEq, Eq)]
    struct Place {
        /// Major and minor number of the file system.
        device: (u32, u32),
        /// From the root of the file system.
        path: PathBuf,
    }

    impl Place {
        /// The place of a file, which need not exist, in a folder.
        fn of(path: &Path) -> Option<Self> {
            let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
            let folder = File::open(folder_of(&path)).ok()?;
            let file = folder.as_raw_fd().to_string();
            let link = fs::read_link(Path::new("/proc/self/fd").join(&file)).ok()?;
            let info = fs::read_to_string(Path::new("/proc/self/fdinfo").join(file)).ok()?;
            let mounts = fs::read_to_string("/proc/self/mountinfo").ok()?;
            let place = Self::in_mounts(&link, &info, &mounts)?;
            let path = place.path.join(path.file_name()?);
            Some(Self { path, ..place })
        }

        /// The place of an open file from its link, its `fdinfo` and the `mountinfo` of its process.
        fn in_mounts(link: &Path, info: &str, mounts: &str) -> Option<Self> {
            let mut lines = info.lines();
            let mount = lines.find_map(|it| it.strip_prefix("mnt_id:"))?.trim();
            // A line such as `145 123 254:0 /etc/trusted_keys//deleted /conf/keys rw - ext4 /dev/vda rw`.
            let mut lines = mounts.lines().map(|it| it.split(' ').collect::<Vec<_>>());
            let line = lines.find(|it| it.first() == Some(&mount))?;
            let [_, _, device, root, point, ..] = line[..] else {
                return None;
            };
            let (major, minor) = device.split_once(':')?;
            // How the system calls a content that was replaced.
            let root = root.strip_suffix("//deleted").unwrap_or(root);
            let link = link.to_str()?;
            let link = Path::new(link.strip_suffix(" (deleted)").unwrap_or(link));
            let within = link.strip_prefix(unescaped(point)).ok()?;
            Some(Self {
                device: (major.parse().ok()?, minor.parse().ok()?),
                path: Path::new(&unescaped(root)).join(within),
            })
        }
    }

    /// A path of `mountinfo`, where blanks, tabs, line ends and backslashes are octal numbers.
    fn unescaped(path: &str) -> String {
        let pairs = [(" ", "040"), ("\t", "011"), ("\n", "012"), ("\\", "134")];
        let replace =
            |path: String, (plain, code): (&str, &str)| path.replace(&format!("\\{code}"), plain);
        pairs.into_iter().fold(path.to_owned(), replace)
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

    /// The marked files at this place, or once there, that a process has open.
    ///
    /// # Errors
    /// If this user may not look into the process, or it has ended.
    fn marks_of_process(process: u32, place: &Place) -> io::Result<Vec<Inode>> {
        let folder = PathBuf::from(format!("/proc/{process}"));
        let files = fs::read_dir(folder.join("fd"))?;
        let mounts = fs::read_to_string(folder.join("mountinfo"))?;
        let marked = |file: fs::DirEntry| {
            let info = folder.join("fdinfo").join(file.file_name());
            let info = fs::read_to_string(info).ok()?;
            let mut locks = info.lines().filter_map(|line| line.strip_prefix("lock:"));
            locks.find_map(mark)?;
            let link = fs::read_link(file.path()).ok()?;
            let is_there = Place::in_mounts(&link, &info, &mounts).as_ref() == Some(place);
            let found = file.path().metadata().ok().filter(|_| is_there)?;
            Some(inode(&found))
        };
        Ok(files.flatten().filter_map(marked).collect())
    }

    fn processes_of(ids: BTreeSet<u32>) -> Vec<FileProcess> {
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
        fn a_file_is_known_by_its_place_in_the_file_system_however_it_is_mounted() {
            let mounts = "\
                123 1 254:0 / / rw,relatime - ext4 /dev/vda rw\n\
                145 123 254:0 /etc/jaus/keys//deleted /conf/keys rw - ext4 /dev/vda rw\n\
                146 123 254:0 /etc/jaus /my\\040conf rw - ext4 /dev/vda rw\n";
            let place = |link: &str, mount: u32| {
                let info = format!("pos:\t0\nmnt_id:\t{mount}\nino:\t812\n");
                Place::in_mounts(Path::new(link), &info, mounts)
            };
            let expected = Place {
                device: (254, 0),
                path: "/etc/jaus/keys".into(),
            };
            for (link, mount) in [
                ("/etc/jaus/keys", 123),
                ("/etc/jaus/keys (deleted)", 123),
                ("/conf/keys (deleted)", 145),
                ("/my conf/keys (deleted)", 146),
            ] {
                assert_eq!(place(link, mount).as_ref(), Some(&expected), "{link}");
            }
            assert_ne!(place("/conf/keys", 123), Some(expected));
            assert_eq!(place("/conf/keys", 147), None, "no longer mounted");
        }

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
