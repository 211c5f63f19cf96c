//! Environment maps that are seen through a window.

use super::environment::SphereTexels;
use super::{BoundingSphere, Departure, LightBounds, LightSample, Target, brightness};
use crate::texture::SpectrumKind;
use glam::{Vec2, Vec3};
use luz_color::{RgbColorSpace, SampledSpectrum, Spectrum, Wavelengths};
use luz_geometry::{Bounds3, Frame, Reference, Transform};
use luz_sample::distribution::{DistributionError, Window, WindowedPiecewiseConstant2D};
use std::f32::consts::{FRAC_PI_2, PI};

/// A rectangle through which an environment map is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Portal {
    corners: [Vec3; 4],
    /// x along the edge from the first corner to the last, y along that to the second, z out of the room.
    frame: Frame,
}

/// All directions out of a portal, in rectified coordinates.
const EVERYWHERE: Window = Window { min: Vec2::ZERO, max: Vec2::ONE };

impl Portal {
    /// A portal with the given corners, in order around it; what looks out sees them run clockwise or anticlockwise such
    /// that `(p3 − p0) × (p1 − p0)` points away from it, as in pbrt-v4. `None` if they are not those of a rectangle.
    pub fn new(corners: [Vec3; 4]) -> Option<Self> {
        const TOLERANCE: f32 = 1e-3;
        let [p0, p1, p2, p3] = corners;
        let along = |from: Vec3, to: Vec3| (to - from).try_normalize();
        let (up, side) = (along(p0, p1)?, along(p0, p3)?);
        let (side_2, up_2) = (along(p1, p2)?, along(p3, p2)?);
        let parallel = |a: Vec3, b: Vec3| (a.dot(b) - 1.0).abs() <= TOLERANCE;
        let is_rectangle = parallel(up, up_2) && parallel(side, side_2) && up.dot(side).abs() <= TOLERANCE;
        let normal = side.cross(up).try_normalize()?;
        let frame = Frame { s: side, t: normal.cross(side), n: normal };
        is_rectangle.then_some(Self { corners, frame })
    }

    /// Its area.
    pub fn area(&self) -> f32 {
        let [p0, p1, _, p3] = self.corners;
        p0.distance(p1) * p0.distance(p3)
    }

    /// Its point at `u ∈ [0, 1]²`.
    fn point(&self, u: Vec2) -> Vec3 {
        let [p0, p1, _, p3] = self.corners;
        p0 + (p3 - p0) * u.x + (p1 - p0) * u.y
    }

    /// The density of its points, drawn evenly, in area of the plane perpendicular to `direction`; `None` for directions
    /// that do not lead out of the room.
    fn density(&self, direction: Vec3) -> Option<f32> {
        let pdf = 1.0 / (self.area() * self.frame.n.dot(direction));
        (pdf > 0.0 && pdf.is_finite()).then_some(pdf)
    }

    /// True if the line through `from` along `direction` meets it.
    fn lets_pass(&self, from: Vec3, direction: Vec3) -> bool {
        let [p0, p1, _, p3] = self.corners;
        let t = self.frame.n.dot(p0 - from) / self.frame.n.dot(direction);
        let at = self.frame.to_local(from + direction * t - p0);
        (0.0..=p0.distance(p3)).contains(&at.x) && (0.0..=p0.distance(p1)).contains(&at.y)
    }

    /// The rectified coordinates of a direction in world space (Bitterli, Novák, and Jarosz 2015, section 3), in
    /// `[0, 1]²`: the angles to the frame's planes, such that portals are upright rectangles from everywhere. With the
    /// solid angle by area of the square; `None` for directions into the room.
    fn coordinates(&self, direction: Vec3) -> Option<(Vec2, f32)> {
        let w = self.frame.to_local(direction);
        if w.z <= 0.0 {
            return None;
        }
        let uv = Vec2::new(w.x.atan2(w.z), w.y.atan2(w.z)) / PI + 0.5;
        Some((uv.clamp(Vec2::ZERO, Vec2::ONE), solid_angle_by_area(w)))
    }

