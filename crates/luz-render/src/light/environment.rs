//! Environment maps.

use super::distortion::{keeps_angles, local_solid_angle};
use super::{Combination, LightSample, Target, brightness};
use crate::sphere_map::SphereMap;
use crate::texture::{SpectrumKind, TexelFilter};
use glam::{IVec2, Vec2, Vec3};
use luz_color::{RgbColorSpace, SampledSpectrum, Spectrum, Wavelengths};
use luz_geometry::Transform;
use luz_sample::distribution::{DistributionError, PiecewiseBilinear2D, PiecewiseConstant2D, SquareMeasure};
use std::f32::consts::{PI, TAU};

/// The share of the map's mean radiance that is left to directions drawn from the BSDF.
///
/// Of as many samples of either technique those of the map should have the density `2 p* − p_bsdf` where that is positive
/// (Karlík et al. 2019, "MIS Compensation: Optimizing Sampling Techniques in Multiple Importance Sampling"). With `p*` in
/// proportion to the radiance and `p_bsdf` even, as it is on average over all normals, this is in proportion to the
/// radiance less half its mean. Of 0, ½, ¾ and 1, ½ was best on average and the only one that never lost.
const OTHERS_SHARE: f32 = 0.5;

/// An environment map, drawn in proportion to the radiance that is looked up in it.
///
/// Where directions drawn from the BSDF are weighted with its own, it draws in proportion to what exceeds half the map's
/// mean radiance: what is dimmer those find.
#[derive(Clone, Debug)]
pub struct ImageInfiniteLight {
    texels: SphereTexels,
    color_space: &'static RgbColorSpace,
    scale: f32,
    world_from_light: Transform,
    /// Whether solid angles of the map's space are those of the world.
    keeps_angles: bool,
    whole: SphereDistribution,
    /// What exceeds the share of the others.
    excess: SphereDistribution,
}

impl ImageInfiniteLight {
    /// A map of `size` (width, height) texels, row by row from the top; RGB in `color_space`, finite and not negative.
    /// Each texel stands for all directions nearest to it, or bilinearly with its neighbours, as `filter` says.
    ///
    /// # Errors
    /// If a texel is negative or not finite, or there are not as many as the size says.
    pub fn new(
        map: SphereMap,
        filter: TexelFilter,
        size: [usize; 2],
        texels: Vec<[f32; 3]>,
        color_space: &'static RgbColorSpace,
        scale: f32,
        world_from_light: Transform,
    ) -> Result<Self, DistributionError> {
        Self::with_texels(SphereTexels::new(map, filter, size, texels)?, color_space, scale, world_from_light)
    }

    /// As [`new`](Self::new), of texels that are put together already.
    pub(crate) fn with_texels(
        texels: SphereTexels,
        color_space: &'static RgbColorSpace,
        scale: f32,
        world_from_light: Transform,
    ) -> Result<Self, DistributionError> {
        let brightness = texels.brightness();
        let whole = SphereDistribution::new(&texels, &brightness)?;
        let mean = whole.mean() as f32;
        let excess: Vec<f32> = brightness.iter().map(|b| (b - OTHERS_SHARE * mean).max(0.0)).collect();
        let excess = SphereDistribution::new(&texels, &excess)?;
        let keeps_angles = keeps_angles(&world_from_light);
        Ok(Self { texels, color_space, scale, world_from_light, keeps_angles, whole, excess })
    }

    fn distribution(&self, combination: Combination) -> &SphereDistribution {
        match combination {
            Combination::Alone => &self.whole,
            Combination::WithBsdf => &self.excess,
        }
    }

    /// Draws a direction; `None` for a black map.
    pub fn sample(&self, combination: Combination, u: Vec2, wavelengths: &Wavelengths) -> Option<LightSample> {
        let (uv, direction, pdf) = self.sample_map(combination, u)?;
        let radiance = self.texel_radiance(uv, wavelengths);
        Some(LightSample { radiance, direction, target: Target::Infinity, pdf, is_delta: false })
    }

    /// The direction of [`sample`](Self::sample) and its density in solid angle.
    pub fn sample_direction(&self, combination: Combination, u: Vec2) -> Option<(Vec3, f32)> {
        self.sample_map(combination, u).map(|(_, direction, pdf)| (direction, pdf))
    }

    fn sample_map(&self, combination: Combination, u: Vec2) -> Option<(Vec2, Vec3, f32)> {
        let (uv, pdf) = self.distribution(combination).sample(u);
        if pdf <= 0.0 {
            return None;
        }
        let direction = self.world_from_light.vector(self.texels.direction(uv)).normalize();
        Some((uv, direction, pdf * self.distortion(direction)))
    }

