//! The exact filter is its definition.

mod common;

use common::{picture, plain, psnr};
use luz_filter::{BilateralFilter, Border, SimdLevel};

const LEVELS: [SimdLevel; 3] = [SimdLevel::Scalar, SimdLevel::Avx2, SimdLevel::Avx512];

#[test]
fn agrees_with_a_plain_loop_to_120_db() {
    let channels: [&[&str]; 5] =
        [&["Y"], &["Y", "Z"], &["R", "G", "B"], &["a", "b", "c", "d"], &["a", "b", "c", "d", "e", "f"]];
    for names in channels {
        let image = picture(67, 41, names);
        for border in [Border::Mirror, Border::Clamp, Border::Renormalize] {
            for (sigma_s, sigma_r) in [(0.3, 0.1), (2.0, 0.05), (4.0, 0.3)] {
                let mut filter = BilateralFilter::new(sigma_s, sigma_r);
                filter.border = border;
                let reference = plain(&filter, &image);
                for simd in LEVELS {
                    filter.simd = simd;
                    let filtered = filter.apply(&image, &[]).unwrap();
                    let quality = psnr(&filtered.image, &reference);
                    assert!(quality >= 120.0, "{names:?} {border:?} {sigma_s} {sigma_r} {simd:?}: {quality}");
                }
            }
        }
    }
}
