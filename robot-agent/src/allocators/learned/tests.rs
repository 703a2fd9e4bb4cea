use serde_json::json;

use super::*;
use crate::testkit::check_allocator;

/// Returns a file with these tensors.
fn file(tensors: &[Tensor<'_>]) -> Vec<u8> {
    let (mut header, mut numbers) = (serde_json::Map::new(), Vec::new());
    for (name, shape, values) in tensors {
        let from = numbers.len();
        numbers.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        let offsets = [from, numbers.len()];
        let entry = json!({ "dtype": "F32", "shape": shape, "data_offsets": offsets });
        header.insert((*name).to_owned(), entry);
    }
    let header = serde_json::to_vec(&header).unwrap();
    let mut file = (header.len() as u64).to_le_bytes().to_vec();
    file.extend(header);
    file.extend(numbers);
    file
}

/// The name, the shape and the values of a tensor.
type Tensor<'a> = (&'a str, &'a [usize], &'a [f32]);

#[test]
fn the_laws_of_allocators_hold() {
    check_allocator::<Learned>(&Config::from_file(SHIPPED).unwrap());
    // This network prefers claimed tasks.
    let weights: Vec<f32> = (0..FEATURES).map(|place| place as f32 - 4.0).collect();
    let odd = file(&[
        ("0.weight", &[1, FEATURES], &weights),
        ("0.bias", &[1], &[0.5]),
    ]);
    check_allocator::<Learned>(&Config::from_file(&odd).unwrap());
}

#[test]
fn a_network_of_two_layers_has_the_score_of_its_formula() {
    let mut first = [0.0; 2 * FEATURES];
    (first[0], first[FEATURES + 1]) = (0.5, -2.0);
    let bytes = file(&[
        ("0.weight", &[2, FEATURES], &first),
        ("0.bias", &[2], &[0.25, 0.0]),
        ("2.weight", &[1, 2], &[3.0, 4.0]),
        ("2.bias", &[1], &[-1.0]),
    ]);
    let network = Network::new(safetensors::tensors(&bytes).unwrap()).unwrap();
    let mut features = [0.0; FEATURES];
    (features[0], features[1]) = (1.0, 0.125);
    // -1 + 3·tanh(0.25 + 0.5) + 4·tanh(-0.25)
    let expected = -1.0 + 3.0 * libm::tanh(0.75) + 4.0 * libm::tanh(-0.25);
    assert_eq!(network.score(&features), expected);
}

#[test]
fn damaged_files_and_wrong_shapes_are_refused() {
    let good = file(&[
        ("0.weight", &[1, FEATURES], &[0.0; FEATURES]),
        ("0.bias", &[1], &[0.0]),
    ]);
    assert!(Config::from_file(&good).is_ok());
    for length in 0..good.len() {
        assert!(Config::from_file(&good[..length]).is_err(), "{length}");
    }
    let refusals: [(&[Tensor<'_>], &str); 6] = [
        (&[], "the last layer has 9 units"),
        (
            &[("weight", &[1], &[0.0])],
            "the tensor 'weight' is unknown",
        ),
        (&[("0.bias", &[1], &[0.0])], "layer 0 lacks"),
        (&[("0.bias", &[1], &[f32::NAN])], "not finite"),
        (
            &[("0.weight", &[1, 2], &[0.0; 2]), ("0.bias", &[1], &[0.0])],
            "0.weight has the shape [1, 2]; it must be [1, 9]",
        ),
        (
            &[
                ("0.weight", &[2, FEATURES], &[0.0; 2 * FEATURES]),
                ("0.bias", &[2], &[0.0; 2]),
            ],
            "the last layer has 2 units",
        ),
    ];
    for (tensors, expected) in refusals {
        let why = Config::from_file(&file(tensors)).unwrap_err();
        assert!(why.contains(expected), "{why}");
    }
    let mut stated = json!({ "weights": "mine" });
    let why = Config::deserialize(&stated).unwrap_err().to_string();
    assert_eq!(why, "the file 'mine' was not read");
    stated["weights"] = json!("hex:00");
    let why = Config::deserialize(&stated).unwrap_err().to_string();
    assert_eq!(
        why,
        "weights: the file is not in the format safetensors, or it is cut"
    );
}
