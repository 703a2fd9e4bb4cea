//! Traces serde types: a deserializer that reads no bytes, but records which parts a type asks for.
//!
//! The crate serde-reflection does the same, but identifies a type by its name without module and parameters. The
//! messages contain `Fact<T>` of several `T`, and each mission has a `SensorReading`.

use std::any::type_name;
use std::collections::BTreeMap;

use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, EnumAccess, IntoDeserializer, SeqAccess,
    VariantAccess, Visitor, value,
};
use serde::forward_to_deserialize_any;
use serde_json::{Value, json};

/// The named types by name.
#[derive(Default)]
pub struct Types {
    types: BTreeMap<String, Value>,
    enums: BTreeMap<String, Variants>,
}

/// The variants of an enum: names and contents. A content is `None` before it is traced.
struct Variants {
    traced: Vec<(&'static str, Option<Value>)>,
    visits: usize,
}

impl Variants {
    /// Returns the variant to trace next: the first untraced one, else all in turn, because they may contain enums with
    /// untraced variants.
    fn next(&mut self) -> usize {
        self.visits += 1;
        let untraced = self
            .traced
            .iter()
            .position(|(_, content)| content.is_none());
        untraced.unwrap_or(self.visits % self.traced.len())
    }
}

impl Types {
    /// Adds a type with all types that it contains, and returns its description.
    pub fn trace<T: DeserializeOwned>(&mut self) -> Value {
        for _ in 0..10_000 {
            let mut found = Value::Null;
            let tracer = Tracer {
                types: self,
                found: &mut found,
            };
            T::deserialize(tracer).unwrap_or_else(|error| panic!("{}: {error}", type_name::<T>()));
            let mut variants = self.enums.values().flat_map(|variants| &variants.traced);
            if variants.all(|(_, content)| content.is_some()) {
                return found;
            }
        }
        panic!("{}: a variant is never reached", type_name::<T>());
    }

    /// Returns the descriptions by the names of the types.
    pub fn described(mut self) -> BTreeMap<String, Value> {
        for (name, variants) in self.enums {
            let variants = variants.traced.into_iter().map(
                |(name, content)| json!({ "name": name, "content": content.unwrap_or_default() }),
            );
            self.types
                .insert(name, json!({ "enum": Vec::from_iter(variants) }));
        }
        self.types
    }

    fn insert(&mut self, name: String, described: Value) -> Value {
        let earlier = self.types.insert(name.clone(), described.clone());
        let is_same = earlier.is_none_or(|earlier| earlier == described);
        assert!(is_same, "two types have the name {name}");
        Value::String(name)
    }
}

/// Returns a type's name without modules, but with the mission, as in `service::Action`. Boxes have no bytes.
fn name_of<T>() -> String {
    let mut name = String::new();
    for part in type_name::<T>().split_inclusive(['<', '>', ',', ' ']) {
        let mut modules = part.split("::");
        if modules.next() == Some("missions") {
            name += modules.next().unwrap_or_default();
            name += "::";
        }
        name += part.rsplit("::").next().unwrap_or_default();
    }
    // The parameters of `ToAgent` only avoid copies.
    let name = name.replace("ToAgent<Box<TickMessage>, EncodedBroadcast>", "ToAgent");
    assert!(!name.contains("Box<"), "{name}");
    name
}

/// Traces one value.
struct Tracer<'t> {
    types: &'t mut Types,
    /// The description of the value's type.
    found: &'t mut Value,
}

type Error = value::Error;

/// Implements a method for a type without parts.
macro_rules! plain {
    ($($method:ident $visit:ident $name:literal $value:expr;)*) => {
        $(fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
            *self.found = json!($name);
            visitor.$visit($value)
        })*
    };
}

