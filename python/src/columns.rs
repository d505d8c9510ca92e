//! The messages of one topic as columns.
//!
//! Never keeps half a row: a message that does not decode leaves every column as it was.

use crate::{
    message_shape::{Kind, Leaf, MessageShape, Node, Nodes},
    wire::{Fields, Wire, unzigzag},
};
use numpy::IntoPyArray;
use prost_types::field_descriptor_proto::Type;
use pyo3::{
    prelude::*,
    types::{PyList, PyTuple},
};
use std::collections::HashMap;

/// The column that every table has.
const TICK: &str = "tick";

/// Texts, each different one once.
#[derive(Debug, Default)]
pub(crate) struct TextColumn {
    codes: Vec<u32>,
    texts: Vec<String>,
    known: HashMap<String, u32>,
}

impl TextColumn {
    pub(crate) fn push(&mut self, text: String) {
        // A flight repeats a few texts in every tick.
        let code = if let Some(code) = self.known.get(&text) {
            *code
        } else {
            let code = self.texts.len() as u32;
            self.texts.push(text.clone());
            self.known.insert(text, code);
            code
        };
        self.codes.push(code);
    }
}

/// One column.
#[derive(Debug)]
pub(crate) enum Column {
    Float(Vec<f64>),
    Int(Vec<i64>),
    Unsigned(Vec<u64>),
    Flag(Vec<bool>),
    Text(TextColumn),
    Texts(Vec<Vec<String>>),
}

impl Column {
    fn new(kind: Kind) -> Self {
        match kind {
            Kind::Float => Self::Float(Vec::new()),
            Kind::Int => Self::Int(Vec::new()),
            Kind::Unsigned => Self::Unsigned(Vec::new()),
            Kind::Flag => Self::Flag(Vec::new()),
            Kind::Text => Self::Text(TextColumn::default()),
            Kind::Texts => Self::Texts(Vec::new()),
        }
    }

    /// Adds a value. What is absent is `absent` in a column of floats, and elsewhere what protobuf says of a field that is
    /// not written.
    fn push(&mut self, value: Value, absent: f64) {
        match self {
            Self::Float(column) => column.push(if let Value::Float(value) = value { value } else { absent }),
            Self::Int(column) => column.push(if let Value::Int(value) = value { value } else { 0 }),
            Self::Unsigned(column) => column.push(if let Value::Unsigned(value) = value { value } else { 0 }),
            Self::Flag(column) => column.push(matches!(value, Value::Flag(true))),
            Self::Text(column) => {
                column.push(if let Value::Text(text) = value { text } else { String::new() });
            }
            Self::Texts(column) => {
                column.push(if let Value::Texts(texts) = value { texts } else { Vec::new() });
            }
        }
    }

    /// The column for Python: an array, a tuple of an array of codes and a list of texts, or a list of lists.
    pub(crate) fn into_python(self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(match self {
            Self::Float(column) => column.into_pyarray(py).into_any().unbind(),
            Self::Int(column) => column.into_pyarray(py).into_any().unbind(),
            Self::Unsigned(column) => column.into_pyarray(py).into_any().unbind(),
            Self::Flag(column) => column.into_pyarray(py).into_any().unbind(),
            Self::Text(TextColumn { codes, texts, .. }) => {
                let parts = [codes.into_pyarray(py).into_any(), PyList::new(py, texts)?.into_any()];
                PyTuple::new(py, parts)?.into_any().unbind()
            }
            Self::Texts(column) => PyList::new(py, column)?.into_any().unbind(),
        })
    }
}

/// A value of a message.
#[derive(Debug, Clone, Default)]
enum Value {
    #[default]
    Absent,
    Float(f64),
    Int(i64),
    Unsigned(u64),
    Flag(bool),
    Text(String),
    Texts(Vec<String>),
}

/// The messages of a topic, column by column.
#[derive(Debug)]
pub(crate) struct Columns {
    shape: MessageShape,
    columns: Vec<Column>,
    /// The ticks of the rows, by the times of the log.
    ticks: Vec<i64>,
    /// The message that is being read, so that a damaged one leaves no half row.
    row: Vec<Value>,
}

impl Columns {
    /// No messages yet of this `shape`.
    pub(crate) fn new(shape: MessageShape) -> Self {
        let columns = shape.columns.iter().map(|column| Column::new(column.kind)).collect();
        Self { columns, ticks: Vec::new(), row: Vec::new(), shape }
    }

