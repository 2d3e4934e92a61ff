//! Selects the definition that decodes or encodes a message: a generated type, or a definition
//! loaded at run time.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::path::Path;

use bytes::Bytes;
use jsidl::model::{Id, Message, Service, Version};
use jsidl::{Diagnostics, Library, Loaded, Loader};

use super::definition::{Body, Decode, Definition, ServiceName, Unreadable};
use super::request::Request;
use jaus::codec::Registry;
use jaus::messages;

/// Message definitions by code and by name.
///
/// Several definitions may share a code. They are tried in this order: those loaded at run time,
/// then the generated ones; newer versions first. The first one that fits exactly applies.
/// [`prefer`](Self::prefer) selects a service instead.
///
/// ```
/// use jaus_view::Dictionary;
///
/// let dictionary = Dictionary::new();
/// let reading = dictionary.read(&vec![0x00, 0x2B, 0x02].into());
/// assert_eq!(reading.message, Some("QueryIdentification"));
/// ```
#[derive(Debug)]
pub struct Dictionary {
    by_code: BTreeMap<u16, Vec<Definition>>,
    /// The Reference Architecture's, whose codes are those of other layouts in `by_code`.
    ra: BTreeMap<u16, Definition>,
    preferred: Vec<ServiceName>,
    /// Whether all of `ra` is preferred.
    prefers_ra: bool,
    /// The services that were read from their definitions, with all details of their messages.
    library: Library,
    /// Those of them that do not come with this crate.
    added: Vec<Id>,
}

/// The least similarity of a misspelt name; 1 is equality.
const ALIKE: f64 = 0.75;

/// The result of [`Dictionary::load`].
#[derive(Debug)]
pub struct Added {
    /// The number of added messages. A message that a service both receives and sends counts twice.
    pub messages: usize,
    /// The errors and warnings in the definitions.
    pub diagnostics: Diagnostics,
}

/// A decoded message.
#[derive(Debug, Clone)]
pub struct Reading<'d> {
    /// The message code, unless there are fewer than two octets.
    pub code: Option<u16>,
    /// The message's name, if the code is known.
    pub message: Option<&'d str>,
    /// The URN of a service that defines it.
    pub service: Option<&'d str>,
    /// That service's version, if the definition is not the one that is tried first.
    pub version: Option<Version>,
    /// The fields.
    pub body: Result<Body, Unreadable>,
}

impl Default for Dictionary {
    fn default() -> Self {
        Self::new()
    }
}

impl Dictionary {
    /// The messages of the SAE service sets that `jaus` was built with.
    pub fn new() -> Self {
        Self::of(messages::registry())
    }

    /// The messages of a registry.
    pub fn of(messages: Registry) -> Self {
        let mut by_code: BTreeMap<_, Vec<_>> = BTreeMap::new();
        // A registry has the newest of the types with one code first.
        for info in messages.iter() {
            let definition = Definition::generated(info, |info, octets| (info.decode)(octets));
            by_code.entry(info.code).or_default().push(definition);
        }
        Self {
            by_code,
            ra: BTreeMap::new(),
            preferred: Vec::new(),
            prefers_ra: false,
            library: Library::default(),
            added: Vec::new(),
        }
    }

    /// Adds the messages of the Reference Architecture. Their codes are those of other layouts in
    /// the SAE sets, so they are used only for frames with that architecture's header.
    #[must_use]
    pub fn with_reference_architecture(mut self, messages: Registry, decode: Decode) -> Self {
        let definitions = messages
            .iter()
            .map(|info| (info.code, Definition::generated(info, decode)));
        self.ra.extend(definitions);
        self
    }

    /// Adds the service sets whose features are off, from their definitions. Parsing them takes some
    /// milliseconds and a few MiB.
    #[must_use]
    pub fn with_catalogue(mut self) -> Self {
        self.load::<&Path>([]);
        self
    }

    /// Adds the definitions in files and directories. They may refer to one another and to the
    /// definitions of this crate, which are added too, after all others. A service replaces a
    /// present one with the same URN and version. Definitions with errors are left out; the
    /// diagnostics name them.
    pub fn load<P: AsRef<Path>>(&mut self, paths: impl IntoIterator<Item = P>) -> Added {
        let mut loader = Loader::new();
        for path in paths {
            loader.path(path);
        }
        loader.catalogue();
        let Loaded {
            library,
            diagnostics,
        } = loader.load();
        for service in library.services() {
            self.library.insert(service.clone());
        }
        let (mut ours, theirs): (Vec<_>, Vec<_>) =
            library.services().partition(|it| comes_with_us(it));
        for service in &theirs {
            self.add(service);
            self.added.push(service.id.clone());
        }
        ours.retain(|service| !self.knows(&service.id));
        ours.sort_by_key(|service| Reverse(service.id.version));
        for service in &ours {
            self.add_last(service);
        }
        Added {
            messages: theirs.iter().flat_map(|s| s.messages()).count(),
            diagnostics,
        }
    }

