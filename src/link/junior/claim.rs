//! The sockets in the folder of Junior's node manager: its own, and one per client.

use std::io::{self, ErrorKind};
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::path::{Path, PathBuf};
use std::task::{Context, Poll};

use socket2::Type;
use tokio::io::ReadBuf;
use tokio::net;

use crate::address::JausId;
use crate::link::socket_file::{Obstacle, SocketFile};

/// The folder that Junior uses unless fkie's `SockPath` names another.
pub const DEFAULT_FOLDER: &str = "/tmp";

/// Why a component cannot be a client of Junior's node manager.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The folder cannot contain sockets.
    #[error(
        "`{}` cannot hold Junior's sockets: choose a folder whose path has at most 90 octets. \
         Junior uses /tmp, fkie's the value of its `SockPath`", .0.display()
    )]
    Folder(PathBuf),
    /// The node manager cannot be reached.
    #[error(
        "cannot reach Junior's node manager at {} ({source}): {}", path.display(),
        remedy(source, path, "start it (JuniorRTE, or NodeManager of the JAUS Tool Set)")
    )]
    Manager {
        /// Its socket.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// Another client has the id, with this socket.
    #[error(
        "{0} is used by another client of Junior's node manager, which reads {path}: choose \
         another id, or stop that program", path = .1.display()
    )]
    Taken(JausId, PathBuf),
    /// This socket for an id cannot be created.
    #[error(
        "{0} cannot connect to Junior's node manager: cannot create its socket {path} ({2}): \
         {remedy}", path = .1.display(), remedy = remedy(.2, .1, "check that path")
    )]
    Socket(JausId, PathBuf, #[source] io::Error),
}

fn remedy(error: &io::Error, path: &Path, otherwise: &str) -> String {
    match error.kind() {
        ErrorKind::PermissionDenied => format!(
            "start the node manager and this program as the same user, or, if {0} is another \
             user's, `sudo chmod o+w {0}`",
            path.display()
        ),
        _ => otherwise.to_owned(),
    }
}

/// Checks that a node manager listens in this folder.
///
/// # Errors
/// The reason, and a remedy.
pub fn check(folder: &Path) -> Result<(), Error> {
    check_folder(folder)?;
    let reached = connect(folder).map(drop);
    let path = manager_in(folder);
    reached.map_err(|source| Error::Manager { path, source })
}

pub(super) fn check_folder(folder: &Path) -> Result<(), Error> {
    let longest = client_in(folder, JausId::EVERYONE);
    let is_fit = folder.is_dir() && SocketAddr::from_pathname(longest).is_ok();
    is_fit
        .then_some(())
        .ok_or_else(|| Error::Folder(folder.to_owned()))
}

pub(super) fn manager_in(folder: &Path) -> PathBuf {
    folder.join("JuniorRTE")
}

fn client_in(folder: &Path, id: JausId) -> PathBuf {
    folder.join(id.to_u32().to_string())
}

/// A non-blocking socket that sends to the node manager.
pub(super) fn connect(folder: &Path) -> io::Result<UnixDatagram> {
    let socket = UnixDatagram::unbound()?;
    socket.connect(manager_in(folder))?;
    socket.set_nonblocking(true)?;
    Ok(socket)
}

/// The socket at which the node manager reaches one component. Dropping it removes the file.
#[derive(Debug)]
pub(crate) struct Claim {
    id: JausId,
    _file: SocketFile,
    /// The socket until the runtime watches it, because components may be attached outside a
    /// runtime.
    idle: Option<UnixDatagram>,
    watched: Option<net::UnixDatagram>,
}

