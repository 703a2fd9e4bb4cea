//! The file format safetensors: the length of a header in 8 bytes, the header in JSON, and the numbers. All numbers are
//! little-endian.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value;

/// A tensor of finite numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    pub shape: Vec<usize>,
    pub values: Vec<f32>,
}

#[derive(Deserialize)]
struct Entry {
    dtype: String,
    shape: Vec<usize>,
    /// The first byte of the numbers and the byte after the last one.
    data_offsets: [usize; 2],
}

/// Reads the tensors of a file by name.
///
/// # Errors
/// Describes the first part of the file that is damaged, or a tensor whose type is not F32.
pub fn tensors(file: &[u8]) -> Result<BTreeMap<String, Tensor>, String> {
    let damaged = || "the file is not in the format safetensors, or it is cut".to_owned();
    let (length, rest) = file.split_first_chunk::<8>().ok_or_else(damaged)?;
    let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| damaged())?;
    let (header, numbers) = rest.split_at_checked(length).ok_or_else(damaged)?;
    let header: BTreeMap<String, Value> = serde_json::from_slice(header).map_err(|_| damaged())?;
    let mut tensors = BTreeMap::new();
    // The program that wrote the file may describe it here.
    for (name, entry) in header
        .into_iter()
        .filter(|(name, _)| name != "__metadata__")
    {
        let entry = Entry::deserialize(entry).map_err(|_| damaged())?;
        if entry.dtype != "F32" {
            return Err(format!(
                "the tensor '{name}' has the type {}; use F32",
                entry.dtype
            ));
        }
        let [from, to] = entry.data_offsets;
        let bytes = numbers.get(from..to).ok_or_else(damaged)?;
        let (chunks, []) = bytes.as_chunks::<4>() else {
            return Err(damaged());
        };
        let values: Vec<f32> = chunks
            .iter()
            .map(|chunk| f32::from_le_bytes(*chunk))
            .collect();
        let count = entry
            .shape
            .iter()
            .try_fold(1_usize, |all, side| all.checked_mul(*side));
        if count != Some(values.len()) {
            return Err(damaged());
        }
        if values.iter().any(|value| !value.is_finite()) {
            return Err(format!(
                "the tensor '{name}' has a number that is not finite"
            ));
        }
        let shape = entry.shape;
        tensors.insert(name, Tensor { shape, values });
    }
    Ok(tensors)
}
