//! A feed-forward network with tanh between its layers.
//!
//! The arithmetic is exact on every machine: weights are `f32`, all other numbers `f64`. A unit starts with its bias and adds the
//! products in the order of its inputs; tanh is libm's.

use std::collections::BTreeMap;

use super::FEATURES;
use super::safetensors::Tensor;

/// The largest number of units in a layer.
const WIDEST: usize = 64;

/// The layers, from the features of a choice to its score.
#[derive(Clone, Debug, PartialEq)]
pub struct Network(Vec<Layer>);

#[derive(Clone, Debug, PartialEq)]
struct Layer {
    inputs: usize,
    /// The weights of each unit in turn.
    weights: Vec<f32>,
    /// The bias of each unit.
    biases: Vec<f32>,
}

impl Network {
    /// Creates a network from tensors `N.weight` and `N.bias`, as PyTorch names those of a `Sequential`. The layers are in
    /// the order of N.
    ///
    /// # Errors
    /// Describes the first tensor that is missing, unknown or of a wrong shape.
    pub fn new(tensors: BTreeMap<String, Tensor>) -> Result<Self, String> {
        let mut layers: BTreeMap<u32, [Option<Tensor>; 2]> = BTreeMap::new();
        for (name, tensor) in tensors {
            let parts = name.split_once('.');
            let number = parts.and_then(|(number, _)| number.parse().ok());
            let place = match parts.map(|(_, part)| part) {
                Some("weight") => Some(0),
                Some("bias") => Some(1),
                _ => None,
            };
            let (Some(number), Some(place)) = (number, place) else {
                return Err(format!(
                    "the tensor '{name}' is unknown; use 0.weight, 0.bias, 2.weight and so on"
                ));
            };
            layers.entry(number).or_default()[place] = Some(tensor);
        }
        let (mut inputs, mut all) = (FEATURES, Vec::with_capacity(layers.len()));
        for (number, tensors) in layers {
            let [Some(weight), Some(bias)] = tensors else {
                return Err(format!("layer {number} lacks its weight or its bias"));
            };
            let outputs = bias.values.len();
            if bias.shape != [outputs] || !(1..=WIDEST).contains(&outputs) {
                return Err(format!(
                    "{number}.bias has the shape {:?}; it must be 1 to {WIDEST} numbers",
                    bias.shape
                ));
            }
            if weight.shape != [outputs, inputs] {
                return Err(format!(
                    "{number}.weight has the shape {:?}; it must be [{outputs}, {inputs}]",
                    weight.shape
                ));
            }
            all.push(Layer {
                inputs,
                weights: weight.values,
                biases: bias.values,
            });
            inputs = outputs;
        }
        if all.is_empty() || inputs != 1 {
            return Err(format!("the last layer has {inputs} units; it must have 1"));
        }
        Ok(Self(all))
    }

    /// Returns the score of a choice.
    #[must_use]
    pub fn score(&self, features: &[f64; FEATURES]) -> f64 {
        let mut values = [0.0; WIDEST];
        values[..FEATURES].copy_from_slice(features);
        for (number, layer) in self.0.iter().enumerate() {
            let is_last = number + 1 == self.0.len();
            let mut next = [0.0; WIDEST];
            let units = layer.weights.chunks_exact(layer.inputs).zip(&layer.biases);
            for (unit, (weights, bias)) in next.iter_mut().zip(units) {
                let mut sum = f64::from(*bias);
                for (weight, value) in weights.iter().zip(&values) {
                    sum += f64::from(*weight) * value;
                }
                *unit = if is_last { sum } else { libm::tanh(sum) };
            }
            values = next;
        }
        values[0]
    }
}