impl<'de> Deserializer<'de> for Tracer<'_> {
    type Error = Error;

    plain! {
        deserialize_bool visit_bool "bool" false;
        deserialize_u8 visit_u8 "u8" 0;
        deserialize_u16 visit_u16 "u16" 0;
        deserialize_u32 visit_u32 "u32" 0;
        deserialize_u64 visit_u64 "u64" 0;
        deserialize_u128 visit_u128 "u128" 0;
        deserialize_f32 visit_f32 "f32" 0.0;
        deserialize_f64 visit_f64 "f64" 0.0;
        deserialize_str visit_str "text" "";
        deserialize_string visit_str "text" "";
        deserialize_bytes visit_bytes "bytes" &[];
        deserialize_byte_buf visit_bytes "bytes" &[];
    }

    forward_to_deserialize_any! { i8 i16 i32 i64 i128 char map identifier ignored_any }

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Error> {
        Err(serde::de::Error::custom("the schema lacks such types"))
    }

    fn is_human_readable(&self) -> bool {
        false
    }

    fn deserialize_unit<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        *self.found = json!({ "tuple": [] });
        visitor.visit_unit()
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        let mut part = Value::Null;
        let types = &mut *self.types;
        let value = visitor.visit_some(Tracer {
            types,
            found: &mut part,
        })?;
        *self.found = json!({ "option": part });
        Ok(value)
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        let mut parts = Parts::new(self.types, 1);
        let value = visitor.visit_seq(&mut parts)?;
        *self.found = match &parts.found[..] {
            // The same bytes.
            [Value::String(part)] if part == "u8" => json!("bytes"),
            [part] => json!({ "list": part }),
            parts => panic!("{} parts of a list", parts.len()),
        };
        Ok(value)
    }

    fn deserialize_tuple<V: Visitor<'de>>(
        self,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, Error> {
        let mut parts = Parts::new(self.types, length);
        let value = visitor.visit_seq(&mut parts)?;
        *self.found = json!({ "tuple": parts.found });
        Ok(value)
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Error> {
        let name = name_of::<V::Value>();
        *self.found = self.types.insert(name, json!({ "struct": [] }));
        visitor.visit_unit()
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Error> {
        let mut part = Value::Null;
        let types = &mut *self.types;
        let value = visitor.visit_newtype_struct(Tracer {
            types,
            found: &mut part,
        })?;
        *self.found = self.types.insert(name_of::<V::Value>(), part);
        Ok(value)
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, Error> {
        let mut parts = Parts::new(self.types, length);
        let value = visitor.visit_seq(&mut parts)?;
        let described = json!({ "tuple": parts.found });
        *self.found = self.types.insert(name_of::<V::Value>(), described);
        Ok(value)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        let mut parts = Parts::new(self.types, fields.len());
        let value = visitor.visit_seq(&mut parts)?;
        let described = parts.of_struct(fields);
        *self.found = self.types.insert(name_of::<V::Value>(), described);
        Ok(value)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        names: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        let name = name_of::<V::Value>();
        let variants = self.types.enums.entry(name.clone());
        let variants = variants.or_insert_with(|| Variants {
            traced: names.iter().map(|name| (*name, None)).collect(),
            visits: 0,
        });
        let index = variants.next();
        let mut content = Value::Null;
        let types = &mut *self.types;
        let value = visitor.visit_enum(Variant {
            index,
            content: Tracer {
                types,
                found: &mut content,
            },
        })?;
        if let Some(variants) = self.types.enums.get_mut(&name) {
            variants.traced[index].1 = Some(content);
        }
        *self.found = Value::String(name);
        Ok(value)
    }
}

/// Traces the parts of a list, tuple or struct.
struct Parts<'t> {
    types: &'t mut Types,
    length: usize,
    found: Vec<Value>,
}

impl<'t> Parts<'t> {
    fn new(types: &'t mut Types, length: usize) -> Self {
        Self {
            types,
            length,
            found: Vec::new(),
        }
    }

    fn of_struct(self, names: &[&str]) -> Value {
        assert_eq!(self.found.len(), names.len());
        let fields = names.iter().zip(self.found);
        let fields = fields.map(|(name, part)| json!({ "name": name, "type": part }));
        json!({ "struct": Vec::from_iter(fields) })
    }
}

impl<'de> SeqAccess<'de> for &mut Parts<'_> {
    type Error = Error;

    fn next_element_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, Error> {
        if self.found.len() == self.length {
            return Ok(None);
        }
        let mut part = Value::Null;
        let types = &mut *self.types;
        let value = seed.deserialize(Tracer {
            types,
            found: &mut part,
        })?;
        self.found.push(part);
        Ok(Some(value))
    }
}

/// Traces the content of a variant.
struct Variant<'t> {
    index: usize,
    content: Tracer<'t>,
}

impl<'de, 't> EnumAccess<'de> for Variant<'t> {
    type Error = Error;
    type Variant = Tracer<'t>;

    fn variant_seed<S: DeserializeSeed<'de>>(
        self,
        seed: S,
    ) -> Result<(S::Value, Tracer<'t>), Error> {
        let index = (self.index as u32).into_deserializer();
        Ok((
            seed.deserialize::<value::U32Deserializer<Error>>(index)?,
            self.content,
        ))
    }
}

impl<'de> VariantAccess<'de> for Tracer<'_> {
    type Error = Error;

    fn unit_variant(self) -> Result<(), Error> {
        Ok(())
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, Error> {
        seed.deserialize(self)
    }

    fn tuple_variant<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, Error> {
        self.deserialize_tuple(length, visitor)
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        names: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        let mut parts = Parts::new(self.types, names.len());
        let value = visitor.visit_seq(&mut parts)?;
        *self.found = parts.of_struct(names);
        Ok(value)
    }
}
