//! A query to send, made from its name and the fields that its report is to have.

use std::cmp::Ordering;
use std::collections::BTreeSet;

use bytes::Bytes;
use jaus::messages;
use jsidl::model::Service;
use jsidl::presence;
use serde_json::{Map, Value as Json};

use super::definition::{Definition, Unreadable};
use super::dictionary::Dictionary;
use super::request::Request;

/// A query and the report that answers it.
///
/// ```
/// use jaus_view::{Dictionary, Request};
///
/// let request = Request::new("QueryVelocityState", serde_json::json!({}));
/// let dictionary = Dictionary::new().with_catalogue();
/// let query = dictionary.query(&request, &["velocity_x".to_owned()])?;
/// assert_eq!((query.name.as_str(), query.report), ("QueryVelocityState", 0x4404));
/// # Ok::<(), jaus_view::Unreadable>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EncodedQuery {
    /// The name of the query.
    pub name: String,
    /// The query, from its message code.
    pub octets: Bytes,
    /// The message code of the report.
    pub report: u16,
}

impl Dictionary {
    /// Encodes a query. Each presence vector that the request omits gets the bits of `fields`, or,
    /// if there are none, of every field that it can request.
    ///
    /// Names of fields are compared without case, underscores and spaces.
    ///
    /// # Errors
    /// If the message is not a query, has no such field, or its body does not fit the definition.
    pub fn query(&self, request: &Request, fields: &[String]) -> Result<EncodedQuery, Unreadable> {
        let mut failure = None;
        for definition in self.requested(request)? {
            let name = definition.name().to_owned();
            let Some(report) = self.report_of(definition) else {
                let problem = format!("{name} is not a query: no report answers it");
                return Err(Unreadable::new(problem, 0));
            };
            let body = self.with_presence_vectors(definition, report, &request.body, fields)?;
            match definition.encode(&body) {
                Ok(octets) => {
                    let report = report.code();
                    return Ok(EncodedQuery {
                        name,
                        octets,
                        report,
                    });
                }
                Err(problem) => {
                    failure.get_or_insert(problem);
                }
            }
        }
        Err(Unreadable::new(failure.unwrap_or_default(), 0))
    }

    /// The names of the fields that a query can request of its report.
    ///
    /// # Errors
    /// If the request names no definition.
    pub fn requestable_fields(&self, request: &Request) -> Result<Vec<String>, Unreadable> {
        let requested = self.requested(request)?;
        let first = requested.first().copied();
        let vectors = first.and_then(|query| Some(self.vectors(query, self.report_of(query)?)));
        let fields = vectors.into_iter().flatten().flat_map(|it| it.fields);
        Ok(fields.map(|(name, _)| name).collect())
    }

    /// The report that answers a query, as a service of the query defines it.
    fn report_of(&self, query: &Definition) -> Option<&Definition> {
        let shares_service =
            |it: &&Definition| it.services.iter().any(|it| query.services.contains(it));
        let code = self.report_code(query)?;
        let mut known = self.candidates(code);
        known
            .find(shares_service)
            .or_else(|| self.candidates(code).next())
    }

    fn report_code(&self, query: &Definition) -> Option<u16> {
        let library = self.library();
        let services = query.services.iter().filter_map(|id| library.service(id));
        let mut reports = services.filter_map(|service| {
            let mut inputs = service.inputs.iter();
            let declared = inputs.find(|it| it.code == query.code() && it.name == query.name())?;
            service.report_of(declared)
        });
        let defined = reports.next().map(|it| it.code);
        defined.or_else(|| messages::registry().report_of(query.code()))
    }

    /// The services that receive a message, if a component that offers these services has none of
    /// them: not even one that inherits from them. Empty if that is not known for certain.
    pub fn missing_services<'o>(
        &self,
        offered: impl IntoIterator<Item = &'o str>,
        code: u16,
    ) -> BTreeSet<&str> {
        let library = self.library();
        let receives = |service: &Service| service.inputs.iter().any(|it| it.code == code);
        let may_receive = |urn: &str| {
            let mut versions = library.versions(urn).peekable();
            // An unknown service may inherit from any.
            versions.peek().is_none() || versions.any(|it| library.lineage(it).any(receives))
        };
        if offered.into_iter().any(may_receive) {
            return BTreeSet::new();
        }
        let receivers = library.services().filter(|it| receives(it));
        receivers.map(|it| &*it.id.urn).collect()
    }

    fn vectors(&self, query: &Definition, report: &Definition) -> Vec<presence::PresenceVector> {
        let models = self.model(query).zip(self.model(report));
        models.map_or_else(Vec::new, |(query, report)| presence::vectors(query, report))
    }

    /// The body with the presence vectors that it omits.
    fn with_presence_vectors(
        &self,
        query: &Definition,
        report: &Definition,
        body: &Json,
        fields: &[String],
    ) -> Result<Json, Unreadable> {
        let Json::Object(given) = body else {
            return Ok(body.clone());
        };
        let mut body: Map<String, Json> = given.clone();
        let mut vectors = self.vectors(query, report);
        vectors.retain(|vector| !given.contains_key(&vector.name));
        let known: Vec<_> = vectors.iter().flat_map(|it| &it.fields).collect();
        for field in fields {
            if !known.iter().any(|(name, _)| is_same_name(name, field)) {
                let known = known.iter().map(|(name, _)| name.as_str());
                return Err(no_field(field, query.name(), &known.collect::<Vec<_>>()));
            }
        }
        for vector in vectors {
            let wanted =
                |name: &str| fields.is_empty() || fields.iter().any(|it| is_same_name(name, it));
            let bits = vector.fields.iter().filter(|(name, _)| wanted(name));
            let bits = bits.fold(0_u64, |bits, (_, bit)| bits | 1 << bit);
            body.insert(vector.name, bits.into());
        }
        Ok(Json::Object(body))
    }
}

