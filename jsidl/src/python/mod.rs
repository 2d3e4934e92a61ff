//! Typed messages in Python: type stubs, and descriptions of classes that are made at run time.
//!
//! The package `jaus` makes a class for each message from the description of its layout; [`files`]
//! writes what type checkers and editors know about these classes. Both follow one plan, so that
//! names and types agree.
//!
//! A module has a namespace for each version (`v1_0`), and each message under its name for its
//! newest layout. The types inside a message are members of its class.

#[cfg(feature = "json")]
mod description;
mod stubs;

use heck::{ToShoutySnakeCase, ToSnakeCase};

use crate::library::Library;
use crate::model::Service;
use crate::presence::{self, PresenceVector};
use crate::typed::lines::quoted as quoted_with;
use crate::typed::names::Spelling;
use crate::typed::{self, Plan, Set, keywords};

#[cfg(feature = "json")]
pub use description::{ClassDescription, SetDescription, describe};

static SPELLING: Spelling = Spelling {
    member: |name| name.to_snake_case(),
    value: |name| name.to_shouty_snake_case(),
    reserved: &[
        keywords::PYTHON,
        &[
            // Members of the base classes.
            "code",
            "copy",
            "decode",
            "encode",
            "from_json",
            "from_raw",
            "is_command",
            "name",
            "replace",
            "report",
            "self",
            "service",
            "services",
            "to_json",
            "version",
            // Types in annotations of the members beside them.
            "bool",
            "bytes",
            "float",
            "int",
            "list",
            "property",
            "str",
            "typed",
        ],
    ],
    suffix: "_",
};

fn plan<'m>(library: &'m Library, wanted: impl Fn(&Service) -> bool) -> Vec<Set<'m>> {
    typed::sets(library, wanted, &SPELLING)
}

/// The type stubs for the services that `wanted` selects, by file name: one for each set, such as
/// `core.pyi`.
///
/// ```
/// let mut loader = jsidl::Loader::new();
/// loader.catalogue();
/// let files = jsidl::python::files(&loader.load().library, |_| true);
/// let (_, core) = files.iter().find(|(name, _)| name == "core.pyi").expect("the core set");
/// assert!(core.contains("class ReportIdentification(typed.Message):"));
/// ```
pub fn files(library: &Library, wanted: impl Fn(&Service) -> bool) -> Vec<(String, String)> {
    let sets = plan(library, wanted);
    let files = sets.iter();
    files
        .map(|set| (format!("{}.pyi", set.name), stubs::module(set)))
        .collect()
}

/// The report of a query, declared by a service that declares the query. Of several layouts that of the
/// newest version which declares both.
fn report<'p, 'm>(query: &Plan<'m>, set: &'p Set<'m>) -> Option<&'p Plan<'m>> {
    let report = query.report?;
    let shared = |plan: &Plan<'m>| {
        let services = plan.services.iter();
        let services = services.filter(|service| query.services.contains(service));
        services.map(|service| service.version).max()
    };
    let answers = set
        .messages
        .iter()
        .filter(|plan| plan.message.name == report);
    let dated = answers.filter_map(|plan| Some((shared(plan)?, plan)));
    dated
        .max_by_key(|(version, _)| *version)
        .map(|(_, plan)| plan)
}

/// The number that requests every field of the report in a presence vector of its query; `None` if
/// the member is no such vector.
fn everything(vectors: &[PresenceVector], member: &str) -> Option<u64> {
    let vector = vectors.iter().find(|vector| vector.name == member)?;
    let bits = vector.fields.iter().map(|(_, bit)| *bit as u32);
    Some(bits.fold(0, |all, bit| all | 1_u64.checked_shl(bit).unwrap_or(0)))
}

/// The presence vectors of a message, if it is a query.
fn vectors<'m>(plan: &Plan<'m>, set: &Set<'m>) -> Vec<PresenceVector> {
    let report = report(plan, set);
    report.map_or_else(Vec::new, |report| {
        presence::vectors(plan.message, report.message)
    })
}

/// The place of a class in its module, such as `v1_0.ReportIdentification`.
fn path(plan: &Plan<'_>) -> String {
    let (number, ident) = plan.definition();
    format!("{}.{ident}", typed::names::version(number))
}

/// A literal of a string.
fn quoted(text: &str) -> String {
    quoted_with(text, |out, character| {
        let code = u32::from(character);
        if code > 0xFFFF {
            out.push_str(&format!("\\U{code:08x}"));
        } else {
            out.push_str(&format!("\\u{code:04x}"));
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loader::Loader;

    fn catalogue() -> Library {
        let mut loader = Loader::new();
        loader.catalogue();
        loader.load().library
    }

    #[test]
    fn the_presence_vector_of_a_query_requests_every_field_of_its_report() {
        let library = catalogue();
        let sets = plan(&library, |_| true);
        let mobility = sets.iter().find(|set| set.name == "mobility").unwrap();
        let newest = |name: &str| {
            let mut plans = mobility.messages.iter();
            plans.find(|plan| plan.newest.as_deref() == Some(name))
        };
        let query = newest("QueryLocalPose").unwrap();
        let report = report(query, mobility).unwrap();
        assert!(std::ptr::eq(report, newest("ReportLocalPose").unwrap()));
        let vectors = vectors(query, mobility);
        assert_eq!(everything(&vectors, "PresenceVector"), Some(0x1FF));
        assert_eq!(everything(&vectors, "Other"), None);
    }

    #[test]
    fn names_of_the_base_classes_and_keywords_are_no_members() {
        let mut names = typed::names::Names::new(&SPELLING);
        let members = ["Name", "class", "Position_RMS", "Self", "List"].map(|it| names.member(it));
        assert_eq!(
            members,
            ["name_", "class_", "position_rms", "self_", "list_"]
        );
        assert_eq!(names.value("Front left"), "FRONT_LEFT");
    }

    #[test]
    fn a_required_field_has_no_default_in_the_stub() {
        let files = files(&catalogue(), |_| true);
        let (_, mobility) = files
            .iter()
            .find(|(name, _)| name == "mobility.pyi")
            .unwrap();
        let initializer =
            "def __init__(self, *, latitude_deg: float | v1_0.SetGlobalWaypoint.Latitude, ";
        assert!(mobility.contains(initializer));
        assert!(
            mobility.contains("def __init__(self, *, presence_vector: int = ...) -> None: ...")
        );
    }

    #[cfg(feature = "json")]
    #[test]
    fn each_description_names_its_class_and_its_services() {
        let sets = describe(&catalogue(), |_| true);
        let core = sets.iter().find(|set| set.name == "core").unwrap();
        let mut classes = core.classes.iter();
        let class = classes.find(|class| class.code == 0x4B00).unwrap();
        assert_eq!(class.newest.as_deref(), Some("ReportIdentification"));
        assert_eq!(
            class.places[0],
            ("v1_0".to_owned(), "ReportIdentification".to_owned())
        );
        assert_eq!(&*class.services[0].urn, "urn:jaus:jss:core:Discovery");
        assert_eq!(class.layout["fields"][0]["key"], "query_type");
    }
}