    /// The density of [`sample`](Self::sample) in solid angle.
    pub fn pdf(&self, combination: Combination, direction: Vec3) -> f32 {
        self.distribution(combination).pdf(self.coordinates(direction)) * self.distortion(direction)
    }

    /// The radiance that arrives against `direction`.
    pub fn radiance(&self, direction: Vec3, wavelengths: &Wavelengths) -> SampledSpectrum {
        self.texel_radiance(self.coordinates(direction), wavelengths)
    }

    /// What of the light [`sample`](Self::sample) draws falls on the sphere that bounds the scene.
    pub fn power(&self, combination: Combination, scene_radius: f32) -> f64 {
        let white = luz_color::spectrum_to_y(&Spectrum::Dense(self.color_space.illuminant().clone()));
        let mean = self.distribution(combination).mean();
        f64::from(2.0 * TAU * PI) * f64::from(scene_radius).powi(2) * mean * f64::from(self.scale) * f64::from(white)
    }

    /// Solid angle in the map's space by that in the world.
    fn distortion(&self, direction: Vec3) -> f32 {
        if self.keeps_angles { 1.0 } else { local_solid_angle(&self.world_from_light, direction) }
    }

    fn coordinates(&self, direction: Vec3) -> Vec2 {
        self.texels.map.coordinates(self.world_from_light.inverse().vector(direction).normalize())
    }

    fn texel_radiance(&self, uv: Vec2, wavelengths: &Wavelengths) -> SampledSpectrum {
        SpectrumKind::Illuminant.spectrum(self.color_space, self.texels.lookup(uv), wavelengths) * self.scale
    }
}

/// Colours over the sphere.
#[derive(Clone, Debug)]
pub(crate) struct SphereTexels {
    map: SphereMap,
    filter: TexelFilter,
    size: [usize; 2],
    texels: Vec<[f32; 3]>,
}

impl SphereTexels {
    pub fn new(
        map: SphereMap,
        filter: TexelFilter,
        size: [usize; 2],
        texels: Vec<[f32; 3]>,
    ) -> Result<Self, DistributionError> {
        let [width, height] = size;
        if width == 0 || height == 0 {
            return Err(DistributionError::Empty);
        }
        if texels.len() != width * height {
            return Err(DistributionError::Length { expected: width * height, found: texels.len() });
        }
        Ok(Self { map, filter, size, texels })
    }

    fn brightness(&self) -> Vec<f32> {
        self.texels.iter().map(|rgb| brightness(*rgb)).collect()
    }

    /// The colour in a direction of the map's space.
    pub fn at(&self, direction: Vec3) -> [f32; 3] {
        self.lookup(self.map.coordinates(direction))
    }

    /// The colour at `uv ∈ [0, 1]²`.
    pub fn lookup(&self, uv: Vec2) -> [f32; 3] {
        let [width, height] = self.size;
        let at = uv * Vec2::new(width as f32, height as f32);
        if self.filter == TexelFilter::Point {
            let (x, y) = ((at.x as usize).min(width - 1), (at.y as usize).min(height - 1));
            return self.texels[y * width + x];
        }
        let at = at - 0.5;
        let (corner, d) = (at.floor(), at - at.floor());
        let corner = corner.as_ivec2();
        let [a, b, c, e] = [(0, 0), (1, 0), (0, 1), (1, 1)]
            .map(|(x, y)| self.texels[self.map.texel(corner + IVec2::new(x, y), self.size)]);
        std::array::from_fn(|k| {
            let top = a[k] + (b[k] - a[k]) * d.x;
            let bottom = c[k] + (e[k] - c[k]) * d.x;
            top + (bottom - top) * d.y
        })
    }

    /// The direction at `uv`. Over a texel of a map that is not interpolated directions are spread evenly over its solid
    /// angle: linearly in cos θ, not in θ, on a band of latitude.
    pub fn direction(&self, uv: Vec2) -> Vec3 {
        if self.map == SphereMap::EqualArea || self.filter != TexelFilter::Point {
            return self.map.direction(uv);
        }
        let rows = self.size[1] as f32;
        let row = ((uv.y * rows) as usize).min(self.size[1] - 1);
        let (top, extent) = latitude_band(row, self.size[1]);
        let cos_theta = (top - extent * (uv.y * rows - row as f32)).clamp(-1.0, 1.0);
        let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (uv.x * TAU).sin_cos();
        Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
    }
}

