//! Writes the book's reference of a command line as Markdown, from its definition.

use std::fmt::Write as _;

use clap::{Arg, ArgAction, Command};

use crate::failure::Failure;
use crate::output::Output;

/// The argument with which a program prints its part of the book instead of running.
pub const ARGUMENT: &str = "--reference";

/// Prints the reference of a command line. Options that `others` has as well are listed at the end.
///
/// # Errors
/// Closed standard output.
pub fn print(command: Command, others: Command) -> Result<(), Failure> {
    Output::new().part(&text(command, others))
}

/// The reference of a command line: a section for the command and each of its subcommands, and one
/// for the common options.
fn text(mut command: Command, mut others: Command) -> String {
    command.build();
    others.build();
    let mut sections = Vec::new();
    collect(&command, &mut sections);
    let common = common(&sections, &Section::new(&others).options);
    let mut text = String::new();
    for section in &sections {
        section.write(&common, &mut text);
    }
    if !common.is_empty() {
        text.push_str("## Common options\n");
        write_options(&common, &mut text);
    }
    text
}

/// The section of one command.
struct Section {
    name: String,
    about: String,
    usage: String,
    options: Vec<Entry>,
    /// Examples and the like.
    end: String,
}

/// An option or argument.
#[derive(Clone, PartialEq)]
struct Entry {
    /// The heading of its group, if it has one.
    group: Option<String>,
    /// As it is written, such as `--id <ID>`.
    name: String,
    help: String,
}

/// An option in more commands than these is described once.
const FEW: usize = 3;

/// The options that many commands or `others` share, in the order of their groups.
fn common(sections: &[Section], others: &[Entry]) -> Vec<Entry> {
    let mut common = Vec::new();
    for entry in sections.iter().flat_map(|section| &section.options) {
        let uses = sections.iter().filter(|it| it.options.contains(entry));
        let is_common = uses.count() > FEW || others.contains(entry);
        if is_common && !common.contains(entry) {
            common.push(entry.clone());
        }
    }
    common.sort_by(|a, b| a.group.cmp(&b.group));
    common
}

fn collect(command: &Command, sections: &mut Vec<Section>) {
    sections.push(Section::new(command));
    let visible = command.get_subcommands().filter(|it| !it.is_hide_set());
    for subcommand in visible.filter(|it| it.get_name() != "help") {
        collect(subcommand, sections);
    }
}

impl Section {
    fn new(command: &Command) -> Self {
        let about = command.get_long_about().or(command.get_about());
        let end = command.get_after_long_help().or(command.get_after_help());
        let text = |text: Option<&clap::builder::StyledStr>| {
            text.map(ToString::to_string).unwrap_or_default()
        };
        let usage = command.clone().render_usage().to_string();
        let usage = usage.strip_prefix("Usage: ").unwrap_or(&usage);
        let name = command.get_bin_name().unwrap_or(command.get_name());
        let shown = command.get_arguments().filter(|it| is_shown(it));
        let mut options: Vec<_> = shown.map(Entry::new).collect();
        options.sort_by_key(|option| option.group.is_some());
        Self {
            name: name.to_owned(),
            about: text(about),
            usage: usage.to_owned(),
            options,
            end: text(end),
        }
    }

    fn write(&self, common: &[Entry], text: &mut String) {
        let _ = writeln!(text, "## {}\n", self.name);
        write_blocks(&self.about, "", text);
        let _ = writeln!(text, "\n```text\n{}\n```", self.usage);
        let (shared, own): (Vec<_>, Vec<_>) = self
            .options
            .iter()
            .cloned()
            .partition(|entry| common.contains(entry));
        write_options(&own, text);
        if !shared.is_empty() {
            let names: Vec<_> = shared.iter().map(|it| format!("`{}`", it.name)).collect();
            let names = names.join(", ");
            let _ = writeln!(text, "\n[Common options](#common-options): {names}");
        }
        if !self.end.is_empty() {
            text.push('\n');
            write_blocks(&self.end, "", text);
        }
        text.push('\n');
    }
}

fn is_shown(argument: &Arg) -> bool {
    let is_standard = matches!(argument.get_id().as_str(), "help" | "version");
    !argument.is_hide_set() && !is_standard
}

impl Entry {
    fn new(argument: &Arg) -> Self {
        let help = argument.get_long_help().or(argument.get_help());
        let mut help = help.map(ToString::to_string).unwrap_or_default();
        if argument.get_action().takes_values() {
            for value in argument.get_possible_values() {
                let about = value.get_help().map(ToString::to_string);
                let about = about.map(|about| format!(": {about}")).unwrap_or_default();
                let _ = write!(help, "\n\n`{}`{about}", value.get_name());
            }
            let defaults = argument.get_default_values();
            if !defaults.is_empty() && !argument.is_hide_default_value_set() {
                let defaults: Vec<_> = defaults.iter().map(|it| it.to_string_lossy()).collect();
                let (first, rest) = help.split_once("\n\n").unwrap_or((&help, ""));
                let default = format!("{first} [default: {}]", defaults.join(" "));
                help = [&default, rest].join("\n\n").trim_end().to_owned();
            }
        }
        Self {
            group: argument.get_help_heading().map(str::to_owned),
            name: name(argument),
            help,
        }
    }
}

