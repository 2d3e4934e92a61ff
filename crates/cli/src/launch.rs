//! Launches a single-component program: flags, settings file, node, shutdown.

use std::convert::Infallible;
use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

use clap::builder::Resettable;
use clap::{ArgMatches, Args, Command, CommandFactory, FromArgMatches, Parser};

use super::failure::{Failure, Outcome};
use super::logging::{self, LevelRequests, Logging};
use super::metrics::{Metrics, MetricsFlags};
use super::network::Network;
use super::runtime::RunFor;
use super::systemd::Systemd;
use super::{exposure, output, reference, runtime, settings};
use jaus::address::JausId;
use jaus::component::Kind;
use jaus::node::{Config, Node};
use jaus_audit::AuditLog;
use jaus_vehicle::parts::{Part, PartError, Slot};

/// The flags of a program with a single [`Part`].
pub trait Ready: Args {
    /// Name of the program, for example `jaus-planner`.
    const PROGRAM: &'static str;
    /// Description in one line.
    const ABOUT: &'static str;
    /// Examples below the help text.
    const EXAMPLES: &'static str;
    /// Id if none is chosen.
    const ID: JausId;
    /// Kind of its subsystem.
    const KIND: Kind = Kind::Vehicle;
    /// Name of its subsystem, unless a flag or the settings file sets one.
    const SUBSYSTEM: &'static str = "G-Bat";

    /// Changes of the node's settings by the flags, if the program runs a node.
    fn for_node(&self) -> impl FnOnce(&mut Config) + 'static {
        |_: &mut Config| {}
    }

    /// Whether the program has entries of its own for the audit log. The others have those of the links of
    /// their node, and leave the log to the program whose node they attach to.
    const AUDITS: bool = false;

    /// Takes the audit log of the program, if there is one.
    fn audit(&mut self, _log: Option<AuditLog>) {}

    /// Creates the component from the flags.
    ///
    /// # Errors
    /// An invalid flag, with its remedy.
    fn part(self) -> Result<impl Part, Failure>;
}

#[derive(Parser)]
#[command(version)]
struct Program<F: Args> {
    #[command(flatten)]
    flags: F,

    /// The subsystem's name, the same for all its components
    #[arg(long, help_heading = Resettable::Reset)]
    name: Option<String>,

    #[command(flatten)]
    run_for: RunFor,

    #[command(flatten)]
    network: Network,

    #[command(flatten)]
    metrics: MetricsFlags,

    #[command(flatten)]
    logging: Logging,
}

/// Log filter without `-v`: warnings of every module, such as an emergency or an unwritable log,
/// and the reports of the parts.
const USUAL: &str = "warn,jaus_vehicle=info,jaus_ocu=info,jaus_ra=info,jaus_zenoh=info,jaus_ros2=info,jaus_cli=info";

/// Runs a program: reads flags and settings, attaches to a node, runs the part until Ctrl-C or
/// SIGTERM, and detaches.
///
/// Exit status: 0 after a signal or Management's Shutdown; 1 it could not continue, or another program has its
/// port; 2 it could not start.
#[must_use]
pub fn launch<F: Ready>() -> ExitCode {
    if std::env::args_os().skip(1).eq([reference::ARGUMENT]) {
        return end::<F>(print_reference::<F>());
    }
    let program = match read::<F>() {
        Ok(program) => program,
        Err(failure) => return end::<F>(Err(failure)),
    };
    let outcome = program.logging.start(USUAL);
    end::<F>(outcome.and_then(|()| program.run()))
}

/// Prints the program's part of the book.
fn print_reference<F: Ready>() -> Result<Outcome, Failure> {
    #[derive(Args)]
    struct NoFlags;
    let others = with_file_help(Program::<NoFlags>::command());
    reference::print(command::<F>(), others)?;
    Ok(Outcome::Done)
}

fn end<F: Ready>(outcome: Result<Outcome, Failure>) -> ExitCode {
    match outcome {
        Ok(Outcome::Done) | Err(Failure::OutputClosed) => ExitCode::SUCCESS,
        Ok(Outcome::Incomplete) => ExitCode::from(1),
        Err(failure) => {
            output::say_as(F::PROGRAM, &failure);
            failure.status()
        }
    }
}

