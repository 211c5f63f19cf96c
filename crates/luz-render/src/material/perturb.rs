//! What tilts the shading normal: displacement ("bump") and normal maps.

use crate::texture::{FloatTextureId, Pyramid, SurfaceContext, Textures};
use glam::{Vec2, Vec3};
use luz_geometry::{Frame, SurfacePoint};
use std::sync::Arc;

/// A tangent-space normal map: components in `[0, 1]` stand for `[−1, 1]`.
#[derive(Clone, Debug)]
pub struct NormalMap {
    /// The texels.
    pub pyramid: Arc<Pyramid<3>>,
}

/// What tilts the shading normal.
#[derive(Clone, Debug)]
pub enum Perturbation {
    /// A displacement along the normal whose slope is seen, not its parallax (Blinn 1978, "Simulation of Wrinkled
    /// Surfaces").
    Displacement(FloatTextureId),
    /// Normals out of an image.
    NormalMap(NormalMap),
}

impl Perturbation {
    /// The derivatives of the perturbed surface, whose cross product is its normal.
    pub(crate) fn derivatives(
        &self,
        textures: &Textures,
        surface: &SurfacePoint,
        context: &SurfaceContext,
    ) -> (Vec3, Vec3) {
        match self {
            Self::Displacement(texture) => displaced(|c| textures.float(*texture, c), surface, context),
            Self::NormalMap(map) => {
                let texel = map.pyramid.finest(Vec2::new(surface.uv.x, 1.0 - surface.uv.y));
                let local = Vec3::from(texel) * 2.0 - 1.0;
                let frame = Frame::from_zx(surface.shading_normal, surface.shading_dpdu.normalize());
                let normal = frame.to_world(local.try_normalize().unwrap_or(Vec3::Z));
                // The tangents keep their lengths and turn with the normal.
                let u = (surface.shading_dpdu - normal * normal.dot(surface.shading_dpdu)).normalize_or_zero();
                let v = normal.cross(u);
                (u * surface.shading_dpdu.length(), v * surface.shading_dpdv.length())
            }
        }
    }
}

/// Forward differences over half the lookup's footprint.
fn displaced(
    displacement: impl Fn(&SurfaceContext) -> f32,
    surface: &SurfacePoint,
    context: &SurfaceContext,
) -> (Vec3, Vec3) {
    let step = |footprint: f32| if footprint > 0.0 { 0.5 * footprint } else { 0.0005 };
    let footprint = context.duv_dx.abs() + context.duv_dy.abs();
    let (du, dv) = (step(footprint.x), step(footprint.y));
    let moved = |along: Vec3, uv: Vec2| {
        displacement(&SurfaceContext { position: context.position + along, uv: context.uv + uv, ..*context })
    };
    let here = displacement(context);
    let slope_u = (moved(surface.shading_dpdu * du, Vec2::new(du, 0.0)) - here) / du;
    let slope_v = (moved(surface.shading_dpdv * dv, Vec2::new(0.0, dv)) - here) / dv;
    let n = surface.shading_normal;
    (surface.shading_dpdu + n * slope_u + surface.dndu * here, surface.shading_dpdv + n * slope_v + surface.dndv * here)
}
