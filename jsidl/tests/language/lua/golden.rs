//! The dissector on every golden message: tshark prints the values that our codec decodes.

use std::cmp::Reverse;
use std::thread;

use jaus_test_kit::evidence;
use jaus_test_kit::tools::has_tshark;
use jsidl::Library;
use jsidl::dynamic::{Limits, Value, decode_with};
use jsidl::model::Message;
use roxmltree::{Document, Node};
use serde_json::Value as Json;

use super::expected::{agrees, fields, shown};
use super::packets::Packets;
use super::tshark;
use crate::support::golden;

/// The family of a message, which determines its header.
#[derive(Clone, Copy)]
pub(crate) enum Family {
    Services,
    ReferenceArchitecture,
}

impl Family {
    /// The common prefix of its message and field names.
    const fn prefix(self) -> &'static str {
        match self {
            Self::Services => "jaus.",
            Self::ReferenceArchitecture => "jaus.ra.",
        }
    }

    fn add(self, packets: &mut Packets, octets: &[u8]) -> usize {
        match self {
            Self::Services => packets.message(octets),
            Self::ReferenceArchitecture => packets.ra_message(octets),
        }
    }
}

/// Decodes a message as the dissector should: by the newest definition that fits.
fn read<'l>(library: &'l Library, octets: &[u8]) -> Option<(&'l Message, Value)> {
    let code = u16::from_le_bytes(*octets.first_chunk()?);
    let mut candidates: Vec<_> = library.by_code(code).collect();
    candidates.sort_by_key(|(service, _)| Reverse(service.id.version));
    candidates.into_iter().find_map(|(_, message)| {
        let value = decode_with(message, octets, Limits::Ignored).ok()?;
        Some((message.as_ref(), value))
    })
}

/// Compares a packet with our value; the error is the first difference.
fn compare(
    packet: Node<'_, '_>,
    family: Family,
    message: &Message,
    value: &Value,
) -> Result<(), String> {
    let items = tshark::messages(packet);
    let [item] = items[..] else {
        return Err(format!("{} messages in one packet", items.len()));
    };
    let called = tshark::show(item, "jaus.message");
    if called != Some(&message.name) {
        return Err(format!("{called:?} instead of {}", message.name));
    }
    let prefix = format!("{}{}", family.prefix(), message.name.to_ascii_lowercase());
    let body = item
        .children()
        .find(|child| tshark::name(*child).starts_with(&prefix))
        .ok_or("no body")?;
    let (mut found, wanted) = (Vec::new(), fields(family.prefix(), message, value));
    shown(body, &format!("{prefix}."), &mut found);
    for (item, field) in found.iter().zip(&wanted) {
        if !agrees(*item, field) {
            let (name, show) = (tshark::name(*item), item.attribute("show"));
            return Err(format!("{name} {show:?} instead of {field:?}"));
        }
    }
    if found.len() != wanted.len() {
        return Err(format!("{} fields, not {}", found.len(), wanted.len()));
    }
    Ok(())
}

#[test]
fn tshark_prints_the_values_of_every_golden_message() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    if !has_tshark() {
        return;
    }
    let sources = golden::sources();
    let check = |source: &str, rows: &[Json]| {
        let vectors: Vec<_> = rows
            .iter()
            .map(|row| golden::octets_of(&row["hex"]))
            .collect();
        let library = golden::load(&corpus, source);
        check_source(&library, source, Family::Services, &vectors)
    };
    let total: usize = thread::scope(|scope| {
        let running: Vec<_> = sources
            .iter()
            .map(|(source, rows)| scope.spawn(|| check(source, rows)))
            .collect();
        running.into_iter().map(|one| one.join().unwrap()).sum()
    });
    println!("{total} messages in all");
    assert!(total > 2000, "the golden data have 2116 messages");
}

/// Checks the messages of one source; returns how many were compared.
pub(crate) fn check_source(
    library: &Library,
    source: &str,
    family: Family,
    vectors: &[Vec<u8>],
) -> usize {
    let directory = tshark::directory(source);
    let capture = directory.join("golden.pcap");
    let mut packets = Packets::new();
    let known: Vec<_> = vectors
        .iter()
        .filter_map(|octets| Some((octets, read(library, octets)?)))
        .map(|(octets, read)| (family.add(&mut packets, octets), read))
        .collect();
    packets.write(&capture);
    let pdml = tshark::pdml(library, &directory, &capture);
    let document = Document::parse(&pdml).unwrap();
    let packets = tshark::packets(&document);
    let differences: Vec<_> = known
        .iter()
        .filter_map(|(place, (message, value))| {
            let problem = compare(packets[*place], family, message, value).err()?;
            Some(format!(
                "{source}, packet {}, {}: {problem}",
                place + 1,
                message.name
            ))
        })
        .collect();
    assert!(differences.is_empty(), "{}", differences.join("\n"));
    println!("{source}: {} of {} messages", known.len(), vectors.len());
    known.len()
}
