//! Which optional fields of a report the presence vectors of its query request.

use crate::model::Message;
use crate::rust::selections::of_messages;

/// A presence vector of a query.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PresenceVector {
    /// Its name in the definition of the query, for example `PresenceVector`.
    pub name: String,
    /// The fields of the report by name, with the number of the bit that requests each.
    pub fields: Vec<(String, usize)>,
}

/// The presence vectors of a query whose bits its report determines.
///
/// Vectors inside a list of the query, and those whose meaning the definitions leave open, are not
/// among them.
///
/// ```
/// let mut loader = jsidl::Loader::new();
/// loader.catalogue();
/// let library = loader.load().library;
/// let message = |code| library.by_code(code).next().expect("the mobility set is there").1;
/// let (query, report) = (message(0x2404), message(0x4404));
/// assert_eq!(query.name, "QueryVelocityState");
///
/// let vectors = jsidl::presence::vectors(query, report);
/// assert_eq!(vectors[0].name, "PresenceVector");
/// assert_eq!(vectors[0].fields[0], ("Velocity_X".to_owned(), 0));
/// ```
pub fn vectors(query: &Message, report: &Message) -> Vec<PresenceVector> {
    let selections = of_messages(query, report);
    let vectors = selections.iter().map(|selection| {
        let fields = selection.fields().into_iter();
        PresenceVector {
            name: selection.name.to_owned(),
            fields: fields.map(|(name, bit)| (name.to_owned(), bit)).collect(),
        }
    });
    vectors.collect()
}
