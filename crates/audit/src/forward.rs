//! Forwards entries to journald, or by syslog (RFC 5424) to another host, where who changes this host's
//! files does not reach them.
#![expect(
    clippy::disallowed_types,
    reason = "the thread of the log owns the socket to another host, which is no link of JAUS"
)]

use std::fmt;
use std::io;
use std::net::{SocketAddr, UdpSocket};
#[cfg(unix)]
use std::os::unix::net::UnixDatagram;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::SystemTime;

use crate::entry::{Entry, Outcome};

/// The socket of journald.
const JOURNALD: &str = "/run/systemd/journal/socket";
/// The UDP port of syslog.
const PORT: u16 = 514;
/// The facility for audits, `log audit` (13), as the upper part of a priority.
const FACILITY: u8 = 13 << 3;

/// Where entries go besides the file.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ForwardTo {
    /// To journald at this socket.
    Journald(PathBuf),
    /// By syslog over UDP to this address.
    Syslog(SocketAddr),
}

/// The text is no place to forward to.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no place to forward to: write journald, or the address of a syslog server such as 10.0.0.5:514"
)]
pub struct ForwardError(String);

impl FromStr for ForwardTo {
    type Err = ForwardError;

    /// Reads `journald`, or an address, by default with port 514.
    fn from_str(text: &str) -> Result<Self, ForwardError> {
        if text == "journald" {
            return Ok(Self::Journald(JOURNALD.into()));
        }
        let whole = text.parse().ok();
        let address = whole.or_else(|| Some(SocketAddr::new(text.parse().ok()?, PORT)));
        address
            .map(Self::Syslog)
            .ok_or_else(|| ForwardError(text.chars().take(60).collect()))
    }
}

impl fmt::Display for ForwardTo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Journald(socket) => write!(f, "{}", socket.display()),
            Self::Syslog(address) => write!(f, "{address}"),
        }
    }
}

/// The open socket. It never waits: what the other side does not take is lost there, which shows in the
/// numbers of the lines.
#[derive(Debug)]
pub(crate) struct Forwarder {
    socket: Socket,
    is_failing: bool,
}

#[derive(Debug)]
enum Socket {
    #[cfg(unix)]
    Journald(UnixDatagram),
    Syslog(UdpSocket),
}

impl Forwarder {
    pub(crate) fn open(to: ForwardTo) -> io::Result<Self> {
        let socket = match to {
            #[cfg(unix)]
            ForwardTo::Journald(path) => {
                let socket = UnixDatagram::unbound()?;
                socket.connect(path)?;
                socket.set_nonblocking(true)?;
                Socket::Journald(socket)
            }
            #[cfg(not(unix))]
            ForwardTo::Journald(_) => return Err(io::ErrorKind::Unsupported.into()),
            ForwardTo::Syslog(address) => {
                let any = match address {
                    SocketAddr::V4(_) => SocketAddr::from(([0; 4], 0)),
                    SocketAddr::V6(_) => SocketAddr::from(([0; 16], 0)),
                };
                let socket = UdpSocket::bind(any)?;
                socket.connect(address)?;
                socket.set_nonblocking(true)?;
                Socket::Syslog(socket)
            }
        };
        Ok(Self {
            socket,
            is_failing: false,
        })
    }

    /// Sends the line of an entry.
    pub(crate) fn send(&mut self, entry: &Entry, line: &str) {
        let sent = self.try_send(entry, line);
        let was_failing = std::mem::replace(&mut self.is_failing, sent.is_err());
        if let Err(error) = sent
            && !was_failing
        {
            tracing::warn!(%error, "an entry of the audit log was not forwarded");
        }
    }

    fn try_send(&self, entry: &Entry, line: &str) -> io::Result<()> {
        match &self.socket {
            #[cfg(unix)]
            Socket::Journald(socket) => socket.send(journald(entry, line).as_bytes())?,
            Socket::Syslog(socket) => socket.send(syslog(entry, line).as_bytes())?,
        };
        Ok(())
    }
}

/// The severity of an entry: notice, warning or error.
const fn severity(entry: &Entry) -> u8 {
    match entry.result {
        Outcome::Allowed => 5,
        Outcome::Refused => 4,
        Outcome::Failed => 3,
    }
}

/// Fields, one in each line: JSON escapes the ends of lines in a text.
#[cfg(unix)]
fn journald(entry: &Entry, json: &str) -> String {
    let priority = severity(entry);
    format!(
        "MESSAGE={json}\nPRIORITY={priority}\nSYSLOG_FACILITY=13\nSYSLOG_IDENTIFIER=jaus-audit\n"
    )
}

/// A message of RFC 5424, without a host name: the server knows the address.
fn syslog(entry: &Entry, json: &str) -> String {
    let (priority, process) = (FACILITY | severity(entry), std::process::id());
    let time: SystemTime = entry.time;
    let time = humantime::format_rfc3339_millis(time);
    format!("<{priority}>1 {time} - jaus-audit {process} - - {json}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry() -> Entry {
        Entry::new("con\nsole", "login", Outcome::Refused)
    }

    fn line() -> String {
        serde_json::to_string(&entry()).unwrap()
    }

    #[cfg(unix)]
    #[test]
    fn journald_gets_fields_whatever_a_text_contains() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("socket");
        let journald = UnixDatagram::bind(&path).unwrap();
        let mut forward = Forwarder::open(ForwardTo::Journald(path)).unwrap();
        forward.send(&entry(), &line());
        let mut octets = [0; 1000];
        let length = journald.recv(&mut octets).unwrap();
        let text = std::str::from_utf8(&octets[..length]).unwrap();
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines.len(), 4, "{text}");
        assert!(
            lines[0].contains(r#""who":"con\\nsole","what":"login""#),
            "{text}"
        );
        assert_eq!(lines[1], "PRIORITY=4");
    }

    #[test]
    fn a_syslog_server_gets_a_message_of_rfc_5424() {
        let server = UdpSocket::bind("127.0.0.1:0").unwrap();
        let to = ForwardTo::Syslog(server.local_addr().unwrap());
        Forwarder::open(to).unwrap().send(&entry(), &line());
        let mut octets = [0; 1000];
        let length = server.recv(&mut octets).unwrap();
        let text = std::str::from_utf8(&octets[..length]).unwrap();
        let words: Vec<_> = text.splitn(8, ' ').collect();
        assert_eq!(words[0], "<108>1", "{text}");
        assert!(words[1].ends_with('Z'), "{text}");
        assert_eq!(&words[2..4], ["-", "jaus-audit"]);
        assert!(words[7].starts_with('{'), "{text}");
    }

    #[test]
    fn a_place_is_a_word_or_an_address() {
        let at = |text: &str| text.parse::<ForwardTo>().map(|it| it.to_string());
        assert_eq!(at("journald").unwrap(), JOURNALD);
        assert_eq!(at("10.0.0.5").unwrap(), "10.0.0.5:514");
        assert_eq!(at("[::1]:1514").unwrap(), "[::1]:1514");
        assert!(
            at("loghost")
                .unwrap_err()
                .to_string()
                .contains("10.0.0.5:514")
        );
    }
}
