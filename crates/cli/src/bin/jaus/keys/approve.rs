//! `jaus keys approve`, and the proposals of the commands that change trusted keys under dual control.
#![expect(
    clippy::disallowed_methods,
    reason = "proposals are made and end at the time of the host"
)]

use std::path::PathBuf;
use std::time::SystemTime;

use clap::Args;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::{Output, say};
use jaus_cli::secure::KeyFiles;
use jaus_secure::{DualControl, Key, Trust, edit};

use crate::uptake::with_uptake;

/// How another person approves a change of the trusted keys.
pub(super) const COMMAND: &str = "jaus keys approve";

/// Approve a proposed change of the trusted keys, or list those that wait
///
/// Where a file of approvers stands beside the trusted keys, or is named by --approvers, a key that is
/// trusted or allowed more takes effect when two of its people have signed that: one by --sign with `jaus
/// keys trust` or `allow`, another one here. Revoking needs one alone.
#[derive(Args)]
pub(super) struct Approve {
    /// The proposal to approve, as it is listed without this argument
    #[arg(requires = "sign")]
    proposal: Option<String>,

    #[command(flatten)]
    signer: Signer,

    #[command(flatten)]
    files: KeyFiles,
}

#[derive(Args)]
pub(super) struct Signer {
    /// Under dual control, sign with this approver's key: a file, or the PKCS #11 URI of a key in a token
    #[arg(long, value_name = "KEY")]
    sign: Option<PathBuf>,
}

impl Signer {
    pub(super) fn key(&self) -> Result<Key, Failure> {
        let Some(path) = &self.sign else {
            return Err(Failure::new(
                "here two people must approve this: propose it by --sign with your own key, and have \
                 another one approve it",
            ));
        };
        Key::load(path).map_err(Failure::of)
    }

    /// Proposes lines, which another person approves by this command.
    pub(super) fn propose(
        &self,
        control: &DualControl,
        command: &str,
        lines: &[String],
    ) -> Result<Outcome, Failure> {
        let (key, mut output) = (self.key()?, Output::new());
        for line in lines {
            let proposed = control.propose(line, &key, SystemTime::now());
            let proposed = proposed.map_err(Failure::of)?;
            say(format_args!(
                "proposed; until {} another approver runs: {command} {} --sign KEY",
                proposed.end(),
                proposed.id()
            ));
            output.line(proposed.id())?;
        }
        Ok(Outcome::Done)
    }
}

/// The dual control of these files, if they are under it.
pub(super) fn control(files: &KeyFiles) -> Result<Option<DualControl>, Failure> {
    let (trusted_keys, approvers) = (files.trusted_keys()?, files.approvers()?);
    Ok(approvers.map(|it| DualControl::new(&trusted_keys, &it)))
}

/// Removes the approvals of lines that were revoked.
pub(super) fn forget_removed(files: &KeyFiles) {
    let forget = || {
        let Some(control) = control(files)? else {
            return Ok(());
        };
        let path = files.trusted_keys()?;
        let text = std::fs::read_to_string(&path).map_err(|error| Failure::file(&path, &error))?;
        let trust = Trust::parse(&text).map_err(Failure::of)?;
        control.forget_removed(&trust).map_err(Failure::of)
    };
    if let Err(error) = forget() {
        // The line is gone; with its approvals, it could be put back.
        say(format_args!("its approvals are still there: {error}"));
    }
}

impl Approve {
    pub(super) fn run(&self) -> Result<Outcome, Failure> {
        let Some(control) = control(&self.files)? else {
            return Err(Failure::new(
                "the trusted keys are not under dual control: name the people who approve by --approvers",
            ));
        };
        let Some(id) = &self.proposal else {
            return list_waiting(&control);
        };
        let key = self.signer.key()?;
        let path = self.files.trusted_keys()?;
        with_uptake(&path, || {
            let approved = control.approve(id, &key, SystemTime::now());
            let approved = approved.map_err(Failure::of)?;
            edit::put(&path, approved.line()).map_err(Failure::of)?;
            say(format_args!("approved: {}", approved.line()));
            Ok(())
        })
    }
}

/// Lists the proposals that wait for another person.
pub(super) fn list_waiting(control: &DualControl) -> Result<Outcome, Failure> {
    let waiting = control.waiting(SystemTime::now()).map_err(Failure::of)?;
    let mut output = Output::new();
    for (proposal, signers) in &waiting {
        let (id, end, line) = (proposal.id(), proposal.end(), proposal.line());
        let signers = signers.join(",");
        output.line(format_args!("{id}  by {signers} until {end}: {line}"))?;
    }
    Ok(Outcome::complete_if(!waiting.is_empty()))
}
