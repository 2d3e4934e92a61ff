//! `jaus-tester`: end-to-end test of a vehicle, and load test of nodes.

mod load;
mod mission;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::logging::Logging;
use jaus_cli::output;

/// Test a vehicle: a mission through all of its components, and load on nodes
#[derive(Parser)]
#[command(name = "jaus-tester", version)]
struct Program {
    #[command(subcommand)]
    command: Command,

    #[command(flatten)]
    logging: Logging,
}

#[derive(Subcommand)]
enum Command {
    Mission(mission::MissionCommand),
    Load(load::LoadCommand),
    #[command(name = load::SUBCOMMAND, hide = true)]
    LoadChild(load::LoadChild),
}

fn main() -> ExitCode {
    let program = Program::parse();
    let outcome = program
        .logging
        .start("warn")
        .and_then(|()| match program.command {
            Command::Mission(mission) => mission.run(),
            Command::Load(load) => load.run(),
            Command::LoadChild(child) => child.run(),
        });
    match outcome {
        Ok(Outcome::Done) | Err(Failure::OutputClosed) => ExitCode::SUCCESS,
        Ok(Outcome::Incomplete) => ExitCode::from(1),
        Ok(Outcome::Broken) => ExitCode::from(2),
        Err(failure) => {
            output::say_as("jaus-tester", failure);
            ExitCode::from(2)
        }
    }
}
