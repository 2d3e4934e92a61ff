//! Builds the RA view of a JAUS subsystem: each component once per component type of its services.

use std::collections::BTreeMap;

use super::proxy::Target;
use super::roles;
use crate::RaId;
use crate::ids::{IdTable, RaComponent, Side, Unmapped};
use crate::node;
use jaus::address::JausId;
use jaus::service::{ComponentEntry, Directory, Kind};

/// RA view of a JAUS subsystem, with the JAUS component behind each RA id.
#[derive(Debug, Default)]
pub(super) struct Picture {
    pub(super) subsystem: node::RaSubsystemEntry,
    pub(super) routes: BTreeMap<RaId, Target>,
    /// Components that cannot be shown, with the reason.
    pub(super) unmapped: Vec<(JausId, Unmapped)>,
}

/// Maximum length of a name in RA reports, in octets.
const LONGEST_NAME: usize = 79;

/// Builds the view of a subsystem. `us` is the gateway itself, which is shown as a commander;
/// `is_front` identifies the proxies of RA components.
pub(super) fn draw(
    directory: &Directory,
    ids: &IdTable,
    number: u16,
    us: JausId,
    is_front: impl Fn(JausId) -> bool,
) -> Option<Picture> {
    let subsystem = directory.subsystem(number)?;
    let id = u8::try_from(ids.subsystem(Side::Jaus, number).ok()?).ok()?;
    let identification = subsystem.identification();
    let is_operator = identification.is_some_and(|it| it.kind == Kind::OperatorControlUnit);
    let name = |identification: Option<&jaus::service::Identification>| {
        identification.map_or_else(String::new, |it| cut(&it.name))
    };
    let mut picture = Picture::default();
    picture.subsystem.id = id;
    picture.subsystem.name = name(identification);
    for (node_number, jaus_node) in subsystem.nodes() {
        let mut node = node::RaNodeEntry {
            id: node_number,
            name: name(jaus_node.identification()),
            components: Vec::new(),
        };
        for component in jaus_node.components().filter(|it| !is_front(it.id)) {
            let commander = component.id == us || is_operator;
            picture.add(ids, component, commander, &mut node);
        }
        if !node.components.is_empty() {
            picture.subsystem.nodes.push(node);
        }
    }
    (!picture.subsystem.nodes.is_empty()).then_some(picture)
}

impl Picture {
    fn add(
        &mut self,
        ids: &IdTable,
        component: &ComponentEntry,
        commander: bool,
        node: &mut node::RaNodeEntry,
    ) {
        let mut parts = BTreeMap::new();
        for offer in component.offered() {
            if let Some(role) = roles::of_service(&offer.urn) {
                let part = parts.entry(role.part);
                let (minor, lists, _) = part.or_insert((offer.minor, false, role.services()));
                *minor = offer.minor.max(*minor);
                *lists |= role.works_off(&offer.urn);
            }
        }
        if parts.is_empty() && commander {
            let core = vec![roles::core_service()];
            parts.insert(RaComponent::SUBSYSTEM_COMMANDER, (0, false, core));
        }
        let several = parts.len() > 1;
        for (part, (minor, lists, services)) in parts {
            let shown = match ids.ra_id(component.id, part) {
                Ok(shown) => shown,
                Err(why) => {
                    self.unmapped.push((component.id, why));
                    continue;
                }
            };
            let target = Target {
                id: component.id,
                minor,
                lists,
            };
            self.routes.insert(shown, target);
            node.components.push(node::RaComponentEntry {
                component: shown.component,
                instance: shown.instance,
                name: name(component, part, several),
                services,
            });
        }
    }
}

/// The name of a component; with several component types, the type is part of it.
fn name(component: &ComponentEntry, part: RaComponent, several: bool) -> String {
    let name = component.identification.as_ref().map(|it| it.name.as_str());
    match name.filter(|name| !name.is_empty()) {
        Some(name) if several => cut(&format!("{name}: {part}")),
        Some(name) => cut(name),
        None => part.to_string(),
    }
}

fn cut(name: &str) -> String {
    let mut cut = String::new();
    for letter in name.chars() {
        if cut.len() + letter.len_utf8() > LONGEST_NAME {
            break;
        }
        cut.push(letter);
    }
    cut
}
