//! The message types of ROS 2 that a team uses, as ROS 2 Humble to Kilted define them.
//!
//! Lengths are in m, angles in rad, speeds in m/s and rad/s, times in s. A Rust name that is taken differs from that of
//! ROS: [`StringMessage`] is `std_msgs/msg/String`, and [`TfMessage`] is `tf2_msgs/msg/TFMessage`.

use crate::cdr::CdrWriter;
use crate::description::{BaseType, Constant, FieldSpec, FieldType, MessageType, Shape};
use crate::field::{Byte, Element, Field};
use crate::message::Message;
use crate::read::{CdrReader, ReadError};

/// The covariance of six coordinates, row by row: x, y, z, and the rotations about x, y and z. A matrix of zeros means
/// that it is unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covariance(pub [f64; 36]);

impl Default for Covariance {
    fn default() -> Self {
        Self([0.0; 36])
    }
}

impl Covariance {
    /// Creates a covariance with the same variance for each coordinate.
    #[must_use]
    pub fn diagonal(variance: f64) -> Self {
        let mut entries = [0.0; 36];
        for entry in entries.iter_mut().step_by(7) {
            *entry = variance;
        }
        Self(entries)
    }
}

impl Field for Covariance {
    const TYPE: FieldType = <[f64; 36]>::TYPE;

    fn write(&self, to: &mut CdrWriter) {
        self.0.write(to);
    }

    fn read(from: &mut CdrReader<'_>) -> Result<Self, ReadError> {
        Field::read(from).map(Self)
    }
}

