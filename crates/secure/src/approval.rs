//! Dual control: what a trust file allows takes effect when two people have signed it.
//!
//! | file | contents |
//! |---|---|
//! | `approvers` | who may propose and approve: in each line a name and a public key |
//! | `trusted_keys.approvals` | the lines that were proposed for the file `trusted_keys`, with their signatures |
//! | `issued.approvals` | the certificates that were proposed to an authority, with the signatures |
//!
//! A proposal has the time of its making, the end of its time for approval (both in seconds since 1970),
//! its signatures, and the line:
//!
//! ```text
//! 1795910400 1796515200 KEY:SIGNATURE,KEY:SIGNATURE console KEY 60.1.255 control=127
//! ```
//!
//! A certificate contains the signatures of what it allows, so the key of the authority is not enough to issue one.
//! Removing a line, or revoking a certificate, needs no approval. The rest depends on the file of approvers: one
//! person who can change it, or the settings of the services, can do everything alone.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::{Duration, SystemTime};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use jaus_files::Readers;
use rustls::pki_types::UnixTime;

use crate::certificate::{Certificate, hex, shown};
use crate::crypto::digest::{SHA256, digest};
use crate::key::{Key, PublicKey};
use crate::trust::{LONGEST, Trust};

/// What a signature is about: it is none of a handshake or a beacon.
const PURPOSE: &str = "jaus: a line of a trust file";
/// People who must have signed a line.
const NEEDED: usize = 2;

/// Why a change under dual control is refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ApprovalError {
    /// A file cannot be read or written.
    #[error("{}: {source}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// Fewer than two people have approved a line.
    #[error(
        "the line of `{0}` is not approved by two people: propose it with `jaus keys trust` or \
         `allow` and --sign, and have another person approve it by `jaus keys approve`; or revoke it"
    )]
    Unapproved(String),
    /// The file of approvers is malformed.
    #[error("the file of approvers, {}, line {line}: write a name and a public key", .path.display())]
    Approvers {
        /// The file.
        path: PathBuf,
        /// The line's number, from 1.
        line: usize,
    },
    /// The file of approvals is malformed.
    #[error("the file of approvals, {}, line {line} is damaged: remove it", .path.display())]
    Approvals {
        /// The file.
        path: PathBuf,
        /// The line's number, from 1.
        line: usize,
    },
    /// Who approves a line must see all of it.
    #[error("the line has characters that cannot be shown")]
    Unprintable,
    /// No proposal has this id.
    #[error("no proposal `{}` waits for approval: `approve` without it lists those that do", jaus_text::visible(.0))]
    NoProposal(String),
    /// The time in which a proposal may be approved is over.
    #[error("the time to approve the proposal `{0}` is over: propose it again")]
    ProposalExpired(String),
    /// The key of who signs is not in the file of approvers.
    #[error("the key {0} is no approver's")]
    NoApprover(PublicKey),
    /// The same person has signed before.
    #[error("`{0}` has signed this already: another approver is needed")]
    SamePerson(String),
    /// The key does not sign.
    #[error("the key {0} has not signed: is its token there?")]
    NotSigned(PublicKey),
}

/// The files by which a trust file is under dual control.
#[derive(Clone, Debug)]
pub struct DualControl {
    approvers: PathBuf,
    approvals: PathBuf,
}

/// A line that is proposed for a trust file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Proposal {
    line: String,
    made: u64,
    until: u64,
    signatures: Vec<(PublicKey, Vec<u8>)>,
}

/// The people who approve, with their keys. A person may have several.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Approvers(Vec<(String, PublicKey)>);

impl DualControl {
    /// How long a proposal may be approved.
    pub const LIFE: Duration = Duration::from_secs(7 * 24 * 60 * 60);

    /// The dual control of a trust file by the people in the file of approvers.
    #[must_use]
    pub fn new(trusted_keys: &Path, approvers: &Path) -> Self {
        let mut approvals = trusted_keys.as_os_str().to_owned();
        approvals.push(".approvals");
        Self {
            approvers: approvers.to_owned(),
            approvals: approvals.into(),
        }
    }

    /// All files that decide.
    pub(crate) fn files(&self, trusted_keys: &Path) -> Vec<PathBuf> {
        let trusted_keys = trusted_keys.to_owned();
        vec![trusted_keys, self.approvers.clone(), self.approvals.clone()]
    }