    /// The direction at rectified coordinates, and the solid angle by area of the square.
    fn direction(&self, uv: Vec2) -> (Vec3, f32) {
        let angle = uv * PI - FRAC_PI_2;
        let w = Vec3::new(angle.x.tan(), angle.y.tan(), 1.0).normalize();
        (self.frame.to_world(w), solid_angle_by_area(w))
    }

    /// What is seen of the map from a point; `None` from beside or beyond the portal.
    fn window(&self, from: Vec3) -> Option<Window> {
        let corner = |p: Vec3| self.coordinates((p - from).try_normalize()?).map(|(uv, _)| uv);
        let (a, b) = (corner(self.corners[0])?, corner(self.corners[2])?);
        Some(Window { min: a.min(b), max: a.max(b) })
    }
}

fn solid_angle_by_area(w: Vec3) -> f32 {
    PI * PI * (1.0 - w.x * w.x) * (1.0 - w.y * w.y) / w.z
}

/// An environment map that is seen through a portal and nowhere else, drawn within what is seen of it from where it is
/// asked (Bitterli, Novák, and Jarosz 2015, "Portal-Masked Environment Map Sampling").
///
/// As pbrt-v4 has it: the map is resampled to rectified coordinates, and what lies beyond the portal it does not light.
#[derive(Clone, Debug)]
pub struct PortalInfiniteLight {
    portal: Portal,
    size: [usize; 2],
    texels: Vec<[f32; 3]>,
    color_space: &'static RgbColorSpace,
    scale: f32,
    distribution: WindowedPiecewiseConstant2D,
    /// The mean of the radiance over directions out of the portal, weighted by the cosine to its normal.
    mean: f64,
}

impl PortalInfiniteLight {
    /// The map `texels` through `portal`; a rectified map of `resolution` texels along each side.
    ///
    /// # Errors
    /// If a texel is negative or not finite, or the resolution is zero.
    pub(crate) fn new(
        portal: Portal,
        texels: &SphereTexels,
        resolution: usize,
        color_space: &'static RgbColorSpace,
        scale: f32,
        world_from_light: Transform,
    ) -> Result<Self, DistributionError> {
        let center = |i: usize| ((i % resolution) as f32 + 0.5, (i / resolution) as f32 + 0.5);
        let mut rectified = Vec::with_capacity(resolution * resolution);
        let mut weights = Vec::with_capacity(resolution * resolution);
        let (mut flux, mut cosines) = (0.0, 0.0);
        for i in 0..resolution * resolution {
            let (direction, solid_angle) = portal.direction(Vec2::from(center(i)) / resolution as f32);
            let local = world_from_light.inverse().vector(direction).normalize();
            let rgb = texels.at(local);
            let brightness = brightness(rgb);
            rectified.push(rgb);
            weights.push(brightness * solid_angle);
            let cosine = f64::from(direction.dot(portal.frame.n) * solid_angle);
            cosines += cosine;
            flux += f64::from(brightness) * cosine;
        }
        let size = [resolution; 2];
        let distribution = WindowedPiecewiseConstant2D::new(weights, size)?;
        Ok(Self { portal, size, texels: rectified, color_space, scale, distribution, mean: flux / cosines })
    }

    /// Draws a direction through the portal; `None` where nothing is seen through it.
    pub fn sample(&self, reference: &Reference, u: Vec2, wavelengths: &Wavelengths) -> Option<LightSample> {
        let (uv, direction, pdf) = self.sample_window(&self.portal.window(reference.position)?, u)?;
        let radiance = self.texel_radiance(uv, wavelengths);
        Some(LightSample { radiance, direction, target: Target::Infinity, pdf, is_delta: false })
    }

    /// The direction of [`sample`](Self::sample) and its density in solid angle.
    pub fn sample_direction(&self, reference: &Reference, u: Vec2) -> Option<(Vec3, f32)> {
        self.sample_window(&self.portal.window(reference.position)?, u).map(|(_, direction, pdf)| (direction, pdf))
    }

