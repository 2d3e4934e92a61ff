//! What a screen reader knows of the page.

use serde_json::Value;

/// A node of the accessibility tree.
#[derive(Debug)]
pub(crate) struct Accessible {
    pub(crate) role: String,
    pub(crate) name: String,
    pub(crate) is_focusable: bool,
    /// `polite` or `assertive` for a live region; empty otherwise.
    pub(crate) live: String,
    /// All text in it.
    pub(crate) text: String,
}

impl Accessible {
    pub(super) fn of(node: &Value, nodes: &[Value]) -> Self {
        let text = |value: &Value| {
            value["value"]
                .as_str()
                .unwrap_or_default()
                .trim()
                .to_owned()
        };
        let properties = node["properties"].as_array().into_iter().flatten();
        let property = |name: &str| {
            let mut named = properties.clone().filter(|it| it["name"] == name);
            named
                .next()
                .map(|it| it["value"].clone())
                .unwrap_or_default()
        };
        let live = text(&property("live"));
        Self {
            role: text(&node["role"]),
            name: text(&node["name"]),
            is_focusable: property("focusable")["value"] == true,
            live: if live == "off" { String::new() } else { live },
            text: text_within(node, nodes),
        }
    }
}

fn text_within(node: &Value, nodes: &[Value]) -> String {
    if node["role"]["value"] == "StaticText" {
        return node["name"]["value"]
            .as_str()
            .unwrap_or_default()
            .to_owned();
    }
    let ids = node["childIds"].as_array().into_iter().flatten();
    let children = ids.filter_map(|id| nodes.iter().find(|it| it["nodeId"] == *id));
    let texts: Vec<_> = children.map(|it| text_within(it, nodes)).collect();
    texts.join(" ")
}
