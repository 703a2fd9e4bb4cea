//! Decoding of the poses in `nav_msgs/Odometry` messages of other nodes.

use crate::field::Field;
use crate::messages::{Header, Pose};
use crate::read::{CdrReader, ReadError};

/// The largest deviation of a quaternion's squared length from 1.
const QUATERNION_TOLERANCE: f64 = 0.1;

/// A message that contains no usable pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OdometryError {
    #[error("the message is no nav_msgs/Odometry in plain CDR")]
    Malformed,
    #[error("the pose is not finite")]
    NotFinite,
    #[error("the orientation is no unit quaternion")]
    NoRotation,
}

/// The pose of an odometry message in the plane.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanarPose {
    /// The frame of the pose.
    pub frame: String,
    /// The time of the pose, ns.
    pub stamp_ns: i64,
    pub x_m: f64,
    pub y_m: f64,
    /// The rotation about the vertical axis, rad in [-π, π].
    pub heading_rad: f64,
}

impl PlanarPose {
    /// Decodes the pose of a message. The velocity and the covariances are not read.
    ///
    /// # Errors
    /// Returns the reason why the message contains no pose.
    pub fn decode(message: &[u8]) -> Result<Self, OdometryError> {
        let (header, pose) = head(message).map_err(|_| OdometryError::Malformed)?;
        let (position, turn) = (pose.position, pose.orientation);
        let coordinates = [
            position.x, position.y, position.z, turn.x, turn.y, turn.z, turn.w,
        ];
        if !coordinates.iter().all(|value| value.is_finite()) {
            return Err(OdometryError::NotFinite);
        }
        let [x_m, y_m, _, x, y, z, w] = coordinates;
        let squared = x * x + y * y + z * z + w * w;
        if (squared - 1.0).abs() > QUATERNION_TOLERANCE {
            return Err(OdometryError::NoRotation);
        }
        let heading_rad = libm::atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z);
        Ok(Self {
            frame: header.frame_id,
            stamp_ns: i64::from(header.stamp.sec) * 1_000_000_000 + i64::from(header.stamp.nanosec),
            x_m,
            y_m,
            heading_rad,
        })
    }
}

/// Decodes the begin of an odometry message, up to its pose.
fn head(message: &[u8]) -> Result<(Header, Pose), ReadError> {
    let mut reader = CdrReader::new(message)?;
    let header = Header::read(&mut reader)?;
    // The child frame.
    String::read(&mut reader)?;
    Ok((header, Pose::read(&mut reader)?))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::encode;
    use crate::messages::{Header, Odometry, Time, turned};

    fn odometry(frame: &str, child: &str, x: f64, y: f64, heading_rad: f32) -> Odometry {
        let mut odometry = Odometry {
            header: Header {
                stamp: Time {
                    sec: 12,
                    nanosec: 345,
                },
                frame_id: frame.to_owned(),
            },
            child_frame_id: child.to_owned(),
            ..Odometry::default()
        };
        odometry.pose.pose.position.x = x;
        odometry.pose.pose.position.y = y;
        odometry.pose.pose.orientation = turned(heading_rad);
        odometry
    }

    proptest! {
        #[test]
        fn an_encoded_pose_is_decoded(
            frame in "[a-z/_]{0,12}",
            child in "[a-z/_]{0,12}",
            x in -1e3..1e3,
            y in -1e3..1e3,
            heading_rad in -3.1_f32..3.1,
        ) {
            let message = encode(&odometry(&frame, &child, x, y, heading_rad));
            let pose = PlanarPose::decode(&message).unwrap();
            prop_assert_eq!((pose.frame, pose.stamp_ns), (frame, 12_000_000_345));
            prop_assert_eq!((pose.x_m, pose.y_m), (x, y));
            prop_assert!((pose.heading_rad - f64::from(heading_rad)).abs() < 1e-9);
        }

        #[test]
        fn any_bytes_are_refused_or_decoded(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let _ = PlanarPose::decode(&bytes);
        }

        #[test]
        fn a_shortened_message_is_malformed(length in 0_usize..84) {
            // The header, the stamp, two texts of 4 bytes with padding, and 7 numbers are 4 + 8 + 8 + 8 + 56 bytes.
            let message = encode(&odometry("map", "abc", 1.0, 2.0, 0.5));
            prop_assert_eq!(PlanarPose::decode(&message[..length]), Err(OdometryError::Malformed));
            prop_assert!(PlanarPose::decode(&message[..84]).is_ok());
        }
    }

    #[test]
    fn a_big_endian_message_has_the_same_pose() {
        let mut bytes = vec![0, 0, 0, 0];
        bytes.extend(12_i32.to_be_bytes());
        bytes.extend(345_u32.to_be_bytes());
        for text in [b"map\0", b"abc\0"] {
            bytes.extend(4_u32.to_be_bytes());
            bytes.extend(text);
        }
        for value in [1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0_f64] {
            bytes.extend(value.to_be_bytes());
        }
        let little = PlanarPose::decode(&encode(&odometry("map", "abc", 1.0, 2.0, 0.0)));
        assert_eq!(PlanarPose::decode(&bytes), little);
    }

    #[test]
    fn impossible_poses_are_refused() {
        let decode = |odometry: &Odometry| PlanarPose::decode(&encode(odometry)).unwrap_err();
        let mut wrong = odometry("map", "abc", f64::NAN, 2.0, 0.0);
        assert_eq!(decode(&wrong), OdometryError::NotFinite);
        wrong.pose.pose.position.x = 1.0;
        wrong.pose.pose.orientation.w = f64::INFINITY;
        assert_eq!(decode(&wrong), OdometryError::NotFinite);
        wrong.pose.pose.orientation.w = 0.0;
        assert_eq!(decode(&wrong), OdometryError::NoRotation);
    }
}
