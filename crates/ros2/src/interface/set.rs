//! A set of message types that refer to each other.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

use super::bundled;
use super::{Definition, Field, Interface, Kind, ParseError, Size, TypeName, TypeNameError};

/// The most types of a set.
const MOST_TYPES: usize = 8192;
/// The most levels of messages within messages.
const MOST_LEVELS: usize = 32;
/// The most values of a new message, those of nested messages and fixed arrays included.
const MOST_VALUES: usize = 1 << 20;

/// Known message types.
#[derive(Clone, Debug, Default)]
pub struct Interfaces {
    definitions: BTreeMap<TypeName, Definition>,
}

/// Why a message type cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InterfaceError {
    /// The name is malformed.
    #[error(transparent)]
    Name(#[from] TypeNameError),
    /// The text is malformed.
    #[error(transparent)]
    Parse(#[from] ParseError),
    /// The set has another definition of this name.
    #[error("{0} is already defined otherwise: use another package or name")]
    Conflict(TypeName),
    /// The set is full.
    #[error("there are more than {MOST_TYPES} message types")]
    Full,
    /// No type of the set has this name.
    #[error("there is no message type {0}: add the text of its .msg file")]
    Unknown(TypeName),
    /// A field has a type that is not in the set.
    #[error(
        "{owner}: its field `{field}` has the type {name}, which is unknown: add its .msg file"
    )]
    Missing {
        /// The type that has the field.
        owner: TypeName,
        /// The field.
        field: String,
        /// The unknown type.
        name: TypeName,
    },
    /// A type contains itself.
    #[error("{0} contains itself: remove one of the fields between")]
    Cycle(TypeName),
    /// Messages are nested too deeply.
    #[error("{0} has more than {MOST_LEVELS} levels of messages within messages")]
    TooDeep(TypeName),
    /// A message has too many values.
    #[error("{0} has more than {MOST_VALUES} values: use sequences instead of arrays")]
    TooLarge(TypeName),
}

impl Interfaces {
    /// The types that this crate brings: those of `std_msgs`, `geometry_msgs`, `nav_msgs`,
    /// `sensor_msgs`, `diagnostic_msgs` and `tf2_msgs` that a vehicle needs.
    ///
    /// # Errors
    /// None: a test resolves every one of them.
    pub fn bundled() -> Result<Self, InterfaceError> {
        let mut set = Self::default();
        for (name, text) in bundled::TEXTS {
            set.add(name, text)?;
        }
        Ok(set)
    }

    /// Adds a type by the text of its `.msg` file. Types that it refers to may follow later.
    ///
    /// # Errors
    /// A malformed name or text, another definition of the same name, or too many types.
    pub fn add(&mut self, name: &str, text: &str) -> Result<(), InterfaceError> {
        let definition = Definition::parse(name.parse()?, text)?;
        let is_full = self.definitions.len() >= MOST_TYPES;
        match self.definitions.entry(definition.name.clone()) {
            Entry::Occupied(known) if *known.get() != definition => {
                Err(InterfaceError::Conflict(definition.name))
            }
            Entry::Occupied(_) => Ok(()),
            Entry::Vacant(_) if is_full => Err(InterfaceError::Full),
            Entry::Vacant(place) => {
                place.insert(definition);
                Ok(())
            }
        }
    }

    /// The names of all types, in order.
    pub fn names(&self) -> impl Iterator<Item = &TypeName> {
        self.definitions.keys()
    }

    /// A type with all types that it contains.
    ///
    /// # Errors
    /// An unknown type, here or in a field, a type that contains itself, or one that is too large.
    pub fn get(&self, name: &str) -> Result<Arc<Interface>, InterfaceError> {
        let name: TypeName = name.parse()?;
        if !self.definitions.contains_key(&name) {
            return Err(InterfaceError::Unknown(name));
        }
        let mut resolution = Resolution {
            set: self,
            open: Vec::new(),
            done: BTreeMap::new(),
        };
        resolution.resolve(&name)
    }
}

/// The types of one request, while they are resolved.
struct Resolution<'a> {
    set: &'a Interfaces,
    /// The types that contain the present one.
    open: Vec<TypeName>,
    done: BTreeMap<TypeName, Arc<Interface>>,
}

impl Resolution<'_> {
    fn resolve(&mut self, name: &TypeName) -> Result<Arc<Interface>, InterfaceError> {
        if let Some(done) = self.done.get(name) {
            return Ok(done.clone());
        }
        if self.open.contains(name) {
            return Err(InterfaceError::Cycle(name.clone()));
        }
        if self.open.len() == MOST_LEVELS {
            let outermost = self.open.first().unwrap_or(name);
            return Err(InterfaceError::TooDeep(outermost.clone()));
        }
        let Some(definition) = self.set.definitions.get(name) else {
            return Err(InterfaceError::Unknown(name.clone()));
        };
        self.open.push(name.clone());
        let interface = Arc::new(self.interface(definition)?);
        self.open.pop();
        self.done.insert(name.clone(), interface.clone());
        Ok(interface)
    }

    fn interface(&mut self, definition: &Definition) -> Result<Interface, InterfaceError> {
        let (mut values, mut levels) = (1_usize, 1);
        let mut fields = Vec::with_capacity(definition.fields.len());
        for field in &definition.fields {
            let kind = self.kind(definition, field)?;
            let (inside, below) = match &kind {
                Kind::Message(nested) => (nested.values, nested.levels),
                _ => (1, 0),
            };
            let count = match field.size {
                Size::Fixed(count) => count,
                _ => 1,
            };
            values = inside
                .checked_mul(count)
                .and_then(|inside| values.checked_add(inside))
                .filter(|&values| values <= MOST_VALUES)
                .ok_or_else(|| InterfaceError::TooLarge(definition.name.clone()))?;
            levels = levels.max(below + 1);
            fields.push(Field {
                name: field.name.clone(),
                kind,
                size: field.size,
                default: field.default.clone(),
            });
        }
        // A type that was resolved before may be deeper than the types around it allow.
        if levels > MOST_LEVELS {
            return Err(InterfaceError::TooDeep(definition.name.clone()));
        }
        Ok(Interface {
            name: definition.name.clone(),
            fields,
            constants: definition.constants.clone(),
            values,
            levels,
        })
    }

    fn kind(
        &mut self,
        owner: &Definition,
        field: &Field<TypeName>,
    ) -> Result<Kind, InterfaceError> {
        Ok(match &field.kind {
            Kind::Primitive(primitive) => Kind::Primitive(*primitive),
            Kind::String { most } => Kind::String { most: *most },
            Kind::Message(name) if !self.set.definitions.contains_key(name) => {
                return Err(InterfaceError::Missing {
                    owner: owner.name.clone(),
                    field: field.name.clone(),
                    name: name.clone(),
                });
            }
            Kind::Message(name) => Kind::Message(self.resolve(name)?),
        })
    }
}
