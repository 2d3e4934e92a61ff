//! Generates Rust from resolved services: typed messages over the codec runtime of the crate
//! `jaus`.
//!
//! The output is indented and documented, to be included from a build script's `OUT_DIR`;
//! [`build`](crate::build) does all of that. Messages are in modules of the versions of their services,
//! such as `v1_0`; the types inside a message are in a module with its name. The newest layouts are in
//! the root, too. A message that several services or versions declare with one layout is one type. A
//! message converts into its next newer layout if that loses nothing. The state machine of a service is
//! in the service's module.

mod arrays;
mod choices;
mod conversions;
mod decode;
mod dimension;
mod docs;
mod encode;
mod ident;
mod layout;
mod machine;
mod members;
mod messages;
mod newtypes;
mod plan;
mod queries;
mod random;
mod registry;
mod reports;
pub(crate) mod selections;
mod services;
mod structs;
mod types;
mod writer;

use std::collections::{BTreeMap, BTreeSet, HashMap};

use self::ident::Names;
use self::machine::{Extern, Messages};
use self::messages::Written;
use self::plan::Plan;
use self::registry::ServicePaths;
use self::writer::Writer;
use crate::library::Library;
use crate::model::{Service, Version};
use crate::typed::names;

/// How generated code finds what it refers to.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Settings {
    runtime: String,
    /// Paths of other modules, each with the beginnings of the URNs of its services.
    externs: Vec<(String, Vec<String>)>,
    warns_of_deprecated: bool,
}

impl Settings {
    /// `runtime` is the path of the codec runtime as the generated module sees it, for example
    /// `::jaus::codec`.
    pub fn new(runtime: &str) -> Self {
        Self {
            runtime: runtime.to_owned(),
            externs: Vec::new(),
            warns_of_deprecated: true,
        }
    }

    /// The same with another path of the codec runtime.
    #[must_use]
    pub fn with_runtime(mut self, path: &str) -> Self {
        path.clone_into(&mut self.runtime);
        self
    }

    /// The module that has the messages of the services whose URN begins with `urn`, for example
    /// `::jaus::messages::core`. State machines then get these messages as their types instead of as
    /// octets. The module must have been generated from the same definitions.
    #[must_use]
    pub fn extern_path(mut self, urn: &str, path: &str) -> Self {
        match self.externs.iter_mut().find(|(known, _)| known == path) {
            Some((_, urns)) => urns.push(urn.to_owned()),
            None => self.externs.push((path.to_owned(), vec![urn.to_owned()])),
        }
        self
    }

    /// Whether the compiler warns of uses of messages that all their services call deprecated; it does if
    /// nothing else is set. Code that must talk to peers of older versions may have it off.
    #[must_use]
    pub const fn warn_of_deprecated(mut self, warns: bool) -> Self {
        self.warns_of_deprecated = warns;
        self
    }
}

/// Generates the Rust module of a set of services, which may inherit from others in the library.
///
/// `runtime` is the path of the codec runtime as the generated module sees it, for example
/// `::jaus::codec`.
pub fn module<'m>(
    library: &'m Library,
    services: impl IntoIterator<Item = &'m Service>,
    runtime: &str,
) -> String {
    module_with(library, services, &Settings::new(runtime))
}

