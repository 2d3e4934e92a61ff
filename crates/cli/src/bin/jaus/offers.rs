//! The services that a component lists, and whether one of them can receive a message.

use std::collections::BTreeMap;
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, QueryOptions};
use jaus::messages::core::query_services::{ComponentId, ComponentRec, NodeId, NodeRec, NodeSeq};
use jaus::messages::core::{QueryServices, ReportServices};
use jaus_view::Dictionary;

/// How long to wait for the list.
const LIMIT: Duration = Duration::from_secs(1);

/// The query for the services of one component.
pub(crate) fn query_services(of: JausId) -> QueryServices {
    QueryServices {
        node_list: vec![NodeSeq {
            node_rec: NodeRec {
                node_id: NodeId(of.node()),
            },
            component_list: vec![ComponentRec {
                component_id: ComponentId(of.component()),
            }],
        }],
    }
}

/// The services of one component, by URN, with major and minor version; `None` if the report has
/// none. Some peers list the component under the wildcard number.
pub(crate) fn services(report: &ReportServices, of: JausId) -> Option<BTreeMap<String, (u8, u8)>> {
    let nodes = report.node_list.iter();
    let nodes = nodes.filter(|node| node.node_rec.node_id == of.node());
    let components = nodes.flat_map(|node| &node.component_list);
    let wanted = [of.component(), JausId::ANY_COMPONENT];
    let component = components.filter(|one| wanted.contains(&one.component_rec.component_id));
    let mut services = BTreeMap::new();
    for service in component.flat_map(|component| &component.service_list) {
        let uri = service.uri.to_string_lossy().into_owned();
        let version = (service.major_version_number, service.minor_version_number);
        let newest = services.entry(uri).or_insert(version);
        *newest = version.max(*newest);
    }
    (!services.is_empty()).then_some(services)
}

/// Why a component will not handle a message, if its list has none of the message's services.
pub(crate) fn not_offered(
    dictionary: &Dictionary,
    report: &ReportServices,
    of: JausId,
    code: u16,
) -> Option<String> {
    let offered = services(report, of)?;
    let missing = dictionary.missing_services(offered.keys().map(String::as_str), code);
    let name = dictionary.name_of(code)?;
    let missing: Vec<_> = missing.into_iter().collect();
    (!missing.is_empty()).then(|| {
        let services = missing.join(" or ");
        format!("{of} does not offer the service of {name}: {services}")
    })
}

/// Requests the list of a component, and explains as [`not_offered`] does why it will not handle one
/// of these messages.
pub(crate) async fn ask_if_not_offered(
    component: &Component,
    dictionary: &Dictionary,
    peer: JausId,
    codes: &[u16],
) -> Option<String> {
    let options = QueryOptions::default().within(LIMIT);
    let report = component
        .query_with(options, peer, &query_services(peer))
        .await
        .ok()?;
    codes
        .iter()
        .find_map(|&code| not_offered(dictionary, &report, peer, code))
}
