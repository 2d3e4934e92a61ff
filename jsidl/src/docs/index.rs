//! Index page: all services by set, and all messages by code.

use std::collections::BTreeMap;

use super::block::{Block, Inline, Page, Row, Table, code, heading, link, muted, text};
use super::names::{self, Names};
use crate::model::{Message, Service};

/// The index page.
pub(super) fn page(names: &Names, services: &[&Service]) -> Page {
    let mut sets: BTreeMap<&str, Vec<&Service>> = BTreeMap::new();
    for service in services {
        sets.entry(names::set(&service.id))
            .or_default()
            .push(service);
    }
    let messages: usize = services
        .iter()
        .map(|service| service.messages().count())
        .sum();
    let mut blocks = vec![
        heading(1, "Services and messages", None),
        Block::Paragraph(vec![text(format!(
            "{} services in {} sets, with {messages} messages. All numbers are little-endian, without padding; \
             offsets count octets from the message code.",
            services.len(),
            sets.len()
        ))]),
    ];
    let mut contents = Vec::new();
    for (number, (set, services)) in sets.into_iter().enumerate() {
        let anchor = format!("set-{}", number + 1);
        let name = set.rsplit(':').next().filter(|name| !name.is_empty());
        let name = name.unwrap_or("no set").to_owned();
        contents.push(vec![link(name.clone(), "", Some(anchor.clone()))]);
        blocks.push(Block::Heading {
            level: 2,
            text: vec![text(name), muted(format!(" {set}"))],
            anchor: Some(anchor),
        });
        blocks.push(of_set(names, &services));
    }
    contents.push(vec![link("By message code", "", Some("codes".to_owned()))]);
    blocks.push(heading(2, "By message code", Some("codes".to_owned())));
    blocks.push(by_code(names, services));
    Page {
        name: "index".to_owned(),
        title: "Services and messages".to_owned(),
        contents,
        blocks,
        searchable: true,
    }
}

fn of_set(names: &Names, services: &[&Service]) -> Block {
    let rows = services.iter().map(|service| {
        let page = names.page(&service.id).unwrap_or_default();
        Row::of([
            vec![link(service.name.clone(), page, None)],
            vec![code(service.id.version.to_string())],
            vec![text(&service.description)],
        ])
    });
    Block::Table(Table {
        class: "index",
        head: &["Service", "Version", "Description"],
        rows: rows.collect(),
    })
}

fn by_code(names: &Names, services: &[&Service]) -> Block {
    let mut codes: BTreeMap<(u16, &str), Vec<(&Service, &Message)>> = BTreeMap::new();
    for service in services {
        for message in service.messages() {
            let known = codes.entry((message.code, &message.name)).or_default();
            if known.iter().all(|(other, _)| other.id != service.id) {
                known.push((service, message));
            }
        }
    }
    let rows = codes.into_iter().map(|((number, name), defined)| {
        let mut line = Vec::new();
        for (service, message) in &defined {
            if !line.is_empty() {
                line.push(text(", "));
            }
            let page = names.page(&service.id).unwrap_or_default();
            let words = format!("{} {}", service.name, service.id.version);
            line.push(link(words, page, Some(names::anchor(message))));
        }
        let command = defined.iter().any(|(_, message)| message.is_command);
        let mut words = vec![text(name)];
        if command {
            words.extend([text(" "), Inline::Badge("command")]);
        }
        Row::of([vec![code(format!("{number:04X}h"))], words, line])
    });
    Block::Table(Table {
        class: "codes",
        head: &["Code", "Message", "Service"],
        rows: rows.collect(),
    })
}
