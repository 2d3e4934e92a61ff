//! A message: a type and its values, by path.

use std::sync::Arc;

use crate::Value;
use crate::interface::{Field, Interface, Kind, Size, TypeName, defaults, fit, shown, zero_of};

/// A message of a known type. Its values fit the type at all times, so that it can be encoded.
///
/// A path names a value: `pose.pose.position.x`, `covariance[35]`, `status[0].values[2].key`.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    interface: Arc<Interface>,
    fields: Vec<Value>,
}

/// A value that a message does not have or cannot take.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name}: `{path}`: {reason}")]
pub struct ValueError {
    /// The message type.
    pub name: TypeName,
    /// The path of the value; empty for the whole message.
    pub path: String,
    /// What is wrong.
    pub reason: String,
}

impl Message {
    /// A message with the values that the type gives, and zeros.
    #[must_use]
    pub fn new(interface: &Arc<Interface>) -> Self {
        Self {
            interface: interface.clone(),
            fields: defaults(interface),
        }
    }

    /// A message with these values, a [`Value::Message`] in the order of the fields.
    ///
    /// # Errors
    /// The first value that does not fit, with its path.
    pub fn from_value(interface: &Arc<Interface>, value: Value) -> Result<Self, ValueError> {
        let fitted = fit_message(value, interface);
        let fields = fitted.map_err(|misfit| misfit.of(interface))?;
        Ok(Self {
            interface: interface.clone(),
            fields,
        })
    }

    /// A message with these values, which fit.
    pub(crate) const fn from_fitting(interface: Arc<Interface>, fields: Vec<Value>) -> Self {
        Self { interface, fields }
    }

    /// The type.
    #[must_use]
    pub const fn interface(&self) -> &Arc<Interface> {
        &self.interface
    }

    /// The values, in the order of the fields.
    #[must_use]
    pub fn fields(&self) -> &[Value] {
        &self.fields
    }

    /// The value at a path.
    ///
    /// # Errors
    /// The message has no such value.
    pub fn get(&self, path: &str) -> Result<&Value, ValueError> {
        let route = Route::find(&self.interface, path)?;
        let mut found = self.fields.get(route.first);
        for &index in &route.rest {
            found = match found {
                Some(Value::Sequence(children) | Value::Message(children)) => children.get(index),
                _ => None,
            };
        }
        found.ok_or_else(|| missing(&self.interface, path))
    }

    /// The number at a path, for fields that are one number.
    ///
    /// # Errors
    /// The message has no such value, or it is no number.
    pub fn float(&self, path: &str) -> Result<f64, ValueError> {
        let value = self.get(path)?.as_float();
        value.ok_or_else(|| error(&self.interface, path, "the value is not a number"))
    }

    /// The text at a path.
    ///
    /// # Errors
    /// The message has no such value, or it is no text.
    pub fn text(&self, path: &str) -> Result<&str, ValueError> {
        let value = self.get(path)?.as_str();
        value.ok_or_else(|| error(&self.interface, path, "the value is not a text"))
    }

    /// Sets the value at a path: one value, a whole array or sequence, or a nested message.
    ///
    /// # Errors
    /// The message has no such value, or the new one does not fit: it is out of range, too long, or of
    /// another type.
    pub fn set(&mut self, path: &str, value: impl Into<Value>) -> Result<(), ValueError> {
        let interface = self.interface.clone();
        let route = Route::find(&interface, path)?;
        let fitted = match route.place {
            Place::Array(field) => fit_array(value.into(), field),
            Place::One(kind) => fit_one(value.into(), kind),
        };
        let fitted = fitted.map_err(|misfit| misfit.within(path).of(&interface))?;
        let place = self.at_mut(&route);
        *place.ok_or_else(|| missing(&interface, path))? = fitted;
        Ok(())
    }

    /// Gives the sequence at a path this many elements. New ones are zero, empty, or new messages.
    ///
    /// # Errors
    /// The message has no such sequence, or the sequence allows only fewer elements.
    pub fn resize(&mut self, path: &str, count: usize) -> Result<(), ValueError> {
        let interface = self.interface.clone();
        let route = Route::find(&interface, path)?;
        let Place::Array(field) = route.place else {
            return Err(error(&interface, path, "the value is not a sequence"));
        };
        check_count(count, field.size).map_err(|reason| error(&interface, path, reason))?;
        match self.at_mut(&route) {
            Some(Value::Sequence(elements)) => elements.resize(count, zero_of(&field.kind)),
            _ => return Err(missing(&interface, path)),
        }
        Ok(())
    }

    fn at_mut(&mut self, route: &Route<'_>) -> Option<&mut Value> {
        let first = self.fields.get_mut(route.first)?;
        route
            .rest
            .iter()
            .try_fold(first, |value, &index| match value {
                Value::Sequence(children) | Value::Message(children) => children.get_mut(index),
                _ => None,
            })
    }
}

fn missing(interface: &Interface, path: &str) -> ValueError {
    error(interface, path, "there are fewer elements: resize it first")
}

fn error(interface: &Interface, path: &str, reason: impl Into<String>) -> ValueError {
    Misfit::new(reason).within(&shown(path)).of(interface)
}

