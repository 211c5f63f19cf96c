//! The averaged scattering of the dielectric coat over a base, in tables.
//!
//! Light that crosses the coat's interface, reaches a Lambertian base and leaves again forgets, at the base, where it
//! came from. The whole of the layered BSDF therefore needs three averages of the interface only: how much of the
//! light from a direction arrives at the base, how much is reflected by the interface, and how much of the base's light
//! comes back to it from the inside.

use std::{f32::consts::FRAC_PI_2, sync::OnceLock};

use glam::{Vec2, Vec3};

use super::{
    Dielectric, TrowbridgeReitz,
    coat_quadrature::{self, Rule},
    fresnel,
};

/// Nodes of a table over the square root of the cosine, in which `T` is well-behaved down to grazing angles.
const NODES: usize = 257;
/// Every how many nodes the integral is computed; the ones between are interpolated by cubics.
const STRIDE: usize = 4;
/// Rows of a table for textured roughness, at equidistant `alpha` in `[0, 1]`.
const ROUGHNESS_ROWS: usize = 33;
/// Rows of a table for an anisotropic interface, at equidistant values of the `alpha` along the direction, on which its
/// averages depend almost linearly.
const AZIMUTH_ROWS: usize = 4;

/// How an evaluation weighs the two ways in which light can be found to leave a rough coat.
///
/// Of light from a base through a rough interface to `wi`, walks in a coat know two techniques: one samples the
/// direction inside from `wi`, the other from the base. Both need the density of the former to be combined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CoatWeights {
    /// The weights sum to one; the BSDF is reciprocal, and its samples have the same expectation as its values.
    #[default]
    Exact,
    /// As in pbrt-v4 (`LayeredBxDF::f`), which takes, for the second technique, the density of the opposite direction,
    /// from the inside to `wi`. The weights sum to more than one: at light samples, the base of a rough coat looks 1 to
    /// 10 % brighter, more at grazing angles (issue 187 of pbrt-v4). Samples are not affected, so that sampling lights and
    /// sampling the BSDF have different expectations. For pictures that shall agree with pbrt-v4's.
    PbrtV4,
}

/// The dielectric interface of a coat of given thickness, as seen by a Lambertian base below it.
///
/// Built once per material and shared by every [`CoatedDiffuse`](super::CoatedDiffuse) of it. On a server core a smooth
/// interface takes microseconds, a rough one 2 ms, an anisotropic one 15 ms and a textured one 60 ms.
#[derive(Debug)]
pub struct CoatInterface {
    eta: f32,
    thickness: f32,
    max_depth: u32,
    weights: CoatWeights,
    table: Table,
    /// The same interface after [`TrowbridgeReitz::regularize`], made when it is first asked for.
    regularized: OnceLock<Box<CoatInterface>>,
}

#[derive(Debug)]
enum Table {
    /// A mirror-like interface: closed form.
    Smooth(TrowbridgeReitz, Averages),
    Isotropic(TrowbridgeReitz, Averages, Row),
    Anisotropic(TrowbridgeReitz, Averages, Box<[Row; AZIMUTH_ROWS]>),
    Textured(Box<[(Averages, Row)]>),
}

/// Averages over the hemisphere.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Averages {
    /// `2∫ T(μ) μ dμ`: the fraction of Lambertian light from outside that arrives at the base.
    pub transmittance: f32,
    /// The fraction of the base's light that comes back to it.
    pub internal_reflectance: f32,
}

impl Averages {
    fn lerp(self, other: Self, t: f32) -> Self {
        Self {
            transmittance: self.transmittance + (other.transmittance - self.transmittance) * t,
            internal_reflectance: self.internal_reflectance
                + (other.internal_reflectance - self.internal_reflectance) * t,
        }
    }
}

/// Directional averages of an interface for one direction.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Directional {
    /// Fraction of the light from a direction outside that arrives at the base, without radiance scaling.
    pub transmittance: f32,
    /// Fraction that the interface reflects, single scattering.
    pub reflectance: f32,
    /// `transmittance` as [`CoatWeights::PbrtV4`] estimates it for light that comes through the coat's outside to the base.
    pub emergence: f32,
}