    /// Adds a row with the values of the `message` of `tick`; returns whether it decodes.
    pub(crate) fn push(&mut self, tick: i64, message: &[u8]) -> bool {
        // A message that did not decode leaves its values here.
        self.row.clear();
        self.row.resize(self.columns.len(), Value::Absent);
        if read(&self.shape.fields, message, &mut self.row).is_none() {
            return false;
        }
        let values = self.row.drain(..);
        for ((column, shape), value) in self.columns.iter_mut().zip(&self.shape.columns).zip(values) {
            column.push(value, shape.absent);
        }
        self.ticks.push(tick);
        true
    }

    /// The names of the columns and their values, for Python. One of them is `tick`.
    pub(crate) fn into_python(self, py: Python<'_>) -> PyResult<Vec<(String, Py<PyAny>)>> {
        // Messages for viewers, such as the leader's pose, have no tick of their own.
        let has_tick = self.shape.columns.iter().any(|shape| shape.name == TICK);
        let ticks = (!has_tick).then(|| (TICK.to_owned(), Column::Int(self.ticks)));
        let named = self.shape.columns.into_iter().map(|shape| shape.name).zip(self.columns);
        ticks.into_iter().chain(named).map(|(name, column)| Ok((name, column.into_python(py)?))).collect()
    }
}

/// Reads the fields of `message` into `row`; `None` if it does not decode.
fn read(fields: &Nodes, message: &[u8], row: &mut [Value]) -> Option<()> {
    for field in Fields::of(message) {
        let (number, wire) = field?;
        match (fields.get(&number), wire) {
            (Some(Node::Leaf(leaf)), wire) => read_leaf(leaf, wire, row.get_mut(leaf.column)?)?,
            (Some(Node::Message(inner)), Wire::Bytes(message)) => read(inner, message, row)?,
            (Some(Node::Message(_)), _) => return None,
            // Protobuf lets a message have fields that its description does not name.
            (None, _) => {}
        }
    }
    Some(())
}

fn read_leaf(leaf: &Leaf, wire: Wire<'_>, place: &mut Value) -> Option<()> {
    if let Wire::Bytes(bytes) = wire {
        let text = str::from_utf8(bytes).ok()?.to_owned();
        match (leaf.kind, place) {
            (Kind::Text, place) => *place = Value::Text(text),
            // Protobuf writes a list of texts as one field per text, so the list grows field by field.
            (Kind::Texts, Value::Texts(texts)) => texts.push(text),
            (Kind::Texts, place) => *place = Value::Texts(vec![text]),
            _ => return None,
        }
        return Some(());
    }
    *place = match leaf.kind {
        Kind::Float => Value::Float(float(leaf.wire, wire)?),
        Kind::Int => Value::Int(int(leaf.wire, wire)?),
        Kind::Unsigned => Value::Unsigned(bits(wire)),
        Kind::Flag => Value::Flag(bits(wire) != 0),
        Kind::Text | Kind::Texts => return None,
    };
    Some(())
}

/// The number in a column of floats, which also holds integers that may be absent.
fn float(declared: Type, wire: Wire<'_>) -> Option<f64> {
    match (declared, wire) {
        (Type::Double, Wire::Fixed64(bits)) => Some(f64::from_bits(bits)),
        (Type::Float, Wire::Fixed32(bits)) => Some(f32::from_bits(bits).into()),
        (Type::Double | Type::Float, _) => None,
        (Type::Uint64 | Type::Fixed64, wire) => Some(bits(wire) as f64),
        (declared, wire) => int(declared, wire).map(|number| number as f64),
    }
}

fn int(declared: Type, wire: Wire<'_>) -> Option<i64> {
    match (declared, wire) {
        (Type::Sint32 | Type::Sint64, Wire::Varint(value)) => Some(unzigzag(value)),
        (Type::Sfixed32, Wire::Fixed32(bits)) => Some(bits.cast_signed().into()),
        (_, Wire::Bytes(_)) => None,
        // Protobuf writes all other integers in two's complement, so their bits are the number.
        (_, wire) => Some(bits(wire).cast_signed()),
    }
}

fn bits(wire: Wire<'_>) -> u64 {
    match wire {
        Wire::Varint(value) | Wire::Fixed64(value) => value,
        Wire::Fixed32(value) => value.into(),
        Wire::Bytes(_) => 0,
    }
}
