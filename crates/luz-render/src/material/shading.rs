//! Everything that scattering at one point of a path needs.

use super::{MaterialId, Perturbation};
use crate::bsdf::{Bsdf, Diffuse};
use crate::camera::{Camera, RayDifferentials};
use crate::texture::SurfaceContext;
use crate::world::{Interaction, World};
use glam::{Vec2, Vec3};
use luz_color::{SampledSpectrum, Wavelengths};
use luz_geometry::{Frame, SurfacePoint};

/// Texture footprints are made as narrow as this many samples per pixel want them, no less than pbrt-v4's eighth.
const FOOTPRINT_SCALE: f32 = 0.125;

/// The BSDF at a point, and the frame that it lives in.
#[derive(Clone, Copy, Debug)]
pub struct Shading<'w> {
    /// Local space: z is the shading normal.
    pub frame: Frame,
    /// How the point scatters.
    pub bsdf: Bsdf<'w>,
}

impl<'w> Shading<'w> {
    /// A black surface that faces z. (No constant: that would be copied whole.)
    #[inline(always)]
    pub fn black() -> Self {
        Self {
            bsdf: Bsdf::Diffuse(Diffuse::new(SampledSpectrum::ZERO)),
            frame: Frame { s: Vec3::X, t: Vec3::Y, n: Vec3::Z },
        }
    }

    /// What stands at `interaction`, wherever it is seen from; `None` where nothing scatters. Without differentials of the
    /// ray, textures are filtered by what the camera would see there.
    #[inline]
    pub fn at(
        world: &'w World,
        camera: &Camera,
        interaction: &Interaction,
        differentials: Option<&RayDifferentials>,
        wavelengths: &mut Wavelengths,
    ) -> Option<Self> {
        let mut shading = Self::black();
        let Interaction { surface, material, .. } = interaction;
        shading.set(world, camera, surface, *material, differentials, wavelengths).then_some(shading)
    }

    /// As [`at`](Self::at), in place, which spares copies. False where nothing scatters.
    #[inline(always)]
    pub fn set(
        &mut self,
        world: &'w World,
        camera: &Camera,
        surface: &SurfacePoint,
        material: MaterialId,
        differentials: Option<&RayDifferentials>,
        wavelengths: &mut Wavelengths,
    ) -> bool {
        let mut material = world.material(material);
        if material.perturbation.is_none()
            && let Some(diffuse) = material.plain(world.textures(), wavelengths)
        {
            // Where it is looked up need not be known.
            self.bsdf = Bsdf::Diffuse(diffuse);
            self.frame = Frame::from_zx(surface.shading_normal, surface.shading_dpdu);
            return true;
        }
        let context = if world.has_varying_textures() {
            context(camera, surface, differentials)
        } else {
            SurfaceContext { position: surface.position, uv: surface.uv, ..Default::default() }
        };
        // A chain of mixes is as long as the scene file made it, and has no circles.
        while let Some(chosen) = material.choose(world.textures(), &context) {
            material = world.material(chosen);
        }
        if !material.set_bsdf(&mut self.bsdf, world.textures(), &context, wavelengths) {
            return false;
        }
        self.frame = Frame::from_zx(surface.shading_normal, surface.shading_dpdu);
        if let Some(perturbation) = &material.perturbation
            && let Some(frame) = perturbed_frame(world, perturbation, surface, &context)
        {
            self.frame = frame;
        }
        true
    }
}

/// The frame of a tilted normal; `None` where it is not finite.
#[inline(never)]
fn perturbed_frame(
    world: &World,
    perturbation: &Perturbation,
    surface: &SurfacePoint,
    context: &SurfaceContext,
) -> Option<Frame> {
    let (dpdu, dpdv) = perturbation.derivatives(world.textures(), surface, context);
    let normal = dpdu.cross(dpdv).normalize();
    if !normal.is_finite() {
        return None;
    }
    let normal = if normal.dot(surface.shading_normal) < 0.0 { -normal } else { normal };
    let normal = if normal.dot(surface.geometric_normal) < 0.0 { -normal } else { normal };
    Some(Frame::from_zx(normal, dpdu.normalize_or_zero()))
}

/// Where textures are looked up, and how far the lookup moves with a pixel.
fn context(camera: &Camera, surface: &SurfacePoint, differentials: Option<&RayDifferentials>) -> SurfaceContext {
    let n = surface.geometric_normal;
    let (dp_dx, dp_dy) = differentials
        .and_then(|d| {
            // Where the neighbouring rays meet the tangent plane.
            let meet = |(origin, direction): (Vec3, Vec3)| {
                let cos = n.dot(direction);
                let t = n.dot(surface.position - origin) / cos;
                (cos != 0.0 && t.is_finite()).then(|| origin + direction * t - surface.position)
            };
            Some((meet(d.x)?, meet(d.y)?))
        })
        .unwrap_or_else(|| camera.approximate_footprint(surface.position, n, surface.time));
    let (dp_dx, dp_dy) = (dp_dx * FOOTPRINT_SCALE, dp_dy * FOOTPRINT_SCALE);
    let [duv_dx, duv_dy] = parameters_along(surface, [dp_dx, dp_dy]);
    SurfaceContext { position: surface.position, uv: surface.uv, dp_dx, dp_dy, duv_dx, duv_dy }
}

/// The changes of (u, v) that move the point by each `dp`, in the least-squares sense; zero where the parametrisation is
/// degenerate.
fn parameters_along(surface: &SurfacePoint, dp: [Vec3; 2]) -> [Vec2; 2] {
    let (u, v) = (surface.dpdu, surface.dpdv);
    let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
    let determinant = uu * vv - uv * uv;
    let along = |dp: Vec3| {
        let (bu, bv) = (u.dot(dp), v.dot(dp));
        let solution = Vec2::new(vv * bu - uv * bv, uu * bv - uv * bu) / determinant;
        if solution.is_finite() { solution.clamp(Vec2::splat(-1e8), Vec2::splat(1e8)) } else { Vec2::ZERO }
    };
    [along(dp[0]), along(dp[1])]
}
