//! Small convex polygons, to be cut along axes.

use glam::{DVec2, Vec2};

use crate::warp::uniform_triangle;

/// A quadrilateral that is cut along four lines has at most eight corners; the rest is for those that rounding doubles.
const MOST: usize = 12;

/// A convex polygon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polygon {
    corners: [DVec2; MOST],
    count: usize,
}

impl Polygon {
    pub fn new(corners: impl IntoIterator<Item = DVec2>) -> Self {
        let mut polygon = Self { corners: [DVec2::ZERO; MOST], count: 0 };
        corners.into_iter().for_each(|corner| polygon.push(corner));
        polygon
    }

    fn push(&mut self, corner: DVec2) {
        if self.count < MOST {
            self.corners[self.count] = corner;
            self.count += 1;
        }
    }

    pub fn corners(&self) -> &[DVec2] {
        &self.corners[..self.count]
    }

    /// Its area, whichever way its corners run.
    pub fn area(&self) -> f64 {
        let [first, rest @ ..] = self.corners() else { return 0.0 };
        0.5 * rest.windows(2).map(|w| (w[0] - first).perp_dot(w[1] - first)).sum::<f64>().abs()
    }

    /// The mean of its corners.
    pub fn middle(&self) -> DVec2 {
        self.corners().iter().sum::<DVec2>() / self.count.max(1) as f64
    }

    /// The corners of the box around it.
    pub fn bounds(&self) -> (DVec2, DVec2) {
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        self.corners().iter().fold(start, |(min, max), c| (min.min(*c), max.max(*c)))
    }

    /// The parts on both sides of the line where the coordinate `axis` is `at`: below, and above.
    pub fn cut(&self, axis: usize, at: f64) -> [Self; 2] {
        let mut parts = [Self::new([]), Self::new([])];
        for (k, &corner) in self.corners().iter().enumerate() {
            let next = self.corners[(k + 1) % self.count];
            let (a, b) = (corner[axis] - at, next[axis] - at);
            if a <= 0.0 {
                parts[0].push(corner);
            }
            if a >= 0.0 {
                parts[1].push(corner);
            }
            if a * b < 0.0 {
                let mut crossing = corner + (next - corner) * (a / (a - b));
                crossing[axis] = at;
                parts[0].push(crossing);
                parts[1].push(crossing);
            }
        }
        parts
    }

    /// A point, evenly by area.
    pub fn sample(&self, mut u: Vec2) -> DVec2 {
        let Some(&first) = self.corners().first() else { return DVec2::ZERO };
        let areas = || self.corners()[1..].windows(2).map(|w| (w[0] - first).perp_dot(w[1] - first).abs());
        let total: f64 = areas().sum();
        let mut left = f64::from(u.x) * total;
        for (area, w) in areas().zip(self.corners()[1..].windows(2)) {
            if left < area {
                u.x = (left / area) as f32;
                let [a, b, c] = uniform_triangle(u.clamp(Vec2::ZERO, Vec2::splat(crate::ONE_MINUS_EPSILON)));
                return first * f64::from(a) + w[0] * f64::from(b) + w[1] * f64::from(c);
            }
            left -= area;
        }
        self.middle()
    }
}