    /// The services that [`load`](Self::load) and [`with_catalogue`](Self::with_catalogue) have
    /// read.
    #[must_use]
    pub const fn library(&self) -> &Library {
        &self.library
    }

    /// The message as its service defines it, if the service is in the library.
    pub(super) fn model(&self, definition: &Definition) -> Option<&Message> {
        let mut services = definition.services.iter();
        let service = services.find_map(|id| self.library.service(id))?;
        let mut messages = service.messages();
        let it = messages.find(|it| it.code == definition.code() && it.name == definition.name());
        it.map(AsRef::as_ref)
    }

    fn knows(&self, service: &Id) -> bool {
        let mut services = self.definitions().flat_map(|d| &d.services);
        services.any(|known| known == service)
    }

    fn add_last(&mut self, service: &Service) {
        for message in service.messages() {
            let known = self.by_code.entry(message.code).or_default();
            known.push(Definition::dynamic(&service.id, message));
        }
    }

    fn add(&mut self, service: &Service) {
        self.forget(&service.id);
        for message in service.messages() {
            let known = self.by_code.entry(message.code).or_default();
            // Before the generated ones, and before older versions.
            let place = known.partition_point(|other| other.comes_before(service.id.version));
            known.insert(place, Definition::dynamic(&service.id, message));
        }
    }

    /// Drops a service, and the definitions that no other service has.
    fn forget(&mut self, service: &Id) {
        for definitions in self.by_code.values_mut() {
            definitions
                .iter_mut()
                .for_each(|d| d.services.retain(|s| s != service));
            definitions.retain(|d| !d.services.is_empty());
        }
    }

    /// Prefers the definitions of this service to all others.
    ///
    /// # Errors
    /// If no definition here belongs to such a service.
    pub fn prefer(&mut self, service: ServiceName) -> Result<(), Unreadable> {
        let definitions = || self.definitions().chain(self.ra.values());
        let all = || definitions().flat_map(|d| &d.services);
        if all().any(|known| service.matches(known)) {
            self.preferred.push(service);
            return Ok(());
        }
        let wanted = service.urn.to_lowercase();
        let (family, wanted) = wanted.rsplit_once(':').unwrap_or(("", &wanted));
        let similar = all().filter(|known| known.urn.to_lowercase().contains(wanted));
        // One of the same family, else the standard's, and the one that has little else in its name.
        let similar = similar.min_by_key(|known| {
            let urn = known.urn.to_lowercase();
            let is_kin = urn.starts_with(family);
            (!is_kin, !urn.starts_with("urn:jaus:"), urn.len())
        });
        Err(Unreadable::new(
            match similar {
                Some(similar) => format!(
                    "there is no service {service}; did you mean {}@{}?",
                    similar.urn, similar.version
                ),
                None => format!("there is no service {service}"),
            },
            0,
        ))
    }

    /// Prefers the definitions of the Reference Architecture, for messages without a header, which
    /// would identify it.
    pub fn prefer_reference_architecture(&mut self) {
        self.prefers_ra = true;
    }

    /// The Reference Architecture's definition for a code, if that is preferred.
    fn preferred_ra(&self, code: u16) -> Option<&Definition> {
        let preferred = |it: &Id| self.prefers_ra || self.is_preferred(it);
        let known = self.ra.get(&code);
        known.filter(|definition| definition.services.iter().any(preferred))
    }

    /// The name of the messages with this code, if it is known.
    pub fn name_of(&self, code: u16) -> Option<&str> {
        self.candidates(code).next().map(Definition::name)
    }