impl<F: Ready> Program<F> {
    fn run(self) -> Result<Outcome, Failure> {
        let for_node = self.flags.for_node();
        let mut flags = self.flags;
        if F::AUDITS {
            flags.audit(self.network.audit()?);
        }
        let mut part = flags.part()?;
        logging::use_level(self.network.log_level()?);
        runtime::run(async {
            let levels = LevelRequests::accept(self.network.file());
            let place = self.network.join(F::ID, for_node, part.links());
            let until = self.run_for.end();
            tokio::pin!(until);
            let place = tokio::select! {
                place = place => place?,
                () = &mut until => return Ok(Outcome::Done),
            };
            let metrics = Metrics::open(self.metrics, place.identity.metrics).await?;
            let node = place.stay.node();
            let port = place.port;
            tell_place(port.id(), node.as_ref());
            let kind = place.identity.kind.map_or(F::KIND, Kind::from);
            let name = self.name.or(place.identity.name);
            let name = name.unwrap_or_else(|| F::SUBSYSTEM.to_owned());
            let slot = Slot::new(port, node.clone(), kind, name);
            let telemetry = slot.telemetry.clone();
            let systemd = Systemd::from_environment();
            let outcome = tokio::select! {
                result = part.run(slot) => {
                    let Err(error): Result<Infallible, _> = result;
                    let outcome = match error {
                        PartError::ShutDown => Outcome::Done,
                        _ => Outcome::Incomplete,
                    };
                    output::say_as(F::PROGRAM, error);
                    outcome
                }
                () = systemd.watch() => Outcome::Done,
                () = metrics.run(node, telemetry.clone()) => Outcome::Done,
                () = levels.follow() => Outcome::Done,
                () = &mut until => Outcome::Done,
            };
            systemd.stopping();
            telemetry.release();
            place.stay.end().await;
            Ok(outcome)
        })
    }
}

/// Prints the id and the node.
fn tell_place(id: JausId, node: Option<&Node>) {
    let Some(node) = node else {
        tracing::info!("{id} attached to the node of this host");
        return;
    };
    for link in node.links() {
        tracing::info!("{id} on {}, UDP {}", link.interface.name, link.local);
    }
    exposure::tell(node);
}

/// Parses flags and settings file; help, version and mistakes end the process here.
fn read<F: Ready>() -> Result<Program<F>, Failure> {
    let given: Vec<OsString> = std::env::args_os().collect();
    let matches = command::<F>().get_matches_from(&given);
    let program = parse::<F>(&matches);
    let Some(file) = program.network.file() else {
        return Ok(program);
    };
    let from_file = settings::flags(file)?;
    if from_file.is_empty() {
        return Ok(program);
    }
    // Command line flags come later and therefore win.
    let (name, rest) = given
        .split_first()
        .map_or((None, &[][..]), |(n, r)| (Some(n), r));
    let all = name
        .cloned()
        .into_iter()
        .chain(from_file.into_iter().map(OsString::from));
    let all = all.chain(rest.iter().cloned());
    let matches = command::<F>()
        .try_get_matches_from(all)
        .map_err(|error| in_file(file, &error))?;
    Ok(parse::<F>(&matches))
}

fn command<F: Ready>() -> Command {
    with_file_help(Program::<F>::command())
        .name(F::PROGRAM)
        .about(F::ABOUT)
        .long_about(None)
        .after_help(F::EXAMPLES)
        .args_override_self(true)
        .mut_arg("id", |id| id.help(id_help(F::ID)))
}

fn with_file_help(command: Command) -> Command {
    command.mut_arg("config", |config| {
        config
            .help(FILE_HELP)
            .long_help(format!("{FILE_HELP}\n\n{FILE_EXAMPLE}"))
    })
}

fn id_help(usual: JausId) -> String {
    format!(
        "Our id, SUBSYSTEM.NODE.COMPONENT; with --attach, subsystem and node are those of the \
         host's node [default: {usual}; with --attach component {}]",
        usual.component()
    )
}

const FILE_HELP: &str = "Read settings from a TOML file; flags take precedence";

const FILE_EXAMPLE: &str = r#"For example:
  id = "101.1.1"                  # our id
  name = "Rover"                  # the subsystem's name
  interfaces = ["eth0"]           # or "all", or "loopback"
  port = 3794
  group = "239.255.0.1:3794"      # or "off"
  peers = ["192.168.7.2", "102.255.255@192.168.7.3:3795"]

  [component]                     # the flags above, by their long names
  attach = true
  for = "1h""#;

fn parse<F: Ready>(matches: &ArgMatches) -> Program<F> {
    // The matches belong to this command, so only a mistake in its definition can fail.
    Program::from_arg_matches(matches).unwrap_or_else(|error| error.exit())
}

/// Formats a mistake in the file's table `[component]` like one on the command line.
fn in_file(file: &Path, error: &clap::Error) -> Failure {
    let text = error.to_string();
    let text = text.strip_prefix("error: ").unwrap_or(&text);
    let told: Vec<_> = text
        .lines()
        .map(str::trim)
        .take_while(|line| !line.starts_with("Usage:"))
        .filter(|line| !line.is_empty())
        .collect();
    Failure::new(format!(
        "{}: in [component], which takes flags by their long names: {}",
        file.display(),
        told.join("; ")
    ))
}

#[cfg(test)]
mod tests {
    use tracing_subscriber::filter::Targets;

    use super::*;

    #[test]
    fn warnings_of_every_module_are_logged_without_a_flag() {
        let usual: Targets = USUAL.parse().unwrap();
        for target in ["jaus::service::control", "jaus_view::log", "jaus::endpoint"] {
            assert!(
                usual.would_enable(target, &tracing::Level::WARN),
                "{target}"
            );
            assert!(
                !usual.would_enable(target, &tracing::Level::INFO),
                "{target}"
            );
        }
        assert!(usual.would_enable("jaus_vehicle::parts::planner", &tracing::Level::INFO));
    }
}
