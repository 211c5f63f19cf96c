//! A space of paths that can be counted.
//!
//! Vertices are numbers, their measure counts. Edges have random symmetric geometry factors, vertices random factors that know no
//! symmetry, walks random probabilities, and nothing but the rules of [`PathSpace`] relates any of them. So a density is a probability,
//! `p⊥(a→b) G(a, b)` being that of going from `a` to `b`, but for specular vertices: the probability of one is that of the kind of
//! scattering, and its `δ` is one over the geometry of the edge towards the eye, which walks from the light multiply by; for walks from
//! the eye that makes the compression what it is here ([`Toy::delta`]).

mod space;

use luz_render::transport::{PathSpace, Range, SpecularKind};
use luz_sample::random::{hash, unit_f64};

/// The number of vertices.
pub const COUNT: usize = 13;

/// A point light: nothing can hit it.
pub const SPOT: usize = 0;
/// A light that does not scatter: walks pass through it unless they want to end.
pub const LAMP: usize = 1;
/// The emission of [`GLOWING`].
pub const GLOW: usize = 2;
/// Two environments.
pub const SKIES: [usize; 2] = [3, 4];
/// A surface that emits and scatters.
pub const GLOWING: usize = 5;
/// Two points of the lens.
pub const EYES: [usize; 2] = [11, 12];

/// What a vertex is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Light,
    /// Does it scatter into solid angles, and which specular kinds has it?
    Surface {
        spread: bool,
        reflects: bool,
        transmits: bool,
    },
    Eye,
}

const fn surface(spread: bool, reflects: bool, transmits: bool) -> Kind {
    Kind::Surface { spread, reflects, transmits }
}

const KINDS: [Kind; COUNT] = [
    Kind::Light,
    Kind::Light,
    Kind::Light,
    Kind::Light,
    Kind::Light,
    surface(true, false, false),
    surface(true, false, false),
    surface(true, true, true),
    surface(false, true, true),
    surface(false, true, false),
    surface(true, true, false),
    Kind::Eye,
    Kind::Eye,
];

/// What a vertex is.
pub fn kind(vertex: usize) -> Kind {
    KINDS[vertex]
}

/// Where it stands: the emission of a surface on that surface, both environments at infinity.
fn place(vertex: usize) -> usize {
    match vertex {
        GLOW => GLOWING,
        _ if vertex == SKIES[1] => SKIES[0],
        _ => vertex,
    }
}

/// A kind of specular scattering as an index.
const fn number(kind: SpecularKind) -> usize {
    match kind {
        SpecularKind::Reflection => 0,
        SpecularKind::Transmission => 1,
    }
}

const SPECULAR_KINDS: [SpecularKind; 2] = [SpecularKind::Reflection, SpecularKind::Transmission];

/// One number for each direction of arrival and each of departure, at each vertex. A direction is named by what lies there, the last
/// thing if there are several.
type ByDirections = Box<[[[f32; COUNT]; COUNT]; COUNT]>;

/// The probability of ending a walk in the first of two lights.
const FIRST_END: f32 = 0.3;

/// How many different kernels there are for perturbations.
const KERNELS: usize = 3;

/// See the [module](self).
#[derive(Clone)]
pub struct Toy {
    seed: u64,
    geometry: [[f32; COUNT]; COUNT],
    visible: [[bool; COUNT]; COUNT],
    /// `[from][to]`
    direction: [[usize; COUNT]; COUNT],
    /// `[eye's side][at][light's side]` of surfaces; `[0][at][out]` of ends.
    value: ByDirections,
    /// Probabilities of walks from the eye (and from eyes): `[from][at][out]`.
    eye_walk: ByDirections,
    /// Probabilities of walks from the light (and from lights): `[from][at][out]`.
    light_walk: ByDirections,
    /// Probabilities of specular scattering in walks from the eye and from the light, and coefficients: `[at][kind][from]`.
    eye_specular: [[[f32; COUNT]; 2]; COUNT],
    light_specular: [[[f32; COUNT]; 2]; COUNT],
    coefficient: [[[f32; COUNT]; 2]; COUNT],
    /// Where specular scattering leads, both ways: `[at][kind][direction]`.
    mate: [[[Option<usize>; COUNT]; 2]; COUNT],
    pub begin_light: [f32; COUNT],
    pub begin_eye: [f32; COUNT],
    /// `[x₁][x₀]`
    pub direct: [[f32; COUNT]; COUNT],
    /// `[kernel][old direction][at][new direction]`
    kernels: [ByDirections; KERNELS],
    /// Turns have ranges that depend on the path.
    pub ranges_vary: bool,
    /// What walks hit counts as a way to make `x₀`.
    pub knows_hits: bool,
    /// Perturbations choose the kind of specular scattering by themselves.
    pub compels: bool,
}

