//! Types of messages as data.

/// A message type with its fields.
#[derive(Debug)]
pub struct MessageType {
    /// The full name, such as `std_msgs/msg/Header`.
    pub name: &'static str,
    pub constants: &'static [Constant],
    /// The fields in the order of their encoding, at least one.
    pub fields: &'static [FieldSpec],
}

/// A constant of a message type. It is part of the definition, but neither of the encoding nor of the hash.
#[derive(Debug)]
pub struct Constant {
    pub name: &'static str,
    pub base: BaseType,
    /// The number. The types of this crate have no constants beyond 255.
    pub value: u8,
}

/// A field of a message type.
#[derive(Debug)]
pub struct FieldSpec {
    pub name: &'static str,
    pub of: FieldType,
}

/// The type of a field.
#[derive(Clone, Copy, Debug)]
pub struct FieldType {
    pub base: BaseType,
    pub shape: Shape,
}

/// The number of values in a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    Single,
    /// A fixed number of values.
    Array(usize),
    /// Any number of values.
    Sequence,
    /// At most this number of values.
    Bounded(usize),
}

/// The type of a value.
#[derive(Clone, Copy, Debug)]
pub enum BaseType {
    Bool,
    Byte,
    Int8,
    Uint8,
    Int32,
    Uint32,
    Int64,
    Float32,
    Float64,
    String,
    Message(&'static MessageType),
}

impl BaseType {
    /// Returns the name in definitions. A message type is without its middle part `msg`.
    #[must_use]
    pub fn name(self) -> String {
        let name = match self {
            Self::Bool => "bool",
            Self::Byte => "byte",
            Self::Int8 => "int8",
            Self::Uint8 => "uint8",
            Self::Int32 => "int32",
            Self::Uint32 => "uint32",
            Self::Int64 => "int64",
            Self::Float32 => "float32",
            Self::Float64 => "float64",
            Self::String => "string",
            Self::Message(message) => return message.short_name(),
        };
        name.to_owned()
    }
}

impl MessageType {
    /// Returns the name without its middle part, such as `std_msgs/Header`.
    #[must_use]
    pub fn short_name(&self) -> String {
        self.name.replacen("/msg/", "/", 1)
    }

    /// Returns the types that the fields contain, directly or within others, in the order of their first occurrence.
    #[must_use]
    pub fn referenced(&self) -> Vec<&'static MessageType> {
        let mut found = Vec::new();
        self.collect_referenced(&mut found);
        found
    }

    fn collect_referenced(&self, found: &mut Vec<&'static MessageType>) {
        for field in self.fields {
            if let BaseType::Message(message) = field.of.base
                && found.iter().all(|known| known.name != message.name)
            {
                found.push(message);
                message.collect_referenced(found);
            }
        }
    }
}