fn no_field(field: &str, query: &str, known: &[&str]) -> Unreadable {
    let alike = |it: &&str| strsim::normalized_damerau_levenshtein(&plain(it), &plain(field));
    let by_likeness =
        |a: &&str, b: &&str| alike(a).partial_cmp(&alike(b)).unwrap_or(Ordering::Equal);
    let nearest = known.iter().copied().max_by(by_likeness);
    Unreadable::new(
        match nearest {
            None => format!("{query} has no fields to choose: omit --fields"),
            Some(nearest) if alike(&nearest) > 0.6 => {
                format!("{query} has no field {field}; did you mean {nearest}?")
            }
            Some(_) => format!(
                "{query} has no field {field}: choose from {}",
                known.join(", ")
            ),
        },
        0,
    )
}

/// Whether two names are equal without case, underscores and spaces.
#[must_use]
pub fn is_same_name(one: &str, other: &str) -> bool {
    plain(one) == plain(other)
}

/// Whether a name contains a text, both without case, underscores and spaces.
#[must_use]
pub fn is_part_of_name(text: &str, name: &str) -> bool {
    plain(name).contains(&plain(text))
}

/// A name without case, underscores and spaces.
pub(super) fn plain(name: &str) -> String {
    let letters = name.chars().filter(|c| c.is_alphanumeric());
    letters.flat_map(char::to_lowercase).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    const CORE: &str = "urn:jaus:jss:core";
    const QUERY_STATUS: u16 = 0x2002;

    fn dictionary() -> Dictionary {
        Dictionary::new().with_catalogue()
    }

    #[test]
    fn fields_become_bits_of_the_presence_vector_that_the_request_omits() {
        let dictionary = dictionary();
        let query = |body, fields: &[&str]| {
            let fields: Vec<_> = fields.iter().map(ToString::to_string).collect();
            let request = Request::new("QueryVelocityState", body);
            dictionary
                .query(&request, &fields)
                .map(|it| it.octets.to_vec())
        };
        // The vector has two octets. Bit 6 is YawRate, bit 8 TimeStamp.
        let chosen = query(json!({}), &["velocity x", "YAW_RATE"]);
        assert_eq!(chosen.unwrap(), [0x04, 0x24, 0x41, 0x00]);
        assert_eq!(query(json!({}), &[]).unwrap(), [0x04, 0x24, 0xFF, 0x01]);
        let given = query(json!({ "PresenceVector": 4 }), &[]);
        assert_eq!(given.unwrap(), [0x04, 0x24, 0x04, 0x00]);
    }

    #[test]
    fn only_queries_have_a_report_and_each_has_its_own() {
        let dictionary = dictionary();
        let query = |name: &str| dictionary.query(&Request::new(name, json!({})), &[]);
        assert_eq!(query("QueryStatus").unwrap().report, 0x4002);
        let resume = query("Resume").unwrap_err();
        assert!(resume.problem.contains("Resume is not a query"), "{resume}");
    }

    #[test]
    fn a_service_is_missing_only_if_no_offered_one_can_receive_the_message() {
        let dictionary = dictionary();
        let missing = |offered: &[&str], code| {
            let missing = dictionary.missing_services(offered.iter().copied(), code);
            missing.into_iter().collect::<Vec<_>>()
        };
        let [discovery, management] = ["Discovery", "Management"].map(|it| format!("{CORE}:{it}"));
        let driver = "urn:jaus:jss:mobility:PrimitiveDriver";
        assert_eq!(missing(&[], QUERY_STATUS), [&*management]);
        assert_eq!(missing(&[&discovery], QUERY_STATUS), [&*management]);
        for offered in [&*management, driver, "urn:example:arm"] {
            let found = missing(&[&discovery, offered], QUERY_STATUS);
            assert!(found.is_empty(), "{offered}: {found:?}");
        }
        assert!(missing(&[&discovery], 0xD3FF).is_empty());
    }

    #[test]
    fn the_definition_knows_the_report_of_a_query() {
        let dictionary = Dictionary::new().with_catalogue();
        for (query, report) in [
            ("QueryPlatformMode", 0xFF23),
            ("QuerySupportedPlatformModes", 0xFF24),
            ("QueryVelocityState", 0x4404),
        ] {
            let request = Request::new(query, serde_json::json!({}));
            let encoded = dictionary.query(&request, &[]).unwrap();
            assert_eq!(encoded.report, report, "{query}");
        }
    }

    #[test]
    fn a_service_decides_between_messages_with_one_name() {
        let mut dictionary = dictionary();
        let request = Request::new("QueryDigitalResourceEndpoint", json!({}));
        let unclear = dictionary.write(&request).unwrap_err();
        for choice in ["2816h of urn:jaus:jss:", "E702h of urn:jaus:jss:iop:"] {
            assert!(unclear.problem.contains(choice), "{unclear}");
        }
        let service = "urn:jaus:jss:iop:DigitalResourceDiscovery";
        dictionary.prefer(service.parse().unwrap()).unwrap();
        let octets = dictionary.write(&request).unwrap();
        assert_eq!(octets[..2], [0x02, 0xE7]);
    }
}
