//! Surfaces whose emission is an image, drawn in proportion to it.

use super::parametric::parametric_at;
use super::{AreaLight, Emission, EmittingPoint, LightContext, LightSample, Target};
use glam::{Vec2, Vec3};
use luz_color::Wavelengths;
use luz_geometry::{Reference, Shape, ShapeId, SurfacePoint, UvFootprint, UvPoint, offset_ray_origin};
use luz_sample::distribution::{Steering, TexelTree};

/// From the surface's parameters to the image's coordinates, and back: images have their first row on top.
pub(crate) fn image_coordinates(uv: Vec2) -> Vec2 {
    Vec2::new(uv.x, 1.0 - uv.y)
}

/// One primitive with its image, seen from a point.
///
/// Points are drawn by walking down the image's tree, each part weighted by its brightness and by what its middle would
/// contribute to the irradiance of the reference point: cos θ cos θ' / d².
struct Screen<'a> {
    shape: &'a Shape,
    primitive: usize,
    tree: &'a TexelTree,
    footprint: UvFootprint,
    two_sided: bool,
    /// Where it is seen from; points are drawn by brightness and area alone where it is from nowhere.
    reference: Option<&'a Reference>,
}

/// The primitive's place in the image.
fn polygon(footprint: &UvFootprint) -> ([Vec2; 4], usize) {
    let mut corners = [Vec2::ZERO; 4];
    let given = footprint.corners();
    for (corner, uv) in corners.iter_mut().zip(given) {
        *corner = image_coordinates(*uv);
    }
    (corners, given.len())
}

impl Screen<'_> {
    fn steer(&self, at: Vec2, area: f32) -> Steering {
        /// The share of the texture over which area is taken to be spread evenly.
        const EVEN_PART: f32 = 1.0 / 64.0;
        /// The largest ratio of a part's area to its distance squared at which its middle stands for all of it.
        const FAR: f32 = 0.06;
        let Some(point) = self.shape.at_uv(self.primitive, image_coordinates(at)) else { return Steering::NONE };
        let Some(reference) = self.reference else {
            let is_settled = matches!(self.shape, Shape::Triangles(_)) || area <= EVEN_PART * self.uv_area();
            return Steering { factor: point.area_by_uv.clamp(1e-20, 1e20), is_settled };
        };
        let area = point.area_by_uv * area;
        let to = point.position - reference.position;
        let distance_squared = to.length_squared();
        let is_settled = area <= FAR * distance_squared;
        // About the tangent of the angle to the part's border: by so much cosines may be larger there.
        let reach = (area / distance_squared.max(area)).sqrt();
        let direction = to * distance_squared.max(f32::MIN_POSITIVE).sqrt().recip();
        let leaving = -point.normal.dot(direction);
        let leaving = if self.two_sided { leaving.abs() } else { leaving.max(0.0) };
        let arriving = reference.normal.map_or(1.0, |n| n.dot(direction).abs());
        let factor = (leaving + reach) * (arriving + reach) * point.area_by_uv / distance_squared.max(0.5 * area);
        Steering { factor: factor.clamp(1e-20, 1e20), is_settled }
    }

    /// The area of the primitive in texture coordinates.
    fn uv_area(&self) -> f32 {
        let corners = self.footprint.corners();
        let next = corners.iter().cycle().skip(1);
        0.5 * corners.iter().zip(next).map(|(a, b)| (*a - corners[0]).perp_dot(*b - corners[0])).sum::<f32>().abs()
    }

    fn sample(&self, u: Vec2) -> Option<(Vec2, f32)> {
        let (corners, count) = polygon(&self.footprint);
        self.tree.sample(&corners[..count], u, |at, area| self.steer(at, area))
    }

    fn pdf(&self, uv: Vec2) -> f32 {
        let (corners, count) = polygon(&self.footprint);
        self.tree.pdf(&corners[..count], image_coordinates(uv), |at, area| self.steer(at, area))
    }
}

/// From density in area to density in solid angle.
fn solid_angle_density(density: f32, to: Vec3, normal: Vec3) -> f32 {
    let distance_squared = to.length_squared();
    let pdf = density * (distance_squared * distance_squared.sqrt() / to.dot(normal).abs());
    if pdf.is_finite() { pdf } else { 0.0 }
}

impl AreaLight {
    fn screen<'a>(&self, context: LightContext<'a>, reference: Option<&'a Reference>) -> Option<Screen<'a>> {
        let emission = &context.emissions[self.emission as usize];
        let tree = emission.tree.as_deref().filter(|_| emission.is_drawn_by_image)?;
        let shape = context.accelerator.shape(ShapeId(self.shape));
        let primitive = self.primitive as usize;
        let footprint = shape.uv_footprint(primitive)?;
        Some(Screen { shape, primitive, tree, footprint, two_sided: emission.two_sided, reference })
    }

    /// Whether the light is drawn by its image.
    #[inline]
    pub(super) fn is_drawn_by_image(&self, context: LightContext<'_>) -> bool {
        let emission = &context.emissions[self.emission as usize];
        emission.is_drawn_by_image
            && emission.tree.is_some()
            && context.accelerator.shape(ShapeId(self.shape)).uv_footprint(self.primitive as usize).is_some()
    }

