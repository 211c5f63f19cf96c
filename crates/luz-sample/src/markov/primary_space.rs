//! Primary sample space: chains over the uniform numbers that an estimator draws.
//!
//! Kelemen, Szirmay-Kalos, Antal and Csonka 2002, "A Simple and Robust Mutation Strategy for the Metropolis Light Transport
//! Algorithm".

use glam::Vec2;
use serde::{Deserialize, Serialize, Serializer};

use crate::Samples;
use crate::random::{Random, unit_f32};

/// Dimensions beyond are the same as those before, modulo this, lest a stray one exhaust the memory.
const DIMENSIONS: u32 = 1 << 20;

/// The uniform numbers that an estimator has drawn: a point of the unit cube of which only the coordinates that were asked for
/// are known.
///
/// What the estimator made of them depends on these coordinates alone. All others are, given these, uniformly distributed and
/// independent of everything, so they need not be kept, and are drawn afresh when a later mutation asks for them. That is a
/// step of a Gibbs sampler, and leaves the chain's distribution as it is.
///
/// Coordinates are in *streams*, which an estimator may use for parts that should keep their numbers whatever other parts
/// draw, as for subpaths from either end.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct PrimarySample {
    /// By stream and dimension, as 32-bit fractions. There may be empty ones at the end, whose memory is to be used again.
    #[serde(serialize_with = "serialize_used")]
    streams: Vec<Vec<Option<u32>>>,
}

/// The streams without the empty ones at the end.
fn used(streams: &[Vec<Option<u32>>]) -> &[Vec<Option<u32>>] {
    let count = streams.iter().rposition(|stream| !stream.is_empty()).map_or(0, |last| last + 1);
    &streams[..count]
}

/// The same point has the same bytes, whatever the memory was used for before.
fn serialize_used<S: Serializer>(streams: &[Vec<Option<u32>>], serializer: S) -> Result<S::Ok, S::Error> {
    used(streams).serialize(serializer)
}

impl PartialEq for PrimarySample {
    fn eq(&self, other: &Self) -> bool {
        used(&self.streams) == used(&other.streams)
    }
}

impl Eq for PrimarySample {}

impl PrimarySample {
    /// A point of which no coordinate is known.
    pub const fn new() -> Self {
        Self { streams: Vec::new() }
    }

    /// The coordinate at a dimension of a stream, in `[0, 1)`; `None` if it was not asked for.
    pub fn coordinate(&self, stream: usize, dimension: u32) -> Option<f32> {
        self.bits(stream, dimension).map(unit_f32)
    }

    /// How many coordinates are known.
    pub fn known(&self) -> usize {
        self.streams.iter().flatten().flatten().count()
    }

    #[inline]
    fn bits(&self, stream: usize, dimension: u32) -> Option<u32> {
        *self.streams.get(stream)?.get((dimension % DIMENSIONS) as usize)?
    }

    /// Forgets all coordinates, not the memory that they took.
    fn clear(&mut self) {
        self.streams.iter_mut().for_each(Vec::clear);
    }
}

/// How far a small step moves a coordinate: by at least `smallest`, at most `largest`, up or down, around the ends of the
/// unit interval, all orders of magnitude in between being equally likely.
///
/// A step of length `δ = largest · exp(−ln(largest / smallest) u)`, for a uniform `u` (Kelemen et al. 2002, section 4.1). It is
/// symmetric.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kernel {
    smallest: f32,
    largest: f32,
    /// `largest` as a 32-bit fraction.
    largest_bits: u32,
    /// `log₂(largest / smallest)`, of which 26 bits are below one.
    octaves: u32,
}

impl Default for Kernel {
    /// Steps from 1/1024 to 1/64, as in the paper.
    fn default() -> Self {
        Self { smallest: 1.0 / 1024.0, largest: 1.0 / 64.0, largest_bits: 1 << 26, octaves: 4 << 26 }
    }
}

/// `2^(-i / 256)` for `i` from 0 to 256, as a 31-bit fraction.
static OCTAVE: [u32; 257] = {
    const ROOT: f64 = 0.997_296_056_085_470_126_2;
    let (mut powers, mut power, mut i) = ([0; 257], 2_147_483_648.0, 0);
    while i < powers.len() {
        powers[i] = (power + 0.5) as u32;
        power *= ROOT;
        i += 1;
    }
    powers
};

