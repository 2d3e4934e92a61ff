//! `jaus jsidl explain`: explains the octets of a message or datagram, one by one.

use std::cell::LazyCell;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bytes::Bytes;
use clap::Args;
use jaus::wire::ra::RaId;
use jaus::wire::{Frame, Version, judp};
use jaus_cli::failure::Failure;
use jaus_cli::output::Output;
use jsidl::Library;
use jsidl::explain::{Explanation, ServiceName, Unexplained, explain, table};
use jsidl::model::Id;

use super::datagram::Datagram;
use super::ra::ReferenceArchitecture;
use super::sources::{self, Sources};

/// Maximum number of octets: a datagram has at most 65,507, a large message rarely more than this.
const MOST: u64 = 4 << 20;

/// Explain a message octet by octet: an annotated hex dump
///
/// Shows the octets, their field, the integer on the wire and its value, absent optional fields,
/// and where decoding stops on an error. A whole JUDP datagram is recognised by its header, which
/// is explained too. The header also identifies messages of the Reference Architecture (OpenJAUS
/// 3.x), which has other layouts for the same codes.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus jsidl explain 002B02\n  \
    jaus jsidl explain 02 00 11 00 09 ff ff ff ff 07 01 e8 03 00 2b 02 00 00\n  \
    jaus jsidl explain message.bin --jsidl my-services/\n  \
    jaus jsidl explain --service urn:jaus:jss:core:Time@1.0 11 40 40 e2 01 00\n  \
    jaus jsidl explain --ra 02 44 01 00 aa aa aa 2a\n  \
    jaus jsidl explain --json - < message.hex | jq .rows\n\n\
    Exit status: 0 decoded completely; 1 decoding stopped; 2 unknown message.")]
pub(crate) struct Arguments {
    /// Hexadecimal digits, or a file of such digits or of octets; - is standard input
    #[arg(required = true, value_name = "HEX|FILE")]
    input: Vec<String>,

    /// Add the service definitions of a JSIDL file or directory (repeatable)
    #[arg(long, value_name = "PATH")]
    jsidl: Vec<PathBuf>,

    /// The service to prefer where several define the same message code, with or without its
    /// version
    #[arg(long, value_name = "URN[@VERSION]")]
    service: Option<String>,

    /// Explain a bare message by the definitions of the Reference Architecture (RA 3.x)
    #[arg(long)]
    ra: bool,

    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let octets = octets(&arguments.input)?;
    // A client service has the messages of another, so that it is only used if it is wanted.
    let Sources { loaded, .. } = match arguments.service {
        Some(_) => sources::load_with_clients(&arguments.jsidl)?,
        None => sources::load(&arguments.jsidl)?,
    };
    let explainer = Explainer {
        library: loaded.library,
        ra: LazyCell::new(ReferenceArchitecture::load),
        by_ra: arguments.ra,
        service: arguments
            .service
            .as_deref()
            .map(|name| name.parse().map_err(|error| wrong(name, &error)))
            .transpose()?,
    };
    let (complete, text) = match Datagram::recognised(&octets) {
        Some(datagram) => explainer.datagram(&datagram, arguments.json)?,
        None => explainer.message(&octets, arguments.json)?,
    };
    Output::new().part(&text)?;
    Ok(ExitCode::from(u8::from(!complete)))
}

fn wrong(name: &str, error: &Unexplained) -> Failure {
    Failure::new(format!("--service {name}: {error}"))
}

struct Explainer {
    library: Library,
    ra: LazyCell<ReferenceArchitecture>,
    /// Whether ambiguous messages are taken for the Reference Architecture.
    by_ra: bool,
    service: Option<ServiceName>,
}

impl Explainer {
    /// Explains a bare message: whether it was completely readable, and the output.
    fn message(&self, octets: &Bytes, json: bool) -> Result<(bool, String), Failure> {
        let explained = if self.by_ra {
            self.explain_as_ra(octets)
        } else {
            self.explain(octets)
        };
        let explanation = explained.map_err(|error| {
            // An input that begins like a datagram is rather a damaged one than an unknown message.
            let error = match damaged(octets) {
                Some(damage) => format!("{error}; as a JUDP datagram: {damage}"),
                None => error.to_string(),
            };
            Failure::new(match self.hint(octets) {
                Some(hint) => format!("{error}; {hint}"),
                None => error,
            })
        })?;
        let complete = explanation.stop.is_none();
        if json {
            return Ok((complete, format!("{}\n", explanation.to_json())));
        }
        let mut text = format!("{}\n\n{}", title(&explanation), table(&explanation.rows));
        text.push_str(&remarks(&explanation));
        if let Some(damage) = damaged(octets).filter(|_| !complete) {
            text.push_str(&format!("\nIt is not a JUDP datagram either: {damage}\n"));
        }
        if let Some(hint) = self.hint(octets).filter(|_| !complete) {
            text.push_str(&format!("\nBut {hint}\n"));
        }
        Ok((complete, text))
    }

