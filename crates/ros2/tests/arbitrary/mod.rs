//! Arbitrary messages, and their encodings in both byte orders, written independently of the crate's encoder.

use std::sync::Arc;

use jaus_ros2::interface::{Field, Kind, Primitive, Size};
use jaus_ros2::{Interface, Interfaces, Message, Value};
use proptest::prelude::*;
use proptest::strategy::{BoxedStrategy, Just};

/// The type `test_msgs/Test` with this text.
pub(crate) fn interface(text: &str) -> Arc<Interface> {
    let mut interfaces = Interfaces::bundled().unwrap();
    interfaces.add("test_msgs/Test", text).unwrap();
    interfaces.get("test_msgs/Test").unwrap()
}

/// Every kind of field, and the bundled types within it.
pub(crate) fn everything() -> Arc<Interface> {
    interface(
        "bool a\nint64 b\nbyte c\nuint16[3] d\nstring<=9 e\nfloat32[] f\nint8 g\nuint64[<=3] h\n\
         string[2] i\ndiagnostic_msgs/DiagnosticArray j\nint32 k\nstd_msgs/Empty[<=2] l\nfloat64 m\n\
         nav_msgs/Odometry n\ntf2_msgs/TFMessage[] o\nuint32 p\nint16 q\nsensor_msgs/BatteryState r",
    )
}

/// A message of the type.
pub(crate) fn message_of(interface: &Arc<Interface>) -> impl Strategy<Value = Message> + use<> {
    let interface = interface.clone();
    let value = fields_of(&interface);
    value.prop_map(move |value| Message::from_value(&interface, value).unwrap())
}

fn fields_of(interface: &Interface) -> BoxedStrategy<Value> {
    let fields = interface.fields().iter();
    let none = Just(Vec::new()).boxed();
    let fields = fields.fold(none, |before: BoxedStrategy<Vec<Value>>, field| {
        let pair = (before, field_of(field));
        pair.prop_map(|(mut before, value)| {
            before.push(value);
            before
        })
        .boxed()
    });
    fields.prop_map(Value::Message).boxed()
}

fn field_of(field: &Field) -> BoxedStrategy<Value> {
    let count = match field.size {
        Size::One => return value_of(&field.kind),
        Size::Fixed(count) => count..=count,
        Size::AtMost(most) => 0..=most.min(4),
        Size::Any => 0..=4,
    };
    let elements = prop::collection::vec(value_of(&field.kind), count);
    elements.prop_map(Value::Sequence).boxed()
}

fn value_of(kind: &Kind) -> BoxedStrategy<Value> {
    match kind {
        Kind::Primitive(primitive) => number_of(*primitive),
        Kind::String { most } => {
            let most = most.unwrap_or(12).min(12);
            let text = "[a-zé]{0,12}".prop_filter("too long", move |text| text.len() <= most);
            text.prop_map(Value::String).boxed()
        }
        Kind::Message(nested) => fields_of(nested),
    }
}

fn number_of(primitive: Primitive) -> BoxedStrategy<Value> {
    match primitive {
        Primitive::Bool => any::<bool>().prop_map(Value::from).boxed(),
        Primitive::Byte | Primitive::Uint8 => any::<u8>().prop_map(Value::from).boxed(),
        Primitive::Int8 => any::<i8>().prop_map(Value::from).boxed(),
        Primitive::Int16 => any::<i16>().prop_map(Value::from).boxed(),
        Primitive::Uint16 => any::<u16>().prop_map(Value::from).boxed(),
        Primitive::Int32 => any::<i32>().prop_map(Value::from).boxed(),
        Primitive::Uint32 => any::<u32>().prop_map(Value::from).boxed(),
        Primitive::Int64 => any::<i64>().prop_map(Value::from).boxed(),
        Primitive::Uint64 => any::<u64>().prop_map(Value::from).boxed(),
        Primitive::Float32 => any::<f32>().prop_map(Value::from).boxed(),
        Primitive::Float64 => any::<f64>().prop_map(Value::from).boxed(),
    }
}

/// A message in a byte order, with its header, and where the lengths of its texts and sequences are.
pub(crate) fn encode(message: &Message, is_little: bool) -> (Vec<u8>, Vec<usize>) {
    let mut writer = Writer {
        body: Vec::new(),
        lengths: Vec::new(),
        is_little,
    };
    writer.message(message.interface(), message.fields());
    let header = [0, is_little.into(), 0, 0];
    let lengths = writer.lengths.iter().map(|at| header.len() + at);
    ([&header[..], &writer.body].concat(), lengths.collect())
}

struct Writer {
    /// What follows the header.
    body: Vec<u8>,
    lengths: Vec<usize>,
    is_little: bool,
}

impl Writer {
    fn message(&mut self, interface: &Interface, values: &[Value]) {
        if values.is_empty() {
            self.body.push(0);
        }
        for (field, value) in interface.fields().iter().zip(values) {
            let Value::Sequence(elements) = value else {
                self.one(&field.kind, value);
                continue;
            };
            if !matches!(field.size, Size::Fixed(_)) {
                self.length(elements.len());
            }
            elements.iter().for_each(|it| self.one(&field.kind, it));
        }
    }

    fn one(&mut self, kind: &Kind, value: &Value) {
        match (kind, value) {
            (Kind::Message(nested), Value::Message(values)) => self.message(nested, values),
            (Kind::String { .. }, Value::String(text)) => {
                self.length(text.len() + 1);
                self.body.extend(text.bytes().chain([0]));
            }
            (Kind::Primitive(primitive), value) => self.number(*primitive, value),
            _ => panic!("{value:?} is no {kind:?}"),
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "a float32 is one")]
    fn number(&mut self, primitive: Primitive, value: &Value) {
        let octets = match value {
            Value::Bool(it) => u64::from(*it).to_be_bytes(),
            Value::Unsigned(it) => it.to_be_bytes(),
            Value::Signed(it) => it.to_be_bytes(),
            Value::Float(it) if primitive == Primitive::Float32 => {
                return self.aligned((*it as f32).to_be_bytes());
            }
            Value::Float(it) => it.to_be_bytes(),
            _ => panic!("{value:?} is no {primitive:?}"),
        };
        let [a, b, c, d, e, f, g, h] = octets;
        match primitive {
            Primitive::Bool | Primitive::Byte | Primitive::Int8 | Primitive::Uint8 => {
                self.aligned([h]);
            }
            Primitive::Int16 | Primitive::Uint16 => self.aligned([g, h]),
            Primitive::Int32 | Primitive::Uint32 | Primitive::Float32 => {
                self.aligned([e, f, g, h]);
            }
            Primitive::Int64 | Primitive::Uint64 | Primitive::Float64 => {
                self.aligned([a, b, c, d, e, f, g, h]);
            }
        }
    }

    fn length(&mut self, length: usize) {
        self.aligned(u32::try_from(length).unwrap().to_be_bytes());
        self.lengths.push(self.body.len() - 4);
    }

    /// Writes a number, given in big endian.
    fn aligned<const N: usize>(&mut self, mut number: [u8; N]) {
        if self.is_little {
            number.reverse();
        }
        self.body.resize(self.body.len().next_multiple_of(N), 0);
        self.body.extend(number);
    }
}