/// An option as it is written: `-v, --verbose`, `--id <ID>`, `<FILE>`.
fn name(argument: &Arg) -> String {
    let mut name = argument.to_string();
    if matches!(argument.get_action(), ArgAction::Count) {
        name = name.trim_end_matches('.').to_owned();
    }
    match (argument.get_short(), argument.get_long()) {
        (Some(short), Some(_)) => format!("-{short}, {name}"),
        _ => name,
    }
}

/// Writes options as a list, each group under its heading.
fn write_options(options: &[Entry], text: &mut String) {
    let mut before: Option<&Entry> = None;
    for option in options {
        let is_new = before.is_none_or(|it| it.group != option.group);
        before = Some(option);
        if is_new {
            text.push('\n');
        }
        if let Some(group) = option.group.as_ref().filter(|_| is_new) {
            let _ = writeln!(text, "**{group}**\n");
        }
        let _ = write!(text, "- `{}`", option.name);
        if !option.help.is_empty() {
            text.push_str(": ");
            write_blocks(&option.help, "  ", text);
        }
    }
}

/// Writes paragraphs of a help text, except for the first line with this indentation. Indented lines
/// become code.
fn write_blocks(help: &str, indent: &str, text: &mut String) {
    let mut is_code = false;
    let mut gap = "";
    for line in help.lines() {
        let is_indented = line.starts_with("  ");
        if line.is_empty() {
            gap = "\n";
            continue;
        }
        if is_code && !is_indented {
            let _ = writeln!(text, "{indent}```");
            (is_code, gap) = (false, "\n");
        }
        if is_indented && !is_code {
            let _ = writeln!(text, "\n{indent}```text");
            (is_code, gap) = (true, "");
        }
        text.push_str(gap);
        gap = "";
        let is_start = text.ends_with(": ");
        let indent = if is_start { "" } else { indent };
        let line = if is_code {
            line[2..].to_owned()
        } else {
            escaped(line)
        };
        let _ = writeln!(text, "{indent}{line}");
    }
    if is_code {
        let _ = writeln!(text, "{indent}```");
    }
}

/// Escapes what Markdown would read as markup, outside code.
fn escaped(text: &str) -> String {
    let mut is_code = false;
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        is_code ^= c == '`';
        if !is_code && matches!(c, '<' | '*' | '_') {
            escaped.push('\\');
        }
        escaped.push(c);
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tool() -> Command {
        let example = "Examples:\n  tool run <x>\n\n  tool run *\n\nThe end_of it.";
        let run = |name: &'static str| {
            Command::new(name)
                .about("Runs <it>")
                .after_help(example)
                .arg(Arg::new("file").required(true).help("The file"))
                .arg(
                    Arg::new("speed")
                        .long("speed")
                        .default_value("2")
                        .help("The speed"),
                )
                .arg(
                    Arg::new("id")
                        .long("id")
                        .help_heading("Network")
                        .help("Our id"),
                )
        };
        let hidden = Command::new("hidden").hide(true);
        Command::new("tool")
            .about("A tool")
            .subcommands(["a", "b", "c", "d"].map(run))
            .subcommand(hidden)
            .subcommand(
                Command::new("e")
                    .arg(Arg::new("x").short('x').long("extra"))
                    .arg(Arg::new("y").long("other")),
            )
    }

    #[test]
    fn each_command_has_a_section_and_a_shared_option_is_described_once() {
        let text = text(tool(), Command::new("").arg(Arg::new("y").long("other")));
        assert!(text.starts_with("## tool\n\nA tool\n"), "{text}");
        assert_eq!(text.matches("Our id").count(), 1, "{text}");
        assert!(text.contains("## tool a\n\nRuns \\<it>\n\n```text\ntool a [OPTIONS] <file>\n```"));
        assert!(text.contains("[Common options](#common-options): `<file>`, `--speed <speed>`"));
        assert!(text.contains("- `--speed <speed>`: The speed [default: 2]\n"));
        assert!(text.contains("**Network**\n\n- `--id <id>`: Our id\n"));
        assert!(text.contains("- `-x, --extra <x>`\n"));
        assert_eq!(text.matches("- `--other <y>`").count(), 1, "{text}");
        assert!(!text.contains("hidden") && !text.contains("tool help"));
    }

    #[test]
    fn indented_lines_of_a_help_text_are_code() {
        let mut text = String::new();
        write_blocks(
            "Examples:\n  run <x>\n\n  run *\n\nThe end_of `a_b`.",
            "",
            &mut text,
        );
        let expected = "Examples:\n\n```text\nrun <x>\n\nrun *\n```\n\nThe end\\_of `a_b`.\n";
        assert_eq!(text, expected);
    }
}