impl Kernel {
    /// Steps between two lengths. `None` unless `2⁻²⁰ ≤ smallest < largest ≤ 1/2`.
    pub fn new(smallest: f32, largest: f32) -> Option<Self> {
        let fine = (1.0 / (1u32 << 20) as f32..largest).contains(&smallest) && largest <= 0.5;
        fine.then(|| {
            let octaves = (f64::from(largest) / f64::from(smallest)).log2();
            Self {
                smallest,
                largest,
                largest_bits: (f64::from(largest) * f64::from(2u32).powi(32)) as u32,
                octaves: (octaves * f64::from(1u32 << 26)) as u32,
            }
        })
    }

    /// Moves a coordinate, a 32-bit fraction.
    #[inline]
    fn step(&self, coordinate: u32, random: u64) -> u32 {
        // All in integers: faster, and the same on every machine. Octaves below the largest are a number of which 58 bits are
        // below one; the power of their fraction is interpolated, with a relative error below 1e-6.
        let below = u64::from(self.octaves) * (random & 0xffff_ffff);
        let (whole, fraction) = (below >> 58, (below >> 26) as u32);
        let place = (fraction >> 24) as usize;
        let [high, low] = [OCTAVE[place], OCTAVE[place + 1]].map(u64::from);
        let power = high - (((high - low) * u64::from(fraction & 0xff_ffff)) >> 24);
        let distance = ((u64::from(self.largest_bits) * power) >> (31 + whole)) as u32;
        // Wrapping addition goes around the ends exactly, and there and back are equally likely to the last bit. The distance
        // is negated without a branch, which would be mispredicted half of the time.
        let sign = (random >> 63) as u32;
        coordinate.wrapping_add((distance ^ sign.wrapping_neg()).wrapping_add(sign))
    }

    /// The density of a small step from one coordinate to another, in length: `1 / (2 ln(largest / smallest) δ)` where their
    /// distance `δ`, around the ends if that is shorter, is in range, else 0.
    pub fn pdf(&self, from: f32, to: f32) -> f32 {
        let direct = (to - from).abs();
        let distance = direct.min(1.0 - direct);
        if (self.smallest..=self.largest).contains(&distance) {
            0.5 / ((self.largest / self.smallest).ln() * distance)
        } else {
            0.0
        }
    }
}

/// The coordinates of a mutated [`PrimarySample`], made when they are asked for ("lazy evaluation"): what an estimator draws
/// its numbers from, and the proposal of a chain at the same time.
///
/// A *large step* draws all coordinates afresh. It makes the chain ergodic, whatever the estimator does, and its proposals
/// are independent samples, whose mean density is the integral of the density. A *small step* moves each by a [`Kernel`].
/// Both are symmetric. What is asked for twice is the same.
///
/// ```
/// use luz_sample::Samples;
/// use luz_sample::markov::{Chain, Kernel, PrimarySample, PrimarySamples, Proposal};
///
/// let estimate = |samples: &mut PrimarySamples<'_>| f64::from(samples.next_2d().length_squared());
/// let mut chain = Chain::new(0, 0, PrimarySample::new(), 0.0);
/// let mut spare = PrimarySample::new();
/// for _ in 0..100 {
///     chain.step(&mut spare, |current, proposed, random| {
///         let mut samples = if random.next_f64() < 0.3 {
///             PrimarySamples::large(proposed, random)
///         } else {
///             PrimarySamples::small(current, proposed, Kernel::default(), random)
///         };
///         Some(Proposal::symmetric(estimate(&mut samples)))
///     });
/// }
/// assert_eq!(chain.state().known(), 2);
/// ```
#[derive(Debug)]
pub struct PrimarySamples<'a> {
    from: Option<&'a PrimarySample>,
    to: &'a mut PrimarySample,
    kernel: Kernel,
    key: u64,
    stream: usize,
    dimension: u32,
    /// The numbers that move the stream's coordinates, one for each dimension.
    random: Random,
}

impl<'a> PrimarySamples<'a> {
    /// A large step, into `to`. Draws one number from `random`.
    pub fn large(to: &'a mut PrimarySample, random: &mut Random) -> Self {
        Self::new(None, to, Kernel::default(), random)
    }

    /// A small step from `from` into `to`. Draws one number from `random`.
    pub fn small(from: &'a PrimarySample, to: &'a mut PrimarySample, kernel: Kernel, random: &mut Random) -> Self {
        Self::new(Some(from), to, kernel, random)
    }

