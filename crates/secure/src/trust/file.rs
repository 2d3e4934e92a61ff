//! The trust file of a running node, which is read again when it has changed.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use jaus::address::JausId;
use jaus::rights::{RuleError, Table};
use jaus_files::{Followed, Readers};

use super::{LONGEST, Peer, Trust, TrustError};
use crate::approval::DualControl;
use crate::certificate::Certificate;
use crate::follow::{REFUSING, follow};
use crate::key::PublicKey;

/// The trust of a running node, shared by its link and its handshakes. Replacing it takes effect at
/// once: the link closes the sessions of keys that are no longer trusted.
#[derive(Clone, Debug)]
pub struct TrustFile(Followed<Trust, TrustError>);

impl Default for TrustFile {
    fn default() -> Self {
        Self::of(Trust::default())
    }
}

impl TrustFile {
    /// Shares a trust that is not in a file.
    #[must_use]
    pub fn of(trust: Trust) -> Self {
        Self(Followed::of(trust))
    }

    /// Reads a trust file.
    ///
    /// # Errors
    /// If it cannot be read, or a line is malformed.
    pub fn load(path: &Path) -> Result<Self, TrustError> {
        let path = path.to_owned();
        Followed::load(vec![path.clone()], move || read(&path)).map(Self)
    }

    /// Reads a trust file under dual control: two of the people in the file of approvers must have approved
    /// each line.
    ///
    /// # Errors
    /// As [`load`](Self::load); or a line that is not approved.
    pub fn load_controlled(path: &Path, approvers: &Path) -> Result<Self, TrustError> {
        let (path, control) = (path.to_owned(), DualControl::new(path, approvers));
        let files = control.files(&path);
        let read = move || Ok(control.verified(read(&path)?)?);
        Followed::load(files, read).map(Self)
    }

    /// Reads a trust file, which may be missing as long as there is nothing to say: one that was there and
    /// vanishes may have narrowed the rights of a certificate, and is unusable.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn load_optional(path: &Path) -> Result<Self, TrustError> {
        let (owned, was_there) = (path.to_owned(), AtomicBool::new(false));
        let read = move || match read(&owned) {
            Err(TrustError::File { source, .. })
                if source.kind() == io::ErrorKind::NotFound
                    && !was_there.load(Ordering::Relaxed) =>
            {
                Ok(Trust::default())
            }
            other => {
                was_there.store(true, Ordering::Relaxed);
                other
            }
        };
        Followed::load(vec![path.to_owned()], read).map(Self)
    }

    /// Reads the file again. On an error the previous trust stays, and new sessions are refused until
    /// the file can be read again.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn reload(&self) -> Result<(), TrustError> {
        self.0.reload()
    }

    /// Reads the file again whenever it has changed, as long as the trust is in use. Must be called
    /// within a tokio runtime. A file that has become unusable is logged, and has the effect of
    /// [`reload`](Self::reload) with an error.
    pub fn follow(&self) {
        follow(&self.0, REFUSING);
    }

    /// Why new sessions are refused: the file has become unusable.
    pub(crate) fn fault(&self) -> Option<Arc<str>> {
        self.0.fault()
    }

    /// Replaces the trust.
    pub fn replace(&self, trust: Trust) {
        self.0.replace(trust);
    }

    /// The peer with this key.
    #[must_use]
    pub fn find(&self, key: PublicKey) -> Option<Peer> {
        self.0.get().find(key).cloned()
    }

    /// The peer with this certificate, which has been verified; `None` if it needs an approval that it lacks.
    pub(crate) fn certified(&self, certificate: &Certificate) -> Option<Peer> {
        let trust = self.0.get();
        let mut approvers = trust.approvers.iter();
        let is_approved = approvers.all(|it| it.approve_certificate(certificate));
        is_approved.then(|| trust.certified(certificate))
    }

    /// Checks the names in its rules: see [`Trust::verify`].
    ///
    /// # Errors
    /// As [`Trust::verify`].
    pub fn verify(&self, table: &Table) -> Result<(), (String, RuleError)> {
        self.0.get().verify(table)
    }

    /// Whether an id is rather that of another key: see [`Trust::is_others`].
    pub(crate) fn is_others(&self, peer: &Peer, id: JausId) -> bool {
        self.0.get().is_others(peer, id)
    }

    /// The number of trusted keys.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.get().peers().len()
    }

    /// Whether no key is trusted.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All trusted keys.
    pub(crate) fn keys(&self) -> Vec<PublicKey> {
        let trust = self.0.get();
        trust.peers().iter().map(|peer| peer.key).collect()
    }

    /// The ids of all trusted keys.
    pub(crate) fn ids(&self) -> Vec<JausId> {
        let trust = self.0.get();
        let ids = trust.peers().iter().flat_map(|peer| &peer.ids);
        ids.copied().collect()
    }

    /// How often the trust was replaced.
    pub(crate) fn edition(&self) -> u64 {
        self.0.edition()
    }
}

