//! What is varied, and all combinations of it.

use luz_render::Overrides;
use serde::Serialize;

/// Something that is varied, with the values that it takes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Axis {
    /// `technique`
    pub name: String,
    /// `bsdf`, `light`, `both`
    pub values: Vec<String>,
}

/// A combination of values, one of each axis.
#[derive(Clone, Debug)]
pub struct Variant {
    /// What it is called: `both · power`.
    pub name: String,
    /// Its value on each axis.
    pub values: Vec<String>,
    /// How it is rendered.
    pub overrides: Overrides,
    /// Variants that differ in what the world is made of, and not only in how it is rendered, have different keys.
    pub world: String,
}

/// All combinations of values, as indices; the last axis changes fastest. Of no axis, there is one combination, of nothing.
pub fn product(axes: &[Axis]) -> Vec<Vec<usize>> {
    axes.iter().fold(vec![Vec::new()], |combinations, axis| {
        combinations
            .iter()
            .flat_map(|combination| {
                (0..axis.values.len()).map(move |value| combination.iter().copied().chain([value]).collect())
            })
            .collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(values: &[&str]) -> Axis {
        Axis { name: "axis".to_owned(), values: values.iter().map(|v| (*v).to_owned()).collect() }
    }

    #[test]
    fn every_value_meets_every_other_once_and_in_order() {
        let combinations = product(&[axis(&["a", "b", "c"]), axis(&["x", "y"])]);
        assert_eq!(combinations, [[0, 0], [0, 1], [1, 0], [1, 1], [2, 0], [2, 1]]);
        assert_eq!(product(&[axis(&["a"])]), [[0]]);
        assert_eq!(product(&[]), [Vec::<usize>::new()]);
        assert!(product(&[axis(&["a"]), axis(&[])]).is_empty());
        assert_eq!(product(&[axis(&["a", "b"]), axis(&["a", "b"]), axis(&["a", "b"])]).len(), 8);
    }
}