    fn new(from: Option<&'a PrimarySample>, to: &'a mut PrimarySample, kernel: Kernel, random: &mut Random) -> Self {
        let key = random.next_u64();
        to.clear();
        Self { from, to, kernel, key, stream: 0, dimension: 0, random: Random::of_stream(key, 0) }
    }

    /// Goes on at dimension 0 of a stream; the first one is stream 0. Streams are numbered without gaps, and few.
    pub fn set_stream(&mut self, stream: usize) {
        self.stream = stream;
        self.dimension = 0;
        self.random = Random::of_stream(self.key, stream as u64);
    }

    /// The dimension to be drawn next.
    pub fn dimension(&self) -> u32 {
        self.dimension
    }

    #[inline]
    fn next(&mut self) -> f32 {
        let dimension = self.dimension % DIMENSIONS;
        self.dimension = self.dimension.wrapping_add(1);
        let (place, random) = (dimension as usize, self.random.at(dimension));
        if self.to.streams.len() <= self.stream {
            self.to.streams.resize_with(self.stream + 1, Vec::new);
        }
        let coordinates = &mut self.to.streams[self.stream];
        if let Some(Some(known)) = coordinates.get(place) {
            return unit_f32(*known);
        }
        let bits = match self.from.and_then(|from| from.bits(self.stream, dimension)) {
            Some(old) => self.kernel.step(old, random),
            None => (random >> 32) as u32,
        };
        if coordinates.len() == place {
            // As it nearly always is.
            coordinates.push(Some(bits));
        } else {
            if coordinates.len() <= place {
                coordinates.resize(place + 1, None);
            }
            coordinates[place] = Some(bits);
        }
        unit_f32(bits)
    }
}

impl Samples for PrimarySamples<'_> {
    #[inline]
    fn next_1d(&mut self) -> f32 {
        self.next()
    }

    #[inline]
    fn next_2d(&mut self) -> Vec2 {
        let x = self.next();
        Vec2::new(x, self.next())
    }

    #[inline]
    fn set_dimension(&mut self, dimension: u32) {
        self.dimension = dimension;
    }
}

/// The weights, of the current and of the proposed state, by which a step of a chain in primary sample space contributes to an
/// estimate, large steps being used twice: as proposals of the chain and as independent samples, combined by the balance
/// heuristic (Kelemen et al. 2002, section 5).
///
/// The estimate is the mean over steps of `Σ weight · F(state)`, where `F` is the integrand (the contributions to all pixels)
/// of which the chain follows the density `f`: `wₓ = (1 − a) / (f(x)/b + p)`, `w_y = (a + l) / (f(y)/b + p)`, with the acceptance
/// probability `a`, the probability of large steps `p`, `l` one if this was one and else zero, and `b = ∫ f` (which makes for
/// a bias of the order of its own relative error squared, where it is an estimate). Without large steps, `p = 0`, it is the
/// plain `(1 − a) b / f(x)` and `a b / f(y)`. The weight of a state of density zero is zero without large steps.
#[inline]
pub fn large_step_weights(
    acceptance: f64,
    is_large: bool,
    current_density: f64,
    proposed_density: f64,
    normalization: f64,
    large_step_probability: f64,
) -> [f64; 2] {
    let weight = |numerator: f64, density: f64| {
        let denominator = density / normalization + large_step_probability;
        if numerator > 0.0 && denominator > 0.0 { numerator / denominator } else { 0.0 }
    };
    let large = if is_large { 1.0 } else { 0.0 };
    [weight(1.0 - acceptance, current_density), weight(acceptance + large, proposed_density)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_follow_the_formula() {
        for kernel in
            [Kernel::default(), Kernel::new(1e-6, 0.4).expect("in range"), Kernel::new(0.1, 0.2).expect("in range")]
        {
            let magnitudes = f64::from(kernel.largest / kernel.smallest).ln();
            for i in 0..100_000u32 {
                let random = i * 42_949;
                let u = f64::from(random) / f64::from(2u32).powi(32);
                let exact = f64::from(kernel.largest) * (-magnitudes * u).exp();
                for (bits, sign) in [(0, 1.0), (1 << 63, -1.0)] {
                    let moved = kernel.step(7, u64::from(random) | bits).wrapping_sub(7) as i32;
                    let length = sign * f64::from(moved) / f64::from(2u32).powi(32);
                    // An error of the interpolation, of the logarithm's last bits, and of the last bit of the coordinate.
                    assert!((length - exact).abs() < 3e-6 * exact + 2.4e-10, "{kernel:?} {length} {exact}");
                }
            }
        }
    }
}
