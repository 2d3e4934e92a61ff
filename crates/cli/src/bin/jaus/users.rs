//! `jaus users`: the users of the operator's page.

use std::io::{self, IsTerminal as _};
use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::folders::{config_folder, make_folder_of};
use jaus_cli::output::{Output, say};
use jaus_ocu::users::{self, PasswordHash, User, UserRole, UsersFile};
use serde_json::json;

use crate::terminal::ask_twice;
use crate::uptake::with_uptake;

/// Choose the users of the operator's page
///
/// `jaus-ocu --users FILE` requires them to log in. A running station notices a change within a
/// second, and ends the sessions of users that were removed. A command that changes the file waits
/// for all running stations that use it, and says whether they have taken the change.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus users add anna --role administer\n  \
    jaus users add ben --role drive < password.txt\n  \
    jaus users list\n  \
    jaus users remove ben\n\n\
    Exit status: 0 done, and every running station that uses the file has taken the change; 1 the \
    file is changed, but a station has not taken the change within 2 s, or it cannot be confirmed; \
    also 1 if there was nothing to remove or list; 2 the file is not changed.")]
pub(crate) struct UsersCommand {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Add a user; the password is read twice from the terminal, or once from standard input
    Add(Add),
    /// List the users and their roles
    List(List),
    /// Remove a user; the user's sessions end
    Remove(Remove),
}

#[derive(Args)]
struct File {
    /// The file of the users [default: ~/.config/jaus/users]
    #[arg(long, value_name = "FILE")]
    users: Option<PathBuf>,
}

#[derive(Args)]
struct Add {
    /// The name: 1 to 32 letters, digits and -._@
    name: String,

    /// What the user may do; each role includes those before it
    #[arg(long)]
    role: Role,

    #[command(flatten)]
    file: File,
}

#[derive(Args)]
struct Remove {
    /// The user's name
    name: String,

    #[command(flatten)]
    file: File,
}

#[derive(Args)]
struct List {
    /// Print JSON, one object on a line
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    file: File,
}

/// The roles as values of the flag.
#[derive(Clone, Copy, ValueEnum)]
enum Role {
    /// See everything, and change nothing
    Observe,
    /// Take control of vehicles, drive them, and send them on missions
    Drive,
    /// See who is logged in, and end their sessions
    Administer,
}

impl From<Role> for UserRole {
    fn from(role: Role) -> Self {
        match role {
            Role::Observe => Self::Observe,
            Role::Drive => Self::Drive,
            Role::Administer => Self::Administer,
        }
    }
}

impl UsersCommand {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        match &self.action {
            Action::Add(it) => it.run(),
            Action::List(it) => it.run(),
            Action::Remove(it) => it.run(),
        }
    }
}

impl File {
    fn path(&self) -> Result<PathBuf, Failure> {
        let usual = || config_folder().map(|folder| folder.join("users"));
        self.users.clone().or_else(usual).ok_or_else(|| {
            Failure::new("there is no home directory: name the file of the users with --users")
        })
    }
}

impl Add {
    fn run(&self) -> Result<Outcome, Failure> {
        let path = self.file.path()?;
        make_folder_of(&path)?;
        let password = read_password()?;
        let user = User {
            name: self.name.clone(),
            role: self.role.into(),
            password: PasswordHash::of(&password).map_err(Failure::of)?,
        };
        with_uptake(&path, || {
            users::add(&path, &user).map_err(Failure::of)?;
            say(format_args!(
                "{} may {}; users log in to a station that runs with: jaus-ocu --users {}",
                user.name,
                user.role,
                path.display()
            ));
            Ok(())
        })
    }
}

/// Reads a password twice from the terminal, or a line of standard input.
fn read_password() -> Result<String, Failure> {
    if io::stdin().is_terminal() {
        return ask_twice("Password");
    }
    let mut line = String::new();
    let read = io::stdin().read_line(&mut line);
    read.map_err(|error| Failure::new(format!("cannot read the password: {error}")))?;
    Ok(line.trim_end_matches(['\r', '\n']).to_owned())
}

impl Remove {
    fn run(&self) -> Result<Outcome, Failure> {
        let path = self.file.path()?;
        with_uptake(&path, || {
            if users::remove(&path, &self.name).map_err(Failure::of)? {
                return Ok(());
            }
            Err(Failure::negative(format!(
                "`{}` is not in {}: see `jaus users list`",
                self.name,
                path.display()
            )))
        })
    }
}

impl List {
    fn run(&self) -> Result<Outcome, Failure> {
        let file = UsersFile::load(&self.file.path()?).map_err(Failure::of)?;
        let users = file.users();
        let mut output = Output::new();
        for User { name, role, .. } in users.iter() {
            if self.json {
                output.line(json!({ "name": name, "role": role }))?;
            } else {
                output.line(format_args!("{name:32} {role}"))?;
            }
        }
        Ok(Outcome::complete_if(users.iter().len() > 0))
    }
}