    /// Decodes a message.
    pub fn read(&self, octets: &Bytes) -> Reading<'_> {
        let Some(code) = octets.first_chunk().map(|&code| u16::from_le_bytes(code)) else {
            let count = octets.len();
            let problem = format!(
                "a message starts with the two octets of its code, but there are only {count}"
            );
            return Reading::unknown(None, Unreadable::new(problem, 0));
        };
        if let Some(definition) = self.preferred_ra(code) {
            return self.reading(code, 0, definition, definition.decode(octets));
        }
        let mut failure = None;
        for (rank, definition) in self.candidates(code).enumerate() {
            match definition.decode(octets) {
                Ok(body) => return self.reading(code, rank, definition, Ok(body)),
                Err(unreadable) => {
                    failure.get_or_insert((definition, unreadable));
                }
            }
        }
        match failure {
            Some((definition, unreadable)) => self.reading(code, 0, definition, Err(unreadable)),
            None => {
                let problem = format!(
                    "no loaded definition has the message code {code:04X}h; load one that has it"
                );
                Reading::unknown(Some(code), Unreadable::new(problem, 0))
            }
        }
    }

    /// Looks a message of the Reference Architecture up; `None` if its code is unknown there.
    pub(super) fn read_ra(&self, octets: &Bytes) -> Option<Reading<'_>> {
        let code = u16::from_le_bytes(*octets.first_chunk()?);
        let definition = self.of_ra(code)?;
        Some(self.reading(code, 0, definition, definition.decode(octets)))
    }

    /// The Reference Architecture's definition for a code.
    pub(super) fn of_ra(&self, code: u16) -> Option<&Definition> {
        self.ra.get(&code)
    }

    /// The name of the Reference Architecture's message with this code.
    pub(super) fn ra_name_of(&self, code: u16) -> Option<&str> {
        self.of_ra(code).map(Definition::name)
    }

    fn reading<'d>(
        &self,
        code: u16,
        rank: usize,
        definition: &'d Definition,
        body: Result<Body, Unreadable>,
    ) -> Reading<'d> {
        let service = definition
            .services
            .iter()
            .find(|service| self.is_preferred(service))
            .or(definition.services.first());
        Reading {
            code: Some(code),
            message: Some(definition.name()),
            service: service.map(|service| &*service.urn),
            version: service.map(|service| service.version).filter(|_| rank > 0),
            body,
        }
    }

    /// The definitions to try for a code, best first.
    pub(super) fn candidates(&self, code: u16) -> impl Iterator<Item = &Definition> {
        let definitions = self.by_code.get(&code).map_or(&[][..], Vec::as_slice);
        let preferred = |d: &Definition| d.services.iter().any(|s| self.is_preferred(s));
        let some_preferred = definitions.iter().any(preferred);
        definitions
            .iter()
            .filter(move |definition| !some_preferred || preferred(definition))
    }

    /// All definitions but those of the Reference Architecture, by code.
    pub(super) fn definitions(&self) -> impl Iterator<Item = &Definition> {
        self.by_code.values().flatten()
    }

    fn is_preferred(&self, service: &Id) -> bool {
        self.preferred.iter().any(|name| name.matches(service))
    }
}

impl Dictionary {
    /// Whether a message of this name is defined.
    pub fn defines(&self, message: &str) -> bool {
        self.definitions()
            .any(|definition| definition.name() == message)
    }

    /// The definitions in the library of the messages that a request may mean, best first.
    ///
    /// # Errors
    /// If there is none.
    pub fn models(&self, request: &Request) -> Result<Vec<&Message>, Unreadable> {
        let requested = self.requested(request)?;
        Ok(requested.iter().filter_map(|it| self.model(it)).collect())
    }

    /// Whether the message is a command: components obey it only from the client in control.
    pub fn is_command(&self, octets: &[u8]) -> bool {
        let code = octets.first_chunk().map(|&code| u16::from_le_bytes(code));
        code.is_some_and(|code| self.candidates(code).any(Definition::is_command))
    }

    /// Encodes a message.
    ///
    /// # Errors
    /// If the request names no definition, or the body does not fit it.
    pub fn write(&self, request: &Request) -> Result<Bytes, Unreadable> {
        let mut failure = None;
        for definition in self.requested(request)? {
            match definition.encode(&request.body) {
                Ok(octets) => return Ok(octets),
                Err(problem) => {
                    failure.get_or_insert(problem);
                }
            }
        }
        let problem = failure.unwrap_or_else(|| format!("{request} is not defined here"));
        Err(Unreadable::new(problem, 0))
    }

    /// The definitions that a request may mean, best first; at least one, and all with one code.
    pub(super) fn requested(&self, request: &Request) -> Result<Vec<&Definition>, Unreadable> {
        if let Some(of_ra) = self.requested_of_ra(request) {
            return Ok(vec![of_ra]);
        }
        let codes = match request.code {
            Some(code) => vec![code],
            None => self.by_code.keys().copied().collect(),
        };
        let of_name: Vec<_> = codes
            .into_iter()
            .flat_map(|code| self.candidates(code))
            .filter(|d| {
                request
                    .message
                    .as_deref()
                    .is_none_or(|name| name == d.name())
            })
            .collect();
        if of_name.is_empty() {
            return Err(Unreadable::new(self.advice(request), 0));
        }
        let Some(service) = &request.service else {
            return self.of_one_code(request, of_name);
        };
        let of_service = of_name.iter().copied().filter(|d| d.belongs_to(service));
        let of_service: Vec<_> = of_service.collect();
        if of_service.is_empty() {
            let services = of_name.iter().flat_map(|d| &d.services);
            let services: Vec<_> = services
                .map(|s| format!("{}@{}", s.urn, s.version))
                .collect();
            let problem = format!(
                "{service} does not define {request}; it is defined in {}",
                services.join(", ")
            );
            return Err(Unreadable::new(problem, 0));
        }
        Ok(of_service)
    }

