//! The numbers of a JSON view with their definitions.

use serde_json::{Map, Value as Json};

use super::SECTIONS;
use crate::model::{Array, Item, Message, Scalar, Shape, SubField};

/// The definition of a number in a JSON view.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Leaf<'m> {
    /// A `fixed_field`, or the value of a `variable_field`.
    Scalar(&'m Scalar),
    /// A part of a bit field.
    SubField(&'m SubField),
}

/// Calls a function for each number in the [JSON view](super::to_json) of a message, in any order.
/// Members that do not fit the definition are left out.
pub fn for_each_number(
    message: &Message,
    view: &mut Json,
    act: &mut impl FnMut(Leaf<'_>, &mut Json),
) {
    if message.header.is_none() && message.footer.is_none() {
        if let Some(body) = &message.body {
            shape(&body.shape, view, act);
        }
        return;
    }
    let sections = [&message.header, &message.body, &message.footer];
    for (key, section) in SECTIONS.into_iter().zip(sections) {
        if let (Some(item), Some(view)) = (section, view.get_mut(key)) {
            shape(&item.shape, view, act);
        }
    }
}

fn shape(definition: &Shape, view: &mut Json, act: &mut impl FnMut(Leaf<'_>, &mut Json)) {
    match (definition, view) {
        (Shape::Group(group), Json::Object(view)) => members(&group.members, view, act),
        (Shape::Variant(variant), Json::Object(view)) => members(&variant.alternatives, view, act),
        (Shape::List(list), Json::Array(views)) => {
            for view in views {
                shape(&list.element.shape, view, act);
            }
        }
        (Shape::Array(array), view) => elements(array, array.dimensions.len(), view, act),
        (Shape::Scalar(scalar), view) => act(Leaf::Scalar(scalar), view),
        (Shape::Bits(bits), Json::Object(view)) => {
            for field in &bits.fields {
                if let Some(view) = view.get_mut(&field.name) {
                    act(Leaf::SubField(field), view);
                }
            }
        }
        (Shape::Measure { choices }, Json::Object(view)) => {
            let index = view.get("index").and_then(Json::as_u64);
            let choice = choices.iter().find(|it| Some(it.index.into()) == index);
            if let (Some(choice), Some(view)) = (choice, view.get_mut("value")) {
                act(Leaf::Scalar(&choice.scalar), view);
            }
        }
        _ => {}
    }
}

fn members(
    items: &[Item],
    view: &mut Map<String, Json>,
    act: &mut impl FnMut(Leaf<'_>, &mut Json),
) {
    for item in items {
        if let Some(view) = view.get_mut(&item.name) {
            shape(&item.shape, view, act);
        }
    }
}

/// The elements of nested arrays.
fn elements(
    array: &Array,
    depth: usize,
    view: &mut Json,
    act: &mut impl FnMut(Leaf<'_>, &mut Json),
) {
    match (depth, view) {
        (0, view) => shape(&array.element.shape, view, act),
        (_, Json::Array(views)) => {
            for view in views {
                elements(array, depth - 1, view, act);
            }
        }
        _ => {}
    }
}