/// The probability that walks go on rather than being lost.
const KEPT: f64 = 0.9;

impl Toy {
    pub fn new(seed: u64) -> Self {
        let zeros = || Box::new([[[0.0; COUNT]; COUNT]; COUNT]);
        let mut toy = Self {
            seed,
            geometry: [[0.0; COUNT]; COUNT],
            visible: [[false; COUNT]; COUNT],
            direction: [[0; COUNT]; COUNT],
            value: zeros(),
            eye_walk: zeros(),
            light_walk: zeros(),
            eye_specular: [[[0.0; COUNT]; 2]; COUNT],
            light_specular: [[[0.0; COUNT]; 2]; COUNT],
            coefficient: [[[0.0; COUNT]; 2]; COUNT],
            mate: [[[None; COUNT]; 2]; COUNT],
            begin_light: [0.0; COUNT],
            begin_eye: [0.0; COUNT],
            direct: [[0.0; COUNT]; COUNT],
            kernels: [zeros(), zeros(), zeros()],
            ranges_vary: true,
            knows_hits: true,
            compels: true,
        };
        toy.arrange();
        for at in 0..COUNT {
            match kind(at) {
                Kind::Surface { .. } => toy.scatter(at),
                Kind::Light | Kind::Eye => toy.depart(at),
            }
        }
        toy.choose_ends();
        for kernel in 0..KERNELS {
            for at in 0..COUNT {
                for old in 0..COUNT {
                    let near = |new: usize| (new + COUNT - old) % COUNT <= 4 || (old + COUNT - new) % COUNT <= 4;
                    let mass = |new| {
                        let mass = if near(new) { 0.2 + toy.random(20 + kernel as u64, [old, at, new]) } else { 0.0 };
                        if toy.directions(at).any(|d| d == new) { mass } else { 0.0 }
                    };
                    let row = normalised(std::array::from_fn(mass), KEPT);
                    toy.kernels[kernel][old][at] = row;
                }
            }
        }
        toy
    }

    /// A number in `[0, 1)`.
    fn random(&self, table: u64, [a, b, c]: [usize; 3]) -> f64 {
        unit_f64(hash(self.seed, table, ((a * COUNT + b) * COUNT + c) as u64, 0))
    }

    /// A factor between ¼ and 2.
    fn factor(&self, table: u64, index: [usize; 3]) -> f32 {
        (0.25 * 8f64.powf(self.random(table, index))) as f32
    }

    /// Geometry, visibility, and what lies in which direction.
    fn arrange(&mut self) {
        for a in 0..COUNT {
            for b in 0..COUNT {
                let (p, q) = (place(a).min(place(b)), place(a).max(place(b)));
                let ends = |v: usize| !matches!(kind(v), Kind::Surface { .. });
                let may_see = p != q && !(ends(p) && ends(q) && (kind(a) == kind(b)));
                if may_see {
                    let lies_flat = p != LAMP && q != LAMP && self.random(1, [p, q, 0]) < 0.05;
                    self.geometry[a][b] = if lies_flat { 0.0 } else { self.factor(2, [p, q, 0]) };
                    self.visible[a][b] = !lies_flat && self.random(3, [p, q, 0]) < 0.95;
                }
            }
        }
        for a in 0..COUNT {
            for b in 0..COUNT {
                self.direction[a][b] = place(b);
            }
            // The lamp stands before some surface, or before none.
            let behind = GLOWING + (self.random(4, [a, 0, 0]) * 7.0) as usize;
            if behind < EYES[0] && self.visible[a][behind] && self.visible[a][LAMP] {
                self.direction[a][LAMP] = behind;
            }
        }
    }