impl Directional {
    fn lerp(self, other: Self, t: f32) -> Self {
        Self {
            transmittance: self.transmittance + (other.transmittance - self.transmittance) * t,
            reflectance: self.reflectance + (other.reflectance - self.reflectance) * t,
            emergence: self.emergence + (other.emergence - self.emergence) * t,
        }
    }
}

/// Directional averages at equidistant square roots of the cosine, linearly interpolated.
#[derive(Debug)]
struct Row(Box<[Directional; NODES]>);

impl Row {
    fn new(distribution: &TrowbridgeReitz, eta: f32, thickness: f32, azimuth: f32) -> Self {
        let coarse: Vec<Directional> = (0..=(NODES - 1) / STRIDE)
            .map(|i| {
                let x = (i * STRIDE) as f32 / (NODES - 1) as f32;
                coat_quadrature::directional(Rule::table(), distribution, eta, thickness, x * x, azimuth)
            })
            .collect();
        let mut nodes = Box::new([Directional::default(); NODES]);
        for (i, node) in nodes.iter_mut().enumerate() {
            let at = i as f32 / STRIDE as f32;
            *node = Directional {
                transmittance: cubic(&coarse, at, |d| d.transmittance).clamp(0.0, 1.0),
                reflectance: cubic(&coarse, at, |d| d.reflectance).clamp(0.0, 1.0),
                emergence: cubic(&coarse, at, |d| d.emergence).max(0.0),
            };
        }
        Self(nodes)
    }

    /// `2∫ T(μ) μ dμ` with `μ = x²`, by Simpson's rule.
    fn mean_transmittance(&self) -> f32 {
        let mut sum = 0.0;
        for (i, node) in self.0.iter().enumerate() {
            let x = i as f64 / (NODES - 1) as f64;
            let weight = if i == 0 || i == NODES - 1 { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
            sum += weight * f64::from(node.transmittance) * 4.0 * x * x * x;
        }
        (sum / (3.0 * (NODES - 1) as f64)) as f32
    }

    #[inline(always)]
    fn at(&self, cos: f32) -> Directional {
        let x = cos.clamp(0.0, 1.0).sqrt() * (NODES - 1) as f32;
        let i = (x as usize).min(NODES - 2);
        self.0[i].lerp(self.0[i + 1], x - i as f32)
    }
}

/// The cubic Lagrange interpolant through the four nodes around `at` (three at the ends stay inside the table).
fn cubic(values: &[Directional], at: f32, of: impl Fn(&Directional) -> f32) -> f32 {
    let first = (at as usize).saturating_sub(1).min(values.len() - 4);
    let w = lagrange(at - first as f32);
    (0..4).map(|i| w[i] * of(&values[first + i])).sum()
}

/// Weights of the values at 0, 1, 2 and 3 in the cubic through them, at `t`.
#[inline(always)]
fn lagrange(t: f32) -> [f32; 4] {
    let (a, b, c, d) = (t, t - 1.0, t - 2.0, t - 3.0);
    [-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0]
}

impl CoatInterface {
    /// The interface with Trowbridge–Reitz roughnesses `alpha_x`, `alpha_y`, over a coat of relative index of refraction
    /// `eta > 0` (anything else counts as 1) that attenuates by `exp(−thickness/|cosθ|)` at each crossing.
    ///
    /// A path in the coat ends after `max_depth` encounters with its boundaries, as in pbrt-v4.
    pub fn new(alpha_x: f32, alpha_y: f32, eta: f32, thickness: f32, max_depth: u32) -> Self {
        let (eta, thickness) = valid(eta, thickness);
        let distribution = TrowbridgeReitz::new(alpha_x, alpha_y);
        let row = |azimuth| Row::new(&distribution, eta, thickness, azimuth);
        let table = if distribution.effectively_smooth() || eta == 1.0 {
            Table::Smooth(distribution, coat_quadrature::smooth_averages(eta, thickness))
        } else if alpha_x == alpha_y {
            let (averages, row) = isotropic(&distribution, eta, thickness);
            Table::Isotropic(distribution, averages, row)
        } else {
            let (x2, y2) = (alpha_x * alpha_x, alpha_y * alpha_y);
            let rows: [Row; AZIMUTH_ROWS] = std::array::from_fn(|i| {
                let alpha = alpha_x + (alpha_y - alpha_x) * i as f32 / (AZIMUTH_ROWS - 1) as f32;
                row(((alpha * alpha - x2) / (y2 - x2)).clamp(0.0, 1.0).sqrt().asin())
            });
            // The mean over a quarter turn.
            const AZIMUTHS: usize = 32;
            let mut transmittance = 0.0;
            for i in 0..AZIMUTHS {
                let (sin, cos) = (FRAC_PI_2 * (i as f32 + 0.5) / AZIMUTHS as f32).sin_cos();
                let weights = azimuth_weights(Vec3::new(cos, sin, 0.0), distribution.alpha());
                let at = rows.iter().zip(weights).map(|(row, weight)| weight * row.mean_transmittance());
                transmittance += at.sum::<f32>() / AZIMUTHS as f32;
            }
            let averages = Averages {
                transmittance,
                internal_reflectance: coat_quadrature::internal_reflectance(
                    Rule::table(),
                    &distribution,
                    eta,
                    thickness,
                ),
            };
            Table::Anisotropic(distribution, averages, Box::new(rows))
        };
        Self { eta, thickness, max_depth, weights: CoatWeights::Exact, table, regularized: OnceLock::new() }
    }

