//! `jaus keys explain`: what a trusted key may do, message by message.

use std::collections::BTreeSet;
use std::fs;

use clap::Args;
use jaus::address::JausId;
use jaus::rights::{Permission, Rules, Selection, Table};
use jaus::wire::Frame;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::{Output, say};
use jaus_cli::permissions::table_with;
use jaus_cli::secure::KeyFiles;
use jaus_secure::Trust;
use serde_json::json;

use crate::definitions::Jsidl;

/// Show what a peer may send, and why
///
/// Of each message of the definitions: the right that it needs, and whether the rules of the peer's key
/// give that. A node decides by the same table.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus keys explain console\n  \
    jaus keys explain console SetTravelSpeed\n  \
    jaus keys explain console PrimitiveDriver RequestControl")]
pub(super) struct Explain {
    /// The peer's name
    name: String,

    /// Only these messages: names of messages or services, or codes such as D103h
    #[arg(value_name = "MESSAGE")]
    messages: Vec<Selection>,

    /// Print JSON, one object on a line
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    jsidl: Jsidl,

    #[command(flatten)]
    files: KeyFiles,
}

impl Explain {
    pub(super) fn run(&self) -> Result<Outcome, Failure> {
        let table = table_with(self.jsidl.paths())?;
        let all_rules = self.rules()?;
        for named in &self.messages {
            named.verify(&table).map_err(Failure::of)?;
        }
        for rules in &all_rules {
            if let Err(error) = rules.verify(&table) {
                say(format_args!("of the rules of `{}`: {error}", self.name));
            }
        }
        // What no definition has is explained if it is named.
        let named = self.messages.iter().flat_map(|it| it.codes(&table));
        let mut codes: BTreeSet<_> = named.collect();
        if self.messages.is_empty() {
            codes.extend(table.codes());
        }
        let mut output = Output::new();
        for rules in &all_rules {
            for &code in &codes {
                self.line(&mut output, &Answer::of(rules, &table, code))?;
            }
        }
        Ok(Outcome::complete_if(!codes.is_empty()))
    }

    /// The rules of the peer: one set for each of its keys.
    fn rules(&self) -> Result<Vec<Rules>, Failure> {
        let path = self.files.trusted_keys()?;
        let text = fs::read_to_string(&path).map_err(|error| Failure::file(&path, &error))?;
        let trust = Trust::parse(&text).map_err(Failure::of)?;
        let keys = trust.peers().iter().map(|it| (&it.name, &it.rules));
        let certificates = trust.grants().iter().map(|it| (&it.name, &it.rules));
        let own = keys.chain(certificates);
        let own = own.filter(|(name, _)| **name == self.name);
        let mut rules: Vec<_> = own.map(|(_, rules)| rules.clone()).collect();
        rules.dedup();
        if rules.is_empty() {
            let (name, path) = (&self.name, path.display());
            let text = format!("`{name}` is not in {path}: see `jaus keys list`");
            return Err(Failure::negative(text));
        }
        Ok(rules)
    }

    fn line(&self, output: &mut Output, answer: &Answer) -> Result<(), Failure> {
        let Answer {
            code,
            name,
            needs,
            most,
            refusal,
        } = answer;
        if self.json {
            let code = format!("{code:04X}");
            let may = refusal.is_none();
            return output.line(json!({
                "code": code, "name": name, "needs": needs, "may": may, "authority": most, "why": refusal,
            }));
        }
        let may = match (refusal, most) {
            (Some(why), _) => format!("no: {why}"),
            (None, Some(most)) => format!("yes, with an authority up to {most}"),
            (None, None) => "yes".to_owned(),
        };
        output.line(format_args!("{code:04X}h {name:34} {needs:16} {may}"))
    }
}

/// Whether a peer may send a message.
struct Answer {
    code: u16,
    name: String,
    /// The right that the message needs.
    needs: String,
    /// The greatest authority with which the peer may ask for control by it.
    most: Option<u8>,
    /// Why not.
    refusal: Option<String>,
}

impl Answer {
    fn of(rules: &Rules, table: &Table, code: u16) -> Self {
        // Without an authority, and with empty lists.
        let message = [&code.to_le_bytes()[..], &[0; 64]].concat();
        let to = rules.with.first().copied().unwrap_or(JausId::EVERYONE);
        let needs = table.words(&message);
        let is_control = |it| matches!(it, Permission::Control { .. });
        let is_control = table.needs(&message).any(is_control);
        let frame = Frame::new(JausId::new(1, 1, 1), to, message.into());
        Self {
            code,
            name: table.names(code).join(","),
            needs,
            most: rules.control.filter(|_| is_control),
            refusal: rules.check(&frame, table).err().map(|it| it.to_string()),
        }
    }
}