impl Claim {
    /// Creates the socket of an id. Replaces the socket of a dead client, but not of a living one.
    pub(crate) fn new(folder: &Path, id: JausId) -> Result<Self, Error> {
        let path = client_in(folder, id);
        // The node manager may belong to another user, and must be able to write here.
        let (socket, file) = match SocketFile::bind(&path, Type::DGRAM, 0o666) {
            Ok(bound) => bound,
            Err(Obstacle::Io(source)) => return Err(Error::Socket(id, path, source)),
            Err(_) => return Err(Error::Taken(id, path)),
        };
        Ok(Self {
            id,
            _file: file,
            idle: Some(socket.into()),
            watched: None,
        })
    }

    pub(super) const fn id(&self) -> JausId {
        self.id
    }

    /// Receives a datagram. Must be called within a runtime.
    pub(super) fn poll_recv(
        &mut self,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        if let Some(socket) = self.idle.take() {
            self.watched = Some(net::UnixDatagram::from_std(socket)?);
        }
        match &self.watched {
            Some(socket) => socket.poll_recv(cx, buffer),
            None => Poll::Pending,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    const ID: JausId = JausId::new(101, 1, 33);

    fn folder(name: &str) -> PathBuf {
        let name = format!("jaus-claim-{name}-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn the_socket_of_an_id_is_named_as_junior_names_it_and_goes_with_its_claim() {
        let folder = folder("name");
        let claim = Claim::new(&folder, ID).unwrap();
        let path = folder.join("6619425");
        assert!(
            UnixDatagram::unbound()
                .unwrap()
                .send_to(b"x", &path)
                .is_ok()
        );
        drop(claim);
        assert!(!path.exists());
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_living_client_keeps_its_id_and_a_dead_one_is_replaced() {
        let folder = folder("taken");
        let path = client_in(&folder, ID);
        let other = UnixDatagram::bind(&path).unwrap();
        let error = Claim::new(&folder, ID).unwrap_err().to_string();
        assert!(
            error.contains("101.1.33 is used by another client"),
            "{error}"
        );
        assert!(error.contains(path.to_str().unwrap()), "{error}");
        other.set_nonblocking(true).unwrap();
        assert!(other.recv(&mut [0; 8]).is_err(), "it must not notice");
        drop(other);
        drop(Claim::new(&folder, ID).unwrap());
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn what_is_no_socket_is_not_removed() {
        let folder = folder("file");
        let path = client_in(&folder, ID);
        fs::write(&path, "precious").unwrap();
        let error = Claim::new(&folder, ID).unwrap_err();
        assert!(matches!(error, Error::Taken { .. }), "{error}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "precious");
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn the_socket_of_a_client_that_took_our_place_stays_when_we_go() {
        let folder = folder("stolen");
        let claim = Claim::new(&folder, ID).unwrap();
        let path = client_in(&folder, ID);
        // Junior's library does the same without a check.
        fs::remove_file(&path).unwrap();
        let _thief = UnixDatagram::bind(&path).unwrap();
        drop(claim);
        assert!(path.exists());
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_folder_that_is_none_or_has_too_long_a_path_is_refused_with_its_name() {
        let missing = check_folder(Path::new("/nowhere/at/all")).unwrap_err();
        assert!(missing.to_string().contains("/nowhere/at/all"));
        let long = folder("long").join("x".repeat(100));
        fs::create_dir_all(&long).unwrap();
        assert!(matches!(check_folder(&long), Err(Error::Folder(_))));
        fs::remove_dir_all(long.parent().unwrap()).unwrap();
    }

    #[test]
    fn a_node_manager_that_does_not_run_is_named_with_its_path_and_a_remedy() {
        let folder = folder("none");
        let error = check(&folder).unwrap_err().to_string();
        assert!(
            error.contains("JuniorRTE") && error.contains("start it"),
            "{error}"
        );
        let source = ErrorKind::PermissionDenied.into();
        let path = manager_in(Path::new("/tmp"));
        let error = Error::Manager { path, source }.to_string();
        assert!(error.contains("`sudo chmod o+w /tmp/JuniorRTE`"), "{error}");
        fs::remove_dir_all(folder).unwrap();
    }
}
