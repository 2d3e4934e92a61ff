//! Decides which types a module has, and what they are called.
//!
//! A type is defined in the module of the first version that has its layout, such as `v1_0`. The
//! modules of later versions with the same layout have it, too, and the root has the newest layout of
//! each message. A new version therefore changes only what the root means by a name.

use std::collections::{BTreeMap, BTreeSet};

use super::ident::Names;
use crate::fingerprint;
use crate::library::Library;
use crate::model::{Id, Message, Service, Version};
use crate::typed::names;

/// A message type to generate.
#[derive(Debug)]
pub(super) struct Plan<'m> {
    pub(super) message: &'m Message,
    /// The first version with this layout.
    pub(super) version: Version,
    /// Name of the type, and of the module with its nested types.
    pub(super) ident: String,
    pub(super) module: String,
    /// Its names in the root, if it is the newest layout.
    pub(super) root: Option<[String; 2]>,
    /// The later versions with this layout, and its names there.
    pub(super) later: Vec<(Version, [String; 2])>,
    /// The declaring services, the newest version first.
    pub(super) services: Vec<&'m Id>,
    /// The name of the report that answers it, if it is a query.
    pub(super) report: Option<&'m str>,
    /// Whether the command requires control.
    pub(super) needs_control: bool,
    /// Whether the command requires a component that is ready.
    pub(super) needs_readiness: bool,
    /// Whether all declarations call it deprecated. A message that an older version still recommends is
    /// not: its peers know no other.
    pub(super) is_deprecated: bool,
}

impl Plan<'_> {
    /// The type's path from the root of the set.
    pub(super) fn path(&self) -> String {
        match &self.root {
            Some([ident, _]) => ident.clone(),
            None => self.definition(),
        }
    }

    /// The path of the definition from the root of the set.
    pub(super) fn definition(&self) -> String {
        format!("{}::{}", names::version(self.version), self.ident)
    }

    /// The path of the module with its nested types from the root of the set.
    pub(super) fn module_path(&self) -> String {
        format!("{}::{}", names::version(self.version), self.module)
    }

    /// Its names in the module of a version that has it.
    pub(super) fn names_in(&self, version: Version) -> Option<[&str; 2]> {
        if self.version == version {
            return Some([&self.ident, &self.module]);
        }
        let later = self.later.iter().find(|(it, _)| *it == version);
        later.map(|(_, [ident, module])| [ident.as_str(), module.as_str()])
    }

    /// Whether both are layouts of one message.
    pub(super) fn is_layout_of(&self, other: &Message) -> bool {
        (self.message.code, &self.message.name) == (other.code, &other.name)
    }
}

/// The modules of versions.
pub(super) fn version_modules(services: &[&Service]) -> Vec<String> {
    let versions: BTreeSet<_> = services.iter().map(|service| service.id.version).collect();
    versions.into_iter().map(names::version).collect()
}

/// Plans the types: one for every code, name and layout; sorted by code, the newest layout of a
/// message first.
pub(super) fn plan<'m>(
    library: &Library,
    services: &[&'m Service],
    root: &mut Names,
) -> Vec<Plan<'m>> {
    let mut messages: BTreeMap<(u16, &str), Vec<Declared<'m>>> = BTreeMap::new();
    for service in services {
        for message in service.messages() {
            let layouts = messages.entry((message.code, &message.name)).or_default();
            let needs = |base| message.is_command && inherits(library, service, base);
            let layout = declare(layouts, message, &service.id);
            let report = service.report_of(message).map(|it| it.name.as_str());
            layout.report = report.or(layout.report);
            layout.needs_control |= needs(ACCESS_CONTROL);
            layout.needs_readiness |= needs(MANAGEMENT);
        }
    }
    let mut plans = Vec::new();
    let mut versions: BTreeMap<Version, Names> = BTreeMap::new();
    for mut layouts in messages.into_values() {
        layouts.sort_by_key(|layout| std::cmp::Reverse(layout.newest()));
        for (age, layout) in layouts.into_iter().enumerate() {
            let name = &layout.message.name;
            let both = |names: &mut Names| [names.camel(name), names.snake(name)];
            let root = (age == 0).then(|| both(root));
            let own: BTreeSet<_> = layout.services.iter().map(|id| id.version).collect();
            let mut named = own.into_iter().map(|version| {
                let names = versions.entry(version);
                let names = names.or_insert_with(|| Names::reserving(&["codec"]));
                (version, both(names))
            });
            let Some((version, [ident, module])) = named.next() else {
                continue;
            };
            let later = named.collect();
            plans.push(layout.plan(version, [ident, module], root, later));
        }
    }
    plans
}

/// One layout of a message with its declaring services.
struct Declared<'m> {
    layout: String,
    /// The newest declaration.
    message: &'m Message,
    services: Vec<&'m Id>,
    report: Option<&'m str>,
    needs_control: bool,
    needs_readiness: bool,
    is_deprecated: bool,
}

impl<'m> Declared<'m> {
    fn newest(&self) -> Version {
        let versions = self.services.iter().map(|id| id.version);
        versions.max().unwrap_or(Version { major: 0, minor: 0 })
    }

    fn plan(
        mut self,
        version: Version,
        [ident, module]: [String; 2],
        root: Option<[String; 2]>,
        later: Vec<(Version, [String; 2])>,
    ) -> Plan<'m> {
        self.services
            .sort_by_key(|id| std::cmp::Reverse(id.version));
        Plan {
            message: self.message,
            version,
            ident,
            module,
            root,
            later,
            services: self.services,
            report: self.report,
            needs_control: self.needs_control,
            needs_readiness: self.needs_readiness,
            is_deprecated: self.is_deprecated,
        }
    }
}

/// Whether a service is derived from another one.
fn inherits(library: &Library, service: &Service, urn: &str) -> bool {
    let mut bases = library
        .lineage(service)
        .filter_map(|it| it.inherits_from.as_ref());
    bases.any(|base| &*base.id.urn == urn)
}

const ACCESS_CONTROL: &str = "urn:jaus:jss:core:AccessControl";
const MANAGEMENT: &str = "urn:jaus:jss:core:Management";

/// The layout of a message in a service, which is added if it is new.
fn declare<'l, 'm>(
    layouts: &'l mut Vec<Declared<'m>>,
    message: &'m Message,
    service: &'m Id,
) -> &'l mut Declared<'m> {
    let layout = fingerprint::layout(message);
    let known = layouts.iter().position(|it| it.layout == layout);
    let index = known.unwrap_or(layouts.len());
    if known.is_none() {
        layouts.push(Declared {
            layout,
            message,
            services: Vec::new(),
            report: None,
            needs_control: false,
            needs_readiness: false,
            is_deprecated: true,
        });
    }
    let declared = &mut layouts[index];
    declared.is_deprecated &= message.is_deprecated;
    if service.version > declared.newest() {
        declared.message = message;
    }
    if !declared.services.contains(&service) {
        declared.services.push(service);
    }
    declared
}
