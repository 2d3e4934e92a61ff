//! Plan of typed code in any language: sets, versions, names and nested types.
//!
//! [`sets`] walks the resolved services once. The generators of [`typescript`](crate::typescript),
//! [`cpp`](crate::cpp), [`python`](crate::python) and [`ros`](crate::ros) write its result in their
//! syntax.
//!
//! Services are grouped into sets by their URN without the last part. A message is defined once for
//! each layout, in the namespace of the oldest version that declares it. Later versions with the
//! same layout, and the set itself for the newest layout, refer to that definition. An additional
//! definition therefore never renames a type of a version.

pub(crate) mod keywords;
pub(crate) mod lines;
pub(crate) mod names;
pub(crate) mod notes;
pub(crate) mod types;

use std::collections::BTreeMap;

use self::names::{Names, Spelling};
use self::types::{Definition, Field, Nested};
use crate::fingerprint;
use crate::library::Library;
use crate::model::{Id, Item, Message, Service, Shape, Unsigned, Version};

/// The services whose URNs differ in the last part only.
#[derive(Debug)]
pub(crate) struct Set<'m> {
    /// For example `core`.
    pub(crate) name: String,
    /// The common part of the URNs, such as `urn:jaus:jss:core`.
    pub(crate) urn: &'m str,
    /// In the order of the versions that define them, then by code.
    pub(crate) messages: Vec<Plan<'m>>,
}

/// One layout of a message.
#[derive(Debug)]
pub(crate) struct Plan<'m> {
    /// The newest declaration of the layout.
    pub(crate) message: &'m Message,
    /// The versions that declare the layout, with the type's name in each. The first one defines it.
    pub(crate) places: Vec<(Version, String)>,
    /// The type's name in the set, if no newer version has another layout.
    pub(crate) newest: Option<String>,
    /// The declaring services.
    pub(crate) services: Vec<&'m Id>,
    /// The name of the report that answers it, if it is a query.
    pub(crate) report: Option<&'m str>,
    /// The content after the message code.
    pub(crate) content: Content<'m>,
    /// Nested types; each one uses only those before it.
    pub(crate) types: Vec<Definition<'m>>,
}

/// The content of a message.
#[derive(Debug)]
pub(crate) enum Content<'m> {
    /// The members of the body, and its presence vector.
    Members(Vec<Field<'m>>, Option<Unsigned>),
    /// A body that is a list or variant.
    Whole(Field<'m>),
    /// Header, body and footer of a message that has more than a body.
    Sections(Vec<Field<'m>>),
}

impl<'m> Content<'m> {
    /// The members of the message's type.
    pub(crate) fn fields(&self) -> &[Field<'m>] {
        match self {
            Self::Members(fields, _) | Self::Sections(fields) => fields,
            Self::Whole(field) => std::slice::from_ref(field),
        }
    }
}

impl Plan<'_> {
    /// The version that defines the type, and the type's name.
    pub(crate) fn definition(&self) -> (Version, &str) {
        // A layout has at least one declaring service.
        self.places
            .first()
            .map_or((Version { major: 0, minor: 0 }, ""), |(version, ident)| {
                (*version, ident)
            })
    }
}

impl<'m> Set<'m> {
    /// The versions with messages, the oldest first.
    pub(crate) fn versions(&self) -> Vec<Version> {
        let places = self.messages.iter().flat_map(|plan| &plan.places);
        let mut versions: Vec<_> = places.map(|(version, _)| *version).collect();
        versions.sort_unstable();
        versions.dedup();
        versions
    }

    /// The messages that a version defines.
    pub(crate) fn defined_in(&self, version: Version) -> impl Iterator<Item = &Plan<'m>> {
        let plans = self.messages.iter();
        plans.filter(move |plan| plan.definition().0 == version)
    }

    /// The messages that a version shares with an older one, with the name in the version.
    pub(crate) fn shared_in(&self, version: Version) -> impl Iterator<Item = (&Plan<'m>, &str)> {
        self.messages.iter().flat_map(move |plan| {
            let later = plan.places.iter().skip(1);
            let here = later.filter(move |(other, _)| *other == version);
            here.map(move |(_, ident)| (plan, ident.as_str()))
        })
    }
}