    /// A point drawn by the image; `None` where none shines towards `reference`.
    pub(super) fn sample_by_image(
        &self,
        context: LightContext<'_>,
        reference: &Reference,
        u: Vec2,
        wavelengths: &Wavelengths,
    ) -> Option<LightSample> {
        let screen = self.screen(context, Some(reference))?;
        let (at, density) = screen.sample(u)?;
        let uv = image_coordinates(at);
        let point = screen.shape.at_uv(screen.primitive, uv)?;
        let to = point.position - reference.position;
        let direction = to.try_normalize()?;
        let pdf = solid_angle_density(density / point.area_by_uv, to, point.normal);
        let pdf = self.among_met(context, pdf, point.position, uv);
        let radiance = context.radiance(self, point.normal, uv, -direction, wavelengths);
        (pdf > 0.0 && !radiance.is_black()).then_some(LightSample {
            radiance,
            direction,
            target: Target::Point(offset_ray_origin(point.position, point.position_error, point.normal, -direction)),
            pdf,
            is_delta: self.is_unseen,
        })
    }

    /// The density of [`sample_by_image`](Self::sample_by_image) in solid angle at a point that a ray has hit, its `alpha` apart.
    pub(super) fn pdf_by_image(&self, context: LightContext<'_>, reference: &Reference, hit: &SurfacePoint) -> f32 {
        let Some(screen) = self.screen(context, Some(reference)) else { return 0.0 };
        let Some(area_by_uv) = screen.shape.area_by_uv(screen.primitive, hit.parametric) else { return 0.0 };
        let density = screen.pdf(hit.uv) / area_by_uv;
        solid_angle_density(density, hit.position - reference.position, hit.geometric_normal)
    }
}

impl AreaLight {
    /// A point drawn by the image, for `reference` or for nobody in particular, with its density in area, its `alpha` apart.
    pub(super) fn sample_image_point(
        &self,
        context: LightContext<'_>,
        reference: Option<&Reference>,
        u: Vec2,
    ) -> Option<(EmittingPoint, f32)> {
        let screen = self.screen(context, reference)?;
        let (at, density) = screen.sample(u)?;
        let uv = image_coordinates(at);
        let UvPoint { position, position_error: error, normal, area_by_uv } =
            screen.shape.at_uv(screen.primitive, uv)?;
        let parametric = parametric_at(screen.shape, screen.primitive, position, uv);
        Some((EmittingPoint { position, error, normal, uv, parametric }, density / area_by_uv))
    }

    /// The density of [`sample_image_point`](Self::sample_image_point) in area.
    pub(super) fn image_point_pdf(
        &self,
        context: LightContext<'_>,
        reference: Option<&Reference>,
        point: &EmittingPoint,
    ) -> f32 {
        let Some(screen) = self.screen(context, reference) else { return 0.0 };
        let Some(area_by_uv) = screen.shape.area_by_uv(screen.primitive, point.parametric) else { return 0.0 };
        let density = screen.pdf(point.uv) / area_by_uv;
        if density.is_finite() { density } else { 0.0 }
    }
}

impl Emission {
    /// The mean over a primitive's area of what `tree` holds of the image: under its texture coordinates.
    pub(crate) fn mean_over(tree: &TexelTree, shape: &Shape, primitive: usize) -> f32 {
        /// Cells along each axis, where area is not the same all over the texture.
        const CELLS: usize = 64;
        let Some(footprint) = shape.uv_footprint(primitive) else { return tree.mean() as f32 };
        let (corners, count) = polygon(&footprint);
        let corners = &corners[..count];
        let area_at = |at: Vec2| shape.at_uv(primitive, image_coordinates(at)).map_or(0.0, |p| p.area_by_uv);
        let middle = corners.iter().sum::<Vec2>() / count as f32;
        let reference = area_at(middle);
        // A little within, where the poles of quadrics are not.
        let is_even = corners.iter().all(|c| (area_at(c.lerp(middle, 0.01)) / reference - 1.0).abs() < 1e-3);
        if is_even {
            return tree.mean_over(corners) as f32;
        }
        let min = corners.iter().fold(Vec2::INFINITY, |a, c| a.min(*c));
        let max = corners.iter().fold(Vec2::NEG_INFINITY, |a, c| a.max(*c));
        let step = (max - min) / CELLS as f32;
        let (mut sum, mut areas) = (0.0, 0.0);
        for i in 0..CELLS * CELLS {
            let low = min + step * Vec2::new((i % CELLS) as f32, (i / CELLS) as f32);
            let center = low + 0.5 * step;
            let turn = |k: usize| (corners[(k + 1) % count] - corners[k]).perp_dot(center - corners[k]);
            let (first, all) = (turn(0).signum(), (0..count).map(turn));
            if !all.into_iter().all(|t| t.signum() == first) {
                continue;
            }
            let cell = [low, low + Vec2::new(step.x, 0.0), low + step, low + Vec2::new(0.0, step.y)];
            let area = f64::from(area_at(center));
            sum += area * tree.mean_over(&cell);
            areas += area;
        }
        if areas > 0.0 { (sum / areas) as f32 } else { tree.mean() as f32 }
    }
}
