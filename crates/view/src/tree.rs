//! The discovery tree and its changes, as readable text and as JSON.

use std::collections::BTreeMap;

use jaus::address::JausId;
use jaus::component::{Change, Directory, Identification, Kind, Level, Loss, Offer};
use jaus::service::ComponentEntry;
use jaus_text::quoted;
use serde_json::{Map, Value as Json, json};

/// Formats the tree as indented lines, without the observing component `left_out`; with the colours of
/// a terminal on demand.
pub fn lines(directory: &Directory, left_out: Option<JausId>, colours: bool) -> Vec<String> {
    let paint = |code: &str, text: String| match colours {
        true => format!("\x1b[{code}m{text}\x1b[0m"),
        false => text,
    };
    let mut lines = Vec::new();
    for (number, subsystem) in directory.subsystems() {
        let others: Vec<_> = subsystem
            .components()
            .filter(|c| Some(c.id) != left_out)
            .collect();
        if others.is_empty() {
            continue;
        }
        let subsystem_line = format!("subsystem {number}{}", naming(subsystem.identification()));
        lines.push(paint("1", subsystem_line));
        for (number, node) in subsystem.nodes() {
            lines.push(format!("  node {number}{}", naming(node.identification())));
            for component in node.components().filter(|c| Some(c.id) != left_out) {
                lines.push(format!(
                    "    {}{}",
                    paint("36", component.id.to_string()),
                    naming(component.identification.as_ref())
                ));
                lines.extend(
                    services(component)
                        .into_iter()
                        .map(|line| format!("      {line}")),
                );
            }
        }
    }
    lines
}

/// Formats kind and name, such as `  vehicle "Rover"`; empty while unknown. Kinds that only repeat
/// the level are omitted.
fn naming(identification: Option<&Identification>) -> String {
    let Some(Identification { kind, name }) = identification else {
        return String::new();
    };
    match (kind, name.as_str()) {
        (Kind::Node | Kind::Component, "") => String::new(),
        (Kind::Node | Kind::Component, name) => format!("  {name:?}"),
        (kind, "") => format!("  {kind}"),
        (kind, name) => format!("  {kind} {name:?}"),
    }
}

/// Formats an identification, such as `the vehicle "Rover"` or `called "Camera"`.
pub fn introduction(Identification { kind, name }: &Identification) -> String {
    match kind {
        Kind::Vehicle | Kind::OperatorControlUnit => format!("the {kind} {name:?}"),
        _ => format!("called {name:?}"),
    }
}

/// One line per service, with its versions aligned in a column.
fn services(component: &ComponentEntry) -> Vec<String> {
    let Some(offers) = &component.services else {
        return vec!["(services not yet reported)".to_owned()];
    };
    let services = by_urn(offers).into_iter();
    let services: Vec<_> = services.map(|(urn, it)| (quoted(urn), it)).collect();
    let width = services.iter().map(|(urn, _)| urn.len()).max().unwrap_or(0);
    services
        .into_iter()
        .map(|(urn, versions)| format!("{urn:width$}  {}", versions.join(", ")))
        .collect()
}

/// The versions of every service, newest first.
pub fn by_urn(offers: &[Offer]) -> BTreeMap<&str, Vec<String>> {
    let mut services: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for Offer { urn, major, minor } in offers.iter().rev() {
        services
            .entry(urn)
            .or_default()
            .push(format!("{major}.{minor}"));
    }
    services
}

/// The tree as one JSON object, without the component `own`.
pub fn json(directory: &Directory, own: JausId) -> Json {
    let mut subsystems = Vec::new();
    for (number, subsystem) in directory.subsystems() {
        let mut nodes = Vec::new();
        for (number, node) in subsystem.nodes() {
            let others = node.components().filter(|component| component.id != own);
            let components: Vec<_> = others.map(component_json).collect();
            if !components.is_empty() {
                let mut object = named_json("node", json!(number), node.identification());
                object.insert("components".to_owned(), Json::Array(components));
                nodes.push(Json::Object(object));
            }
        }
        if !nodes.is_empty() {
            let mut object = named_json("subsystem", json!(number), subsystem.identification());
            object.insert("nodes".to_owned(), Json::Array(nodes));
            subsystems.push(Json::Object(object));
        }
    }
    json!({ "subsystems": subsystems })
}

