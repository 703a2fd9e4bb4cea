//! Rows of tables as protobuf messages with one field per column.

use foxglove::Schema;
use foxglove::prost_types::field_descriptor_proto::{Label, Type};
use foxglove::prost_types::{
    DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet,
    OneofDescriptorProto,
};
use foxglove::protobuf::{encode_varint, prost_file_descriptor_set_to_vec};
use run_log::{CellKind, CellValue};

use crate::columns::Column;

/// Wire types of protobuf.
const VARINT: u64 = 0;
const FIXED_64: u64 = 1;
const BYTES: u64 = 2;
const FIXED_32: u64 = 5;

/// Returns the schema of the message `name`: one field per column, numbered from 1.
pub fn schema<R>(name: &str, columns: &[Column<R>]) -> Schema {
    let mut message = DescriptorProto {
        name: Some(name.to_owned()),
        ..DescriptorProto::default()
    };
    for (column, number) in columns.iter().zip(1..) {
        let kind = match column.kind {
            CellKind::Whole32 => Type::Uint32,
            CellKind::Whole64 => Type::Uint64,
            CellKind::Single => Type::Float,
            CellKind::Double => Type::Double,
            CellKind::Flag => Type::Bool,
            CellKind::Text | CellKind::Hash => Type::String,
        };
        let oneof = message.oneof_decl.len() as i32;
        message.field.push(FieldDescriptorProto {
            name: Some(column.name.clone()),
            number: Some(number),
            label: Some(Label::Optional.into()),
            r#type: Some(kind.into()),
            // proto3 needs this to distinguish a missing number from 0.
            proto3_optional: column.is_optional.then_some(true),
            oneof_index: column.is_optional.then_some(oneof),
            ..FieldDescriptorProto::default()
        });
        if column.is_optional {
            message.oneof_decl.push(OneofDescriptorProto {
                name: Some(format!("_{}", column.name)),
                ..OneofDescriptorProto::default()
            });
        }
    }
    let package = name.to_lowercase();
    let file = FileDescriptorProto {
        name: Some(format!("{name}.proto")),
        package: Some(package.clone()),
        syntax: Some("proto3".to_owned()),
        message_type: vec![message],
        ..FileDescriptorProto::default()
    };
    let files = FileDescriptorSet { file: vec![file] };
    Schema {
        name: format!("{package}.{name}"),
        encoding: "protobuf".to_owned(),
        data: prost_file_descriptor_set_to_vec(&files).into(),
    }
}

/// Encodes a row in this schema. Missing values are left out.
pub fn message<R>(columns: &[Column<R>], row: &R) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (column, number) in columns.iter().zip(1..) {
        let Some(value) = (column.value)(row) else {
            continue;
        };
        let mut tag = |wire: u64| encode_varint(number << 3 | wire, &mut bytes);
        match value {
            CellValue::Whole(number) => {
                tag(VARINT);
                encode_varint(number, &mut bytes);
            }
            CellValue::Flag(flag) => {
                tag(VARINT);
                encode_varint(flag.into(), &mut bytes);
            }
            CellValue::Single(number) => {
                tag(FIXED_32);
                bytes.extend(number.to_le_bytes());
            }
            CellValue::Double(number) => {
                tag(FIXED_64);
                bytes.extend(number.to_le_bytes());
            }
            CellValue::Text(text) => {
                tag(BYTES);
                encode_text(text, &mut bytes);
            }
            CellValue::Hash(hash) => {
                tag(BYTES);
                encode_text(&format!("{hash:016x}"), &mut bytes);
            }
        }
    }
    bytes
}

fn encode_text(text: &str, bytes: &mut Vec<u8>) {
    encode_varint(text.len() as u64, bytes);
    bytes.extend(text.as_bytes());
}

#[cfg(test)]
mod tests {
    use run_log::{MissionRow, PoseRow};
    use scenario::time::SimTime;

    use super::*;
    use crate::columns::{declared, of_mission};
    use crate::visit::VISIT;

    /// Checks the bytes field by field. Missing values are left out.
    #[test]
    fn a_row_has_the_columns_of_its_mission() {
        let names = VISIT.vocabulary().columns;
        let columns = of_mission(names);
        let row = |values: [Option<f64>; 4]| MissionRow {
            t_ms: SimTime(50),
            values: names
                .iter()
                .map(|column| column.name.to_owned())
                .zip(values)
                .collect(),
        };
        let first = row([Some(5.0), Some(0.0), None, None]);
        assert_eq!(message(&columns, &first), [8, 50, 16, 5, 24, 0]);
        let later = row([4.0, 1.0, 300.0, 2.5].map(Some));
        let way = 2.5_f64.to_le_bytes();
        let expected = [&[8, 50, 16, 4, 24, 1, 32, 172, 2, 41], &way[..]].concat();
        assert_eq!(message(&columns, &later), expected);
        let schema = schema("Mission", &columns);
        assert_eq!(schema.name, "mission.Mission");
        let text = String::from_utf8_lossy(&schema.data).into_owned();
        for name in "t_ms places_left places_visited _last_visit_ms _way_m".split(' ') {
            assert!(text.contains(name), "{name}");
        }
    }

    /// Checks the bytes of every type, with 0 and an empty text.
    #[test]
    fn a_pose_has_its_columns() {
        let row = PoseRow {
            t_ms: SimTime(50),
            robot: "r1".to_owned(),
            x_m: 2.5,
            y_m: 0.0,
            heading_rad: 0.0,
            speed_m_s: 0.0,
            carrying: true,
            behavior_set: String::new(),
            energy: None,
        };
        let mut expected = vec![8, 50, 18, 2, b'r', b'1', 29];
        expected.extend(2.5_f32.to_le_bytes());
        for tag in [37, 45, 53] {
            expected.extend([tag, 0, 0, 0, 0]);
        }
        expected.extend([56, 1, 66, 0]);
        assert_eq!(message(&declared::<PoseRow>(), &row), expected);
    }
}