    /// A trust, once it is checked that two people have approved each of its lines.
    pub(crate) fn verified(&self, mut trust: Trust) -> Result<Trust, ApprovalError> {
        let (approvers, proposals) = (self.approvers()?, self.proposals()?);
        let is_approved = |line: &str| {
            let mut same = proposals.iter().filter(|it| it.line == line);
            same.any(|it| approvers.approve(it))
        };
        let mut lines = trust.lines();
        if let Some((name, _)) = lines.find(|(_, line)| !is_approved(line)) {
            return Err(ApprovalError::Unapproved(name.to_owned()));
        }
        drop(lines);
        trust.approvers = Some(approvers);
        Ok(trust)
    }

    /// Proposes a line, signed by an approver.
    ///
    /// # Errors
    /// If a file cannot be used, or the key is not that of an approver.
    pub fn propose(
        &self,
        line: &str,
        key: &Key,
        now: SystemTime,
    ) -> Result<Proposal, ApprovalError> {
        if line.contains(jaus_text::is_unprintable) {
            return Err(ApprovalError::Unprintable);
        }
        let made = since_1970(now);
        let mut proposal = Proposal {
            line: line.to_owned(),
            made,
            until: made + Self::LIFE.as_secs(),
            signatures: Vec::new(),
        };
        self.approvers()?.sign(&mut proposal, key)?;
        self.change(|proposals| {
            proposals.retain(|it| it.id() != proposal.id());
            proposals.push(proposal.clone());
            Ok(())
        })?;
        Ok(proposal)
    }

    /// Approves the proposal with this id, with the key of a further person. Its line may then be put into the
    /// trust file.
    ///
    /// # Errors
    /// If a file cannot be used, there is no such proposal, its time is over, or the key is not that of a
    /// further approver.
    pub fn approve(&self, id: &str, key: &Key, now: SystemTime) -> Result<Proposal, ApprovalError> {
        let approvers = self.approvers()?;
        let mut approved = None;
        self.change(|proposals| {
            let proposal = proposals.iter_mut().find(|it| it.id() == id);
            let proposal = proposal.ok_or_else(|| ApprovalError::NoProposal(id.to_owned()))?;
            if since_1970(now) > proposal.until {
                return Err(ApprovalError::ProposalExpired(id.to_owned()));
            }
            // If it is, the line was not put into the file.
            if !approvers.approve(proposal) {
                approvers.sign(proposal, key)?;
            }
            approved = Some(proposal.clone());
            Ok(())
        })?;
        approved.ok_or_else(|| ApprovalError::NoProposal(id.to_owned()))
    }

    /// The proposals that wait for a further person, each with the names of those who have signed it.
    ///
    /// # Errors
    /// If a file cannot be used.
    pub fn waiting(&self, now: SystemTime) -> Result<Vec<(Proposal, Vec<String>)>, ApprovalError> {
        let approvers = self.approvers()?;
        let all = self.proposals()?.into_iter().map(|it| {
            let signers = approvers.signers(&it);
            let signers = signers.into_iter().map(str::to_owned).collect::<Vec<_>>();
            (it, signers)
        });
        let waits = |(it, signers): &(Proposal, Vec<String>)| {
            since_1970(now) <= it.until && signers.len() < NEEDED
        };
        Ok(all.filter(waits).collect())
    }

    /// Removes the approvals of lines that the trust file no longer has, so that nobody can put them back.
    ///
    /// # Errors
    /// If a file cannot be used.
    pub fn forget_removed(&self, trust: &Trust) -> Result<(), ApprovalError> {
        let approvers = self.approvers()?;
        self.change(|proposals| {
            proposals.retain(|it| {
                !approvers.approve(it) || trust.lines().any(|(_, line)| line == it.line)
            });
            Ok(())
        })
    }

