//! The package: its files, and its types by message.

use std::collections::BTreeMap;

use heck::{ToShoutySnakeCase, ToSnakeCase};

use super::conversion::Conversion;
use super::definitions::Definitions;
use super::package_name::PackageName;
use super::value::Value;
use super::{nested, text};
use crate::dynamic::{self, EncodeError};
use crate::library::Library;
use crate::model::{Id, Message, Service};
use crate::typed::names::Spelling;
use crate::typed::{self, keywords};

static SPELLING: Spelling = Spelling {
    member: |name| words(name).to_snake_case(),
    value: |name| words(name).to_shouty_snake_case(),
    reserved: &[
        keywords::CPP,
        keywords::MACROS,
        keywords::PYTHON,
        &[
            // A keyword of C only.
            "restrict",
            // Of the classes that ROS 2 generates for Python.
            "get_fields_and_field_types",
            "self",
        ],
    ],
    // ROS 2 does not permit `_` at the end.
    suffix: "_value",
};

/// A name with spaces in place of characters that no identifier can have.
fn words(name: &str) -> String {
    let is_valid = |c: char| c.is_ascii_alphanumeric();
    name.replace(|c| !is_valid(c), " ")
}

/// The message types of a ROS 2 package.
///
/// ```
/// use jsidl::ros::{Package, PackageName, Value};
///
/// let mut loader = jsidl::Loader::new();
/// loader.catalogue();
/// let library = loader.load().library;
/// let package = Package::of(&library, |_| true, &PackageName::default());
///
/// let files = package.files();
/// assert!(files.iter().any(|(path, _)| path == "jaus_msgs/msg/CoreReportStatusV1p0.msg"));
///
/// let (service, message) = library.by_code(0x4002).next().expect("the core set is there");
/// let interface = package.interface(&service.id, message).expect("a selected service");
/// assert_eq!(interface.name(), "CoreReportStatusV1p0");
///
/// let status = jsidl::dynamic::decode(message, &[0x02, 0x40, 1, 0, 0, 0, 0])?;
/// let value = interface.value(&status).expect("it was decoded from this definition");
/// assert_eq!(value, Value::Message(vec![Value::Unsigned(1), Value::Unsigned(0)]));
/// # Ok::<(), jsidl::dynamic::DecodeError>(())
/// ```
#[derive(Debug)]
pub struct Package {
    name: PackageName,
    definitions: Definitions,
    /// Code, name and type of each message that a service declares.
    messages: BTreeMap<Id, Vec<(u16, String, usize)>>,
}

impl Package {
    /// The package with the messages of the services that `wanted` selects.
    pub fn of(library: &Library, wanted: impl Fn(&Service) -> bool, name: &PackageName) -> Self {
        let mut definitions = Definitions::default();
        let mut messages: BTreeMap<Id, Vec<_>> = BTreeMap::new();
        for set in typed::sets(library, wanted, &SPELLING) {
            for plan in &set.messages {
                let place = nested::message(&mut definitions, &set, plan);
                for id in &plan.services {
                    let message = plan.message;
                    let declared = (message.code, message.name.clone(), place);
                    messages.entry((*id).clone()).or_default().push(declared);
                }
            }
        }
        Self {
            name: name.clone(),
            definitions,
            messages,
        }
    }

    /// The package's name.
    pub const fn name(&self) -> &PackageName {
        &self.name
    }

    /// The files of the package by path, such as `jaus_msgs/package.xml`, in alphabetical order of
    /// the types.
    pub fn files(&self) -> Vec<(String, String)> {
        let types = self.definitions.all().iter();
        let types = types.map(|it| (it.name.as_str(), text::interface(&self.definitions, it)));
        let mut types: Vec<_> = types.collect();
        types.sort_unstable();
        let name = &self.name;
        let names: Vec<_> = types.iter().map(|(name, _)| *name).collect();
        let mut files = vec![
            (format!("{name}/package.xml"), text::manifest(name)),
            (
                format!("{name}/CMakeLists.txt"),
                text::build_file(name, &names),
            ),
        ];
        let path = |interface| format!("{name}/msg/{interface}.msg");
        files.extend(types.into_iter().map(|(name, text)| (path(name), text)));
        files
    }

    /// The type of a message; `service` is the service that declares it. `None` if the package does
    /// not have the message.
    pub fn interface(&self, service: &Id, message: &Message) -> Option<Interface<'_>> {
        let mut declared = self.messages.get(service)?.iter();
        let same = |(code, name, _): &&(u16, String, usize)| {
            (*code, name.as_str()) == (message.code, message.name.as_str())
        };
        let (_, message, place) = declared.find(same)?;
        Some(Interface {
            package: self,
            message,
            place: *place,
        })
    }
}

/// The type of a message in a [`Package`].
#[derive(Debug, Clone, Copy)]
pub struct Interface<'p> {
    package: &'p Package,
    /// The message's name in the definition.
    message: &'p str,
    place: usize,
}

impl<'p> Interface<'p> {
    /// The type's name in the package, such as `CoreReportStatusV1p0`.
    pub fn name(&self) -> &'p str {
        let definition = self.package.definitions.get(self.place);
        definition.map_or("", |it| &it.name)
    }

    /// The fields of the type, from the value of a message with this definition.
    ///
    /// # Errors
    /// If the value does not fit the definition. Values from [`decode`](dynamic::decode) always fit.
    pub fn value(&self, value: &dynamic::Value) -> Result<Value, EncodeError> {
        let conversion = Conversion::new(&self.package.definitions);
        let converted = conversion.message(self.place, value);
        converted.map_err(|fault| fault.encoding(self.message))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::typed::names::Names;

    #[test]
    fn fields_have_no_reserved_names_and_no_underscores_at_the_end() {
        let mut names = Names::new(&SPELLING);
        let members = [
            "class",
            "Class",
            "Position_RMS",
            "é_",
            "3D",
            "__",
            "restrict",
        ];
        let idents = members.map(|name| names.member(name));
        let expected = [
            "class_value",
            "class_value_2",
            "position_rms",
            "n",
            "n3d",
            "n_2",
            "restrict_value",
        ];
        assert_eq!(idents, expected);
    }
}
