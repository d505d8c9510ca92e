//! The columns that the messages of a topic become, from the description that the log has of them.
//!
//! Never knows ringwing's own messages: a log of another version has other fields, and they are columns, too.

use prost::Message;
use prost_types::{
    DescriptorProto, FieldDescriptorProto, FileDescriptorSet,
    field_descriptor_proto::{Label, Type},
};
use ringwing_recorder::log::reader::TopicSchema;
use std::collections::HashMap;

/// Messages within messages that are followed. A description that contains itself would never end.
const DEPTH_MAX: usize = 8;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// `float64`; also for integers and flags that may be absent.
    Float,
    /// `int64`.
    Int,
    /// `uint64`, for fields that may need all 64 bits.
    Unsigned,
    /// `bool`.
    Flag,
    /// A text.
    Text,
    /// A list of texts.
    Texts,
}

/// A field that becomes a column.
#[derive(Debug, Clone)]
pub(crate) struct Leaf {
    /// Place of its column.
    pub(crate) column: usize,
    pub(crate) kind: Kind,
    /// How it is written.
    pub(crate) wire: Type,
}

/// What a field of a message is.
#[derive(Debug, Clone)]
pub(crate) enum Node {
    Leaf(Leaf),
    Message(Nodes),
}

/// The fields of a message by their numbers.
pub(crate) type Nodes = HashMap<u32, Node>;

/// A column: its name and what it holds.
#[derive(Debug, Clone)]
pub(crate) struct ColumnShape {
    /// The field's name; after a dot for each message around it, as in `pose.position.x`.
    pub(crate) name: String,
    pub(crate) kind: Kind,
    /// What a column of floats holds where the message has no value: NaN if the field may be absent, else 0.
    pub(crate) absent: f64,
}

/// How the messages of a topic become rows.
#[derive(Debug, Clone)]
pub(crate) struct MessageShape {
    pub(crate) columns: Vec<ColumnShape>,
    pub(crate) fields: Nodes,
}

impl MessageShape {
    /// The shape of the messages that `schema` describes; `None` if they are no protobuf, or not rows: a list of messages
    /// within a message has no columns.
    pub(crate) fn of(schema: &TopicSchema) -> Option<Self> {
        let files =
            FileDescriptorSet::decode(&*schema.data).ok().filter(|_| schema.encoding == "protobuf")?;
        let mut messages = HashMap::new();
        for file in &files.file {
            // Without a package the full name of a message begins with a single dot.
            let package = file.package.as_deref().filter(|package| !package.is_empty());
            let scope = package.map_or_else(String::new, |package| format!(".{package}"));
            collect(&scope, &file.message_type, &mut messages);
        }
        let mut shape = Builder { messages, columns: Vec::new() };
        let fields = shape.fields(&format!(".{}", schema.name), "", DEPTH_MAX)?;
        Some(Self { columns: shape.columns, fields })
    }
}

/// Lists `found` and the messages declared within them under their full names.
fn collect<'a>(
    scope: &str,
    found: &'a [DescriptorProto],
    messages: &mut HashMap<String, &'a DescriptorProto>,
) {
    for message in found {
        let name = format!("{scope}.{}", message.name());
        collect(&name, &message.nested_type, messages);
        messages.insert(name, message);
    }
}

struct Builder<'a> {
    messages: HashMap<String, &'a DescriptorProto>,
    columns: Vec<ColumnShape>,
}

impl Builder<'_> {
    fn fields(&mut self, message: &str, before: &str, depth: usize) -> Option<Nodes> {
        let message = *self.messages.get(message)?;
        let mut nodes = Nodes::new();
        for field in &message.field {
            nodes.insert(field.number().cast_unsigned(), self.node(field, before, depth)?);
        }
        Some(nodes)
    }

    fn node(&mut self, field: &FieldDescriptorProto, before: &str, depth: usize) -> Option<Node> {
        let name = format!("{before}{}", field.name());
        let is_list = field.label() == Label::Repeated;
        if field.r#type() == Type::Message {
            let depth = depth.checked_sub(1).filter(|_| !is_list)?;
            return self.fields(field.type_name(), &format!("{name}."), depth).map(Node::Message);
        }
        let kind = kind(field.r#type(), is_list, field.proto3_optional())?;
        let absent = if field.proto3_optional() { f64::NAN } else { 0.0 };
        self.columns.push(ColumnShape { name, kind, absent });
        Some(Node::Leaf(Leaf { column: self.columns.len() - 1, kind, wire: field.r#type() }))
    }
}

fn kind(wire: Type, is_list: bool, is_optional: bool) -> Option<Kind> {
    match (wire, is_list) {
        (Type::String, true) => Some(Kind::Texts),
        // These fit no column, so the whole topic is left out.
        (_, true) | (Type::Bytes | Type::Group | Type::Message, _) => None,
        (Type::String, _) => Some(Kind::Text),
        (Type::Double | Type::Float, _) => Some(Kind::Float),
        // NumPy's integers and flags have no value for "absent".
        _ if is_optional => Some(Kind::Float),
        (Type::Bool, _) => Some(Kind::Flag),
        (Type::Uint64 | Type::Fixed64, _) => Some(Kind::Unsigned),
        _ => Some(Kind::Int),
    }
}
