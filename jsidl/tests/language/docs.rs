//! The documentation generated from definitions: pages are well-formed, links resolve, texts of
//! definitions are escaped, and layouts agree with the decoder.

use std::collections::{BTreeMap, BTreeSet};

use crate::support::catalogue;
use jsidl::Loader;
use jsidl::docs::{Format, Page, pages};
use jsidl::dynamic::{arbitrary, encode};
use jsidl::explain::{Kind, Row, explain_as};

/// Parses an HTML page as XML, which it is except for its first line.
fn parsed(page: &Page) -> roxmltree::Document<'_> {
    let text = page.text.strip_prefix("<!DOCTYPE html>\n").unwrap();
    roxmltree::Document::parse(text).unwrap_or_else(|error| panic!("{}: {error}", page.path))
}

#[test]
fn every_link_leads_to_a_place_that_exists() {
    let pages = pages(&catalogue(), |_| true, Format::Html);
    let documents: BTreeMap<_, _> = pages
        .iter()
        .map(|page| (page.path.as_str(), parsed(page)))
        .collect();
    let anchors = |path: &str| -> BTreeSet<String> {
        let document = &documents[path];
        let ids: Vec<_> = document
            .descendants()
            .filter_map(|node| node.attribute("id"))
            .map(str::to_owned)
            .collect();
        let count = ids.len();
        let ids: BTreeSet<_> = ids.into_iter().collect();
        assert_eq!(ids.len(), count, "{path} has two places of one name");
        ids
    };
    let anchors: BTreeMap<_, _> = documents
        .keys()
        .map(|&path| (path, anchors(path)))
        .collect();
    let mut links = 0;
    for (path, document) in &documents {
        for node in document.descendants() {
            let Some(link) = node.attribute("href") else {
                continue;
            };
            let (page, anchor) = link.split_once('#').unwrap_or((link, ""));
            let page = if page.is_empty() { path } else { page };
            let known = anchors.get(page);
            let known = known.unwrap_or_else(|| panic!("{path}: no page {link}"));
            assert!(
                anchor.is_empty() || known.contains(anchor),
                "{path}: {link}"
            );
            links += 1;
        }
    }
    println!("{} pages, {links} links", pages.len());
    assert!(links > 1000);
}

