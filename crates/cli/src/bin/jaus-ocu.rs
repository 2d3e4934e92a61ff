//! `jaus-ocu`: the operator's station and its page.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use jaus::address::JausId;
use jaus::component::Kind;
use jaus_cli::{Failure, Ready, launch};
use jaus_ocu::{Listen, Station, Token};
use jaus_vehicle::parts::Part;

#[derive(Args)]
struct Flags {
    /// The subsystem of the vehicle to look at [default: the first that is discovered]
    #[arg(long, value_name = "SUBSYSTEM", value_parser = clap::value_parser!(u16).range(1..=65534))]
    vehicle: Option<u16>,

    /// The authority to ask for control with; the greater one wins
    #[arg(long, value_name = "CODE", default_value = "200")]
    authority: u8,

    /// Where the page is, ADDRESS:PORT; other than at a loopback address, whoever changes the
    /// vehicle needs a token [default: 127.0.0.1:8080 or the next port that is free]
    #[arg(long, value_name = "ADDRESS")]
    listen: Option<SocketAddr>,

    /// Take the token from this file of one line, and ask for it on the loopback interface, too
    /// [default: made up and printed if one is needed]
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,

    /// Ask for the token before anything is shown, not only before something is changed
    #[arg(long)]
    token_to_read: bool,

    /// A name under which browsers reach this machine, beside its addresses; may be repeated
    #[arg(long, value_name = "NAME")]
    host: Vec<String>,
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-ocu";
    const ABOUT: &'static str =
        "The operator's station: watch, control and drive a vehicle from a browser";
    const EXAMPLES: &'static str = "Examples:\n  \
        jaus-ocu --loopback                        for a vehicle on this computer\n  \
        jaus-ocu --listen 0.0.0.0:8080             for tablets; prints the address with a token\n  \
        jaus-ocu --listen 0.0.0.0:8080 --token-file /etc/jaus/token --host ocu.local\n  \
        jaus-ocu --vehicle 101 --interface eth0";
    const ID: JausId = JausId::new(42, 1, 1);
    const KIND: Kind = Kind::OperatorControlUnit;
    const SUBSYSTEM: &'static str = "Operator";

    fn part(self) -> Result<impl Part, Failure> {
        let token = self.token_file.as_deref().map(Token::read).transpose();
        let token = token.map_err(|error| Failure::new(format!("--token-file: {error}")))?;
        let listen = self.listen.map_or(Listen::Loopback, Listen::At);
        let is_loopback = self.listen.is_none_or(|it| it.ip().is_loopback());
        if self.token_to_read && token.is_none() && is_loopback {
            return Err(Failure::new(
                "--token-to-read: on the loopback interface there is no token without --token-file; \
                 name a file that holds one",
            ));
        }
        Ok(Station {
            vehicle: self.vehicle,
            authority: self.authority,
            listen,
            token,
            token_to_read: self.token_to_read,
            hosts: self.host,
        })
    }
}

fn main() -> ExitCode {
    launch::<Flags>()
}
