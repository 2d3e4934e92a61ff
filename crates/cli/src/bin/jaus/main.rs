//! The command line tool `jaus`: one file per subcommand, over the library's public API only.
#![warn(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "they panic when the reader is gone; see `output`"
)]

mod audit;
mod control;
mod convert;
mod debug_view;
mod decode;
mod definitions;
mod demo;
mod discover;
mod doctor;
#[cfg(target_os = "linux")]
mod drive;
mod encode;
mod events;
mod examine;
mod jsidl;
mod judge;
#[cfg(feature = "secure")]
mod keys;
mod lease;
mod list;
mod load;
mod manual;
mod monitor;
mod node;
mod offers;
mod packets;
mod ping;
mod queries;
mod query;
mod record;
mod recordings;
mod replay;
mod send;
mod subscribe;
mod terminal;
mod test;
#[cfg(target_os = "linux")]
mod up;
mod uptake;
mod users;
mod vehicle;
mod view;
mod watch;

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use jaus_cli::failure::Failure;
use jaus_cli::logging::Logging;
use jaus_cli::output;

/// Speak SAE JAUS: run nodes, find and query others, read and write messages.
#[derive(Parser)]
#[command(
    name = "jaus",
    version,
    after_help = "Start with `jaus demo`: it needs no network, configuration or second \
        terminal.\n\n\
        Exit status: 0 success; 1 a negative result: no answer, control not granted, a failed check, \
        unreadable input, a node's port in use; 2 it could not run: wrong flag, missing file."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    logging: Logging,
}

#[derive(Subcommand)]
enum Command {
    Demo(demo::Demo),
    #[cfg(target_os = "linux")]
    Up(up::Up),
    #[cfg(target_os = "linux")]
    #[command(name = up::leash::NAME, hide = true)]
    Leash(up::leash::Leash),
    #[cfg(target_os = "linux")]
    #[command(name = up::warden::NAME, hide = true)]
    Warden(up::warden::Warden),
    #[cfg(feature = "secure")]
    Keys(keys::Keys),
    Users(users::UsersCommand),
    Audit(audit::AuditCommand),
    Node(node::NodeCommand),
    Vehicle(vehicle::VehicleCommand),
    Monitor(monitor::Monitor),
    Watch(watch::Watch),
    Discover(discover::Discover),
    Doctor(doctor::Doctor),
    Examine(examine::Examine),
    Ping(ping::Ping),
    Judge(judge::Judge),
    Test(test::TestCommand),
    Load(load::LoadCommand),
    #[command(name = load::SUBCOMMAND, hide = true)]
    LoadChild(load::LoadChild),
    List(list::List),
    Query(query::Query),
    Subscribe(subscribe::Subscribe),
    Send(send::Send),
    Control(control::ControlCommand),
    #[cfg(target_os = "linux")]
    Drive(drive::Drive),
    Record(record::Record),
    Replay(replay::Replay),
    Convert(convert::Convert),
    View(view::View),
    Decode(decode::Decode),
    Encode(encode::Encode),
    Jsidl(jsidl::Jsidl),
    Completions(manual::Completions),
    Man(manual::Man),
    #[command(hide = true)]
    Reference(manual::Reference),
}

impl Command {
    fn run(self) -> Result<ExitCode, Failure> {
        let outcome = match self {
            Self::Demo(demo) => demo.run(),
            #[cfg(target_os = "linux")]
            Self::Up(up) => up.run(),
            #[cfg(target_os = "linux")]
            Self::Leash(leash) => leash.run(),
            #[cfg(target_os = "linux")]
            Self::Warden(warden) => warden.run(),
            #[cfg(feature = "secure")]
            Self::Keys(keys) => keys.run(),
            Self::Users(users) => users.run(),
            Self::Audit(audit) => audit.run(),
            Self::Node(node) => node.run(),
            Self::Vehicle(vehicle) => vehicle.run(),
            Self::Monitor(monitor) => monitor.run(),
            Self::Watch(watch) => watch.run(),
            Self::Discover(discover) => discover.run(),
            Self::Doctor(doctor) => doctor.run(),
            Self::Examine(examine) => examine.run(),
            Self::Ping(ping) => ping.run(),
            Self::Judge(judge) => judge.run(),
            Self::Test(test) => test.run(),
            Self::Load(load) => load.run(),
            Self::LoadChild(child) => child.run(),
            Self::List(list) => list.run(),
            Self::Query(query) => query.run(),
            Self::Subscribe(subscribe) => subscribe.run(),
            Self::Send(send) => send.run(),
            Self::Control(control) => control.run(),
            #[cfg(target_os = "linux")]
            Self::Drive(drive) => drive.run(),
            Self::Record(record) => record.run(),
            Self::Replay(replay) => replay.run(),
            Self::Convert(convert) => convert.run(),
            Self::View(view) => view.run(),
            Self::Decode(decode) => decode.run(),
            Self::Encode(encode) => encode.run(),
            Self::Jsidl(jsidl) => return jsidl.run(),
            Self::Completions(completions) => completions.run(Cli::command()),
            Self::Man(man) => man.run(Cli::command()),
            Self::Reference(reference) => reference.run(Cli::command()),
        };
        outcome.map(ExitCode::from)
    }
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let ended = cli.logging.start("warn").and_then(|()| cli.command.run());
    match ended {
        Ok(status) => status,
        Err(failure) => {
            // Otherwise the reader has closed our output early, as `head` does.
            if !matches!(failure, Failure::OutputClosed) {
                output::say(&failure);
            }
            failure.status()
        }
    }
}
