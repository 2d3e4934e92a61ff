//! Which further reports of the vehicle are published, with their definitions.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use jaus::service::{ComponentEntry, Offer};
use jaus_vehicle::messages;
use jaus_view::{Dictionary, Request};
use jsidl::Library;
use jsidl::model::{Message, Service};

use super::definition::Definition;
use super::following::Extra;

/// No definition has a report with this name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct UnknownReport(String);

/// The reports to publish besides those that have a type of ROS's own.
#[derive(Debug)]
pub struct Reports {
    dictionary: Option<Dictionary>,
    chosen: Chosen,
}

#[derive(Debug)]
enum Chosen {
    All,
    /// By name.
    Some(BTreeSet<String>),
}

/// The services whose reports are about the network itself. They are published only by name.
const OF_NETWORK: [&str; 4] = [
    "urn:jaus:jss:core:Transport",
    "urn:jaus:jss:core:Events",
    "urn:jaus:jss:core:Discovery",
    "urn:jaus:jss:core:Liveness",
];

impl Reports {
    /// No further reports.
    #[must_use]
    pub const fn none() -> Self {
        Self {
            dictionary: None,
            chosen: Chosen::Some(BTreeSet::new()),
        }
    }

    /// All reports that a query answers, but those about the network itself.
    #[must_use]
    pub fn all() -> Self {
        Self {
            dictionary: Some(dictionary()),
            chosen: Chosen::All,
        }
    }

    /// Reports by name, such as `ReportWrenchEffort`.
    ///
    /// # Errors
    /// The first name that no definition has, with the one that is most like it.
    pub fn named(names: &[String]) -> Result<Self, UnknownReport> {
        if names.is_empty() {
            return Ok(Self::none());
        }
        let dictionary = dictionary();
        for name in names {
            let outputs = dictionary.library().services().flat_map(|it| &it.outputs);
            let is_report = |it: &Arc<Message>| it.name == *name && it.name.starts_with(REPORT);
            if !outputs.clone().any(is_report) {
                return Err(unknown(name, outputs.map(|it| &*it.name)));
            }
        }
        let chosen = Chosen::Some(names.iter().cloned().collect());
        let dictionary = Some(dictionary);
        Ok(Self { dictionary, chosen })
    }

    /// The definitions of all services that are known, for their types.
    #[must_use]
    pub fn library(&self) -> Option<&Library> {
        self.dictionary.as_ref().map(Dictionary::library)
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_none(&self) -> bool {
        self.dictionary.is_none()
    }

    /// The subscriptions to the chosen reports of a component.
    pub(super) fn of(&self, entry: &ComponentEntry) -> Vec<Extra> {
        let Some(dictionary) = &self.dictionary else {
            return Vec::new();
        };
        let library = dictionary.library();
        let mut extras = BTreeMap::new();
        for offer in entry.offered() {
            let Some(service) = version(library, offer) else {
                continue;
            };
            for declaring in library.lineage(service) {
                for message in declaring
                    .outputs
                    .iter()
                    .filter(|it| self.wants(declaring, it))
                {
                    if let Some(query) = encoded_query(dictionary, message) {
                        extras.entry(message.code).or_insert_with(|| Extra {
                            peer: entry.id,
                            query,
                            report: message.code,
                            definition: Definition {
                                service: declaring.id.clone(),
                                message: message.clone(),
                            },
                        });
                    }
                }
            }
        }
        extras.into_values().collect()
    }

    fn wants(&self, declaring: &Service, message: &Message) -> bool {
        match &self.chosen {
            Chosen::All => !OF_NETWORK.contains(&&*declaring.id.urn),
            Chosen::Some(names) => names.contains(&message.name),
        }
    }
}

/// The beginning of the names of reports.
const REPORT: &str = "Report";

/// All messages that the tool `jaus` knows. Reading them takes some milliseconds.
fn dictionary() -> Dictionary {
    Dictionary::of(messages::registry()).with_catalogue()
}

/// The version of a service to decode the reports of a provider: its own, or the newest before.
fn version<'l>(library: &'l Library, offer: &Offer) -> Option<&'l Service> {
    let is_before = |service: &&Arc<Service>| {
        let version = service.id.version;
        version.major == offer.major && version.minor <= offer.minor
    };
    let versions = library.versions(&offer.urn);
    versions.filter(is_before).last().map(AsRef::as_ref)
}

