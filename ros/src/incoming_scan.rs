//! Decoding of `sensor_msgs/LaserScan` messages of other nodes.

use std::f32::consts::TAU;

use crate::field::Field;
use crate::messages::LaserScan;
use crate::read::CdrReader;

/// The size of the largest message, bytes. Planar scanners have up to a few thousand beams of 4 or 8 bytes.
const MAX_BYTES: usize = 100_000;

/// The part of a beam's angle by which a full circle may be exceeded: some drivers repeat the first beam at the end.
const OVERLAP: f32 = 1.5;

/// A message that contains no usable scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ScanError {
    #[error("the message is no sensor_msgs/LaserScan in plain CDR")]
    Malformed,
    #[error("the message is larger than {MAX_BYTES} bytes")]
    TooLarge,
    #[error("the angles of the scan are not finite, not apart, or more than a full circle")]
    Angles,
    #[error("the range of the scan is no interval above 0")]
    Range,
}

/// Decodes a scan, and checks its angles and its range. Single distances may have any value.
///
/// # Errors
/// Returns the reason why the message contains no scan.
pub fn decode_scan(message: &[u8]) -> Result<LaserScan, ScanError> {
    if message.len() > MAX_BYTES {
        return Err(ScanError::TooLarge);
    }
    let scan = CdrReader::new(message).and_then(|mut reader| LaserScan::read(&mut reader));
    let scan = scan.map_err(|_| ScanError::Malformed)?;
    let beams = scan.ranges.len();
    let step = scan.angle_increment;
    let is_apart = beams <= 1 || step != 0.0;
    let field = step.abs() * (beams as f32 - OVERLAP);
    // A comparison with NaN is false.
    if !(scan.angle_min.is_finite() && step.is_finite() && is_apart && field <= TAU) {
        return Err(ScanError::Angles);
    }
    let is_range = scan.range_min.is_finite() && 0.0 <= scan.range_min;
    if !(is_range && scan.range_min < scan.range_max) {
        return Err(ScanError::Range);
    }
    Ok(scan)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::encode;

    fn scan() -> LaserScan {
        LaserScan {
            angle_min: -3.0,
            angle_max: 3.0,
            angle_increment: 1.0,
            range_min: 0.1,
            range_max: 5.0,
            ranges: vec![1.0, f32::INFINITY, f32::NEG_INFINITY, 0.0, 9.0, -2.0, 3.0],
            ..LaserScan::default()
        }
    }

    #[test]
    fn a_scan_is_decoded() {
        assert_eq!(decode_scan(&encode(&scan())), Ok(scan()));
        // The last beam is the first one again.
        let mut full = scan();
        full.ranges = vec![1.0; 361];
        full.angle_increment = TAU / 360.0;
        assert_eq!(decode_scan(&encode(&full)), Ok(full));
        // A scanner may turn to the right, and some drivers state no limit.
        let mut other = scan();
        other.angle_increment = -0.5;
        other.range_max = f32::INFINITY;
        assert_eq!(decode_scan(&encode(&other)), Ok(other));
    }

    #[test]
    fn impossible_scans_are_refused() {
        let refused = |change: fn(&mut LaserScan)| {
            let mut scan = scan();
            change(&mut scan);
            decode_scan(&encode(&scan)).unwrap_err()
        };
        assert_eq!(refused(|scan| scan.angle_min = f32::NAN), ScanError::Angles);
        assert_eq!(
            refused(|scan| scan.angle_increment = f32::INFINITY),
            ScanError::Angles
        );
        assert_eq!(
            refused(|scan| scan.angle_increment = 0.0),
            ScanError::Angles
        );
        assert_eq!(
            refused(|scan| scan.angle_increment = 1.2),
            ScanError::Angles
        );
        assert_eq!(refused(|scan| scan.range_min = -0.1), ScanError::Range);
        assert_eq!(refused(|scan| scan.range_min = 5.0), ScanError::Range);
        assert_eq!(refused(|scan| scan.range_max = f32::NAN), ScanError::Range);
        assert_eq!(
            refused(|scan| {
                scan.angle_increment = 1e-4;
                scan.ranges = vec![1.0; MAX_BYTES / 4];
            }),
            ScanError::TooLarge
        );
    }

    proptest! {
        #[test]
        fn any_bytes_are_refused_or_decoded(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let _ = decode_scan(&bytes);
        }

        #[test]
        fn a_shortened_scan_is_malformed(length in 0_usize..72) {
            let message = encode(&scan());
            prop_assert_eq!(decode_scan(&message[..length]), Err(ScanError::Malformed));
        }
    }
}