    /// An interface whose roughness varies over the surface, for [`CoatedDiffuse::textured`](super::CoatedDiffuse).
    ///
    /// Tables are interpolated between 33 values of `alpha` in `[0, 1]` (larger ones count as one). Where the roughness
    /// is anisotropic, a direction takes the averages of the isotropic interface with the `alpha` along that direction,
    /// the one that enters Smith's Λ: an approximation of the base's brightness only.
    pub fn textured(eta: f32, thickness: f32, max_depth: u32) -> Self {
        let (eta, thickness) = valid(eta, thickness);
        let rows = (0..ROUGHNESS_ROWS)
            .map(|i| {
                let alpha = i as f32 / (ROUGHNESS_ROWS - 1) as f32;
                isotropic(&TrowbridgeReitz::new(alpha, alpha), eta, thickness)
            })
            .collect();
        Self {
            eta,
            thickness,
            max_depth,
            weights: CoatWeights::Exact,
            table: Table::Textured(rows),
            regularized: OnceLock::new(),
        }
    }

    /// The same interface with other `weights`.
    #[must_use]
    pub fn with_weights(self, weights: CoatWeights) -> Self {
        Self { weights, regularized: OnceLock::new(), ..self }
    }

    /// How evaluations weigh the ways out.
    #[inline(always)]
    pub(super) fn weights(&self) -> CoatWeights {
        self.weights
    }

    /// Index of refraction of the coat over that outside.
    #[inline(always)]
    pub fn eta(&self) -> f32 {
        self.eta
    }

    /// Optical thickness of the coat.
    #[inline(always)]
    pub fn thickness(&self) -> f32 {
        self.thickness
    }

    /// How often a path may meet the base: `⌈max_depth/2⌉`.
    #[inline(always)]
    pub fn base_bounces(&self) -> u32 {
        self.max_depth.div_ceil(2)
    }

    /// True for an interface of [`CoatInterface::textured`].
    #[inline(always)]
    pub(super) fn is_textured(&self) -> bool {
        matches!(self.table, Table::Textured(_))
    }

    /// The microfacets; a mirror if the roughness is textured.
    pub(super) fn distribution(&self) -> TrowbridgeReitz {
        match &self.table {
            Table::Smooth(d, _) | Table::Isotropic(d, ..) | Table::Anisotropic(d, ..) => *d,
            Table::Textured(_) => TrowbridgeReitz::new(0.0, 0.0),
        }
    }

    /// The interface roughened by [`TrowbridgeReitz::regularize`]; itself, if the roughness is textured.
    pub(super) fn regularized(&self) -> &Self {
        if self.is_textured() {
            return self;
        }
        self.regularized.get_or_init(|| {
            let mut distribution = self.distribution();
            distribution.regularize();
            let alpha = distribution.alpha();
            let rough = Self::new(alpha.x, alpha.y, self.eta, self.thickness, self.max_depth);
            Box::new(rough.with_weights(self.weights))
        })
    }