    fn approvers(&self) -> Result<Approvers, ApprovalError> {
        let text = jaus_files::read_text(&self.approvers, Readers::Everyone, LONGEST);
        let text = text.map_err(|source| in_file(&self.approvers, source))?;
        let malformed = |line| ApprovalError::Approvers {
            path: self.approvers.clone(),
            line,
        };
        let mut approvers = Vec::new();
        for (index, line) in text.lines().enumerate() {
            let line = line.split('#').next().unwrap_or_default();
            let words: Vec<_> = line.split_whitespace().collect();
            match words[..] {
                [] => {}
                [name, key] => {
                    let key = key.parse().map_err(|_| malformed(index + 1))?;
                    approvers.push((name.to_owned(), key));
                }
                _ => return Err(malformed(index + 1)),
            }
        }
        Ok(Approvers(approvers))
    }

    fn proposals(&self) -> Result<Vec<Proposal>, ApprovalError> {
        match jaus_files::read_text(&self.approvals, Readers::Everyone, LONGEST) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
            Err(error) => Err(in_file(&self.approvals, error)),
            Ok(text) => self.parse(&text),
        }
    }

    fn parse(&self, text: &str) -> Result<Vec<Proposal>, ApprovalError> {
        let lines = text.lines().enumerate();
        let proposals = lines.map(|(index, line)| {
            line.parse().map_err(|()| {
                let path = self.approvals.clone();
                ApprovalError::Approvals {
                    path,
                    line: index + 1,
                }
            })
        });
        proposals.collect()
    }

    fn change(
        &self,
        change: impl FnOnce(&mut Vec<Proposal>) -> Result<(), ApprovalError>,
    ) -> Result<(), ApprovalError> {
        let failed = |source| in_file(&self.approvals, source);
        jaus_files::edit(
            &self.approvals,
            Readers::Everyone,
            LONGEST,
            failed,
            |text| {
                let mut proposals = self.parse(text)?;
                change(&mut proposals)?;
                let lines = proposals.iter().map(|it| format!("{it}\n"));
                Ok(Some(lines.collect()))
            },
        )?;
        Ok(())
    }
}

impl Approvers {
    /// Whether enough people have signed a proposal.
    pub(crate) fn approve(&self, proposal: &Proposal) -> bool {
        self.signers(proposal).len() >= NEEDED
    }

    /// Whether enough people have signed what a certificate allows, and the certificate has their signatures.
    pub(crate) fn approve_certificate(&self, certificate: &Certificate) -> bool {
        let seal = certificate.approval();
        let proposal = seal.and_then(|it| Proposal::of_seal(it, &certificate.line()));
        proposal.is_some_and(|it| self.approve(&it))
    }

    fn name_of(&self, key: PublicKey) -> Option<&str> {
        let known = self.0.iter().find(|(_, it)| *it == key);
        known.map(|(name, _)| name.as_str())
    }

    /// The people who have signed a proposal, each once: several keys of one are not several people.
    fn signers(&self, proposal: &Proposal) -> Vec<&str> {
        let message = proposal.message();
        let signed = proposal.signatures.iter();
        let signed = signed.filter(|(key, it)| key.has_signed(message.as_bytes(), it));
        let mut names: Vec<_> = signed.filter_map(|(key, _)| self.name_of(*key)).collect();
        names.sort_unstable();
        names.dedup();
        names
    }

    fn sign(&self, proposal: &mut Proposal, key: &Key) -> Result<(), ApprovalError> {
        let public = key.public();
        let name = self
            .name_of(public)
            .ok_or(ApprovalError::NoApprover(public))?;
        if self.signers(proposal).contains(&name) {
            return Err(ApprovalError::SamePerson(name.to_owned()));
        }
        let signature = key.sign(proposal.message().as_bytes());
        let signature = signature.ok_or(ApprovalError::NotSigned(public))?;
        proposal.signatures.push((public, signature));
        Ok(())
    }
}

impl Proposal {
    /// The line for the trust file.
    #[must_use]
    pub fn line(&self) -> &str {
        &self.line
    }

    /// Until when it may be approved, for people, in UTC.
    #[must_use]
    pub fn end(&self) -> String {
        shown(UnixTime::since_unix_epoch(Duration::from_secs(self.until)))
    }

    /// By what it is named: the first 32 hexadecimal digits of the SHA-256 of what is signed, so that nobody can
    /// make two proposals of one name.
    #[must_use]
    pub fn id(&self) -> String {
        let hash = digest(&SHA256, self.message().as_bytes());
        hex(&hash.as_ref()[..16])
    }

