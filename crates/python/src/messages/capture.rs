//! Messages of a capture file, for `jaus.capture`.
//!
//! A thread reads the file and decodes; Python takes the records from a short queue. So memory has a
//! bound, and a reader that Python drops ends its thread.

use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Mutex, OnceLock};
use std::thread;
use std::time::Duration;

use jaus_view::{Capture, Dictionary, Entry, Filter, Line, MessageStream, Network, Timestamp};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use super::errors::exception;

/// Records that wait for Python.
const MOST_WAITING: usize = 256;

/// The interval at which a waiting reader notices Ctrl-C.
const SIGNAL_CHECK: Duration = Duration::from_millis(100);

/// The definitions of the package.
static BUILT_IN: OnceLock<Dictionary> = OnceLock::new();

/// A message, or an error of the capture.
struct Record {
    time: Option<Timestamp>,
    /// Source and destination, each with address and port.
    addresses: Option<[(String, u16); 2]>,
    entry: Entry,
}

/// Reads the messages of a pcap or pcapng file.
#[pyclass(frozen, module = "jaus._jaus")]
pub(super) struct CaptureReader {
    /// `None` comes last.
    records: Mutex<Receiver<Option<Record>>>,
    is_finished: AtomicBool,
}

/// A record for Python: seconds and nanoseconds since 1970; source, destination; their addresses;
/// octets; whether they have a definition; error; the JSON line.
type Fields<'py> = (
    Option<(i64, u32)>,
    [Option<String>; 2],
    Option<[(String, u16); 2]>,
    Option<Bound<'py, PyBytes>>,
    bool,
    Option<String>,
    String,
);

#[pymethods]
impl CaptureReader {
    /// Opens a capture. `filter` selects messages as in `jaus watch`; `definitions` are files and
    /// directories of further services.
    #[new]
    #[expect(
        clippy::needless_pass_by_value,
        reason = "Python's paths are converted"
    )]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        filter: &str,
        definitions: Vec<PathBuf>,
    ) -> PyResult<Self> {
        let filter: Filter = filter
            .parse()
            .map_err(|error| PyValueError::new_err(format!("{filter}: {error}")))?;
        let file = BufReader::new(File::open(&path)?);
        let capture = py.detach(|| Capture::new(file)).map_err(|error| {
            let text = (format!("{}: {error}", path.display()),);
            exception(py, "CaptureError", text)
        })?;
        let (sender, receiver) = sync_channel(MOST_WAITING);
        thread::Builder::new()
            .name("jaus capture".to_owned())
            .spawn(move || {
                read(capture, filter, &definitions, &sender);
                // Python may have dropped the reader.
                let _ = sender.send(None);
            })?;
        Ok(Self {
            records: Mutex::new(receiver),
            is_finished: AtomicBool::new(false),
        })
    }

    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<Fields<'py>>> {
        loop {
            let next = py.detach(|| {
                let records = self.records.lock().ok()?;
                Some(records.recv_timeout(SIGNAL_CHECK))
            });
            match next {
                Some(Ok(Some(record))) => return Ok(Some(record.fields(py))),
                Some(Ok(None)) => self.is_finished.store(true, Ordering::Relaxed),
                Some(Err(RecvTimeoutError::Timeout)) => py.check_signals()?,
                _ if self.is_finished.load(Ordering::Relaxed) => return Ok(None),
                _ => return Err(PyRuntimeError::new_err("reading the capture has failed")),
            }
        }
    }
}

impl Record {
    fn fields<'py>(self, py: Python<'py>) -> Fields<'py> {
        let entry = &self.entry;
        let text = |key: &str| entry.text(key).map(str::to_owned);
        let octets = entry.octets.as_ref();
        (
            self.time.map(|time| (time.seconds(), time.subsec_nanos())),
            [text("source"), text("destination")],
            self.addresses,
            octets.map(|octets| PyBytes::new(py, octets)),
            entry.json().contains_key("body"),
            text("error"),
            entry.to_json(),
        )
    }
}

/// Reads the capture to its end, or until no one takes the records any more.
fn read(
    mut capture: Capture<BufReader<File>>,
    filter: Filter,
    definitions: &[PathBuf],
    records: &SyncSender<Option<Record>>,
) {
    let with_own;
    let dictionary = if definitions.is_empty() {
        BUILT_IN.get_or_init(|| Dictionary::new().with_catalogue())
    } else {
        let mut dictionary = Dictionary::new();
        dictionary.load(definitions);
        with_own = dictionary;
        &with_own
    };
    let mut stream = MessageStream::new(dictionary, filter);
    let mut network = Network::by_content();
    while let Some(frame) = capture.next_frame() {
        let found = match frame {
            Ok(frame) => {
                let datagrams = network.handle_frame(&frame).into_iter();
                let found = datagrams.flat_map(|datagram| {
                    let ends = [datagram.source, datagram.destination];
                    let addresses = ends.map(|it| (it.ip().to_string(), it.port()));
                    let entries = stream.read_datagram(frame.time, &datagram).into_iter();
                    entries.map(move |entry| Record {
                        time: frame.time,
                        addresses: Some(addresses.clone()),
                        entry,
                    })
                });
                found.collect()
            }
            Err(error) => vec![Record {
                time: None,
                addresses: None,
                entry: Entry::from(&Line::from(&error)),
            }],
        };
        for record in found {
            if records.send(Some(record)).is_err() {
                return;
            }
        }
    }
}