/// [`module`] with other settings.
pub fn module_with<'m>(
    library: &'m Library,
    services: impl IntoIterator<Item = &'m Service>,
    settings: &Settings,
) -> String {
    let runtime = &settings.runtime;
    let mut services: Vec<_> = services.into_iter().collect();
    services.sort_by_key(|service| &service.id);
    let mut out = Writer::default();
    let rename = if runtime.ends_with("::codec") {
        ""
    } else {
        " as codec"
    };
    out.push(format!("use {runtime}{rename};"));
    let modules = plan::version_modules(&services);
    let mut names = Names::reserving(&["codec"]);
    names.reserve(&modules);
    let versions = registry::versions(&services, &mut names);
    let mut plans = plan::plan(library, &services, &mut names);
    for plan in &mut plans {
        plan.is_deprecated &= settings.warns_of_deprecated;
    }
    let has_deprecated = plans.iter().any(|plan| plan.is_deprecated);
    out.uses_deprecated(has_deprecated || !settings.externs.is_empty());
    let externs: Vec<_> = settings
        .externs
        .iter()
        .map(|(path, urns)| Extern::of(library, path, urns))
        .collect();
    let messages = Messages {
        library,
        plans: &plans,
        externs: &externs,
    };
    let paths = registry::services(&mut out, &versions, messages);
    registry::tables(&mut out, &services, &paths, &plans);
    write(&mut out, &plans, &paths);
    out.finish()
}

fn write(out: &mut Writer, plans: &[Plan<'_>], paths: &ServicePaths<'_>) {
    let sections: Vec<_> = plans
        .iter()
        .map(|plan| messages::sections(plan.message))
        .collect();
    let mut shared = HashMap::new();
    let mut written: Vec<Option<Written>> = plans.iter().map(|_| None).collect();
    let versions = plans.iter().flat_map(|plan| {
        let later = plan.later.iter().map(|(version, _)| *version);
        std::iter::once(plan.version).chain(later)
    });
    for version in versions.collect::<BTreeSet<_>>() {
        out.gap();
        out.push(format!(
            "/// The messages of services of version {version}."
        ));
        out.allow_deprecated();
        out.push(format!("pub mod {} {{", names::version(version)));
        if plans.iter().any(|plan| plan.version == version) {
            out.push("use super::codec;");
        }
        aliases(out, plans, &written, |plan| {
            let mut later = plan.later.iter();
            later.find(|(it, _)| *it == version).map(|(_, names)| names)
        });
        for (place, plan) in plans.iter().enumerate() {
            if plan.version == version {
                let others = other_layouts(plan, plans, paths);
                let section = &sections[place];
                written[place] = Some(messages::message(out, plan, section, &others, &mut shared));
                queries::implement(out, plan, plans, &shared);
                reports::implement(out, plan, plans);
            }
        }
        out.push("}");
    }
    aliases(out, plans, &written, |plan| plan.root.as_ref());
    let members = written.into_iter().flatten().map(|it| it.members);
    conversions::implement(out, plans, &members.collect::<Vec<_>>());
}

/// Writes the imports of types that are defined in the modules of other versions, by the names that
/// they get.
fn aliases<'p>(
    out: &mut Writer,
    plans: &'p [Plan<'_>],
    written: &[Option<Written>],
    names: impl Fn(&'p Plan<'_>) -> Option<&'p [String; 2]>,
) {
    let root = if out.is_in_module() { "super::" } else { "" };
    let mut by_version: BTreeMap<Version, Vec<String>> = BTreeMap::new();
    for (plan, written) in plans.iter().zip(written) {
        let (Some([ident, module]), Some(written)) = (names(plan), written) else {
            continue;
        };
        let items = by_version.entry(plan.version).or_default();
        items.push(alias(&plan.ident, ident));
        if written.has_module {
            items.push(alias(&plan.module, module));
        }
    }
    for (version, items) in by_version {
        out.gap();
        out.import(&format!("{root}{}", names::version(version)), &items);
    }
}

fn alias(name: &str, new: &str) -> String {
    match name == new {
        true => name.to_owned(),
        false => format!("{name} as {new}"),
    }
}

/// The identities of the services that declare a message with another layout.
fn other_layouts(plan: &Plan<'_>, plans: &[Plan<'_>], paths: &ServicePaths<'_>) -> Vec<String> {
    let others = plans.iter().filter(|it| it.is_layout_of(plan.message));
    let others = others.flat_map(|it| &it.services);
    let others = others.filter(|id| !plan.services.contains(id));
    others.map(|id| format!("super::{}", paths[*id])).collect()
}
