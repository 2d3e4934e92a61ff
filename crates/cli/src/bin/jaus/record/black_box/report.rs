//! What has become of a file of the black box.

use std::path::PathBuf;

use jaus_cli::failure::Failure;
use jaus_cli::output::{counted, size};
use serde_json::{Value as Json, json};

use crate::events::EventPrinter;
use crate::recordings::Missing;

/// What is in a version of a file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Content {
    pub(super) packets: usize,
    /// Packets of this host lost meanwhile.
    pub(super) lost: u64,
    /// Number of triggers, with the one that began the file.
    pub(super) triggers: u64,
}

/// What has become of a version of a file.
#[derive(Debug)]
pub(super) struct Report {
    pub(super) file: PathBuf,
    pub(super) content: Content,
    /// Number of older files deleted because the disk was full.
    pub(super) deleted: u64,
    /// What was written, or why nothing was.
    pub(super) result: Result<Written, String>,
}

/// A version of a file that is on the disk.
#[derive(Debug, Clone, Copy)]
pub(super) struct Written {
    pub(super) octets: u64,
    /// Messages of an MCAP file that are in its frames alone.
    pub(super) left_out: u64,
}

impl Report {
    /// Prints it as an event.
    pub(super) fn print(&self, printer: &mut EventPrinter) -> Result<(), Failure> {
        let event = if self.result.is_ok() {
            "written"
        } else {
            "failed"
        };
        printer.timed(event, self.to_json(), self.in_words())
    }

    fn to_json(&self) -> Json {
        let Content {
            packets,
            lost,
            triggers,
        } = self.content;
        let file = self.file.display().to_string();
        let deleted = self.deleted;
        match &self.result {
            Ok(Written { octets, left_out }) => json!({
                "file": file,
                "packets": packets,
                "octets": octets,
                "triggers": triggers,
                "lost": lost,
                "left_out": left_out,
                "deleted": deleted,
            }),
            Err(error) => json!({ "file": file, "error": error, "deleted": deleted }),
        }
    }

    fn in_words(&self) -> String {
        let file = self.file.display();
        let Content {
            packets,
            lost,
            triggers,
        } = self.content;
        let mut words = match &self.result {
            Ok(written) => format!("{packets} packets in {file}, {}", size(written.octets)),
            Err(error) => format!("{file} is not written: {error}"),
        };
        if triggers > 1 {
            words += &format!("; {triggers} triggers");
        }
        if self.deleted > 0 {
            let files = counted(usize::try_from(self.deleted).unwrap_or(usize::MAX), "file");
            words += &format!("; the disk was full: deleted the oldest, {files}");
        }
        let missing = Missing {
            lost,
            left_out: self.result.as_ref().map_or(0, |written| written.left_out),
        };
        for remark in missing.remarks() {
            words += &format!("; {remark}");
        }
        words
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(content: Content, deleted: u64, result: Result<Written, String>) -> Report {
        Report {
            file: "box/a.mcap".into(),
            content,
            deleted,
            result,
        }
    }

    #[test]
    fn a_report_says_what_a_file_lacks_and_what_it_has_cost() {
        let content = Content {
            packets: 12,
            lost: 34,
            triggers: 5,
        };
        let written = Written {
            octets: 1500,
            left_out: 6,
        };
        let report = report(content, 2, Ok(written));
        let words = report.in_words();
        for part in [
            "12 packets in box/a.mcap, 1.5 kB; 5 triggers;",
            "deleted the oldest, 2 files;",
            "34 lost packets:",
            "6 messages: in the frames alone",
        ] {
            assert!(words.contains(part), "{words}");
        }
        let numbers = json!({
            "file": "box/a.mcap", "packets": 12, "octets": 1500, "triggers": 5, "lost": 34,
            "left_out": 6, "deleted": 2,
        });
        assert_eq!(report.to_json(), numbers);
    }

    #[test]
    fn a_file_without_remarks_has_a_short_line() {
        let content = Content {
            packets: 1,
            lost: 0,
            triggers: 1,
        };
        let written = Written {
            octets: 100,
            left_out: 0,
        };
        let words = report(content, 0, Ok(written)).in_words();
        assert_eq!(words, "1 packets in box/a.mcap, 100 B");
        let failed = report(content, 1, Err("no space".to_owned())).in_words();
        let expected =
            "box/a.mcap is not written: no space; the disk was full: deleted the oldest, 1 file";
        assert_eq!(failed, expected);
    }
}
