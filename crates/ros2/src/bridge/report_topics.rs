//! The topics of further reports, with types that are generated from the definitions.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use heck::ToSnakeCase;
use jaus::address::JausId;
use jsidl::dynamic;
use jsidl::ros::{Package, PackageName};

use super::definition::Definition;
use super::reports::Reports;
use crate::graph::Qos;
use crate::interface::Interfaces;
use crate::message::Message;
use crate::session::{Node, Publisher};

/// Publishes further reports of a vehicle.
pub(super) struct ReportTopics {
    package: Package,
    interfaces: Interfaces,
    /// `None` for a report that cannot be published, which was logged.
    publishers: BTreeMap<(JausId, Definition), Option<Publisher>>,
    /// How many reports were not published, because there are too many topics or they are malformed.
    refused: u64,
}

impl ReportTopics {
    /// The most topics; further reports are not published.
    const MOST: usize = 1024;

    /// The types of all definitions; `None` if no further reports are published.
    ///
    /// # Errors
    /// A generated type that is not one of ROS.
    pub(super) fn new(reports: &Reports) -> Result<Option<Self>, String> {
        let Some(library) = reports.library() else {
            return Ok(None);
        };
        let package = Package::of(library, |_| true, &PackageName::default());
        let mut interfaces = Interfaces::default();
        for (path, text) in package.files() {
            let Some(name) = path.strip_suffix(".msg") else {
                continue;
            };
            let added = interfaces.add(name, &text);
            added.map_err(|error| format!("{path}: {error}"))?;
        }
        Ok(Some(Self {
            package,
            interfaces,
            publishers: BTreeMap::new(),
            refused: 0,
        }))
    }

    /// Publishes a report.
    pub(super) fn publish(
        &mut self,
        node: &Node,
        namespace: &str,
        source: JausId,
        definition: &Definition,
        octets: &[u8],
    ) {
        let is_full = self.publishers.len() >= Self::MOST;
        let key = (source, definition.clone());
        let publisher = match self.publishers.entry(key) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(_) if is_full => {
                self.refused += 1;
                return;
            }
            Entry::Vacant(new) => {
                let topic = topic(namespace, source, &definition.message.name);
                let made = publisher(&self.package, &self.interfaces, node, &topic, definition);
                if let Err(why) = &made {
                    tracing::warn!("{topic} is not published: {why}");
                }
                new.insert(made.ok())
            }
        };
        if let Some(publisher) = publisher
            && let Err(why) = publish(&self.package, publisher, definition, octets)
        {
            tracing::debug!(%source, "{}: {why}", definition.message.name);
            self.refused += 1;
        }
    }
}

impl Drop for ReportTopics {
    fn drop(&mut self) {
        let publishers = self.publishers.values().flatten();
        let dropped: u64 = publishers.map(Publisher::dropped).sum();
        for (number, what) in [
            (
                dropped,
                "further reports dropped because a link to ROS was congested",
            ),
            (
                self.refused,
                "further reports not published: malformed, or too many topics",
            ),
        ] {
            if number > 0 {
                tracing::info!("{number} {what}");
            }
        }
    }
}

/// The topic of a report, such as `/v101/c1_33/report_wrench_effort` for node 1, component 33.
fn topic(namespace: &str, source: JausId, report: &str) -> String {
    let (node, component) = (source.node(), source.component());
    let name = report.to_snake_case();
    format!("{namespace}/c{node}_{component}/{name}")
}

fn publisher(
    package: &Package,
    interfaces: &Interfaces,
    node: &Node,
    topic: &str,
    definition: &Definition,
) -> Result<Publisher, String> {
    let Definition { service, message } = definition;
    let generated = package.interface(service, message);
    let generated = generated.ok_or("its definition has no type")?;
    let name = format!("{}/msg/{}", package.name(), generated.name());
    let interface = interfaces.get(&name).map_err(|error| error.to_string())?;
    let publisher = node.publisher(topic, &interface, Qos::default());
    publisher.map_err(|error| error.to_string())
}

fn publish(
    package: &Package,
    publisher: &Publisher,
    definition: &Definition,
    octets: &[u8],
) -> Result<(), String> {
    let Definition { service, message } = definition;
    let decoded = dynamic::decode(message, octets).map_err(|error| error.to_string())?;
    let generated = package.interface(service, message);
    let generated = generated.ok_or("its definition has no type")?;
    let value = generated
        .value(&decoded)
        .map_err(|error| error.to_string())?;
    let message = Message::from_value(publisher.interface(), value);
    let message = message.map_err(|error| error.to_string())?;
    publisher
        .publish(&message)
        .map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cdr;

    #[test]
    fn every_report_of_the_catalogue_has_a_type_of_ros() {
        let topics = ReportTopics::new(&Reports::all()).unwrap().unwrap();
        let names: Vec<_> = topics.interfaces.names().map(ToString::to_string).collect();
        assert!(names.len() > 500, "{}", names.len());
        for name in names {
            let resolved = topics.interfaces.get(&name);
            assert!(resolved.is_ok(), "{name}: {resolved:?}");
        }
    }

    #[test]
    fn a_report_is_decoded_and_fits_its_generated_type() {
        let reports = Reports::all();
        let topics = ReportTopics::new(&reports).unwrap().unwrap();
        let library = reports.library().unwrap();
        let (service, message) = library.by_code(0x4002).next().unwrap();
        let generated = topics.package.interface(&service.id, message).unwrap();
        let name = format!("jaus_msgs/msg/{}", generated.name());
        let interface = topics.interfaces.get(&name).unwrap();
        let status = dynamic::decode(message, &[0x02, 0x40, 5, 0, 0, 0, 0]).unwrap();
        let value = generated.value(&status).unwrap();
        let message = Message::from_value(&interface, value).unwrap();
        assert_eq!(message.float("status").unwrap(), 5.0);
        assert_eq!(
            cdr::decode(&interface, &cdr::encode(&message)).unwrap(),
            message
        );
    }

    #[test]
    fn a_topic_has_namespace_component_and_the_name_in_lower_case() {
        let name = topic("/v101", JausId::new(101, 1, 33), "ReportWrenchEffort");
        assert_eq!(name, "/v101/c1_33/report_wrench_effort");
        assert!(name.parse::<crate::TopicName>().is_ok());
    }
}