#[test]
fn markdown_links_lead_to_pages_that_exist() {
    let pages = pages(&catalogue(), |_| true, Format::Markdown);
    let names: BTreeSet<_> = pages.iter().map(|page| page.path.as_str()).collect();
    let mut links = 0;
    for page in &pages {
        for link in page.text.split("](").skip(1) {
            let link = link.split(')').next().unwrap();
            let (target, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = if target.is_empty() {
                &page.path
            } else {
                target
            };
            assert!(names.contains(target), "{}: {link}", page.path);
            let place = format!("<a id=\"{anchor}\"></a>");
            let page = pages.iter().find(|page| page.path == target).unwrap();
            assert!(anchor.is_empty() || page.text.contains(&place), "{link}");
            links += 1;
        }
    }
    assert!(links > 1000);
}

#[test]
fn nothing_in_a_definition_is_taken_for_markup() {
    let hostile = "&lt;script&gt;alert(1)&lt;/script&gt; &quot; ' &amp;amp; `x` | [a](b)";
    let text = format!(
        r#"<service_def name="Odd" id="urn:example:odd:Odd" version="1.0" xmlns="urn:jaus:jsidl:1.1">
          <description>{hostile}</description>
          <assumptions>None.</assumptions>
          <message_set>
            <input_set>
              <message_def name="Odd" message_id="D001" is_command="false">
                <description>{hostile}</description>
                <header name="Header"><record name="HeaderRec" optional="false">
                  <fixed_field name="MessageID" optional="false" field_type="unsigned short integer"
                    field_units="one"/>
                </record></header>
                <body name="Body"><record name="OddRec" optional="false">
                  <fixed_field name="Kind" optional="false" field_type="unsigned byte" field_units="one"
                      interpretation="{hostile}">
                    <value_set offset_to_lower_limit="false">
                      <value_enum enum_index="0" enum_const="{hostile}" interpretation="{hostile}"/>
                    </value_set>
                  </fixed_field>
                </record></body>
                <footer name="Footer"/>
              </message_def>
            </input_set>
            <output_set/>
          </message_set>
          <internal_events_set/>
          <protocol_behavior is_stateless="true"/>
        </service_def>"#
    );
    let mut loader = Loader::new();
    loader.text("odd.xml", &text);
    let loaded = loader.load();
    assert_eq!(
        loaded.library.services().count(),
        1,
        "{}",
        loaded.diagnostics
    );
    for page in pages(&loaded.library, |_| true, Format::Html) {
        let document = parsed(&page);
        let scripts = document.descendants().filter(|n| n.has_tag_name("script"));
        assert_eq!(scripts.count(), usize::from(page.path == "index.html"));
        assert!(document.root_element().descendants().any(|n| {
            n.text()
                .is_some_and(|text| text.contains("<script>alert(1)</script>"))
        }));
    }
    for page in pages(&loaded.library, |_| true, Format::Markdown) {
        assert!(!page.text.contains("<script>"), "{}", page.text);
        let rows = page.text.lines().filter(|line| line.starts_with('|'));
        for row in rows {
            let cells = row.replace("\\|", "").matches('|').count();
            assert!(matches!(cells, 4 | 7), "{row}");
        }
    }
}

/// The fixed offsets that the page of a service states, by message and field.
fn offsets(page: &Page) -> BTreeMap<(String, String), usize> {
    let mut offsets = BTreeMap::new();
    let mut message = "";
    for line in page.text.lines() {
        message = line.strip_prefix("### ").unwrap_or(message);
        let cells: Vec<_> = line.split(" | ").collect();
        let Some(offset) = cells[0].strip_prefix("| ").and_then(|n| n.parse().ok()) else {
            continue;
        };
        let field = cells[2].split("<br>").next().unwrap();
        let field = field.split(" *optional*").next().unwrap();
        let field: String = field.chars().filter(|c| !"`\\".contains(*c)).collect();
        if !field.starts_with("if the index") {
            offsets.insert((message.replace('\\', ""), field), offset);
        }
    }
    offsets
}

/// The name that the layout gives to the octets of an explanation row.
fn name(row: &Row) -> String {
    let field = row.field.clone();
    match row.kind {
        Kind::Value | Kind::Bits | Kind::Message => field,
        kind => format!("{field} {kind}").trim().to_owned(),
    }
}

#[test]
fn fixed_offsets_are_those_at_which_fields_are_read() {
    let library = catalogue();
    let (mut compared, mut unknown) = (0, 0);
    for page in pages(&library, |_| true, Format::Markdown) {
        let service = library.services().find(|service| {
            let id = format!("`{}`", service.id);
            page.path != "index.md" && page.text.contains(&format!("- **Identifier**: {id}"))
        });
        let Some(service) = service else { continue };
        let offsets = offsets(&page);
        for message in service.messages() {
            for entropy in [&[][..], &[255; 64], &[1, 2, 3, 5, 7, 11, 13, 17, 19, 23]] {
                let Ok(octets) = encode(message, &arbitrary(message, entropy)) else {
                    continue;
                };
                let (rows, _) = explain_as(message, &octets);
                for row in rows.iter().filter(|row| !row.octets.is_empty()) {
                    let Some(&stated) = offsets.get(&(message.name.clone(), name(row))) else {
                        unknown += 1;
                        continue;
                    };
                    assert_eq!(stated, row.offset, "{} {}", message.name, name(row));
                    compared += 1;
                }
            }
        }
    }
    println!("{compared} offsets compared, {unknown} not fixed");
    assert!(compared > 2000);
}