    /// The density of [`sample`](Self::sample) in solid angle.
    pub fn pdf(&self, reference: &Reference, direction: Vec3) -> f32 {
        self.portal.window(reference.position).map_or(0.0, |window| self.window_pdf(&window, direction))
    }

    /// Draws a direction out of the portal, from nowhere in particular, in proportion to the map.
    pub fn sample_outward(&self, u: Vec2) -> Option<(Vec3, f32)> {
        self.sample_window(&EVERYWHERE, u).map(|(_, direction, pdf)| (direction, pdf))
    }

    /// The density of [`sample_outward`](Self::sample_outward) in solid angle.
    pub fn outward_pdf(&self, direction: Vec3) -> f32 {
        self.window_pdf(&EVERYWHERE, direction)
    }

    fn sample_window(&self, window: &Window, u: Vec2) -> Option<(Vec2, Vec3, f32)> {
        let (uv, density) = self.distribution.sample(window, u)?;
        let (direction, solid_angle) = self.portal.direction(uv);
        let pdf = density / solid_angle;
        (pdf > 0.0 && pdf.is_finite()).then_some((uv, direction, pdf))
    }

    fn window_pdf(&self, window: &Window, direction: Vec3) -> f32 {
        let Some((uv, solid_angle)) = self.portal.coordinates(direction) else { return 0.0 };
        let pdf = self.distribution.pdf(window, uv) / solid_angle;
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// Draws a ray that comes in through the portal from the direction `towards`: through a point of the portal that is
    /// drawn evenly.
    pub fn sample_departure(&self, sphere: BoundingSphere, towards: Vec3, u: Vec2) -> Option<Departure> {
        let pdf = self.portal.density(towards)?;
        let through = self.portal.point(u);
        // From beyond all that may stand before the portal.
        let origin = through + towards * (through.distance(sphere.center) + sphere.beyond());
        Some(Departure { origin, direction: -towards, pdf })
    }

    /// The density of [`sample_departure`](Self::sample_departure) for the ray to `to`, in area of the plane perpendicular
    /// to `towards`; zero where that ray does not pass the portal.
    pub fn departure_pdf(&self, towards: Vec3, to: Vec3) -> f32 {
        if !self.portal.lets_pass(to, towards) {
            return 0.0;
        }
        self.portal.density(towards).unwrap_or(0.0)
    }

    /// The radiance that arrives at `reference` against `direction`: none beside the portal.
    pub fn radiance(&self, reference: &Reference, direction: Vec3, wavelengths: &Wavelengths) -> SampledSpectrum {
        match (self.portal.coordinates(direction), self.portal.window(reference.position)) {
            (Some((uv, _)), Some(window)) if window.contains(uv) => self.texel_radiance(uv, wavelengths),
            _ => SampledSpectrum::ZERO,
        }
    }

    fn texel_radiance(&self, uv: Vec2, wavelengths: &Wavelengths) -> SampledSpectrum {
        let [width, height] = self.size;
        let x = ((uv.x * width as f32) as usize).min(width - 1);
        let y = ((uv.y * height as f32) as usize).min(height - 1);
        SpectrumKind::Illuminant.spectrum(self.color_space, self.texels[y * width + x], wavelengths) * self.scale
    }

    /// Mean radiance times area, in photometric units.
    fn strength(&self) -> f64 {
        let white = luz_color::spectrum_to_y(&Spectrum::Dense(self.color_space.illuminant().clone()));
        f64::from(self.portal.area()) * self.mean * f64::from(white) * f64::from(self.scale)
    }

    /// What comes in through the portal.
    pub fn power(&self) -> f64 {
        std::f64::consts::PI * self.strength()
    }

    /// The portal shines into the room as a lamp of its size would.
    pub fn bounds(&self) -> LightBounds {
        LightBounds {
            bounds: Bounds3::from_points(self.portal.corners),
            axis: -self.portal.frame.n,
            cos_normals: 1.0 - 1e-6,
            cos_emission: 0.0,
            strength: self.strength() as f32,
            two_sided: false,
        }
    }
}
