//! `jaus list`: the known messages, services and fields.

use std::collections::BTreeMap;

use clap::{Args, Subcommand};
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::{Output, say};
use jaus_view::{Dictionary, Request, is_part_of_name, symbol};
use jsidl::docs::{LayoutRow, layout_rows};
use serde_json::json;

use crate::definitions::Definitions;

/// List known messages and services, and the fields of a message
///
/// Exit status 1 means that nothing matches.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus list messages velocity\n  \
    jaus list messages --service urn:jaus:jss:mobility:PrimitiveDriver\n  \
    jaus list services mobility\n  \
    jaus list fields SetWrenchEffort\n  \
    jaus list messages --jsidl services --json")]
pub(crate) struct List {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Names and codes of messages, with the services that define them
    Messages(Wanted),
    /// Services with their versions, and the services that they inherit from
    Services(Wanted),
    /// The fields of a message: types, units, ranges, named values, bits of optional fields
    Fields(Message),
}

#[derive(Args)]
struct Wanted {
    /// Only those whose name contains this, without case and underscores, or with this code
    text: Option<String>,

    #[command(flatten)]
    form: Form,
}

#[derive(Args)]
struct Message {
    /// The message's name
    message: String,

    #[command(flatten)]
    form: Form,
}

#[derive(Args)]
struct Form {
    /// Print JSON, one object on a line
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    definitions: Definitions,
}

impl List {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let mut output = Output::new();
        let lines = match &self.what {
            What::Messages(wanted) => wanted.messages()?,
            What::Services(wanted) => wanted.services()?,
            What::Fields(message) => message.fields()?,
        };
        lines.iter().try_for_each(|line| output.line(line))?;
        if lines.is_empty() {
            say("nothing matches; a definition of your own is added with --jsidl PATH");
        }
        Ok(Outcome::complete_if(!lines.is_empty()))
    }
}

impl Wanted {
    fn messages(&self) -> Result<Vec<String>, Failure> {
        let dictionary = self.form.definitions.load()?;
        let mut known: BTreeMap<(u16, &str), Vec<String>> = BTreeMap::new();
        for service in dictionary.library().services() {
            if !self.form.definitions.chooses(&service.id) {
                continue;
            }
            for message in service.messages() {
                let services = known.entry((message.code, &message.name)).or_default();
                let id = format!("{}@{}", service.id.urn, service.id.version);
                if !services.contains(&id) {
                    services.push(id);
                }
            }
        }
        known.retain(|(code, name), _| self.matches(name) || self.matches(&format!("{code:04X}")));
        let line = |((code, name), services): ((u16, &str), Vec<String>)| match self.form.json {
            true => json!({
                "code": format!("{code:04X}"), "message": name, "services": services,
            })
            .to_string(),
            false => format!("{code:04X}h  {name:32}  {}", services.join(", ")),
        };
        Ok(known.into_iter().map(line).collect())
    }

    fn services(&self) -> Result<Vec<String>, Failure> {
        let dictionary = self.form.definitions.load()?;
        let services = dictionary.library().services();
        let services = services.filter(|service| {
            self.form.definitions.chooses(&service.id) && self.matches(&service.id.urn)
        });
        let line = |service: &std::sync::Arc<jsidl::model::Service>| {
            let id = format!("{}@{}", service.id.urn, service.id.version);
            let base = service.inherits_from.as_ref();
            let base = base.map(|it| format!("{}@{}", it.id.urn, it.id.version));
            let messages = service.messages().count();
            match (self.form.json, base) {
                (true, base) => {
                    json!({ "service": id, "messages": messages, "inherits": base }).to_string()
                }
                (false, Some(base)) => format!("{id:60}  {messages:>3} messages, inherits {base}"),
                (false, None) => format!("{id:60}  {messages:>3} messages"),
            }
        };
        Ok(services.map(line).collect())
    }

    fn matches(&self, name: &str) -> bool {
        let text = self.text.as_ref();
        text.is_none_or(|text| is_part_of_name(text, name))
    }
}

impl Message {
    fn fields(&self) -> Result<Vec<String>, Failure> {
        let dictionary: Dictionary = self.form.definitions.load()?;
        let request = Request::new(&self.message, json!({}));
        let models = dictionary.models(&request).map_err(Failure::of)?;
        let Some(message) = models.first() else {
            return Ok(Vec::new());
        };
        let rows = layout_rows(message);
        if self.form.json {
            return Ok(rows.iter().map(row_json).collect());
        }
        let field = |row: &LayoutRow| format!("{:1$}{2}", "", 2 * row.depth, row.field);
        let widest = |text: &dyn Fn(&LayoutRow) -> usize| rows.iter().map(text).max().unwrap_or(0);
        let fields = widest(&|row| field(row).chars().count());
        let kinds = widest(&|row| row.kind.chars().count());
        let mut lines = vec![format!("{} ({:04X}h)", message.name, message.code)];
        if !message.description.is_empty() {
            lines.push(message.description.clone());
        }
        for row in &rows {
            let kind = format!("{:kinds$}  {:5}", row.kind, symbol(&row.unit));
            let mut values = row.values.iter();
            let first = values.next().map_or("", String::as_str);
            let line = format!("  {:fields$}  {kind}  {first}", field(row));
            lines.push(line.trim_end().to_owned());
            let indent = fields + kind.chars().count() + 6;
            lines.extend(values.map(|value| format!("{:indent$}{value}", "")));
        }
        Ok(lines)
    }
}

fn row_json(row: &LayoutRow) -> String {
    json!({
        "field": row.field,
        "description": row.description,
        "type": row.kind,
        "unit": row.unit,
        "values": row.values,
    })
    .to_string()
}
