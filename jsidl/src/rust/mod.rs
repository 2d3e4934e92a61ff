//! Generates Rust from resolved services: typed messages over the codec runtime of the crate
//! `jaus`.
//!
//! The output is indented and documented, to be included from a build script's `OUT_DIR`;
//! [`build`](crate::build) does all of that. Messages are flat in the module; the types inside a
//! message are in a module with its name. A message that several services or versions declare with
//! one layout is one type; an older layout is in a module of its version, such as `v1_0`. The state
//! machine of a service is in the service's module.

mod choices;
mod decode;
mod docs;
mod encode;
mod ident;
mod layout;
mod machine;
mod messages;
mod newtypes;
mod queries;
mod random;
mod registry;
mod reports;
pub(crate) mod selections;
mod services;
mod structs;
mod types;
mod view;
mod writer;

use std::collections::{BTreeMap, HashMap};

use self::ident::{Names, version_module};
use self::machine::Messages;
use self::messages::Plan;
use self::registry::ServicePaths;
use self::writer::Writer;
use crate::fingerprint;
use crate::library::Library;
use crate::model::{Id, Message, Service, Version};

/// Generates the Rust module of a set of services, which may inherit from others in the library.
///
/// `runtime` is the path of the codec runtime as the generated module sees it, for example
/// `::jaus::codec`.
pub fn module<'m>(
    library: &'m Library,
    services: impl IntoIterator<Item = &'m Service>,
    runtime: &str,
) -> String {
    let mut services: Vec<_> = services.into_iter().collect();
    services.sort_by_key(|service| &service.id);
    let mut out = Writer::default();
    let rename = if runtime.ends_with("::codec") {
        ""
    } else {
        " as codec"
    };
    out.push(format!("use {runtime}{rename};"));
    let mut names = Names::reserving(&["codec"]);
    let versions = registry::versions(&services, &mut names);
    let plans = plan(library, &services, &mut names);
    let messages = Messages {
        library,
        plans: &plans,
    };
    let paths = registry::services(&mut out, &versions, messages);
    registry::tables(&mut out, &services, &paths, &plans);
    write(&mut out, &plans, &paths);
    out.finish()
}

/// Plans the types: one for every code, name and layout; sorted by code, the newest layout of a
/// message first.
fn plan<'m>(library: &Library, services: &[&'m Service], names: &mut Names) -> Vec<Plan<'m>> {
    let mut messages: BTreeMap<(u16, &str), Vec<Declared<'m>>> = BTreeMap::new();
    for service in services {
        for message in service.messages() {
            let layouts = messages.entry((message.code, &message.name)).or_default();
            let needs = |base| message.is_command && inherits(library, service, base);
            let layout = declare(layouts, message, &service.id);
            layout.needs_control |= needs(ACCESS_CONTROL);
            layout.needs_readiness |= needs(MANAGEMENT);
        }
    }
    let mut plans = Vec::new();
    let mut versions: BTreeMap<String, Names> = BTreeMap::new();
    for mut layouts in messages.into_values() {
        layouts.sort_by_key(|layout| std::cmp::Reverse(layout.version()));
        for (age, mut layout) in layouts.into_iter().enumerate() {
            layout
                .services
                .sort_by_key(|id| std::cmp::Reverse(id.version));
            let version = (age > 0).then(|| version_module(layout.version()));
            let names = match &version {
                Some(version) => versions
                    .entry(version.clone())
                    .or_insert_with(|| Names::reserving(&["codec"])),
                None => &mut *names,
            };
            plans.push(Plan {
                message: layout.message,
                ident: names.camel(&layout.message.name),
                module: names.snake(&layout.message.name),
                version,
                services: layout.services,
                needs_control: layout.needs_control,
                needs_readiness: layout.needs_readiness,
            });
        }
    }
    // The modules of versions are names in the root, too.
    for version in versions.keys() {
        names.snake(version);
    }
    plans
}

/// One layout of a message with its declaring services.
struct Declared<'m> {
    layout: String,
    /// The newest declaration.
    message: &'m Message,
    services: Vec<&'m Id>,
    needs_control: bool,
    needs_readiness: bool,
}

impl Declared<'_> {
    fn version(&self) -> Version {
        let versions = self.services.iter().map(|id| id.version);
        versions.max().unwrap_or(Version { major: 0, minor: 0 })
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
            needs_control: false,
            needs_readiness: false,
        });
    }
    let declared = &mut layouts[index];
    if service.version > declared.version() {
        declared.message = message;
    }
    if !declared.services.contains(&service) {
        declared.services.push(service);
    }
    declared
}

fn write(out: &mut Writer, plans: &[Plan<'_>], paths: &ServicePaths<'_>) {
    let sections: Vec<_> = plans
        .iter()
        .map(|plan| messages::sections(plan.message))
        .collect();
    let all = || plans.iter().zip(&sections);
    let mut shared = HashMap::new();
    for (plan, sections) in all().filter(|(plan, _)| plan.version.is_none()) {
        let others = other_layouts(plan, plans, paths);
        messages::message(out, plan, sections, &others, &mut shared);
        queries::implement(out, plan, plans, &shared);
        reports::implement(out, plan, plans);
    }
    let mut versions: Vec<_> = plans
        .iter()
        .filter_map(|plan| plan.version.as_ref())
        .collect();
    versions.sort();
    versions.dedup();
    for version in versions {
        out.gap();
        let number = version.trim_start_matches('v').replace('_', ".");
        out.push(format!(
            "/// Messages as services of version {number} had them, where newer ones differ."
        ));
        out.push(format!("pub mod {version} {{\nuse super::codec;"));
        for (plan, sections) in all().filter(|(plan, _)| plan.version.as_ref() == Some(version)) {
            let others = other_layouts(plan, plans, paths);
            messages::message(out, plan, sections, &others, &mut shared);
            queries::implement(out, plan, plans, &shared);
            reports::implement(out, plan, plans);
        }
        out.push("}");
    }
}

/// The identities of the services that declare a message with another layout.
fn other_layouts(plan: &Plan<'_>, plans: &[Plan<'_>], paths: &ServicePaths<'_>) -> Vec<String> {
    let root = plan.version.as_ref().map_or("", |_| "super::");
    let same = |it: &&Plan<'_>| {
        (it.message.code, &it.message.name) == (plan.message.code, &plan.message.name)
    };
    let others = plans.iter().filter(same);
    let others = others.flat_map(|it| &it.services);
    let others = others.filter(|id| !plan.services.contains(id));
    others.map(|id| format!("{root}{}", paths[*id])).collect()
}