/// Declares message types with their full names, constants and fields. A field has the name of the definition, without
/// a closing underscore.
macro_rules! messages {
    ($(
        $(#[$about:meta])*
        $type:ident = $name:literal $([$($constant:ident: $constant_type:ty = $value:literal,)+])? {
            $(
                $(#[$field_about:meta])*
                $field:ident: $field_type:ty,
            )+
        }
    )+) => {$(
        $(#[$about])*
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct $type {
            $(
                $(#[$field_about])*
                pub $field: $field_type,
            )+
        }

        impl $type {
            $($(pub const $constant: u8 = $value;)+)?
        }

        impl Message for $type {
            const MESSAGE: &'static MessageType = &MessageType {
                name: $name,
                constants: &[$($(Constant {
                    name: stringify!($constant),
                    base: <$constant_type as Field>::TYPE.base,
                    value: $value,
                },)+)?],
                fields: &[$(FieldSpec {
                    name: without_underscore(stringify!($field)),
                    of: <$field_type as Field>::TYPE,
                },)+],
            };
        }

        impl Field for $type {
            const TYPE: FieldType = FieldType {
                base: BaseType::Message(<Self as Message>::MESSAGE),
                shape: Shape::Single,
            };

            fn write(&self, to: &mut CdrWriter) {
                $(self.$field.write(to);)+
            }

            fn read(from: &mut CdrReader<'_>) -> Result<Self, ReadError> {
                Ok(Self {
                    $($field: Field::read(from)?,)+
                })
            }
        }

        impl Element for $type {}
    )+};
}

/// Returns the name of a field whose name in ROS is a word of Rust, such as `type_`.
const fn without_underscore(name: &str) -> &str {
    match name.as_bytes() {
        [shorter @ .., b'_'] => name.split_at(shorter.len()).0,
        _ => name,
    }
}

messages! {
    /// A time or its distance to the beginning.
    Time = "builtin_interfaces/msg/Time" {
        sec: i32,
        /// The rest, ns, below 10^9.
        nanosec: u32,
    }

    /// A span of time.
    Duration = "builtin_interfaces/msg/Duration" {
        sec: i32,
        /// The rest, ns, below 10^9.
        nanosec: u32,
    }

    /// The time and the coordinate frame of a message.
    Header = "std_msgs/msg/Header" {
        stamp: Time,
        frame_id: String,
    }

    /// A text of any length.
    StringMessage = "std_msgs/msg/String" {
        data: String,
    }

    /// A color. Each part is from 0 to 1.
    ColorRgba = "std_msgs/msg/ColorRGBA" {
        r: f32,
        g: f32,
        b: f32,
        /// The opacity, from 0 to 1.
        a: f32,
    }

    /// The simulated time, for nodes with `use_sim_time`.
    Clock = "rosgraph_msgs/msg/Clock" {
        clock: Time,
    }

    /// A place in space, m.
    Point = "geometry_msgs/msg/Point" {
        x: f64,
        y: f64,
        z: f64,
    }

    /// A vector without a place.
    Vector3 = "geometry_msgs/msg/Vector3" {
        x: f64,
        y: f64,
        z: f64,
    }

    /// A rotation as a unit quaternion. The default is not a rotation; [`turned`] creates one.
    Quaternion = "geometry_msgs/msg/Quaternion" {
        x: f64,
        y: f64,
        z: f64,
        w: f64,
    }

    /// A place and an orientation.
    Pose = "geometry_msgs/msg/Pose" {
        position: Point,
        orientation: Quaternion,
    }

    /// A pose with its uncertainty.
    PoseWithCovariance = "geometry_msgs/msg/PoseWithCovariance" {
        pose: Pose,
        covariance: Covariance,
    }

    /// A linear and an angular velocity.
    Twist = "geometry_msgs/msg/Twist" {
        linear: Vector3,
        angular: Vector3,
    }

    /// A velocity at a time, in the frame of the header.
    TwistStamped = "geometry_msgs/msg/TwistStamped" {
        header: Header,
        twist: Twist,
    }

    /// A velocity with its uncertainty.
    TwistWithCovariance = "geometry_msgs/msg/TwistWithCovariance" {
        twist: Twist,
        covariance: Covariance,
    }

    /// The relation of a frame to its parent.
    Transform = "geometry_msgs/msg/Transform" {
        translation: Vector3,
        rotation: Quaternion,
    }

    /// The relation of the frame `child_frame_id` to the frame of the header, at a time.
    TransformStamped = "geometry_msgs/msg/TransformStamped" {
        header: Header,
        child_frame_id: String,
        transform: Transform,
    }

    /// Relations of frames to their parents.
    TfMessage = "tf2_msgs/msg/TFMessage" {
        transforms: Vec<TransformStamped>,
    }

    /// A pose in the frame of the header and a velocity in the frame `child_frame_id`.
    Odometry = "nav_msgs/msg/Odometry" {
        header: Header,
        child_frame_id: String,
        pose: PoseWithCovariance,
        twist: TwistWithCovariance,
    }

    /// The size and the place of a map.
    MapMetaData = "nav_msgs/msg/MapMetaData" {
        map_load_time: Time,
        /// The edge of a cell, m.
        resolution: f32,
        /// The number of cells in x.
        width: u32,
        /// The number of cells in y.
        height: u32,
        /// The lower left corner of the first cell.
        origin: Pose,
    }

    /// A map of occupied places.
    OccupancyGrid = "nav_msgs/msg/OccupancyGrid" {
        header: Header,
        info: MapMetaData,
        /// The cells row by row: 0 is free, 100 is occupied, and -1 is unknown.
        data: Vec<i8>,
    }

    /// Distances in directions at equal angles, counter-clockwise.
    LaserScan = "sensor_msgs/msg/LaserScan" {
        header: Header,
        /// The direction of the first distance, rad.
        angle_min: f32,
        /// The direction of the last distance, rad.
        angle_max: f32,
        /// The angle between two distances, rad.
        angle_increment: f32,
        /// The time between two distances, s.
        time_increment: f32,
        /// The time between two scans, s.
        scan_time: f32,
        /// The least distance of the sensor, m.
        range_min: f32,
        /// The largest distance of the sensor, m.
        range_max: f32,
        /// The distances, m. Infinity is beyond the range, and NaN is no measurement.
        ranges: Vec<f32>,
        intensities: Vec<f32>,
    }

    /// The place of a number in the points of a cloud.
    PointField = "sensor_msgs/msg/PointField" [
        INT8: u8 = 1,
        UINT8: u8 = 2,
        INT16: u8 = 3,
        UINT16: u8 = 4,
        INT32: u8 = 5,
        UINT32: u8 = 6,
        FLOAT32: u8 = 7,
        FLOAT64: u8 = 8,
    ] {
        name: String,
        /// The distance from the beginning of the point, bytes.
        offset: u32,
        datatype: u8,
        count: u32,
    }

    /// A list of points.
    PointCloud2 = "sensor_msgs/msg/PointCloud2" {
        header: Header,
        /// The number of rows; 1 for points without an order.
        height: u32,
        /// The number of points in a row.
        width: u32,
        fields: Vec<PointField>,
        is_bigendian: bool,
        /// The length of a point, bytes.
        point_step: u32,
        /// The length of a row, bytes.
        row_step: u32,
        data: Vec<u8>,
        /// True if each point is valid.
        is_dense: bool,
    }

    /// An image in a compressed format.
    CompressedImage = "sensor_msgs/msg/CompressedImage" {
        header: Header,
        format: String,
        data: Vec<u8>,
    }

    /// A place on a texture.
    UvCoordinate = "visualization_msgs/msg/UVCoordinate" {
        u: f32,
        v: f32,
    }

    /// The file of a mesh.
    MeshFile = "visualization_msgs/msg/MeshFile" {
        filename: String,
        data: Vec<u8>,
    }

    /// A visible object in a frame.
    Marker = "visualization_msgs/msg/Marker" [
        ARROW: i32 = 0,
        CUBE: i32 = 1,
        SPHERE: i32 = 2,
        CYLINDER: i32 = 3,
        LINE_STRIP: i32 = 4,
        LINE_LIST: i32 = 5,
        CUBE_LIST: i32 = 6,
        SPHERE_LIST: i32 = 7,
        POINTS: i32 = 8,
        TEXT_VIEW_FACING: i32 = 9,
        MESH_RESOURCE: i32 = 10,
        TRIANGLE_LIST: i32 = 11,
        ARROW_STRIP: i32 = 12,
        ADD: i32 = 0,
        MODIFY: i32 = 0,
        DELETE: i32 = 2,
        DELETEALL: i32 = 3,
    ] {
        header: Header,
        /// The namespace. A marker is identified by its namespace and number.
        ns: String,
        id: i32,
        type_: i32,
        action: i32,
        pose: Pose,
        scale: Vector3,
        color: ColorRgba,
        /// The time until the marker disappears; 0 is never.
        lifetime: Duration,
        /// True if the marker moves with its frame.
        frame_locked: bool,
        points: Vec<Point>,
        colors: Vec<ColorRgba>,
        texture_resource: String,
        texture: CompressedImage,
        uv_coordinates: Vec<UvCoordinate>,
        text: String,
        mesh_resource: String,
        mesh_file: MeshFile,
        mesh_use_embedded_materials: bool,
    }

    /// A list of visible objects.
    MarkerArray = "visualization_msgs/msg/MarkerArray" {
        markers: Vec<Marker>,
    }

    /// A value with its name.
    KeyValue = "diagnostic_msgs/msg/KeyValue" {
        key: String,
        value: String,
    }

    /// The state of a component.
    DiagnosticStatus = "diagnostic_msgs/msg/DiagnosticStatus" [
        OK: Byte = 0,
        WARN: Byte = 1,
        ERROR: Byte = 2,
        STALE: Byte = 3,
    ] {
        level: Byte,
        name: String,
        message: String,
        hardware_id: String,
        values: Vec<KeyValue>,
    }

    /// States of components at a time.
    DiagnosticArray = "diagnostic_msgs/msg/DiagnosticArray" {
        header: Header,
        status: Vec<DiagnosticStatus>,
    }

    /// A request without content. Its only field has no meaning.
    TriggerRequest = "std_srvs/srv/Trigger_Request" {
        structure_needs_at_least_one_member: u8,
    }

    /// The response to a request without content.
    TriggerResponse = "std_srvs/srv/Trigger_Response" {
        success: bool,
        /// The effect, or the reason of the failure.
        message: String,
    }
}

/// Creates a rotation about the vertical axis, rad.
#[must_use]
pub fn turned(angle_rad: f32) -> Quaternion {
    let (sin, cos) = libm::sincos(f64::from(angle_rad) / 2.0);
    Quaternion {
        z: sin,
        w: cos,
        ..Quaternion::default()
    }
}
