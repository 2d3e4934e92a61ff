//! Whether the services that use a file have taken a change of it.
#![expect(
    clippy::disallowed_methods,
    reason = "other processes are waited for in real time"
)]

use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use crate::log::open_regular;
use crate::process::{FileProcess, Marked};

/// How often the marks are looked at: for 2 s, four times as long as a service needs to notice a change
/// ([`Followed::INTERVAL`](crate::Followed::INTERVAL)).
const ATTEMPTS: u32 = 40;
const PAUSE: Duration = Duration::from_millis(50);

/// The content of a file before a change. Take it before the change, and ask for the
/// [`uptake`](Self::uptake) after it.
///
/// A service marks the content of each [followed](crate::Followed) file with a shared lock until it uses
/// another content, so an exclusive lock succeeds as soon as no service uses the former one. Contents that
/// were replaced even earlier have no name left; on Linux they are found by the open files of processes, also
/// where a container has them at another path. If this user may not look into a process that has marked a file
/// of the same file system, the uptake is unknown.
#[derive(Debug)]
pub struct FormerContent {
    path: PathBuf,
    file: io::Result<File>,
}

/// Whether running services use the present content of a file.
#[derive(Debug)]
#[must_use]
pub enum Uptake {
    /// The file is new.
    New,
    /// No service uses the file.
    Unused,
    /// All services that use the file have taken its present content.
    Complete,
    /// Services still use a former content: these, or some that this user may not see.
    Incomplete(Vec<FileProcess>),
    /// The system or the file system does not show it.
    Unknown(io::Error),
}

impl FormerContent {
    /// The present content of a file, which is about to be changed by replacing the file. The file need not
    /// exist.
    #[must_use]
    pub fn of(path: &Path) -> Self {
        let file = open_regular(path, File::options().read(true));
        Self {
            path: path.to_owned(),
            file,
        }
    }

    /// Waits until all services that use the file have taken its present content, at most 2 s.
    pub fn uptake(&self) -> Uptake {
        self.uptake_after(ATTEMPTS)
    }

    fn uptake_after(&self, attempts: u32) -> Uptake {
        let mut was_in_use = false;
        for _ in 0..attempts {
            let is_in_use = match self.is_marked() {
                Ok(is_marked) => is_marked,
                Err(error) => return Uptake::Unknown(error),
            };
            let marked = self.processes();
            if !is_in_use && marked.former.is_empty() {
                if !marked.hidden.is_empty() {
                    let names: Vec<_> = marked.hidden.iter().map(ToString::to_string).collect();
                    let text = format!(
                        "this user may not see which files these have read: {}; ask as root",
                        names.join(", ")
                    );
                    return Uptake::Unknown(io::Error::new(io::ErrorKind::PermissionDenied, text));
                }
                return match self.file {
                    _ if was_in_use || !marked.present.is_empty() => Uptake::Complete,
                    Ok(_) => Uptake::Unused,
                    Err(_) => Uptake::New,
                };
            }
            was_in_use = true;
            thread::sleep(PAUSE);
        }
        Uptake::Incomplete(self.processes().former)
    }

    /// Whether a process has marked the content that was replaced.
    fn is_marked(&self) -> io::Result<bool> {
        if cfg!(not(unix)) {
            return Err(io::ErrorKind::Unsupported.into());
        }
        let file = match &self.file {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
            Err(error) => return Err(io::Error::new(error.kind(), error.to_string())),
        };
        match file.try_lock() {
            // At once, because a service may just be marking it.
            Ok(()) => file.unlock().map(|()| false),
            Err(TryLockError::WouldBlock) => Ok(true),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }

    fn processes(&self) -> Marked {
        Marked::of(&self.path, self.file.as_ref().ok())
    }
}

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::{Followed, Readers, replace};

    struct Scene {
        folder: tempfile::TempDir,
    }

    impl Scene {
        /// A file with a text.
        fn new() -> Self {
            let folder = tempfile::tempdir().unwrap();
            let scene = Self { folder };
            fs::write(scene.path(), "0").unwrap();
            scene
        }

