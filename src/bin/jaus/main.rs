//! The command line tool `jaus`: one file per subcommand, over the library's public API only.

mod decode;
mod definitions;
mod demo;
mod discover;
mod encode;
mod failure;
mod network;
mod node;
mod output;
mod query;
mod runtime;
mod tree;

use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};
use tracing_subscriber::EnvFilter;

use failure::{Failure, Outcome};

/// Speak SAE JAUS: run nodes, find and query others, read and write messages.
#[derive(Parser)]
#[command(
    name = "jaus",
    version,
    after_help = "Begin with `jaus demo`: it needs no network, no configuration and no second terminal.\n\n\
        Exit status: 0 all went well; 1 it ran, but something could not be read or did not answer; \
        2 it could not run (wrong flag, missing file, port in use …)."
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
    Node(node::NodeCommand),
    Discover(discover::Discover),
    Query(query::Query),
    Decode(decode::Decode),
    Encode(encode::Encode),
}

#[derive(Args)]
struct Logging {
    /// Say more about what happens inside, on standard error; -vv and -vvv for details
    ///
    /// The environment variable JAUS_LOG chooses by module, for example JAUS_LOG=jaus::endpoint=trace.
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    verbose: u8,
}

impl Logging {
    /// Sends the library's tracing to standard error.
    fn start(&self) {
        let level = match self.verbose {
            0 => "error",
            1 => "info",
            2 => "debug",
            _ => "trace",
        };
        let filter = EnvFilter::try_from_env("JAUS_LOG").unwrap_or_else(|_| EnvFilter::new(level));
        tracing_subscriber::fmt()
            .with_env_filter(filter)
            .with_writer(std::io::stderr)
            .with_ansi(output::colours_wanted(&std::io::stderr()))
            .with_target(self.verbose > 1)
            .init();
    }
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    cli.logging.start();
    let outcome = match cli.command {
        Command::Demo(demo) => demo.run(),
        Command::Node(node) => node.run(),
        Command::Discover(discover) => discover.run(),
        Command::Decode(decode) => decode.run(),
        Command::Encode(encode) => encode.run(),
        Command::Query(query) => query.run(),
    };
    match outcome {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Incomplete) => ExitCode::from(1),
        // Whoever read our output has seen enough, as `head` does.
        Err(Failure::OutputClosed) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("jaus: {failure}");
            ExitCode::from(2)
        }
    }
}
