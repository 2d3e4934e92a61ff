//! The page of settings.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use jaus::node::units;

use super::keys::{Key, Section, Types};
use super::output;
use super::source::{Field, Kind, Shape, Source, Variant};

const HEAD: &str = "# Settings

<!-- Written by a test from the code; CONTRIBUTING.md says how. -->

Every key of the settings files (TOML). `jaus node --config FILE`, the other commands and the programs read one
file with [identity and node](#identity-and-node); `jaus up FILE` reads [a system](#a-system). The Debian
package has files to begin with in `/etc/jaus`. Flags take precedence over a file. An error names file, line, key
and a valid value.

```toml
id = \"101.1.1\"
name = \"Rover\"
interfaces = [\"eth0\"]
peers = [\"102.255.255@192.168.7.3\"]

[limits]
messages_per_id = { per_second = 500, burst = 1000 }
```

";

const COMPONENT: &str = "## [component]

For the programs with one component: their flags, by their long names. `true` sets a flag without a value, and
a list sets a flag several times. [Flags of the programs](programs.md) describes each.

```toml
[component]
attach = \"/run/jaus/node.sock\"
width = 1.2
```

";

const SECURE: &str = "## [secure]

An authenticated, encrypted link to other nodes of this stack; [Secure links](secure-links.md) explains it.

";

const AUDIT: &str = "## [audit]

Who did what, and with what result; [the audit log](secure-links.md#the-audit-log) explains it.

";

const SYSTEM: &str = "## A system

The file of `jaus up` names the programs of one machine: a section `[parts.NAME]` for each, and `[all]` for what
they share.

```toml
[all]
flags = { loopback = true }

[parts.planner]
flags = { width = 1.2 }
```

";

/// The commands whose flags override keys of the file.
const COMMANDS: [(&str, &[&str]); 2] = [
    ("jaus", &["node", "--help"]),
    ("jaus-communicator", &["--help"]),
];

/// The whole page.
pub(super) fn page() -> String {
    let mut types = Types::read();
    let sections = types.sections();
    let flags = flags();
    let mut page = HEAD.to_owned();
    page.push_str("## Identity and node\n\n");
    for section in &sections {
        write_section(section, &flags, &mut page);
    }
    page.push_str(COMPONENT);
    page.push_str(SECURE);
    write_table(&mut page, "crates/cli/src/secure.rs");
    page.push_str(AUDIT);
    write_table(&mut page, "crates/cli/src/audit.rs");
    page.push_str("## Values\n\n");
    write_units(&mut page);
    for (name, (about, keys)) in &types.values {
        let _ = writeln!(page, "### {name}\n\n{}\n", summary(about));
        if !keys.is_empty() {
            write_keys(keys, |_| String::new(), &mut page);
        }
    }
    page.push_str(SYSTEM);
    write_system(&mut page);
    page.truncate(page.trim_end().len());
    page.push('\n');
    page
}

fn write_section(section: &Section, flags: &[(String, BTreeSet<String>)], page: &mut String) {
    match (section.name.as_str(), section.is_list) {
        ("", _) => {}
        (name, true) => {
            let _ = writeln!(page, "### [[{name}]]\n");
        }
        (name, false) => {
            let _ = writeln!(page, "### [{name}]\n");
        }
    }
    if !section.about.is_empty() {
        let _ = writeln!(page, "{}\n", with_settings_only(&section.about));
    }
    if let Some(flag) = flag(&section.name, flags).filter(|_| section.is_list) {
        let _ = writeln!(page, "Flag: {flag}.\n");
    }
    let flag = |key: &str| match section.name.as_str() {
        "" => flag(key, flags),
        _ => flag_against(key, flags),
    };
    write_keys(&section.keys, |key| flag(key).unwrap_or_default(), page);
}

fn write_keys(keys: &[Key], flag: impl Fn(&str) -> String, page: &mut String) {
    let has_flags = keys.iter().any(|key| !flag(&key.name).is_empty());
    let (column, line) = if has_flags {
        (" flag |", "---|")
    } else {
        ("", "")
    };
    let _ = writeln!(page, "| key | value | default |{column} description |");
    let _ = writeln!(page, "|---|---|---|---|{line}");
    for key in keys {
        let about = key.about.replace('|', "\\|");
        let (name, value, default) = (&key.name, &key.value, &key.default);
        let flag = match has_flags {
            true => format!(" {} |", flag(&key.name)),
            false => String::new(),
        };
        let _ = writeln!(page, "| `{name}` | {value} | {default} |{flag} {about} |");
    }
    page.push('\n');
}

/// The long flags of the commands, by command.
fn flags() -> Vec<(String, BTreeSet<String>)> {
    let of = |(program, arguments): (&str, &[&str])| {
        let help = output(program, arguments);
        let words = help.lines().filter_map(|line| {
            let (_, flag) = line.split_once("--").filter(|(start, _)| start.len() < 8)?;
            let end = flag.find(|c: char| !c.is_ascii_alphanumeric() && c != '-');
            Some(flag[..end.unwrap_or(flag.len())].to_owned())
        });
        let command = match program {
            "jaus" => format!("jaus {}", arguments[0]),
            program => program.to_owned(),
        };
        (command, words.collect())
    };
    COMMANDS.into_iter().map(of).collect()
}

/// The flag that is named like a key, or like one of its values.
fn flag(key: &str, flags: &[(String, BTreeSet<String>)]) -> Option<String> {
    let single = key.trim_end_matches('s').to_owned();
    named(&[key.replace('_', "-"), single], flags)
}

/// The flag that switches a key off.
fn flag_against(key: &str, flags: &[(String, BTreeSet<String>)]) -> Option<String> {
    named(&[format!("no-{key}")], flags)
}

/// The first command with a flag of these names.
fn named(names: &[String], flags: &[(String, BTreeSet<String>)]) -> Option<String> {
    flags.iter().find_map(|(command, flags)| {
        let name = names.iter().find(|name| flags.contains(*name))?;
        Some(match command.as_str() {
            "jaus node" => format!("`--{name}`"),
            command => format!("`{command} --{name}`"),
        })
    })
}

/// Sizes and times, in the words of the errors about them.
fn write_units(page: &mut String) {
    for (name, error) in [
        ("size", units::size("x").map(drop)),
        ("time", units::duration("x").map(drop)),
    ] {
        let error = error.unwrap_err().to_string();
        let (_, syntax) = error.split_once(": write ").unwrap();
        let _ = writeln!(page, "### {name}\n\nWrite {syntax}.\n");
    }
}

/// The first paragraph of a description. The others are for programmers.
fn summary(about: &str) -> &str {
    about.split("\n\n").next().unwrap_or(about)
}

/// A description without examples for programmers.
fn with_settings_only(about: &str) -> String {
    let mut kept = String::new();
    for (index, piece) in about.split("```").enumerate() {
        match index % 2 {
            0 => kept.push_str(piece.trim_end_matches('\n')),
            _ if piece.starts_with("toml") => kept.push_str(&format!("\n\n```{piece}```")),
            _ => {}
        }
    }
    kept
}

/// The keys of a table that the program itself reads: of the secure link, or of the audit log.
fn write_table(page: &mut String, file: &str) {
    let source = Source::read(file);
    let Shape::Table(fields) = source.find("Table").unwrap().shape else {
        panic!("it has keys");
    };
    page.push_str("| key | value | description |\n|---|---|---|\n");
    for field in &fields {
        assert!(!field.about.is_empty(), "{} has no description", field.name);
        let value = match (&field.kind, field.name.as_str()) {
            (_, "jsidl") => "list of paths",
            (Kind::List(_), _) => "list of addresses",
            (_, "listen") => "address",
            (_, "budget") => "rate",
            (_, "announce") => "boolean, or list of interfaces",
            (_, "unwritable") => "`\"go-on\"` or `\"refuse-commands\"`",
            (_, "forward") => "`\"journald\"` or address",
            _ => "path",
        };
        let about = field.about.replace('\n', " ");
        let _ = writeln!(page, "| `{}` | {value} | {about} |", field.name);
    }
    page.push('\n');
}

/// The keys of the file of `jaus up`.
fn write_system(page: &mut String) {
    let source = Source::read("crates/cli/src/bin/jaus/up/system.rs");
    let table = |name: &str| match source.find(name).unwrap().shape {
        Shape::Table(fields) => fields,
        _ => panic!("{name} is no table"),
    };
    let (common, part) = (table("Common"), table("Part"));
    let Shape::Choice(restarts) = source.find("Restart").unwrap().shape else {
        panic!("there are several restarts");
    };
    for (section, keys) in [
        ("all", source.texts("ALL")),
        ("parts.NAME", source.texts("PART")),
    ] {
        let _ = writeln!(
            page,
            "### [{section}]\n\n| key | value | description |\n|---|---|---|"
        );
        for key in keys {
            let mut fields = common.iter().chain(&part);
            let field = fields.find(|field| field.name == key);
            let field = field.unwrap_or_else(|| panic!("no field is named {key}"));
            assert!(!field.about.is_empty(), "{key} has no description");
            let (value, about) = described(field, &restarts);
            let _ = writeln!(page, "| `{key}` | {value} | {about} |");
        }
        page.push('\n');
    }
}

/// The value and the description of a key of a system.
fn described(field: &Field, restarts: &[Variant]) -> (&'static str, String) {
    let about = field.about.replace('\n', " ");
    let value = match &field.kind {
        Kind::Map => "table",
        Kind::List(_) => "list of texts",
        Kind::Plain(name) if name == "Restart" => {
            let choice = restarts
                .iter()
                .map(|it| format!("<br>`\"{}\"`: {}", it.name, it.about.replace('\n', " ")));
            return ("choice", about + &choice.collect::<String>());
        }
        _ => "path",
    };
    (value, about)
}
