//! Independent points.

use super::{PointSet, Points, Request, is_within};

/// Independent points; normal ones by the method of Box and Muller (1958).
#[derive(Clone, Copy, Debug, Default)]
pub struct Random;

impl PointSet for Random {
    fn uniform(&self, request: &Request) -> Points {
        let points = (0..request.count as u64)
            .map(|i| std::array::from_fn(|d| if d < request.dimensions { request.random(i, d as u32) } else { 0.0 }))
            .collect();
        Points { points, expected_count: request.count as f64 }
    }

    fn normal(&self, request: &Request, limits: [f64; 3]) -> Points {
        let points = (0..request.count as u64)
            .map(|i| {
                // Rejection; limits that almost nothing passes end in the middle.
                (0..1000)
                    .map(|attempt| {
                        let pair = |first: u32| {
                            let r = (-2.0 * (-request.random(i, first)).ln_1p()).sqrt();
                            let (sin, cos) = (std::f64::consts::TAU * request.random(i, first + 1)).sin_cos();
                            [r * cos, r * sin]
                        };
                        let [x, y] = pair(4 * attempt);
                        [x, y, if request.dimensions > 2 { pair(4 * attempt + 2)[0] } else { 0.0 }]
                    })
                    .find(|point| is_within(point, request.dimensions, limits))
                    .unwrap_or_default()
            })
            .collect();
        Points { points, expected_count: request.count as f64 }
    }
}
