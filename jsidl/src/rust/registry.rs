//! Generates the tables of a set: services by identity, messages by code.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::docs;
use super::ident::{Names, version_constant};
use super::machine::{self, Messages};
use super::plan::Plan;
use super::queries;
use super::services::service;
use super::writer::Writer;
use crate::model::{Id, Message, Service};

/// Constants of the services: identity to path from the root of the set.
pub(super) type ServicePaths<'m> = BTreeMap<&'m Id, String>;

/// Versions of one service, the newest first, with the name of their module.
pub(super) struct Versions<'m> {
    pub(super) services: Vec<&'m Service>,
    module: String,
}

/// The modules of services to generate.
pub(super) fn versions<'m>(services: &[&'m Service], names: &mut Names) -> Vec<Versions<'m>> {
    let mut by_urn: BTreeMap<&str, Vec<&Service>> = BTreeMap::new();
    for &service in services {
        by_urn.entry(&service.id.urn).or_default().push(service);
    }
    let named = by_urn.into_values().map(|mut services| {
        services.sort_by_key(|service| std::cmp::Reverse(service.id.version));
        let module = names.snake(&services[0].name);
        Versions { services, module }
    });
    named.collect()
}

/// Writes a module per service, for all versions: constants, state machines, the trait and the server.
pub(super) fn services<'m>(
    out: &mut Writer,
    all: &[Versions<'m>],
    messages: Messages<'_>,
) -> ServicePaths<'m> {
    let mut paths = ServicePaths::new();
    for Versions { services, module } in all {
        let newest = services[0];
        let urn = &*newest.id.urn;
        out.gap();
        out.doc([
            format!("The service `{}`.", newest.name).as_str(),
            &docs::prose(&newest.description),
        ]);
        out.allow_deprecated();
        out.push(format!("pub mod {module} {{\nuse super::codec;"));
        out.gap();
        out.push(format!(
            "/// What the service is called, whatever its version.\npub const URN: &str = {urn:?};"
        ));
        for service in services {
            let version = service.id.version;
            let constant = version_constant(version);
            out.gap();
            out.push(format!("/// Version {version}."));
            out.push(format!(
                "pub const {constant}: codec::ServiceId = codec::ServiceId {{"
            ));
            out.push(format!(
                "urn: URN,\nmajor: {},\nminor: {},\n}};",
                version.major, version.minor
            ));
            paths.insert(&service.id, format!("{module}::{constant}"));
        }
        out.gap();
        let constant = version_constant(newest.id.version);
        out.push(format!(
            "/// The newest version.\npub const LATEST: codec::ServiceId = {constant};"
        ));
        machine::machines(out, messages, services);
        service(out, messages, services);
        out.push("}");
    }
    paths
}

/// Writes `SERVICES` and `MESSAGES`.
pub(super) fn tables(
    out: &mut Writer,
    services: &[&Service],
    paths: &ServicePaths<'_>,
    plans: &[Plan<'_>],
) {
    out.gap();
    out.push("/// The services of the set, by URN and version.");
    out.push("pub static SERVICES: &[codec::ServiceInfo] = &[");
    for service in services {
        let base = match &service.inherits_from {
            Some(base) => format!("Some({})", service_id(&base.id, paths)),
            None => "None".to_owned(),
        };
        let codes = |messages: &[Arc<Message>]| codes(messages.iter().map(AsRef::as_ref));
        let members = [
            format!("name: {:?}", service.name),
            format!("id: {}", paths[&service.id]),
            format!("inherits_from: {base}"),
            format!("inputs: &[{}]", codes(&service.inputs)),
            format!("outputs: &[{}]", codes(&service.outputs)),
        ];
        out.list("codec::ServiceInfo {", &members, "},");
    }
    out.push("];");
    out.gap();
    out.push(
        "/// The message types of the set, by code; of several with one code the newest first.",
    );
    out.allow_deprecated();
    out.push("pub static MESSAGES: &[codec::MessageInfo] = &[");
    for plan in plans {
        let services: Vec<_> = plan
            .services
            .iter()
            .map(|id| service_id(id, paths))
            .collect();
        let kind = match queries::report(plan, plans) {
            Some(_) => "of_query",
            None => "of",
        };
        let open = format!("codec::MessageInfo::{kind}::<{}>(&[", plan.path());
        out.list(&open, &services, "]),");
    }
    out.push("];");
}

/// The constant of the set's service, or the identity of a foreign one.
fn service_id(id: &Id, paths: &ServicePaths<'_>) -> String {
    paths.get(id).cloned().unwrap_or_else(|| {
        let (urn, version) = (&id.urn, id.version);
        format!(
            "codec::ServiceId {{ urn: {urn:?}, major: {}, minor: {} }}",
            version.major, version.minor
        )
    })
}

fn codes<'m>(messages: impl Iterator<Item = &'m Message>) -> String {
    let codes: Vec<_> = messages
        .map(|message| format!("0x{:04X}", message.code))
        .collect();
    codes.join(", ")
}