fn read(path: &Path) -> Result<Trust, TrustError> {
    let text = jaus_files::read_text(path, Readers::Everyone, LONGEST);
    let text = text.map_err(|source| in_file(path, source))?;
    Trust::parse(&text).map_err(|source| TrustError::Malformed {
        path: path.to_owned(),
        source: Box::new(source),
    })
}

pub(crate) fn in_file(path: &Path, source: io::Error) -> TrustError {
    TrustError::File {
        path: path.to_owned(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn key(octet: u8) -> PublicKey {
        PublicKey::from_octets([octet; 32])
    }

    #[test]
    fn a_reload_with_an_error_leaves_the_trust_of_sessions_and_refuses_new_ones() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trusted_keys");
        fs::write(&path, format!("rover {} 101.255.255\n", key(1))).unwrap();
        let file = TrustFile::load(&path).unwrap();
        fs::write(&path, "rover\n").unwrap();
        assert_eq!(file.fault(), None);
        assert!(file.reload().is_err());
        assert!(file.find(key(1)).is_some());
        let fault = file.fault().unwrap();
        let named = format!("the trust file {}, line 1: ", path.display());
        assert!(fault.starts_with(&named), "{fault}");
        fs::write(&path, "").unwrap();
        file.reload().unwrap();
        assert!(file.find(key(1)).is_none());
        assert_eq!(file.fault(), None);
    }

    #[test]
    fn a_file_that_narrows_certificates_may_be_missing_and_may_not_vanish() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trusted_keys");
        let file = TrustFile::load_optional(&path).unwrap();
        file.reload().unwrap();
        assert_eq!(file.fault(), None);
        fs::write(&path, "viewer certificate 61.255.255 except=SetEmergency\n").unwrap();
        file.reload().unwrap();
        fs::remove_file(&path).unwrap();
        assert!(file.reload().is_err());
        assert!(file.fault().is_some(), "new sessions are refused");
        fs::write(&path, "").unwrap();
        file.reload().unwrap();
        assert_eq!(file.fault(), None);
    }

    #[cfg(unix)]
    #[tokio::test]
    async fn a_revocation_is_confirmed_when_the_node_that_follows_the_file_has_taken_it() {
        use jaus_files::{FormerContent, Uptake};

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trusted_keys");
        fs::write(&path, format!("rover {} 101.255.255\n", key(1))).unwrap();
        let file = TrustFile::load(&path).unwrap();
        file.follow();
        let former = FormerContent::of(&path);
        assert!(crate::edit::revoke(&path, "rover", None).unwrap());
        let waiting = tokio::task::spawn_blocking(move || former.uptake());
        let uptake = waiting.await.unwrap();
        assert!(matches!(uptake, Uptake::Complete), "{uptake:?}");
        assert!(file.find(key(1)).is_none());
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_others_can_change_is_refused_with_the_remedy() {
        use std::os::unix::fs::PermissionsExt as _;

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trusted_keys");
        fs::write(&path, format!("rover {} 101.255.255\n", key(1))).unwrap();
        for (mode, is_refused) in [(0o666, true), (0o664, true), (0o644, false), (0o600, false)] {
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            let loaded = TrustFile::load(&path);
            assert_eq!(loaded.is_err(), is_refused, "{mode:o}");
            if let Err(error) = loaded {
                let error = error.to_string();
                assert!(error.contains("chmod go-w /"), "{error}");
            }
        }
    }
}