    /// What is signed.
    fn message(&self) -> String {
        format!("{PURPOSE}\n{} {}\n{}", self.made, self.until, self.line)
    }
}

impl Proposal {
    /// All but the line, for a certificate: a part of a URI.
    #[cfg(feature = "ca")]
    pub(crate) fn seal(&self) -> String {
        self.head(';')
    }

    fn of_seal(seal: &str, line: &str) -> Option<Self> {
        format!("{} {line}", seal.replace(';', " ")).parse().ok()
    }

    fn head(&self, between: char) -> String {
        let signatures = self.signatures.iter();
        let signatures = signatures.map(|(key, it)| format!("{key}:{}", BASE64.encode(it)));
        let signatures = signatures.collect::<Vec<_>>().join(",");
        format!("{}{between}{}{between}{signatures}", self.made, self.until)
    }
}

/// Its line in the file of approvals.
impl fmt::Display for Proposal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.head(' '), self.line)
    }
}

impl FromStr for Proposal {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        if text.contains(jaus_text::is_unprintable) {
            return Err(());
        }
        let mut parts = text.splitn(4, ' ');
        let mut part = || parts.next().ok_or(());
        let seconds = |text: &str| text.parse().map_err(drop);
        let (made, until) = (seconds(part()?)?, seconds(part()?)?);
        let signatures = part()?.split(',').map(|it| {
            let (key, signature) = it.split_once(':')?;
            Some((key.parse().ok()?, BASE64.decode(signature).ok()?))
        });
        Ok(Self {
            made,
            until,
            signatures: signatures.collect::<Option<_>>().ok_or(())?,
            line: part()?.to_owned(),
        })
    }
}

fn in_file(path: &Path, source: io::Error) -> ApprovalError {
    let path = path.to_owned();
    ApprovalError::File { path, source }
}

