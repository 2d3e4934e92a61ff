//! The journal's current file in either format, and its rotation.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;
use std::sync::PoisonError;
use std::sync::atomic::Ordering;
use std::time::Duration;

use super::directory::Directory;
use super::packets::{Packet, Packets};
use super::{JournalSettings, Numbers};
use crate::capture::{CaptureWriter, InterfaceNumber, LinkType};
use crate::stream::{Links, MessageStream, timestamp};
use crate::time::Timestamp;
use jaus::node::Passage;

/// Maximum overhead per packet in a capture, in octets: its block, a description of a new
/// interface, and the loss comment.
const AROUND: u64 = 512;

#[derive(Debug)]
pub(super) struct Sink {
    directory: Directory,
    file_limit: u64,
    file_age: Duration,
    links: Links,
    packets: Packets,
    open: Option<Open>,
    written: u64,
    lost: u64,
    /// Number of lost items not yet recorded in the log.
    untold: u64,
}

#[derive(Debug)]
struct Open {
    path: PathBuf,
    since: Timestamp,
    /// The same file, for syncing to disk.
    file: File,
    form: Form,
}

#[derive(Debug)]
enum Form {
    Capture {
        writer: CaptureWriter<BufWriter<File>>,
        interfaces: BTreeMap<String, InterfaceNumber>,
    },
    Lines {
        writer: BufWriter<File>,
        octets: u64,
    },
}

impl Sink {
    pub(super) fn new(directory: Directory, settings: &JournalSettings, links: Links) -> Self {
        Self {
            directory,
            file_limit: settings.file_limit,
            file_age: settings.file_age,
            links,
            packets: Packets::default(),
            open: None,
            written: 0,
            lost: 0,
            untold: 0,
        }
    }

    /// Records a loss.
    pub(super) fn lose(&mut self, count: u64) {
        self.lost += count;
        self.untold += count;
    }

    pub(super) fn tell(&self, numbers: &Numbers) {
        numbers.written.store(self.written, Ordering::Relaxed);
        numbers.lost.store(self.lost, Ordering::Relaxed);
        let path = self.open.as_ref().map(|open| &open.path);
        let mut file = numbers.file.write().unwrap_or_else(PoisonError::into_inner);
        if file.as_ref() != path {
            *file = path.cloned();
        }
    }

    /// Writes the packets of a passage.
    pub(super) fn write_packets(&mut self, passage: &Passage) -> io::Result<()> {
        let time = timestamp(passage.time);
        for packet in self.packets.of(passage, &mut self.links) {
            self.write_packet(time, &packet)?;
        }
        Ok(())
    }

    fn write_packet(&mut self, time: Timestamp, packet: &Packet) -> io::Result<()> {
        self.make_room(time, packet.octets.len() as u64 + AROUND, true)?;
        let Some(Open {
            form: Form::Capture { writer, interfaces },
            ..
        }) = &mut self.open
        else {
            return Ok(());
        };
        let on = match interfaces.get(&packet.interface) {
            Some(&on) => on,
            None => {
                let name: String = packet.interface.chars().take(64).collect();
                let on = writer.add_interface(&name, LinkType::RAW)?;
                interfaces.insert(packet.interface.clone(), on);
                on
            }
        };
        writer.write_after_loss(on, time, &packet.octets, self.untold)?;
        self.untold = 0;
        self.written += 1;
        Ok(())
    }

    /// Writes the messages of a passage.
    pub(super) fn write_lines(
        &mut self,
        passage: &Passage,
        messages: &mut MessageStream<'_>,
    ) -> io::Result<()> {
        let time = timestamp(passage.time);
        for entry in messages.read_passage(passage, &mut self.links) {
            let line = entry.to_json();
            if line.len() as u64 + AROUND > self.file_limit {
                self.lose(1);
                continue;
            }
            self.write_line(time, &line)?;
        }
        Ok(())
    }

    fn write_line(&mut self, time: Timestamp, line: &str) -> io::Result<()> {
        let lost = match self.untold {
            0 => String::new(),
            lost => format!("{{\"lost\":{lost}}}\n"),
        };
        let length = (lost.len() + line.len() + 1) as u64;
        self.make_room(time, length, false)?;
        if let Some(Open {
            form: Form::Lines { writer, octets },
            ..
        }) = &mut self.open
        {
            writeln!(writer, "{lost}{line}")?;
            *octets += length;
            self.untold = 0;
            self.written += 1;
        }
        Ok(())
    }

    /// Flushes all data to the operating system.
    pub(super) fn flush(&mut self) -> io::Result<()> {
        match &mut self.open {
            Some(open) => open.flush(),
            None => Ok(()),
        }
    }

    /// Ends the file and syncs it to disk.
    pub(super) fn end(&mut self) -> io::Result<()> {
        let Some(mut open) = self.open.take() else {
            return Ok(());
        };
        self.directory.note_length(open.octets());
        open.flush()?;
        open.file.sync_data()
    }

    /// Abandons a file that cannot be written, and drops the current item.
    pub(super) fn give_up(&mut self) {
        self.lose(1);
        if let Some(open) = self.open.take() {
            self.directory.note_length(open.octets());
        }
    }

    /// Ensures an open file that is young enough and has room for `octets`.
    fn make_room(&mut self, time: Timestamp, octets: u64, capture: bool) -> io::Result<()> {
        let fits = self.open.as_ref().is_some_and(|open| {
            let age = time.seconds().saturating_sub(open.since.seconds());
            // A file does not become old when the clock is set back.
            let is_young = age < i64::try_from(self.file_age.as_secs()).unwrap_or(i64::MAX);
            is_young && open.octets() + octets <= self.file_limit
        });
        if fits {
            return Ok(());
        }
        self.end()?;
        let (file, path) = self.directory.begin(time)?;
        let writer = BufWriter::new(file.try_clone()?);
        let form = if capture {
            let program = concat!("jaus ", env!("CARGO_PKG_VERSION"));
            Form::Capture {
                writer: CaptureWriter::new(writer, program)?,
                interfaces: BTreeMap::new(),
            }
        } else {
            Form::Lines { writer, octets: 0 }
        };
        self.open = Some(Open {
            path,
            since: time,
            file,
            form,
        });
        Ok(())
    }
}

impl Open {
    fn octets(&self) -> u64 {
        match &self.form {
            Form::Capture { writer, .. } => writer.written(),
            Form::Lines { octets, .. } => *octets,
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.form {
            Form::Capture { writer, .. } => writer.flush(),
            Form::Lines { writer, .. } => writer.flush(),
        }
    }
}