        fn path(&self) -> PathBuf {
            self.folder.path().canonicalize().unwrap().join("file")
        }

        /// A service that uses the file.
        fn service(&self) -> Followed<String, io::Error> {
            let path = self.path();
            Followed::load(vec![path.clone()], move || {
                match fs::read_to_string(&path)? {
                    bad if bad.starts_with("bad") => Err(io::Error::other(bad)),
                    text => Ok(text),
                }
            })
            .unwrap()
        }

        fn change(&self, text: &str) -> FormerContent {
            let former = FormerContent::of(&self.path());
            replace(&self.path(), Readers::Everyone, text.as_bytes()).unwrap();
            former
        }
    }

    /// The process of this test is among those that are named, where processes can be seen.
    #[track_caller]
    fn is_incomplete(uptake: Uptake) {
        let Uptake::Incomplete(processes) = uptake else {
            panic!("{uptake:?}");
        };
        let named = processes.iter().any(|it| it.id == std::process::id());
        assert_eq!(named, cfg!(target_os = "linux"), "{processes:?}");
    }

    #[test]
    fn a_file_that_no_service_uses_is_unused_and_a_missing_one_new() {
        let scene = Scene::new();
        assert!(matches!(scene.change("1").uptake(), Uptake::Unused));
        drop(scene.service());
        assert!(matches!(scene.change("2").uptake(), Uptake::Unused));
        fs::remove_file(scene.path()).unwrap();
        assert!(matches!(scene.change("3").uptake(), Uptake::New));
    }

    #[test]
    fn a_change_is_taken_when_every_service_has_read_it() {
        let scene = Scene::new();
        let services = [scene.service(), scene.service()];
        let former = scene.change("1");
        is_incomplete(former.uptake_after(1));
        services[0].refresh().unwrap();
        is_incomplete(former.uptake_after(1));
        thread::scope(|scope| {
            let waiting = scope.spawn(|| former.uptake());
            services[1].refresh().unwrap();
            assert!(matches!(
                waiting.join().unwrap(),
                Uptake::Complete | Uptake::Unused
            ));
        });
        // The mark has moved to the new content, of which the next change sees it.
        is_incomplete(scene.change("2").uptake_after(1));
    }

    #[test]
    fn a_service_that_cannot_use_the_new_content_has_not_taken_it() {
        let scene = Scene::new();
        let service = scene.service();
        let former = scene.change("bad");
        assert!(service.refresh().is_err());
        is_incomplete(former.uptake_after(2));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_service_that_has_missed_an_earlier_change_is_named_at_the_next() {
        let scene = Scene::new();
        let service = scene.service();
        let _ = scene.change("1");
        let former = scene.change("2");
        is_incomplete(former.uptake_after(2));
        fs::remove_file(scene.path()).unwrap();
        is_incomplete(scene.change("3").uptake_after(1));
        service.refresh().unwrap();
        assert!(matches!(former.uptake(), Uptake::Complete));
    }

    #[test]
    fn a_value_that_is_out_of_use_or_replaced_otherwise_holds_nothing() {
        let scene = Scene::new();
        let service = scene.service();
        service.replace("other".to_owned());
        assert!(matches!(scene.change("1").uptake(), Uptake::Unused));
    }

    #[test]
    fn an_exclusive_lock_delays_a_service_by_milliseconds_and_its_mark_until_it_is_gone() {
        let scene = Scene::new();
        let planted = File::open(scene.path()).unwrap();
        planted.lock().unwrap();
        let service = scene.service();
        let edition = service.edition();
        drop(planted);
        assert!(!service.refresh().unwrap());
        assert_eq!(service.edition(), edition, "only the mark is new");
        is_incomplete(scene.change("1").uptake_after(1));
    }

    #[test]
    fn a_lock_of_another_program_is_no_confirmation() {
        let scene = Scene::new();
        let planted = File::open(scene.path()).unwrap();
        planted.lock().unwrap();
        let uptake = scene.change("1").uptake_after(1);
        assert!(matches!(uptake, Uptake::Incomplete(_)), "{uptake:?}");
    }
}