    /// The directions from a vertex in which there is anything.
    fn directions(&self, at: usize) -> impl Iterator<Item = usize> + '_ {
        (0..COUNT).filter(move |&d| (0..COUNT).any(|v| self.visible[at][v] && self.direction[at][v] == d))
    }

    /// The smallest geometry factor in a direction: where that is zero, walks do not go.
    fn can_go(&self, at: usize, direction: usize) -> bool {
        (0..COUNT).all(|v| self.direction[at][v] != direction || self.geometry[at][v] > 0.0)
    }

    /// A value, or none where nothing goes, and the probability of going there, not normalised. Walks go everywhere where there is
    /// a value, and to other places too.
    fn value_and_weight(&self, tables: [u64; 2], index: [usize; 3], is_open: bool) -> (f32, f64) {
        let fate = self.random(tables[0] + 100, index);
        let value = if is_open && fate > 0.1 { self.factor(tables[0], index) } else { 0.0 };
        let weight = if is_open && fate > 0.05 { f64::from(self.factor(tables[1], index)) } else { 0.0 };
        (value, weight)
    }

    fn scatter(&mut self, at: usize) {
        let Kind::Surface { spread, reflects, transmits } = kind(at) else { return };
        let has = [reflects, transmits];
        for from in 0..COUNT {
            let probability = |table, kind: usize| match (has[kind], spread) {
                (false, _) => 0.0,
                (true, true) => 0.1 + 0.15 * self.random(table, [at, from, kind]),
                (true, false) => 0.3 + 0.15 * self.random(table, [at, from, kind]),
            };
            let eye = [probability(5, 0), probability(5, 1)];
            let light = [probability(6, 0), probability(6, 1)];
            let rows = std::array::from_fn::<_, COUNT, _>(|out| {
                self.value_and_weight([7, 8], [from, at, out], spread && self.can_go(at, out))
            });
            let light_row = std::array::from_fn::<_, COUNT, _>(|out| {
                // From the light towards `out` is from the eye's side at `out` towards where the light came from.
                let index = [out, at, from];
                let (value, _) = self.value_and_weight([7, 8], index, spread && self.can_go(at, from));
                let goes = value > 0.0 || self.random(9, index) < 0.7;
                if spread && goes && self.can_go(at, out) { f64::from(self.factor(10, index)) } else { 0.0 }
            });
            let specular = |[a, b]: [f64; 2]| KEPT - a - b;
            self.value[from][at] = rows.map(|(value, _)| value);
            self.eye_walk[from][at] = normalised(rows.map(|(_, weight)| weight), specular(eye));
            self.light_walk[from][at] = normalised(light_row, specular(light));
            for kind in 0..2 {
                self.eye_specular[at][kind][from] = eye[kind] as f32;
                self.light_specular[at][kind][from] = light[kind] as f32;
                self.coefficient[at][kind][from] = if has[kind] { self.factor(11, [at, kind, from]) } else { 0.0 };
            }
        }
        for kind in (0..2).filter(|&kind| has[kind]) {
            let mut open: Vec<usize> = self.directions(at).collect();
            open.sort_by(|&a, &b| self.random(12, [at, kind, a]).total_cmp(&self.random(12, [at, kind, b])));
            for pair in open.chunks(2) {
                // One may be left, which goes back to where it came from.
                let (a, b) = (pair[0], pair[pair.len() - 1]);
                (self.mate[at][kind][a], self.mate[at][kind][b]) = (Some(b), Some(a));
            }
        }
    }

    /// Of lights and eyes.
    fn depart(&mut self, at: usize) {
        let rows: [_; COUNT] = std::array::from_fn(|out| {
            self.value_and_weight([13, 14], [0, at, out], self.can_go(at, out) && place(at) != out)
        });
        self.value[0][at] = rows.map(|(value, _)| value);
        let walk = normalised(rows.map(|(_, weight)| weight), KEPT);
        match kind(at) {
            Kind::Eye => self.eye_walk[0][at] = walk,
            _ => self.light_walk[0][at] = walk,
        }
    }

    fn choose_ends(&mut self) {
        let is = |wanted: Kind| move |v: usize| if kind(v) == wanted { 1.0 } else { 0.0 };
        let weights = |is: &dyn Fn(usize) -> f64, table| {
            std::array::from_fn(|v| is(v) * f64::from(self.factor(table, [v, 0, 0])))
        };
        (self.begin_light, self.begin_eye) =
            (normalised(weights(&is(Kind::Light), 15), KEPT), normalised(weights(&is(Kind::Eye), 16), KEPT));
        for from in 0..COUNT {
            let shines = |light: usize| kind(light) == Kind::Light && self.emitted(light, from) > 0.0;
            let weight = |light| if shines(light) { f64::from(self.factor(17, [from, light, 0])) } else { 0.0 };
            self.direct[from] = normalised(std::array::from_fn(weight), KEPT);
        }
    }

    fn emitted(&self, light: usize, to: usize) -> f32 {
        self.value[0][light][self.direction[light][to]]
    }

    /// What a walk meets in a direction.
    fn trace(&self, at: usize, direction: usize, as_end: bool) -> Option<usize> {
        let is_there = |v: usize| self.visible[at][v] && self.direction[at][v] == direction;
        if as_end && let Some(light) = [LAMP, SKIES[0]].into_iter().find(|&light| is_there(light)) {
            return Some(light);
        }
        (matches!(kind(direction), Kind::Surface { .. }) && is_there(direction)).then_some(direction)
    }

    /// What a walk meets behind a light that it has come upon.
    pub fn beyond(&self, at: usize, light: usize) -> Option<usize> {
        match light {
            LAMP => self.trace(at, self.direction[at][LAMP], false),
            _ => (light == SKIES[0] && self.visible[at][light]).then_some(SKIES[1]),
        }
    }

    /// What can be the end behind a light that a walk has come upon: at the same place as the vertex that is found there.
    fn next_end(&self, at: usize, light: usize) -> Option<usize> {
        self.beyond(at, light).filter(|next| self.as_light(next).is_some())
    }

    /// The kernel that a range stands for.
    fn kernel(&self, range: Range) -> &ByDirections {
        &self.kernels[(range.smallest.round() as usize).clamp(1, KERNELS) - 1]
    }

    /// What is behind a vertex in the direction into which specular scattering leads.
    pub fn mate(&self, at: usize, kind: SpecularKind, previous: usize) -> Option<usize> {
        self.mate[at][number(kind)][self.direction[at][previous]]
    }

    /// The direction in which a vertex lies.
    pub fn direction(&self, at: usize, to: usize) -> usize {
        self.direction[at][to]
    }

    /// The `δ` of a specular vertex.
    pub fn delta(&self, at: usize, eye_side: usize) -> f64 {
        1.0 / f64::from(self.geometry[at][eye_side])
    }

    /// The same space, in which densities are those of shifts and turns as likely one way as the other.
    pub fn with_symmetric_kernels(&self) -> Self {
        let mut toy = self.clone();
        for (new, old) in toy.kernels.iter_mut().zip(&self.kernels) {
            for (from, at, to) in (0..COUNT.pow(3)).map(|i| (i / COUNT / COUNT, i / COUNT % COUNT, i % COUNT)) {
                new[from][at][to] = old[from.min(to)][at][from.max(to)];
            }
        }
        toy
    }

    /// A number for `u` by which a walk is drawn.
    fn draw(masses: impl Iterator<Item = f32>, u: f32) -> Option<usize> {
        let mut left = u;
        for (i, mass) in masses.enumerate() {
            if left < mass {
                return Some(i);
            }
            left -= mass;
        }
        None
    }

    /// A number that makes [`direct`](PathSpace::direct) draw a light.
    pub fn number_for_direct(&self, from: usize, light: usize) -> f32 {
        self.direct[from][..light].iter().sum::<f32>() + 0.5 * self.direct[from][light]
    }
}

fn normalised(weights: [f64; COUNT], total: f64) -> [f32; COUNT] {
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| if weight > 0.0 { (weight / sum * total) as f32 } else { 0.0 })
}
