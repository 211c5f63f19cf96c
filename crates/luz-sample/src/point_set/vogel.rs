//! A spiral like a sunflower's.

use std::f64::consts::{SQRT_2, TAU};

use super::{PointSet, Points, Request, TruncatedNormal, is_within, mass_within};

/// A golden-angle spiral (Vogel 1979, "A Better Way to Construct the Sunflower Head"), with radii at even quantiles of the
/// distribution. A third coordinate, if wanted, follows a Kronecker sequence.
///
/// Members are turned against each other, and their radii interleave.
#[derive(Clone, Copy, Debug, Default)]
pub struct Vogel;

/// The golden section of a turn.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// The reciprocal of the plastic number, for the third coordinate (Roberts 2018, "The Unreasonable Effectiveness of
/// Quasirandom Sequences").
const PLASTIC: f64 = 0.754_877_666_246_692_8;

impl PointSet for Vogel {
    fn uniform(&self, request: &Request) -> Points {
        // On the disk around the square; what is outside the square is dropped.
        let area = TAU / 4.0;
        let radius = |u: f64| u.sqrt() * SQRT_2 / 2.0;
        let points = spiral(request, request.count as f64 * area, radius)
            .into_iter()
            .map(|[x, y, z]| [x + 0.5, y + 0.5, z])
            .filter(|[x, y, _]| (0.0..1.0).contains(x) && (0.0..1.0).contains(y))
            .collect();
        Points { points, expected_count: request.count as f64 }
    }

    fn normal(&self, request: &Request, limits: [f64; 3]) -> Points {
        // Over the whole plane; what is beyond the limits is dropped.
        let wanted = request.count as f64 / mass_within(2, limits);
        let mut points = spiral(request, wanted, |u| (-2.0 * (-u).ln_1p()).sqrt());
        if request.dimensions > 2 {
            let third = TruncatedNormal::new(limits[2]);
            points.iter_mut().for_each(|p| p[2] = third.quantile(p[2]));
        }
        points.retain(|p| is_within(p, 2, limits));
        Points { points, expected_count: request.count as f64 }
    }
}

/// Points around the origin whose quantiles have the given radii: `wanted` of them, which need not be a whole number.
/// The third coordinate is uniform.
fn spiral(request: &Request, wanted: f64, radius: impl Fn(f64) -> f64) -> Vec<[f64; 3]> {
    let fraction = |x: f64| x - x.floor();
    let member = f64::from(request.member);
    let start = fraction(request.common_random(0) + member / f64::from(request.members.max(1)));
    let turn = request.common_random(1) + member * GOLDEN;
    let height = request.common_random(2) + member * PLASTIC;
    (0..)
        .map(|i| (f64::from(i), (f64::from(i) + start) / wanted))
        .take_while(|&(_, u)| u < 1.0)
        .map(|(i, u)| {
            let (sin, cos) = (TAU * fraction(turn + i * GOLDEN)).sin_cos();
            let z = if request.dimensions > 2 { fraction(height + i * PLASTIC) } else { 0.0 };
            [radius(u) * cos, radius(u) * sin, z]
        })
        .collect()
}