    /// A hint for an unreadable message, if the Reference Architecture defines it.
    fn hint(&self, octets: &Bytes) -> Option<&'static str> {
        let of_ra = !self.by_ra && self.explain_as_ra(octets).is_ok_and(|it| it.stop.is_none());
        of_ra.then_some(
            "it is a valid message of the Reference Architecture (OpenJAUS 3.x): add --ra",
        )
    }

    fn datagram(&self, datagram: &Datagram, json: bool) -> Result<(bool, String), Failure> {
        let (rows, messages) = datagram.rows(|frame| self.framed(frame).map_err(Failure::of))?;
        let complete = messages.iter().all(|message| message.stop.is_none());
        if json {
            let mut messages: Vec<_> = messages.iter().map(Explanation::to_json).collect();
            for message in &mut messages {
                message.as_object_mut().map(|object| object.remove("rows"));
            }
            let rows: Vec<_> = rows.iter().map(jsidl::explain::Row::to_json).collect();
            let object = serde_json::json!({
                "transport": datagram.version().name(),
                "messages": messages,
                "rows": rows,
            });
            return Ok((complete, format!("{object}\n")));
        }
        let mut text = format!("{}\n", datagram.title());
        for message in &messages {
            text.push_str(&format!("{}\n", title(message)));
        }
        text.push_str(&format!("\n{}", table(&rows)));
        for message in &messages {
            text.push_str(&remarks(message));
        }
        Ok((complete, text))
    }

    /// Explains a frame's message by the definitions that its header and source indicate; `None` if
    /// these do not know it, and no others are requested.
    fn framed(&self, frame: &Frame) -> Result<Option<Explanation>, Unexplained> {
        let older = frame.version != Version::As5669a;
        let as_ra = (older && self.by_ra || RaId::in_header(frame.version, frame.source).is_some())
            .then(|| self.explain_as_ra(&frame.payload))
            .and_then(Result::ok);
        let is_sure = frame.version == Version::Ra || self.by_ra;
        match as_ra {
            Some(of_ra) if is_sure || of_ra.stop.is_none() => Ok(Some(of_ra)),
            None if is_sure && older && self.service.is_none() => Ok(None),
            // A message of the services may come from a subsystem that looks like one of the
            // Reference Architecture.
            of_ra => match (self.explain(&frame.payload), of_ra) {
                (Ok(other), Some(of_ra)) if other.stop.is_some() => Ok(Some(of_ra)),
                (Err(_), Some(of_ra)) => Ok(Some(of_ra)),
                (other, _) => other.map(Some),
            },
        }
    }

    fn explain(&self, octets: &[u8]) -> Result<Explanation, Unexplained> {
        explain(&self.library, octets, self.service.as_ref())
    }

    fn explain_as_ra(&self, octets: &Bytes) -> Result<Explanation, Unexplained> {
        self.ra.explain(octets, self.service.as_ref())
    }
}

/// Why octets that begin like a datagram are none. In the two current transports, the octet after
/// the version is always 0.
fn damaged(octets: &Bytes) -> Option<String> {
    if octets.get(1) != Some(&0) {
        return None;
    }
    let first = judp::frames(octets.clone()).ok()?.next()?;
    first.err().map(|error| error.to_string())
}

/// For example `QueryIdentification 2B00h of urn:jaus:jss:core:Discovery@1.1`.
fn title(explanation: &Explanation) -> String {
    format!(
        "{} {:04X}h of {}",
        explanation.message,
        explanation.code,
        in_words(&explanation.service)
    )
}

/// A service as `--service` takes it.
fn in_words(service: &Id) -> String {
    format!("{}@{}", service.urn, service.version)
}

/// Where decoding stopped, and other services that define the code.
fn remarks(explanation: &Explanation) -> String {
    let mut text = String::new();
    if let Some(stop) = &explanation.stop {
        text.push_str(&format!(
            "\nDecoding stopped: {stop}, counted from the message code\n"
        ));
    }
    if !explanation.others.is_empty() {
        let others: Vec<_> = explanation.others.iter().map(in_words).collect();
        text.push_str(&format!(
            "\nOther services define {:04X}h differently; choose with --service: {}\n",
            explanation.code,
            others.join(", ")
        ));
    }
    text
}

/// Reads octets from files, standard input or the command line.
fn octets(input: &[String]) -> Result<Bytes, Failure> {
    let content = match input {
        [only] if only == "-" => read(io::stdin(), Path::new("standard input"))?,
        [only] if Path::new(only).is_file() => {
            let path = Path::new(only);
            let file = File::open(path).map_err(|error| Failure::file(path, &error))?;
            read(file, path)?
        }
        written => {
            let octets = from_hex(&written.join(" "))?;
            return Ok(octets.into());
        }
    };
    // Octets that happen to be digits only are no known message.
    let text = std::str::from_utf8(&content).ok();
    let octets = text.and_then(|text| from_hex(text).ok());
    Ok(octets.unwrap_or(content).into())
}

fn read(input: impl Read, path: &Path) -> Result<Vec<u8>, Failure> {
    let mut content = Vec::new();
    input
        .take(MOST + 1)
        .read_to_end(&mut content)
        .map_err(|error| Failure::file(path, &error))?;
    if content.len() as u64 > MOST {
        return Err(Failure::new(format!(
            "{} is larger than {} MiB; give the octets of one message or datagram",
            path.display(),
            MOST >> 20
        )));
    }
    Ok(content)
}

/// Digits with blanks, commas, colons or `0x` between octets.
fn from_hex(text: &str) -> Result<Vec<u8>, Failure> {
    let plain = text.replace("0x", " ").replace([',', ':'], " ");
    let octets = jaus_view::from_hex(&plain).map_err(|error| {
        Failure::new(format!(
            "{text} is neither a file nor hexadecimal digits: {error}"
        ))
    })?;
    Ok(octets)
}
