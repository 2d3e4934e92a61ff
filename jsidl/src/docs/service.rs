//! The page of a service.

use super::block::{Block, Inline, Line, Page, Row, Table, code, heading, link, muted, text};
use super::names::{self, Names};
use super::{layout, machine};
use crate::library::Library;
use crate::model::{Id, Message, Service};

const HEAD: [&str; 3] = ["Code", "Message", "Description"];

/// The page of a service.
pub(super) fn page(library: &Library, names: &Names, service: &Service) -> Page {
    let mut blocks = vec![
        Block::Heading {
            level: 1,
            text: vec![
                text(&service.name),
                muted(format!(" {}", service.id.version)),
            ],
            anchor: None,
        },
        Block::Paragraph(vec![text(&service.description)]),
        Block::Facts(facts(library, names, service)),
    ];
    let mut contents = Vec::new();
    let own = [("Receives", &service.inputs), ("Sends", &service.outputs)];
    for (title, messages) in own {
        if !messages.is_empty() {
            blocks.push(heading(2, title, Some(title.to_lowercase())));
            let rows = messages.iter().map(|message| row("", message));
            blocks.push(summary(rows.collect()));
        }
    }
    blocks.extend(inherited(library, names, service));
    blocks.extend(machine::blocks(library, service));
    if !library.machines(service).is_empty() {
        contents.push(vec![link("Behaviour", "", Some("behaviour".to_owned()))]);
    }
    let messages = distinct(service);
    if !messages.is_empty() {
        blocks.push(heading(2, "Messages", Some("messages".to_owned())));
    }
    for message in messages {
        contents.push(vec![link(
            message.name.clone(),
            "",
            Some(names::anchor(message)),
        )]);
        blocks.extend(details(service, message));
    }
    let name = names.page(&service.id).unwrap_or_default().to_owned();
    Page {
        name,
        title: format!("{} {}", service.name, service.id.version),
        contents,
        blocks,
        searchable: false,
    }
}

fn facts(library: &Library, names: &Names, service: &Service) -> Vec<(&'static str, Vec<Line>)> {
    let mut facts = vec![("Identifier", vec![vec![code(service.id.to_string())]])];
    let bases: Vec<_> = library.lineage(service).skip(1).collect();
    if !bases.is_empty() {
        let mut line = Vec::new();
        for base in bases {
            if !line.is_empty() {
                line.push(muted(" ← "));
            }
            line.push(linked(names, &base.name, &base.id));
        }
        facts.push(("Inherits from", vec![line]));
    }
    let derived: Vec<_> = library
        .services()
        .filter(|other| {
            other
                .inherits_from
                .as_ref()
                .is_some_and(|r| r.id == service.id)
        })
        .filter(|other| names.page(&other.id).is_some())
        .map(|other| linked(names, &other.name, &other.id))
        .collect();
    if !derived.is_empty() {
        facts.push(("Inherited by", vec![listed(derived)]));
    }
    let clients: Vec<_> = service.client_of.iter().collect();
    if !clients.is_empty() {
        let links = clients.iter().map(|other| {
            let name = other.id.urn.rsplit(':').next().unwrap_or_default();
            linked(names, name, &other.id)
        });
        facts.push(("Client of", vec![listed(links.collect())]));
    }
    let versions: Vec<_> = library
        .versions(&service.id.urn)
        .filter(|other| other.id != service.id && names.page(&other.id).is_some())
        .map(|other| {
            link(
                other.id.version.to_string(),
                page_of(names, &other.id),
                None,
            )
        })
        .collect();
    if !versions.is_empty() {
        facts.push(("Other versions", vec![listed(versions)]));
    }
    facts
}

/// A name with version, linked to the service's page if there is one.
fn linked(names: &Names, name: &str, id: &Id) -> Inline {
    let words = format!("{name} {}", id.version);
    match names.page(id) {
        Some(page) => link(words, page, None),
        None => text(words),
    }
}

fn page_of<'a>(names: &'a Names, id: &Id) -> &'a str {
    names.page(id).unwrap_or_default()
}

fn listed(links: Vec<Inline>) -> Line {
    let mut line = Vec::new();
    for link in links {
        if !line.is_empty() {
            line.push(text(", "));
        }
        line.push(link);
    }
    line
}

/// The messages of its base services, linked to their pages.
fn inherited(library: &Library, names: &Names, service: &Service) -> Vec<Block> {
    let mut tables = Vec::new();
    for base in library.lineage(service).skip(1) {
        let page = page_of(names, &base.id);
        for (title, messages) in [("Received", &base.inputs), ("Sent", &base.outputs)] {
            if messages.is_empty() {
                continue;
            }
            let rows = messages.iter().map(|message| row(page, message));
            tables.push(Block::Details {
                summary: format!(
                    "{title} as {} {} ({})",
                    base.name,
                    base.id.version,
                    messages.len()
                ),
                blocks: vec![summary(rows.collect())],
            });
        }
    }
    if !tables.is_empty() {
        tables.insert(
            0,
            heading(2, "Inherited messages", Some("inherited".to_owned())),
        );
    }
    tables
}

fn summary(rows: Vec<Row>) -> Block {
    Block::Table(Table {
        class: "codes",
        head: &HEAD,
        rows,
    })
}

fn row(page: &str, message: &Message) -> Row {
    let name = link(message.name.clone(), page, Some(names::anchor(message)));
    Row::of([
        vec![code(format!("{:04X}h", message.code))],
        vec![name],
        described(message),
    ])
}

/// The description, after the kind of message.
fn described(message: &Message) -> Line {
    let mut line = Vec::new();
    if message.is_command {
        line.extend([Inline::Badge("command"), text(" ")]);
    }
    if message.is_deprecated {
        line.extend([Inline::Badge("deprecated"), text(" ")]);
    }
    line.push(text(&message.description));
    line
}

/// Its own messages without duplicates, in order.
fn distinct(service: &Service) -> Vec<&Message> {
    let mut distinct: Vec<&Message> = Vec::new();
    for message in service.messages() {
        let anchor = names::anchor(message);
        if distinct.iter().all(|known| names::anchor(known) != anchor) {
            distinct.push(message);
        }
    }
    distinct
}

fn details(service: &Service, message: &Message) -> [Block; 4] {
    let is_in = |messages: &[std::sync::Arc<Message>]| {
        messages
            .iter()
            .any(|other| other.code == message.code && other.name == message.name)
    };
    let direction = match (is_in(&service.inputs), is_in(&service.outputs)) {
        (true, true) => "received and sent",
        (true, false) => "received",
        _ => "sent",
    };
    let mut line = vec![code(format!("{:04X}h", message.code)), text(" ")];
    line.push(Inline::Badge(direction));
    if message.is_command {
        line.extend([
            text(" "),
            Inline::Badge("command: from the client in control"),
        ]);
    }
    if message.is_deprecated {
        line.extend([text(" "), Inline::Badge("deprecated")]);
    }
    [
        heading(3, message.name.clone(), Some(names::anchor(message))),
        Block::Paragraph(line),
        Block::Paragraph(vec![text(&message.description)]),
        Block::Table(layout::table(message)),
    ]
}