/// Plans the services that `wanted` selects, one set after the other.
pub(crate) fn sets<'m>(
    library: &'m Library,
    wanted: impl Fn(&Service) -> bool,
    spelling: &'static Spelling,
) -> Vec<Set<'m>> {
    let mut by_urn: BTreeMap<&str, Vec<&Service>> = BTreeMap::new();
    let services = library.services().map(AsRef::<Service>::as_ref);
    for service in services.filter(|service| wanted(service)) {
        let urn = service.id.urn.rsplit_once(':').map_or("", |(set, _)| set);
        by_urn.entry(urn).or_default().push(service);
    }
    let mut names = Names::new(spelling);
    let sets = by_urn.into_iter();
    sets.map(|(urn, services)| Set {
        name: names.set(urn),
        urn,
        messages: plans(&services, spelling),
    })
    .filter(|set| !set.messages.is_empty())
    .collect()
}

/// One layout of a message with its declaring services.
struct Layout<'m> {
    fingerprint: String,
    services: Vec<(&'m Service, &'m Message)>,
}

impl<'m> Layout<'m> {
    /// Sorted, without duplicates.
    fn versions(&self) -> Vec<Version> {
        let versions = self.services.iter().map(|(it, _)| it.id.version);
        let mut versions: Vec<_> = versions.collect();
        versions.sort_unstable();
        versions.dedup();
        versions
    }

    fn newest(&self) -> Option<(&'m Service, &'m Message)> {
        let services = self.services.iter().copied();
        services.max_by_key(|(it, _)| it.id.version)
    }
}

/// The layouts of each message, by code and name.
fn layouts<'m>(services: &[&'m Service]) -> BTreeMap<(u16, &'m str), Vec<Layout<'m>>> {
    let mut messages: BTreeMap<(u16, &str), Vec<Layout<'_>>> = BTreeMap::new();
    for service in services {
        for message in service.messages() {
            let layouts = messages.entry((message.code, &message.name)).or_default();
            let fingerprint = fingerprint::layout(message);
            let declared = (*service, message.as_ref());
            match layouts.iter_mut().find(|it| it.fingerprint == fingerprint) {
                // A message in both sets of a service comes twice.
                Some(known) if known.services.iter().any(|(it, _)| it.id == service.id) => {}
                Some(known) => known.services.push(declared),
                None => layouts.push(Layout {
                    fingerprint,
                    services: vec![declared],
                }),
            }
        }
    }
    messages
}

fn plans<'m>(services: &[&'m Service], spelling: &'static Spelling) -> Vec<Plan<'m>> {
    let mut root = Names::new(spelling);
    let mut in_versions: BTreeMap<Version, Names> = BTreeMap::new();
    let mut plans = Vec::new();
    for ((_, name), mut layouts) in layouts(services) {
        let ident = root.type_name(name);
        layouts.sort_by_key(|layout| layout.newest().map(|(it, _)| it.id.version));
        let last = layouts.len().saturating_sub(1);
        for (age, layout) in layouts.iter().enumerate() {
            let Some((service, message)) = layout.newest() else {
                continue;
            };
            let place = |version| {
                let names = in_versions.entry(version);
                let names = names.or_insert_with(|| Names::new(spelling));
                (version, names.type_name(&ident))
            };
            let places: Vec<_> = layout.versions().into_iter().map(place).collect();
            let mut nested = Nested::new(spelling, places.first().map_or("", |(_, it)| it));
            let content = content(message, &mut nested);
            plans.push(Plan {
                message,
                places,
                newest: (age == last).then(|| ident.clone()),
                services: layout.services.iter().map(|(it, _)| &it.id).collect(),
                report: service.report_of(message).map(|it| it.name.as_str()),
                content,
                types: nested.definitions,
            });
        }
    }
    plans.sort_by_key(|plan| (plan.definition().0, plan.message.code));
    plans
}

fn content<'m>(message: &'m Message, nested: &mut Nested<'m>) -> Content<'m> {
    if message.header.is_some() || message.footer.is_some() {
        let sections = [
            ("header", &message.header),
            ("body", &message.body),
            ("footer", &message.footer),
        ];
        let present = sections.into_iter();
        let present = present.filter_map(|(key, item)| Some((key, item.as_ref()?)));
        return Content::Sections(nested.named(present));
    }
    match &message.body {
        None => Content::Members(Vec::new(), None),
        Some(Item {
            shape: Shape::Group(group),
            ..
        }) => Content::Members(nested.fields(&group.members), group.presence),
        Some(body) => {
            let mut fields = nested.fields([body]);
            // One item makes one field.
            match fields.pop() {
                Some(field) => Content::Whole(field),
                None => Content::Members(Vec::new(), None),
            }
        }
    }
}
