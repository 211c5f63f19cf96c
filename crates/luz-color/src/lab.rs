//! CIELAB, in which equal distances look about equally different.

/// CIELAB `[L*, a*, b*]` of an XYZ triple seen against the white `white` (XYZ, same scale).
///
/// L* is 0 for black and 100 for white. Source: CIE 015:2018, section 8.2.1.
pub fn xyz_to_lab(xyz: [f32; 3], white: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = std::array::from_fn(|i| compress(xyz[i] / white[i]));
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The XYZ triple of CIELAB coordinates; the inverse of [`xyz_to_lab`].
pub fn lab_to_xyz(lab: [f32; 3], white: [f32; 3]) -> [f32; 3] {
    let y = (lab[0] + 16.0) / 116.0;
    let f = [y + lab[1] / 500.0, y, y - lab[2] / 200.0];
    std::array::from_fn(|i| expand(f[i]) * white[i])
}

/// The colour difference ΔE*₇₆: the distance of two CIELAB colours.
pub fn difference(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f32>().sqrt()
}

const DELTA: f32 = 6.0 / 29.0;

fn compress(t: f32) -> f32 {
    if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
}

fn expand(f: f32) -> f32 {
    if f > DELTA { f * f * f } else { 3.0 * DELTA * DELTA * (f - 4.0 / 29.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const D65: [f32; 3] = [0.95047, 1.0, 1.08883];

    #[test]
    fn known_colours() {
        assert_eq!(xyz_to_lab([0.0; 3], D65)[0].abs().max(0.0), 0.0);
        let white = xyz_to_lab(D65, D65);
        assert!(difference(white, [100.0, 0.0, 0.0]) < 1e-4);
        // sRGB red.
        let red = xyz_to_lab([0.4124564, 0.2126729, 0.0193339], D65);
        assert!(difference(red, [53.24, 80.09, 67.20]) < 0.02, "{red:?}");
    }

    #[test]
    fn roundtrip() {
        for i in 0..1000 {
            let xyz = [(i % 10) as f32 / 9.0, (i / 10 % 10) as f32 / 9.0, (i / 100) as f32 / 9.0];
            let back = lab_to_xyz(xyz_to_lab(xyz, D65), D65);
            assert!((0..3).all(|c| (back[c] - xyz[c]).abs() < 1e-5), "{xyz:?} {back:?}");
        }
    }
}