    /// Those of a preferred service if it defines the message, else those of an added one.
    ///
    /// Services may give one name to messages with different codes.
    fn of_one_code<'d>(
        &self,
        request: &Request,
        mut known: Vec<&'d Definition>,
    ) -> Result<Vec<&'d Definition>, Unreadable> {
        let is_added = |it: &Id| self.added.contains(it);
        let is_preferred = |it: &Id| self.is_preferred(it);
        let ranks: [&dyn Fn(&Id) -> bool; 2] = [&is_preferred, &is_added];
        for counts in ranks {
            let counts = |it: &&Definition| it.services.iter().any(counts);
            if known.iter().any(counts) {
                known.retain(counts);
                break;
            }
        }
        let first = known.first().map(|it| it.code());
        if known.iter().all(|it| Some(it.code()) == first) {
            return Ok(known);
        }
        known.dedup_by_key(|it| it.code());
        let choices = known.iter().filter_map(|it| {
            let service = it.services.first()?;
            Some(format!("{:04X}h of {}", it.code(), service.urn))
        });
        let choices: Vec<_> = choices.collect();
        let problem = format!(
            "{request} is several messages, {}: choose with the service (--service URN)",
            choices.join(" or ")
        );
        Err(Unreadable::new(problem, 0))
    }

    /// The definition of the Reference Architecture that a request means: it names the service, or
    /// these definitions are preferred.
    fn requested_of_ra(&self, request: &Request) -> Option<&Definition> {
        let is_it = |it: &&Definition| {
            request.code.is_none_or(|code| code == it.code())
                && request
                    .message
                    .as_deref()
                    .is_none_or(|name| name == it.name())
                && match &request.service {
                    Some(service) => it.belongs_to(service),
                    None => self.preferred_ra(it.code()).is_some(),
                }
        };
        self.ra.values().find(is_it)
    }

    /// What to say about a message that is not here.
    fn advice(&self, request: &Request) -> String {
        let all = || self.definitions();
        let Some(name) = request.message.as_deref() else {
            return format!("no loaded definition has {request}");
        };
        if let Some(known) = all().find(|d| d.name() == name) {
            return format!("{name} has the code {:04X}h", known.code());
        }
        let lower = name.to_lowercase();
        let similar = all().filter_map(|definition| {
            let known = definition.name().to_lowercase();
            let likeness = strsim::normalized_damerau_levenshtein(&known, &lower);
            let alike = likeness > ALIKE || known.contains(&lower) || lower.contains(&known);
            alike.then_some((likeness, definition.name()))
        });
        match similar.max_by(|(one, _), (other, _)| one.total_cmp(other)) {
            Some((_, similar)) => format!("there is no message {name}; did you mean {similar}?"),
            None => format!(
                "there is no message {name}; if your own service defines it, load that definition \
                 too (--jsidl PATH)"
            ),
        }
    }
}

impl<'d> Reading<'d> {
    fn unknown(code: Option<u16>, unreadable: Unreadable) -> Self {
        Self {
            code,
            message: None,
            service: None,
            version: None,
            body: Err(unreadable),
        }
    }
}

/// Whether a service is one of those that come with the crate.
fn comes_with_us(service: &Service) -> bool {
    jsidl::catalogue::find(&service.id)
        .is_some_and(|entry| *service.location.file == *Path::new("catalogue").join(entry.path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_message_that_comes_with_the_crate_is_known_whatever_the_features() {
        let mut loader = Loader::new();
        loader.catalogue();
        let dictionary = Dictionary::new().with_catalogue();
        let services: Vec<_> = loader.load().library.services().cloned().collect();
        assert!(services.len() > 130);
        for service in services {
            for message in service.messages() {
                let known = dictionary.by_code[&message.code].iter();
                let mut known = known.filter(|it| it.name() == message.name);
                assert!(
                    known.any(|it| it.services.contains(&service.id)),
                    "{:04X} {} of {}",
                    message.code,
                    message.name,
                    service.id
                );
            }
        }
    }

    #[test]
    fn what_was_generated_is_tried_before_what_is_read_by_its_definition() {
        let plain = Dictionary::new();
        let complete = Dictionary::new().with_catalogue();
        for (code, known) in &plain.by_code {
            let first = &complete.by_code[code][0];
            assert_eq!(first.services, known[0].services, "{code:04X}");
        }
    }
}