fn component_json(component: &ComponentEntry) -> Json {
    let id = json!(component.id.to_string());
    let mut object = named_json("component", id, component.identification.as_ref());
    if let Some(offers) = &component.services {
        object.insert("services".to_owned(), services_json(offers));
    }
    Json::Object(object)
}

fn services_json(offers: &[Offer]) -> Json {
    let service = |offer: &Offer| {
        let version = format!("{}.{}", offer.major, offer.minor);
        json!({ "urn": offer.urn, "version": version })
    };
    offers.iter().map(service).collect()
}

fn named_json(key: &str, id: Json, identification: Option<&Identification>) -> Map<String, Json> {
    let mut object = Map::new();
    object.insert(key.to_owned(), id);
    if let Some(Identification { kind, name }) = identification {
        object.insert("kind".to_owned(), json!(kind.to_string()));
        object.insert("name".to_owned(), json!(name));
    }
    object
}

/// Describes a change as text; `None` if a following change carries more information.
pub fn in_words(change: Change, directory: &Directory) -> Option<String> {
    Some(match change {
        Change::SubsystemFound(_) => return None,
        Change::Found(id) => format!("{id} appeared"),
        Change::Identified(level, id) => {
            let who = level_name(level, id);
            format!(
                "{who} is {}",
                introduction(directory.identification(level, id)?)
            )
        }
        Change::Services(id) => {
            let offers = directory.component(id)?.services.as_ref()?;
            let names = by_urn(offers).into_iter().map(|(urn, versions)| {
                let name = urn.rsplit(':').next().unwrap_or(urn);
                format!("{} {}", quoted(name), versions.join("/"))
            });
            format!("{id} offers {}", names.collect::<Vec<_>>().join(", "))
        }
        Change::Lost(id, loss) => format!("{id} is lost: {}", reason(loss)),
        Change::SubsystemLost(number) => format!("subsystem {number} is lost"),
    })
}

/// Converts a change to a JSON object.
pub fn change_json(change: Change, directory: &Directory) -> Json {
    match change {
        Change::SubsystemFound(number) => {
            json!({ "change": "subsystem found", "subsystem": number })
        }
        Change::Found(id) => json!({ "change": "found", "component": id.to_string() }),
        Change::Identified(level, id) => {
            let (key, id_json) = match level {
                Level::Subsystem => ("subsystem", json!(id.subsystem())),
                Level::Node => ("node", json!(format!("{}.{}", id.subsystem(), id.node()))),
                Level::Component => ("component", json!(id.to_string())),
            };
            let mut object = Map::new();
            object.insert("change".to_owned(), json!("identified"));
            object.extend(named_json(
                key,
                id_json,
                directory.identification(level, id),
            ));
            Json::Object(object)
        }
        Change::Services(id) => {
            let component = directory.component(id);
            let offers = component.and_then(|component| component.services.as_deref());
            json!({
                "change": "services",
                "component": id.to_string(),
                "services": services_json(offers.unwrap_or_default()),
            })
        }
        Change::Lost(id, loss) => {
            json!({ "change": "lost", "component": id.to_string(), "reason": reason(loss) })
        }
        Change::SubsystemLost(number) => json!({ "change": "subsystem lost", "subsystem": number }),
    }
}

fn level_name(level: Level, id: JausId) -> String {
    match level {
        Level::Subsystem => format!("subsystem {}", id.subsystem()),
        Level::Node => format!("node {}.{}", id.subsystem(), id.node()),
        Level::Component => id.to_string(),
    }
}

const fn reason(loss: Loss) -> &'static str {
    match loss {
        Loss::Silent => "it stopped answering",
        Loss::Unlisted => "its subsystem no longer lists it",
        Loss::WithItsReporter => "the component that reported it is lost",
        Loss::NoRoom => "it never sent a message, and its entry is needed for another",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_urn_of_a_service_is_escaped() {
        let urn = "urn:\x1b[2J\r\nforged \u{202e}".to_owned();
        let offer = Offer {
            urn,
            major: 1,
            minor: 2,
        };
        let component = ComponentEntry {
            id: JausId::new(101, 1, 7),
            identification: None,
            services: Some(vec![offer].into()),
        };
        let line = r#""urn:\u{1b}[2J\r\nforged \u{202e}"  1.2"#;
        assert_eq!(services(&component), [line]);
    }
}
