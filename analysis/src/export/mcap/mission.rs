//! Rows of mission.csv as messages with the columns that the mission declares.

use foxglove::Schema;
use foxglove::prost_types::field_descriptor_proto::{Label, Type};
use foxglove::prost_types::{
    DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet,
    OneofDescriptorProto,
};
use foxglove::protobuf::{encode_varint, prost_file_descriptor_set_to_vec};
use run_log::MissionRow;
use scenario::mission::columns::{Column, ColumnKind};

/// The name of the first field, the time of the row.
const TIME: &str = "t_ms";

/// Wire types of numbers in protobuf.
const VARINT: u64 = 0;
const FIXED_64: u64 = 1;

/// Returns the message schema: the time, then one field per column.
pub fn schema(columns: &[Column]) -> Schema {
    let mut message = DescriptorProto {
        name: Some("Mission".to_owned()),
        ..DescriptorProto::default()
    };
    let time = FieldDescriptorProto {
        name: Some(TIME.to_owned()),
        number: Some(1),
        label: Some(Label::Optional.into()),
        r#type: Some(Type::Uint64.into()),
        ..FieldDescriptorProto::default()
    };
    message.field.push(time);
    for (column, number) in columns.iter().zip(2..) {
        let is_optional = matches!(column.kind, ColumnKind::Time | ColumnKind::Real);
        let kind = match column.kind {
            ColumnKind::Real => Type::Double,
            _ => Type::Uint64,
        };
        let oneof = message.oneof_decl.len() as i32;
        message.field.push(FieldDescriptorProto {
            name: Some(column.name.to_owned()),
            number: Some(number),
            label: Some(Label::Optional.into()),
            r#type: Some(kind.into()),
            // proto3 needs this to distinguish a missing number from 0.
            proto3_optional: is_optional.then_some(true),
            oneof_index: is_optional.then_some(oneof),
            ..FieldDescriptorProto::default()
        });
        if is_optional {
            message.oneof_decl.push(OneofDescriptorProto {
                name: Some(format!("_{}", column.name)),
                ..OneofDescriptorProto::default()
            });
        }
    }
    let file = FileDescriptorProto {
        name: Some("mission.proto".to_owned()),
        package: Some("mission".to_owned()),
        syntax: Some("proto3".to_owned()),
        message_type: vec![message],
        ..FileDescriptorProto::default()
    };
    let files = FileDescriptorSet { file: vec![file] };
    Schema {
        name: "mission.Mission".to_owned(),
        encoding: "protobuf".to_owned(),
        data: prost_file_descriptor_set_to_vec(&files).into(),
    }
}

/// Encodes a row in this schema.
pub fn message(columns: &[Column], row: &MissionRow) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode_varint(1 << 3 | VARINT, &mut bytes);
    encode_varint(row.t_ms.0, &mut bytes);
    for (column, number) in columns.iter().zip(2..) {
        let Some(value) = row.get(column.name) else {
            continue;
        };
        match column.kind {
            ColumnKind::Real => {
                encode_varint(number << 3 | FIXED_64, &mut bytes);
                bytes.extend(value.to_le_bytes());
            }
            _ => {
                encode_varint(number << 3 | VARINT, &mut bytes);
                encode_varint(value as u64, &mut bytes);
            }
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use scenario::time::SimTime;

    use super::*;
    use crate::visit::VISIT;

    /// Checks the bytes field by field. Missing values are left out.
    #[test]
    fn a_row_has_the_columns_of_its_mission() {
        let columns = VISIT.vocabulary().columns;
        let row = |values: [Option<f64>; 4]| MissionRow {
            t_ms: SimTime(50),
            values: columns
                .iter()
                .map(|column| column.name.to_owned())
                .zip(values)
                .collect(),
        };
        let first = row([Some(5.0), Some(0.0), None, None]);
        assert_eq!(message(columns, &first), [8, 50, 16, 5, 24, 0]);
        let later = message(
            columns,
            &row([Some(4.0), Some(1.0), Some(300.0), Some(2.5)]),
        );
        let way = 2.5_f64.to_le_bytes();
        assert_eq!(
            later,
            [&[8, 50, 16, 4, 24, 1, 32, 172, 2, 41], &way[..]].concat()
        );
        let schema = schema(columns);
        let text = String::from_utf8_lossy(&schema.data).into_owned();
        for name in [
            "t_ms",
            "places_left",
            "places_visited",
            "_last_visit_ms",
            "_way_m",
        ] {
            assert!(text.contains(name), "{name}");
        }
    }
}
