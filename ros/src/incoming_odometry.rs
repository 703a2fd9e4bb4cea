//! Decoding of the poses in `nav_msgs/Odometry` messages of other nodes.

use std::str::from_utf8;

/// The size of the encapsulation header, bytes.
const HEADER_BYTES: usize = 4;

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
        let pose = CdrReader::new(message).and_then(|mut reader| {
            let seconds = i64::from(i32::from_ne_bytes(reader.number()?));
            let nanoseconds = i64::from(u32::from_ne_bytes(reader.number()?));
            let frame = reader.text()?.to_owned();
            reader.text()?;
            let mut coordinates = [0.0; 7];
            for coordinate in &mut coordinates {
                *coordinate = f64::from_ne_bytes(reader.number()?);
            }
            Some((seconds * 1_000_000_000 + nanoseconds, frame, coordinates))
        });
        let (stamp_ns, frame, coordinates) = pose.ok_or(OdometryError::Malformed)?;
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
            frame,
            stamp_ns,
            x_m,
            y_m,
            heading_rad,
        })
    }
}

/// The rest of a message in plain CDR of either byte order.
struct CdrReader<'m> {
    /// The message without its encapsulation header.
    body: &'m [u8],
    position: usize,
    is_little: bool,
}

impl<'m> CdrReader<'m> {
    fn new(message: &'m [u8]) -> Option<Self> {
        let (header, body) = message.split_at_checked(HEADER_BYTES)?;
        let is_little = match header[..2] {
            [0, 0] => false,
            [0, 1] => true,
            _ => return None,
        };
        Some(Self {
            body,
            position: 0,
            is_little,
        })
    }

    fn bytes(&mut self, count: usize) -> Option<&'m [u8]> {
        let end = self.position.checked_add(count)?;
        let bytes = self.body.get(self.position..end)?;
        self.position = end;
        Some(bytes)
    }

    /// Returns the next number of `N` bytes, in the byte order of this machine.
    fn number<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.position = self.position.checked_next_multiple_of(N)?;
        let mut number: [u8; N] = self.bytes(N)?.try_into().ok()?;
        if self.is_little != cfg!(target_endian = "little") {
            number.reverse();
        }
        Some(number)
    }

    /// Returns the next text without its closing zero byte.
    fn text(&mut self) -> Option<&'m str> {
        let length = u32::from_ne_bytes(self.number()?);
        let bytes = self.bytes(usize::try_from(length).ok()?)?;
        // Some writers encode an empty text without a zero byte.
        from_utf8(bytes.strip_suffix(&[0]).unwrap_or(bytes)).ok()
    }
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