pub(crate) fn since_1970(time: SystemTime) -> u64 {
    let since = time.duration_since(SystemTime::UNIX_EPOCH);
    since.map_or(0, |it| it.as_secs())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::edit;
    use crate::trust::{TrustError, TrustFile};

    const NOW: SystemTime = SystemTime::UNIX_EPOCH;

    struct Scene {
        folder: tempfile::TempDir,
        control: DualControl,
    }

    impl Scene {
        /// Two approvers, of whom anna has two keys, and a third person, who is none.
        fn new() -> Self {
            let folder = tempfile::tempdir().unwrap();
            let path = |name: &str| folder.path().join(name);
            let line = |name: &str, file: &str| {
                let key = Key::create(&path(file)).unwrap().public();
                format!("{name} {key}\n")
            };
            let mut approvers = "# the team\n".to_owned();
            for (name, file) in [("anna", "anna"), ("anna", "anna2"), ("ben", "ben")] {
                approvers.push_str(&line(name, file));
            }
            let _ = line("carl", "carl");
            fs::write(path("approvers"), approvers).unwrap();
            fs::write(path("trusted_keys"), "").unwrap();
            let control = DualControl::new(&path("trusted_keys"), &path("approvers"));
            Self { folder, control }
        }

        fn path(&self, name: &str) -> PathBuf {
            self.folder.path().join(name)
        }

        fn key(&self, name: &str) -> Key {
            Key::load(&self.path(name)).unwrap()
        }

        fn load(&self) -> Result<TrustFile, TrustError> {
            let approvers = self.path("approvers");
            TrustFile::load_controlled(&self.path("trusted_keys"), &approvers)
        }

        fn refusal(&self) -> String {
            self.load().unwrap_err().to_string()
        }
    }

    fn line(rules: &str) -> String {
        let key = PublicKey::from_octets([7; 32]);
        format!("console {key} 60.1.255 {rules}")
            .trim_end()
            .to_owned()
    }

    #[test]
    fn a_line_takes_effect_when_two_people_have_signed_it() {
        let scene = Scene::new();
        let trusted_keys = scene.path("trusted_keys");
        let line = line("control=127");
        let proposal = scene
            .control
            .propose(&line, &scene.key("anna"), NOW)
            .unwrap();
        // To write the file by hand gains nothing.
        edit::put(&trusted_keys, &line).unwrap();
        assert!(scene.refusal().contains("`console`"), "{}", scene.refusal());
        let approve = |name: &str| scene.control.approve(&proposal.id(), &scene.key(name), NOW);
        for (name, words) in [
            ("anna", "another"),
            ("anna2", "another"),
            ("carl", "no approver"),
        ] {
            let refused = approve(name).unwrap_err().to_string();
            assert!(refused.contains(words), "{refused}");
            assert!(scene.load().is_err());
        }
        // Nor do two keys of one person, written into the file of approvals.
        let (mut twice, second) = (proposal.clone(), scene.key("anna2"));
        let signature = second.sign(twice.message().as_bytes()).unwrap();
        twice.signatures.push((second.public(), signature));
        let approvals = scene.path("trusted_keys.approvals");
        fs::write(&approvals, format!("{twice}\n")).unwrap();
        assert!(scene.load().is_err());
        fs::write(&approvals, format!("{proposal}\n")).unwrap();
        let waiting = scene.control.waiting(NOW).unwrap();
        assert_eq!(waiting[0], (proposal.clone(), vec!["anna".to_owned()]));
        assert_eq!(approve("ben").unwrap().line(), line);
        assert_eq!(scene.load().unwrap().len(), 1);
        assert_eq!(scene.control.waiting(NOW).unwrap(), []);
    }

    #[test]
    fn a_changed_line_or_signature_is_refused_and_a_removed_line_is_not() {
        let scene = Scene::new();
        let [trusted_keys, approvals] =
            ["trusted_keys", "trusted_keys.approvals"].map(|it| scene.path(it));
        let proposal = scene
            .control
            .propose(&line(""), &scene.key("anna"), NOW)
            .unwrap();
        let approved = scene
            .control
            .approve(&proposal.id(), &scene.key("ben"), NOW)
            .unwrap();
        edit::put(&trusted_keys, approved.line()).unwrap();
        let running = scene.load().unwrap();
        edit::put(&trusted_keys, &line("control=255")).unwrap();
        assert!(scene.load().is_err(), "other rules");
        assert!(running.reload().is_err() && running.fault().is_some());
        edit::put(&trusted_keys, approved.line()).unwrap();
        running.reload().unwrap();
        // Signatures of another line, or of nobody.
        let text = fs::read_to_string(&approvals).unwrap();
        fs::write(&approvals, text.replace("60.1.255", "60.1.255 control=255")).unwrap();
        edit::put(&trusted_keys, &line("control=255")).unwrap();
        assert!(scene.load().is_err(), "signatures of another line");
        fs::write(&approvals, &text).unwrap();
        // One person revokes, and the approvals go with the line.
        assert!(edit::revoke(&trusted_keys, "console", None).unwrap());
        assert!(scene.load().unwrap().is_empty());
        scene.control.forget_removed(&Trust::default()).unwrap();
        edit::put(&trusted_keys, approved.line()).unwrap();
        assert!(scene.load().is_err(), "it is put back");
    }

    #[test]
    fn a_proposal_ends_and_unusable_files_are_named() {
        let scene = Scene::new();
        let proposal = scene
            .control
            .propose(&line(""), &scene.key("anna"), NOW)
            .unwrap();
        let late = NOW + DualControl::LIFE + Duration::from_secs(1);
        let approve = |id: &str, now| scene.control.approve(id, &scene.key("ben"), now);
        let refused = approve(&proposal.id(), late).unwrap_err().to_string();
        assert!(refused.contains("propose it again"), "{refused}");
        assert_eq!(scene.control.waiting(late).unwrap(), []);
        let hidden = line("").replace("console", "con\u{1b}[8msole");
        let refused = scene.control.propose(&hidden, &scene.key("anna"), NOW);
        assert!(matches!(refused, Err(ApprovalError::Unprintable)));
        let refused = approve("abc", NOW).unwrap_err().to_string();
        assert!(refused.contains("`abc`"), "{refused}");
        for (name, words) in [
            ("trusted_keys.approvals", "approvals, line 1"),
            ("approvers", "approvers, line 1"),
        ] {
            fs::write(scene.path(name), "nonsense of nobody\n").unwrap();
            assert!(scene.refusal().contains(words), "{}", scene.refusal());
        }
        fs::remove_file(scene.path("approvers")).unwrap();
        assert!(scene.load().is_err(), "without the file nobody approves");
    }
}