    /// Averages for the direction `w`; `distribution` matters only where the roughness is textured.
    #[inline]
    pub(super) fn directional(&self, w: Vec3, distribution: &TrowbridgeReitz) -> Directional {
        let cos = w.z.abs();
        match &self.table {
            Table::Smooth(..) => smooth(cos, self.eta, self.thickness),
            Table::Isotropic(_, _, row) => row.at(cos),
            Table::Anisotropic(own, _, rows) => {
                let weights = azimuth_weights(w, own.alpha());
                let mut sum = Directional::default();
                for (row, weight) in rows.iter().zip(weights) {
                    let at = row.at(cos);
                    sum.transmittance += weight * at.transmittance;
                    sum.reflectance += weight * at.reflectance;
                    sum.emergence += weight * at.emergence;
                }
                sum
            }
            Table::Textured(rows) => {
                let (i, t) = roughness_row(alpha_along(w, distribution.alpha()));
                rows[i].1.at(cos).lerp(rows[i + 1].1.at(cos), t)
            }
        }
    }

    /// Averages over all directions; `distribution` matters only where the roughness is textured.
    #[inline]
    pub(super) fn averages(&self, distribution: &TrowbridgeReitz) -> Averages {
        match &self.table {
            Table::Smooth(_, averages) | Table::Isotropic(_, averages, _) | Table::Anisotropic(_, averages, _) => {
                *averages
            }
            Table::Textured(rows) => {
                let alpha = distribution.alpha();
                let (i, t) = roughness_row((0.5 * alpha.length_squared()).sqrt());
                rows[i].0.lerp(rows[i + 1].0, t)
            }
        }
    }
}

/// The tables of an isotropic interface.
fn isotropic(distribution: &TrowbridgeReitz, eta: f32, thickness: f32) -> (Averages, Row) {
    let row = Row::new(distribution, eta, thickness, 0.0);
    let averages = Averages {
        transmittance: row.mean_transmittance(),
        internal_reflectance: coat_quadrature::internal_reflectance(Rule::table(), distribution, eta, thickness),
    };
    (averages, row)
}

/// A relative index of refraction and a thickness that mean something.
fn valid(eta: f32, thickness: f32) -> (f32, f32) {
    let eta = if eta > 0.0 && eta.is_finite() { Dielectric::matched(eta) } else { 1.0 };
    (eta, if thickness > 0.0 { thickness } else { 0.0 })
}

/// Averages of a smooth interface, in closed form.
#[inline]
pub(super) fn smooth(cos: f32, eta: f32, thickness: f32) -> Directional {
    let sin2_t = (1.0 - cos * cos).max(0.0) / (eta * eta);
    if cos <= 0.0 || sin2_t >= 1.0 {
        return Directional { transmittance: 0.0, reflectance: 1.0, emergence: 0.0 };
    }
    let reflectance = fresnel::dielectric(cos, eta);
    let cos_t = (1.0 - sin2_t).sqrt();
    let transmittance = (1.0 - reflectance) * (-thickness / cos_t).exp();
    Directional { transmittance, reflectance, emergence: transmittance }
}

/// Weights of the rows of an anisotropic interface for the azimuth of `w`.
#[inline(always)]
fn azimuth_weights(w: Vec3, alpha: Vec2) -> [f32; AZIMUTH_ROWS] {
    let t = (alpha_along(w, alpha) - alpha.x) / (alpha.y - alpha.x);
    lagrange(t.clamp(0.0, 1.0) * (AZIMUTH_ROWS - 1) as f32)
}

/// The roughness that the profile of the surface along `w` has.
#[inline(always)]
fn alpha_along(w: Vec3, alpha: Vec2) -> f32 {
    let r2 = w.x * w.x + w.y * w.y;
    let s = if r2 > 0.0 { w.y * w.y / r2 } else { 0.5 };
    ((1.0 - s) * alpha.x * alpha.x + s * alpha.y * alpha.y).sqrt()
}

/// Row below `alpha`, and where between it and the next.
#[inline(always)]
fn roughness_row(alpha: f32) -> (usize, f32) {
    let x = alpha.clamp(0.0, 1.0) * (ROUGHNESS_ROWS - 1) as f32;
    let i = (x as usize).min(ROUGHNESS_ROWS - 2);
    (i, x - i as f32)
}
