//! Colours for numbers.

use std::sync::OnceLock;

use luz_color::RgbColorSpace;
use luz_color::lab::{difference, lab_to_xyz};

/// CIELAB colours that the scale runs through: black, violet, red, orange, pale yellow. Lightness rises throughout.
const STATIONS: [[f32; 3]; 7] = [
    [2.0, 1.0, -4.0],
    [16.0, 26.0, -34.0],
    [32.0, 48.0, -28.0],
    [48.0, 58.0, 14.0],
    [64.0, 44.0, 52.0],
    [80.0, 12.0, 58.0],
    [96.0, -7.0, 32.0],
];

/// Steps of the tabulated scale.
const STEPS: usize = 256;

/// A linear sRGB colour for a number in `[0, 1]`, from black through violet, red and orange to pale yellow.
///
/// Equal steps of the number are equal steps in CIELAB, and lightness rises, so it also reads in grey. Numbers outside are
/// clamped; NaN is bright green, which the scale doesn't have.
pub fn false_color(value: f32) -> [f32; 3] {
    if value.is_nan() {
        return [0.0, 1.0, 0.0];
    }
    static SCALE: OnceLock<Vec<[f32; 3]>> = OnceLock::new();
    let scale = SCALE.get_or_init(|| {
        let space = RgbColorSpace::srgb();
        let white = space.to_xyz([1.0; 3]);
        uniform_path().into_iter().map(|lab| space.from_xyz(lab_to_xyz(lab, white))).collect()
    });
    let position = value.clamp(0.0, 1.0) * (STEPS - 1) as f32;
    let index = (position as usize).min(STEPS - 2);
    let t = position - index as f32;
    std::array::from_fn(|c| (scale[index][c] * (1.0 - t) + scale[index + 1][c] * t).clamp(0.0, 1.0))
}

/// The way through the stations in [`STEPS`] colours of equal distance.
fn uniform_path() -> Vec<[f32; 3]> {
    let fine: Vec<[f32; 3]> = (0..=4096).map(|i| spline(i as f32 / 4096.0)).collect();
    let mut length = vec![0.0];
    for pair in fine.windows(2) {
        length.push(length[length.len() - 1] + difference(pair[0], pair[1]));
    }
    let total = length[length.len() - 1];
    (0..STEPS)
        .map(|i| {
            let wanted = total * i as f32 / (STEPS - 1) as f32;
            fine[length.partition_point(|&l| l < wanted).min(fine.len() - 1)]
        })
        .collect()
}

/// The Catmull–Rom spline through the stations at `t` in `[0, 1]`.
fn spline(t: f32) -> [f32; 3] {
    let last = STATIONS.len() - 1;
    let position = t * last as f32;
    let i = (position as usize).min(last - 1);
    let t = position - i as f32;
    let [p0, p1, p2, p3] = [i.saturating_sub(1), i, i + 1, (i + 2).min(last)].map(|k| STATIONS[k]);
    std::array::from_fn(|c| {
        let (a, b) = (0.5 * (p2[c] - p0[c]), 0.5 * (p3[c] - p1[c]));
        let d = p2[c] - p1[c];
        p1[c] + t * (a + t * (3.0 * d - 2.0 * a - b + t * (a + b - 2.0 * d)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use luz_color::lab::xyz_to_lab;

    #[test]
    fn the_scale_is_uniform_rises_in_lightness_and_is_displayable() {
        let space = RgbColorSpace::srgb();
        let white = space.to_xyz([1.0; 3]);
        let path = uniform_path();
        for (i, &lab) in path.iter().enumerate() {
            let rgb = space.from_xyz(lab_to_xyz(lab, white));
            assert!(rgb.iter().all(|c| (-1e-3..=1.001).contains(c)), "step {i}, {lab:?}: {rgb:?}");
        }
        let labs: Vec<_> = (0..=64).map(|i| xyz_to_lab(space.to_xyz(false_color(i as f32 / 64.0)), white)).collect();
        let steps: Vec<f32> = labs.windows(2).map(|p| difference(p[0], p[1])).collect();
        let mean = steps.iter().sum::<f32>() / steps.len() as f32;
        assert!(steps.iter().all(|s| (s / mean - 1.0).abs() < 0.1), "{steps:?}");
        assert!(labs.windows(2).all(|p| p[1][0] > p[0][0]));
    }

    #[test]
    fn odd_numbers_have_colours() {
        assert_eq!(false_color(f32::NAN), [0.0, 1.0, 0.0]);
        assert_eq!(false_color(f32::INFINITY), false_color(1.0));
        assert_eq!(false_color(-1.0), false_color(0.0));
    }
}
