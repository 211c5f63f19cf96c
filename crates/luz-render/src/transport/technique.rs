//! The densities of all techniques that can make a path.

use luz_sample::mis::Heuristic;

/// What the techniques need to know of a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Densities {
    /// With which a walk from the light makes it.
    pub from_light: f32,
    /// With which a walk from the eye makes it.
    pub from_eye: f32,
    /// Can it be connected to a neighbour?
    pub is_connectable: bool,
}

/// All techniques `(s, t)`, `s + t = k + 1`, of a path: `s` vertices are made from the light, `t ≥ 1` from the eye.
#[derive(Clone, Copy, Debug)]
pub struct Techniques<'a> {
    /// The vertices from light to eye.
    pub vertices: &'a [Densities],
    /// Density of `x₀` with which next-event estimation makes it, when `s = 1`.
    pub direct: f32,
    /// Can a walk from the eye come upon `x₀`?
    pub can_hit_light: bool,
}

impl Techniques<'_> {
    /// Is there such a technique: an edge that can be connected, or a light that can be hit?
    pub fn is_possible(&self, s: usize) -> bool {
        let n = self.vertices.len();
        match s {
            0 => self.can_hit_light,
            // The light in front of the eye is seen without any noise. (Of points that cannot be hit, nothing is seen.)
            1 if n == 2 => false,
            _ if s < n => self.vertices[s - 1].is_connectable && self.vertices[s].is_connectable,
            // The eye cannot be hit: lenses are too small for it to pay.
            _ => false,
        }
    }

    /// The densities of all techniques in units of that of technique `s`, which must be possible: one count and density for each
    /// number of light vertices from 0 to k, in `out`.
    pub fn relative(&self, s: usize, out: &mut Vec<(f32, f32)>) {
        let n = self.vertices.len();
        out.clear();
        out.resize(n, (1.0, 0.0));
        if s >= n {
            return;
        }
        let mut set = |techniques: usize, density: f64| {
            if self.is_possible(techniques) {
                out[techniques].1 = density as f32;
            }
        };
        set(s, 1.0);
        // From technique i to technique i + 1 it is vertex i that changes hands. x₀ has a density of its own where it is the only
        // one of the light's; `density` is that of walks that all begin by emission.
        let gain = |i: usize| f64::from(self.vertices[i].from_light) / f64::from(self.vertices[i].from_eye);
        let (direct, hit) = (f64::from(self.direct), f64::from(self.vertices[0].from_eye));
        let emission = f64::from(self.vertices[0].from_light);
        let mut density = match s {
            0 => emission / hit,
            1 => emission / direct,
            _ => 1.0,
        };
        for i in s.max(1)..n - 1 {
            density *= gain(i);
            set(i + 1, density);
        }
        match s {
            0 => set(1, direct / hit),
            1 => set(0, hit / direct),
            _ => {
                density = 1.0;
                for i in (1..s).rev() {
                    density /= gain(i);
                    if i > 1 {
                        set(i, density);
                    }
                }
                set(1, density * direct / emission);
                set(0, density * hit / emission);
            }
        }
    }

    /// The weight of technique `s`; `scratch` is written over.
    pub fn weight(&self, heuristic: Heuristic, s: usize, scratch: &mut Vec<(f32, f32)>) -> f32 {
        self.relative(s, scratch);
        heuristic.weight(s, scratch)
    }
}