impl From<Message> for Value {
    fn from(message: Message) -> Self {
        Self::Message(message.fields)
    }
}

/// The type of a value.
#[derive(Clone, Copy)]
enum Place<'a> {
    /// A whole array or sequence.
    Array(&'a Field),
    /// One value: of a field, or of an element.
    One(&'a Kind),
}

/// The way from a message to one of its values.
struct Route<'a> {
    /// The index of the field of the message.
    first: usize,
    /// The indices of elements and fields below.
    rest: Vec<usize>,
    place: Place<'a>,
}

impl<'a> Route<'a> {
    fn find(interface: &'a Interface, path: &str) -> Result<Self, ValueError> {
        Self::parse(interface, path).map_err(|reason| error(interface, path, reason))
    }

    fn parse(interface: &'a Interface, path: &str) -> Result<Self, String> {
        let mut steps = path.split('.');
        let (first, element, mut place) = step(interface, steps.next().unwrap_or_default())?;
        let mut rest: Vec<_> = element.into_iter().collect();
        for name in steps {
            let Place::One(Kind::Message(nested)) = place else {
                return Err(format!("`{}` is not in a message", shown(name)));
            };
            let (field, element, found) = step(nested, name)?;
            rest.push(field);
            rest.extend(element);
            place = found;
        }
        Ok(Self { first, rest, place })
    }
}

/// Reads a step of a path, such as `status[1]`: the index of the field and of the element, and the type
/// there.
fn step<'a>(
    interface: &'a Interface,
    text: &str,
) -> Result<(usize, Option<usize>, Place<'a>), String> {
    let (name, index) = match text.split_once('[') {
        None => (text, None),
        Some((name, index)) => (name, Some(index.strip_suffix(']').unwrap_or_default())),
    };
    let at = interface.fields().iter().position(|it| it.name == name);
    let at = at.ok_or_else(|| format!("{} has no field `{}`", interface.name(), shown(name)))?;
    let field = &interface.fields()[at];
    let Some(index) = index else {
        let place = match field.size {
            Size::One => Place::One(&field.kind),
            _ => Place::Array(field),
        };
        return Ok((at, None, place));
    };
    if field.size == Size::One {
        return Err(format!("the field `{name}` is not an array"));
    }
    let index = index.parse();
    let index = index.map_err(|_| format!("`{}` has no index: write `{name}[0]`", shown(text)))?;
    Ok((at, Some(index), Place::One(&field.kind)))
}

/// A value that does not fit, with its path from where it was looked at.
struct Misfit {
    path: String,
    reason: String,
}

impl Misfit {
    fn new(reason: impl Into<String>) -> Self {
        Self {
            path: String::new(),
            reason: reason.into(),
        }
    }

    fn within(self, path: &str) -> Self {
        let separator = match self.path.is_empty() || self.path.starts_with('[') {
            true => "",
            false => ".",
        };
        Self {
            path: format!("{path}{separator}{}", self.path),
            reason: self.reason,
        }
    }

    fn of(self, interface: &Interface) -> ValueError {
        ValueError {
            name: interface.name().clone(),
            path: self.path,
            reason: self.reason,
        }
    }
}

fn fit_message(value: Value, interface: &Interface) -> Result<Vec<Value>, Misfit> {
    let Value::Message(values) = value else {
        return Err(Misfit::new(format!(
            "the value is not a {}",
            interface.name()
        )));
    };
    let fields = interface.fields();
    if values.len() != fields.len() {
        return Err(Misfit::new(format!(
            "there are {} values for the {} fields of {}",
            values.len(),
            fields.len(),
            interface.name()
        )));
    }
    let fitted = values.into_iter().zip(fields).map(|(value, field)| {
        let fitted = match field.size {
            Size::One => fit_one(value, &field.kind),
            _ => fit_array(value, field),
        };
        fitted.map_err(|misfit| misfit.within(&field.name))
    });
    fitted.collect()
}

fn fit_one(value: Value, kind: &Kind) -> Result<Value, Misfit> {
    match kind {
        Kind::Message(nested) => fit_message(value, nested).map(Value::Message),
        _ => fit(value, kind).map_err(Misfit::new),
    }
}

fn fit_array(value: Value, field: &Field) -> Result<Value, Misfit> {
    let Value::Sequence(elements) = value else {
        return Err(Misfit::new("the value is not a sequence"));
    };
    check_count(elements.len(), field.size).map_err(Misfit::new)?;
    let fitted = elements.into_iter().enumerate().map(|(index, element)| {
        fit_one(element, &field.kind).map_err(|misfit| misfit.within(&format!("[{index}]")))
    });
    fitted.collect::<Result<_, _>>().map(Value::Sequence)
}

fn check_count(count: usize, size: Size) -> Result<(), String> {
    match size {
        Size::Fixed(exact) if count != exact => Err(format!(
            "there are {count} elements for an array of {exact}"
        )),
        Size::AtMost(most) if count > most => Err(format!(
            "there are {count} elements, and at most {most} are allowed"
        )),
        _ => Ok(()),
    }
}
