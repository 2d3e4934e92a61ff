//! Evidence or refusals: a file of its own, in which no client takes more than its share.

use std::io;
use std::path::Path;
use std::time::Instant;

use jaus_limits::{Buckets, Rate};

use crate::chain::SealedLine;
use crate::entry::{Entry, Outcome};
use crate::file::{Limits, LogFile};
use crate::repeats::Repeats;

/// Different entries about one client at one address that are refusals, or about what everybody may do,
/// such as releases to ever new ids: a burst, and then one each second. They fill no log.
const SHARE: Rate = Rate::new(1, 200);
/// The same of what needs a right.
const EVIDENCE_SHARE: Rate = Rate::new(10, 2000);
/// Clients with a share of their own. Others have one together.
const MOST_CLIENTS: usize = 256;

/// One of the two files of a log.
#[derive(Debug)]
pub(crate) struct Stream {
    file: LogFile,
    repeats: Repeats,
    shares: Buckets<String>,
    evidence_shares: Buckets<String>,
    /// Entries beyond the share of their client.
    beyond: u64,
    /// The outcome of the lines about them.
    outcome: Outcome,
}

impl Stream {
    pub(crate) fn open(path: &Path, limits: Limits, outcome: Outcome) -> io::Result<Self> {
        Ok(Self {
            file: LogFile::open(path, limits)?,
            repeats: Repeats::default(),
            shares: Buckets::new(SHARE, MOST_CLIENTS),
            evidence_shares: Buckets::new(EVIDENCE_SHARE, MOST_CLIENTS),
            beyond: 0,
            outcome,
        })
    }

    /// Whether an entry is to be appended. If not, it has been counted.
    pub(crate) fn admits(&mut self, now: Instant, entry: &Entry) -> bool {
        if !self.repeats.is_new(now, entry) {
            return false;
        }
        let has_share = self.takes_share(now, entry);
        self.beyond += u64::from(!has_share);
        has_share
    }

    fn takes_share(&mut self, now: Instant, entry: &Entry) -> bool {
        // Who has proved a key has one share, wherever it connects from.
        let address = entry.address.as_deref().unwrap_or_default();
        let client = match &entry.key {
            Some(key) => key.clone(),
            None => format!("{} {address}", entry.who),
        };
        let shares = match entry.is_evidence() {
            true => &mut self.evidence_shares,
            false => &mut self.shares,
        };
        shares.take(now, client)
    }

    /// What was counted until now; all of it without a time.
    pub(crate) fn counted(&mut self, until: Option<Instant>) -> Vec<Entry> {
        let due = self.repeats.due();
        let is_due = until.is_none_or(|now| due.is_some_and(|due| due <= now));
        let mut counted = self.repeats.take(until);
        if is_due && self.beyond > 0 {
            let why = "more different entries of one client at once than are listed";
            let entry = Entry::new("several", "various", self.outcome).because(why);
            counted.push(entry.times(std::mem::take(&mut self.beyond)));
        }
        counted
    }

    /// Appends an entry; as [`LogFile::append`].
    pub(crate) fn append(
        &mut self,
        entry: &Entry,
        sealed: impl FnOnce(&Path, &SealedLine, bool),
    ) -> io::Result<()> {
        self.file.append(entry, sealed)
    }

    /// Waits until the disk has what was appended.
    pub(crate) fn sync(&self) -> io::Result<()> {
        self.file.sync()
    }

    /// When the next counted repetitions are due.
    pub(crate) fn due(&self) -> Option<Instant> {
        self.repeats.due()
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_client_takes_no_more_than_its_share_and_others_keep_theirs() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("audit.jsonl");
        let stream = Stream::open(&path, Limits::default(), Outcome::Allowed);
        let (mut stream, start) = (stream.unwrap(), Instant::now());
        let mut admitted = 0;
        for index in 0..10_000 {
            let release = Entry::new("tablet", "ReleaseControl", Outcome::Allowed);
            let entry = release.to(index).address(format_args!("10.0.0.2:{index}"));
            let entry = Entry {
                is_free: true,
                ..entry.key("key of the tablet")
            };
            admitted += u64::from(stream.admits(start, &entry));
        }
        assert_eq!(admitted, 200);
        // What needs a right is recorded, of others and of the same client.
        for evidence in [
            Entry::new("console", "RequestControl", Outcome::Allowed),
            Entry::new("tablet", "RequestControl", Outcome::Allowed).key("key of the tablet"),
        ] {
            assert!(stream.admits(start, &evidence));
        }
        let counted = stream.counted(Some(start + Duration::from_secs(10)));
        let beyond = counted.iter().find(|it| it.who == "several").unwrap();
        assert_eq!(beyond.times, 9800);
    }
}