/// Draws directions in proportion to numbers on the texels of a map, looked up as its colours are.
#[derive(Clone, Debug)]
enum SphereDistribution {
    /// Equal-area texels, each of one density.
    EqualArea(PiecewiseConstant2D),
    /// Those of bands of latitude.
    Latitudes(PiecewiseConstant2D),
    /// Interpolated; with the integral of the measure, by which densities of the square are those of the sphere.
    Interpolated(PiecewiseBilinear2D, f32),
}

impl SphereDistribution {
    fn new(texels: &SphereTexels, values: &[f32]) -> Result<Self, DistributionError> {
        let size @ [width, height] = texels.size;
        if texels.filter != TexelFilter::Point {
            let grid = framed(texels.map, size, values);
            let (measure, area) = match texels.map {
                SphereMap::EqualArea => (SquareMeasure::Flat, 1.0),
                SphereMap::LatitudeLongitude => (SquareMeasure::Latitudes, 2.0 / PI),
            };
            return Ok(Self::Interpolated(PiecewiseBilinear2D::new(grid, size, measure)?, area));
        }
        match texels.map {
            SphereMap::EqualArea => Ok(Self::EqualArea(PiecewiseConstant2D::new(values, size)?)),
            SphereMap::LatitudeLongitude => {
                // Texels subtend more towards the equator.
                let share = |y: usize| latitude_band(y, height).1 * height as f32 / 2.0;
                let rows = values.chunks_exact(width).enumerate();
                let weights: Vec<f32> = rows.flat_map(|(y, row)| row.iter().map(move |v| v * share(y))).collect();
                Ok(Self::Latitudes(PiecewiseConstant2D::new(&weights, size)?))
            }
        }
    }

    /// The mean over the sphere of what it draws in proportion to.
    fn mean(&self) -> f64 {
        match self {
            Self::EqualArea(d) | Self::Latitudes(d) => d.integral(),
            Self::Interpolated(d, area) => d.integral() / f64::from(*area),
        }
    }

    /// Coordinates and density in solid angle.
    fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (uv, pdf) = match self {
            Self::EqualArea(d) | Self::Latitudes(d) => d.sample(u),
            Self::Interpolated(d, _) => d.sample(u),
        };
        (uv, pdf * self.density_factor(uv))
    }

    /// The density in solid angle at coordinates.
    fn pdf(&self, uv: Vec2) -> f32 {
        let pdf = match self {
            Self::EqualArea(d) | Self::Latitudes(d) => d.pdf(uv),
            Self::Interpolated(d, _) => d.pdf(uv),
        };
        pdf * self.density_factor(uv)
    }

    /// From density over the square to density in solid angle: area over solid angle.
    fn density_factor(&self, uv: Vec2) -> f32 {
        match self {
            Self::EqualArea(_) => 1.0 / (2.0 * TAU),
            Self::Latitudes(d) => {
                let rows = d.resolution()[1];
                let row = ((uv.y * rows as f32) as usize).min(rows - 1);
                1.0 / (TAU * rows as f32 * latitude_band(row, rows).1)
            }
            Self::Interpolated(_, area) => area / (2.0 * TAU),
        }
    }
}

/// Values of texels with a frame of the values along the edges of the square, each the mean of the texels on both sides.
fn framed(map: SphereMap, size: [usize; 2], values: &[f32]) -> Vec<f32> {
    let [width, height] = size;
    // A line through centres, or between the last texels and what lies beyond.
    let lines = |i: usize, count: usize| match i {
        0 => [-1, 0],
        i if i > count => [count as i32 - 1, count as i32],
        i => [i as i32 - 1; 2],
    };
    let value = |x: i32, y: i32| f64::from(values[map.texel(IVec2::new(x, y), size)]);
    let mut grid = Vec::with_capacity((width + 2) * (height + 2));
    for j in 0..height + 2 {
        let [y0, y1] = lines(j, height);
        for i in 0..width + 2 {
            let [x0, x1] = lines(i, width);
            grid.push(if x0 == x1 && y0 == y1 {
                values[y0 as usize * width + x0 as usize]
            } else {
                (0.25 * (value(x0, y0) + value(x1, y0) + value(x0, y1) + value(x1, y1))) as f32
            });
        }
    }
    grid
}

/// cos θ at the top of a row of a latitude–longitude map, and how far it falls to the row's bottom.
fn latitude_band(row: usize, rows: usize) -> (f32, f32) {
    let cos = |edge: usize| (std::f64::consts::PI * edge as f64 / rows as f64).cos();
    (cos(row) as f32, (cos(row) - cos(row + 1)) as f32)
}