/// The query for all fields of a report; `None` if no query asks for it alone.
fn encoded_query(dictionary: &Dictionary, report: &Message) -> Option<bytes::Bytes> {
    let name = report.name.strip_prefix(REPORT)?;
    let request = Request::new(format!("Query{name}"), serde_json::json!({}));
    let query = dictionary.query(&request, &[]).ok()?;
    (query.report == report.code).then_some(query.octets)
}

fn unknown<'n>(name: &str, known: impl Iterator<Item = &'n str>) -> UnknownReport {
    let name: String = name.chars().take(100).collect();
    let likeness = |known: &str| strsim::normalized_damerau_levenshtein(known, &name);
    let known: BTreeSet<_> = known.filter(|it| it.starts_with(REPORT)).collect();
    let nearest = known
        .into_iter()
        .max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    let hint = nearest.filter(|it| likeness(it) > 0.6);
    let hint = hint.map_or_else(
        || "`jaus list messages` lists them".to_owned(),
        |it| format!("did you mean {it}?"),
    );
    UnknownReport(format!("there is no report `{name}`: {hint}"))
}

#[cfg(test)]
mod tests {
    use jaus::address::JausId;
    use jaus::codec::Message as _;
    use jaus::messages::core::management;
    use jaus::messages::mobility::{QueryWrenchEffort, primitive_driver};

    use super::*;

    fn driver() -> ComponentEntry {
        let offers = [management::LATEST, primitive_driver::LATEST].map(Offer::from);
        ComponentEntry {
            id: JausId::new(101, 1, 33),
            identification: None,
            services: Some(offers.into()),
        }
    }

    #[test]
    fn a_report_is_subscribed_to_by_its_query_for_all_fields() {
        let reports = Reports::named(&["ReportWrenchEffort".to_owned()]).unwrap();
        let extras = reports.of(&driver());
        assert_eq!(extras.len(), 1, "{extras:?}");
        assert_eq!(extras[0].report, 0x4405);
        assert_eq!(extras[0].query, QueryWrenchEffort::all().encode().unwrap());
        assert_eq!(&*extras[0].definition.service.urn, primitive_driver::URN);
    }

    #[test]
    fn all_reports_are_those_of_the_services_and_of_those_that_they_extend_but_not_of_the_network()
    {
        let names = |reports: &Reports| -> Vec<_> {
            let extras = reports.of(&driver()).into_iter();
            extras
                .map(|it| it.definition.message.name.clone())
                .collect()
        };
        let all = names(&Reports::all());
        for expected in ["ReportWrenchEffort", "ReportStatus", "ReportControl"] {
            assert!(all.iter().any(|it| it == expected), "{expected}: {all:?}");
        }
        assert!(
            !all.iter().any(|it| it == "ReportIdentification"),
            "{all:?}"
        );
        assert!(names(&Reports::none()).is_empty());
    }

    #[test]
    fn an_unknown_name_is_refused_with_the_nearest_one() {
        let refused = |name: &str| Reports::named(&[name.to_owned()]).unwrap_err().to_string();
        let misspelt = refused("ReportWrenchEfort");
        assert!(
            misspelt.ends_with("did you mean ReportWrenchEffort?"),
            "{misspelt}"
        );
        let query = refused("QueryWrenchEffort");
        assert!(query.contains("ReportWrenchEffort"), "{query}");
        let other = refused("Battery voltage");
        assert!(other.contains("jaus list messages"), "{other}");
    }
}
