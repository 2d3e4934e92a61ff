//! Resolves composites, arrays, and references to them and to fields.

use std::rc::Rc;

use super::{Resolved, Resolver, Whole};
use crate::check;
use crate::model::{
    Array, Group, GroupKind, Item, List, Meaning, Scalar, Shape, Unsigned, ValueSet, Variant,
};
use crate::source::{Span, Spanned};
use crate::syntax::{CountField, Dimension, Kind, Node, Target, TypeSetIndex};

impl Resolver<'_> {
    /// Resolves a field or composite and measures its copy cost.
    pub(super) fn whole(&mut self, scope: TypeSetIndex, node: &Node) -> Option<Rc<Whole>> {
        let item = self.item(scope, node)?;
        let (items, height) = measure(&item);
        Some(Rc::new(Whole {
            item,
            items,
            height,
        }))
    }

    /// Resolves a field or composite.
    pub(super) fn item(&mut self, scope: TypeSetIndex, node: &Node) -> Option<Item> {
        if self.nesting >= super::DEEPEST {
            self.too_deep(node.span);
            return None;
        }
        self.nesting += 1;
        let item = match &node.kind {
            Kind::Reference(target) => self.referred(scope, node, target),
            kind => self.shape(scope, node, kind).map(|shape| Item {
                name: node.name.clone(),
                optional: node.optional.unwrap_or(false),
                interpretation: node.interpretation.clone().unwrap_or_default(),
                shape,
                location: self.location(node.span),
            }),
        };
        self.nesting -= 1;
        item.filter(|_| node.sound)
    }

    /// A copy of the target, overridden by what the reference specifies itself.
    fn referred(&mut self, scope: TypeSetIndex, node: &Node, target: &Target) -> Option<Item> {
        let Resolved::Node(whole) = self.follow(scope, target)? else {
            return None;
        };
        if self.nesting + whole.height > super::DEEPEST {
            self.too_deep(node.span);
            return None;
        }
        self.spend(whole.items, node.span)?;
        let own = node.interpretation.as_ref().filter(|text| !text.is_empty());
        Some(Item {
            name: node.name.clone(),
            optional: node.optional.unwrap_or(whole.item.optional),
            interpretation: own.unwrap_or(&whole.item.interpretation).clone(),
            shape: whole.item.shape.clone(),
            location: self.location(node.span),
        })
    }

    /// Deducts the cost of a copy from the remaining budget. `None` if the budget is exceeded,
    /// which is reported once, because all later failures have the same cause.
    pub(super) fn spend(&mut self, items: usize, span: Span) -> Option<()> {
        let left = self.items_left?;
        self.items_left = left.checked_sub(items);
        if self.items_left.is_none() {
            let limit = super::MOST_ITEMS;
            self.report.error(
                span,
                format!(
                    "the references of these definitions add up to more than {limit} \
                     fields: load fewer of them at once"
                ),
            );
        }
        self.items_left.map(drop)
    }

    fn shape(&mut self, scope: TypeSetIndex, node: &Node, kind: &Kind) -> Option<Shape> {
        match kind {
            Kind::Group {
                kind,
                presence,
                members,
            } => self
                .group(scope, node, *kind, *presence, members)
                .map(Shape::Group),
            Kind::List { count, element } => self.list(scope, count, element).map(Shape::List),
            Kind::Variant { tag, alternatives } => {
                self.variant(scope, tag, alternatives).map(Shape::Variant)
            }
            Kind::Array {
                dimensions,
                element,
            } => self
                .array(scope, node, dimensions, element)
                .map(Shape::Array),
            Kind::Scalar(scalar) => self.scalar(scope, scalar).map(Shape::Scalar),
            Kind::Bits { base, fields } => self.bit_field(scope, *base, fields).map(Shape::Bits),
            Kind::FixedString { length } => self.fixed_string(scope, length),
            Kind::VariableString { count } => {
                let count = self.count(scope, count)?;
                Some(Shape::VariableString { count })
            }
            Kind::Blob { count, format } => {
                let count = self.count(scope, count)?;
                let format = format.clone();
                Some(Shape::Blob { count, format })
            }
            Kind::FormattedBlob { formats, count } => {
                let formats = self.formats(scope, formats);
                let count = self.count(scope, count);
                Some(Shape::FormattedBlob {
                    formats: formats?,
                    count: count?,
                })
            }
            Kind::Measure { choices } => {
                let choices = self.choices(scope, choices)?;
                Some(Shape::Measure { choices })
            }
            Kind::Reference(_) | Kind::Faulty => None,
        }
    }

    fn group(
        &mut self,
        scope: TypeSetIndex,
        node: &Node,
        kind: GroupKind,
        presence: Option<Spanned<Unsigned>>,
        nodes: &[Node],
    ) -> Option<Group> {
        let unique = check::unique_names(self.report, "members", nodes);
        let members = self.items(scope, nodes)?;
        let sound = check::group(self.report, node, kind, presence, nodes, &members);
        (unique && sound).then(|| Group {
            kind,
            presence: presence.map(|presence| presence.value),
            members,
        })
    }

    /// Resolves all items to find every mistake; `None` if one is faulty.
    fn items(&mut self, scope: TypeSetIndex, nodes: &[Node]) -> Option<Vec<Item>> {
        let items: Vec<_> = nodes.iter().map(|node| self.item(scope, node)).collect();
        items.into_iter().collect()
    }

    fn list(&mut self, scope: TypeSetIndex, count: &CountField, element: &Node) -> Option<List> {
        let count = self.count(scope, count);
        let item = self.item(scope, element);
        let what = "the element of a list";
        let sound = check::required(self.report, what, element, item.as_ref());
        let count = count.filter(|_| sound)?;
        Some(List {
            count,
            element: Box::new(item?),
        })
    }

    fn variant(
        &mut self,
        scope: TypeSetIndex,
        tag: &CountField,
        nodes: &[Node],
    ) -> Option<Variant> {
        let mut sound = check::unique_names(self.report, "alternatives", nodes);
        let range = self.count(scope, tag);
        let items: Vec<_> = nodes.iter().map(|node| self.item(scope, node)).collect();
        let what = "an alternative of a variant";
        for (node, item) in nodes.iter().zip(&items) {
            sound &= check::required(self.report, what, node, item.as_ref());
        }
        let alternatives = items.into_iter().collect::<Option<Vec<_>>>()?;
        sound &= check::tag(self.report, tag, range?, alternatives.len());
        sound.then_some(Variant {
            tag: tag.unsigned,
            alternatives,
        })
    }

    fn array(
        &mut self,
        scope: TypeSetIndex,
        node: &Node,
        dimensions: &[Dimension],
        element: &Node,
    ) -> Option<Array> {
        let names = dimensions.iter().map(|d| (d.name.as_str(), d.span));
        let unique = self.report.unique("dimensions", names);
        let sizes: Vec<_> = dimensions
            .iter()
            .map(|dimension| {
                let size = self.integer(scope, &dimension.size, "size")?;
                check::size(self.report, dimension.size.span, "size", size)
            })
            .collect();
        let item = self.item(scope, element);
        let what = "the element of an array";
        let required = check::required(self.report, what, element, item.as_ref());
        let item = item?;
        let dimensions: Vec<u32> = sizes.into_iter().collect::<Option<_>>()?;
        let small = check::array(self.report, node.span, &dimensions, &item);
        (unique && required && small).then(|| Array {
            dimensions,
            element: Box::new(item),
        })
    }
}

/// Copy cost of an item, in fields of usual size, and its nesting depth.
pub(super) fn measure(item: &Item) -> (usize, usize) {
    let own = 1 + text(&item.interpretation) + entries(&item.shape);
    let (items, height) = item
        .shape
        .items()
        .map(measure)
        .fold((own, 0), |(items, height), (i, h)| {
            (items + i, height.max(h))
        });
    (items, height + 1)
}

/// Copy cost of a field's enumerations.
fn entries(shape: &Shape) -> usize {
    match shape {
        Shape::Scalar(scalar) => scalar_entries(scalar),
        Shape::Bits(bits) => {
            let fields = bits.fields.iter();
            fields
                .map(|f| 1 + text(&f.interpretation) + values(&f.values))
                .sum()
        }
        Shape::Measure { choices } => {
            let choices = choices.iter();
            choices.map(|c| 1 + scalar_entries(&c.scalar)).sum()
        }
        Shape::FormattedBlob { formats, .. } => formats.iter().map(|f| 1 + text(&f.name)).sum(),
        Shape::Blob { format, .. } => text(format),
        _ => 0,
    }
}

fn scalar_entries(scalar: &Scalar) -> usize {
    let values = match &scalar.meaning {
        Meaning::Values(set) => values(set),
        Meaning::Plain | Meaning::Scaled(_) => 0,
    };
    text(&scalar.units) + values
}

/// Copy cost of a value set.
pub(super) fn values(set: &ValueSet) -> usize {
    let ranges = set.ranges.iter().map(|r| 1 + text(&r.interpretation));
    let values = set.values.iter();
    let values = values.map(|v| 1 + text(&v.name) + text(&v.interpretation));
    ranges.chain(values).sum()
}

/// Copy cost of a text: 0 if it is short.
pub(super) fn text(text: &str) -> usize {
    text.len() / 256
}
