//! The world: everything that light meets, ready to be asked.

mod build;
mod statistics;

pub use build::{Loaded, build};
pub use statistics::{ShapeCount, WorldStatistics};

use crate::chance::chance_of_ray;
use crate::light::{AreaLight, Combination, Emission, EmittedSpectrum, Light, LightContext, LightSelection, Target};
use crate::material::{Material, MaterialId};
use crate::texture::{FloatTextureId, SurfaceContext, Textures};
use glam::Vec3;
use luz_geometry::{Accelerator, Hit, PrimitiveId, Ray, SurfacePoint};

/// How much of a shadow ray counts: it ends just before the light.
const SHADOW_END: f32 = 0.9999;

/// What the world knows of one shape besides its geometry.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShapeInfo {
    pub material: MaterialId,
    /// The light of the shape's first primitive; the others follow.
    pub first_light: Option<u32>,
    /// Coverage; a ray passes where it exceeds a random number.
    pub alpha: Option<FloatTextureId>,
    /// True for shapes without a material of their own: rays pass.
    pub is_interface: bool,
    /// True where the material is a mix with nothing in it: some rays pass.
    pub is_mixed_interface: bool,
}

/// Everything that light meets.
#[derive(Debug)]
pub struct World {
    pub(crate) accelerator: Accelerator,
    pub(crate) shapes: Vec<ShapeInfo>,
    pub(crate) materials: Vec<Material>,
    pub(crate) textures: Textures,
    pub(crate) emissions: Vec<Emission>,
    pub(crate) lights: Vec<Light>,
    pub(crate) infinite_lights: Vec<u32>,
    pub(crate) selection: LightSelection,
    pub(crate) mis_compensation: bool,
    pub(crate) center: Vec3,
    pub(crate) radius: f32,
    pub(crate) has_passages: bool,
    /// Some light shines from a surface that rays pass.
    pub(crate) has_passable_lights: bool,
    pub(crate) has_varying_textures: bool,
    pub(crate) statistics: WorldStatistics,
}

/// A point of a surface that a path has reached, with what stands there.
#[derive(Clone, Copy, Debug)]
pub struct Interaction {
    /// Geometry.
    pub surface: SurfacePoint,
    /// What scatters there.
    pub material: MaterialId,
    /// The light that the primitive is, if it emits.
    pub light: Option<u32>,
}

impl World {
    /// The lights.
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// The numbers of the lights that surround the scene.
    pub fn infinite_lights(&self) -> &[u32] {
        &self.infinite_lights
    }

    /// How a light is chosen.
    pub fn light_selection(&self) -> &LightSelection {
        &self.selection
    }

    /// The textures.
    pub fn textures(&self) -> &Textures {
        &self.textures
    }

    /// True if some texture varies over a surface, so that lookups need a footprint.
    pub fn has_varying_textures(&self) -> bool {
        self.has_varying_textures
    }

    /// A material.
    pub fn material(&self, id: MaterialId) -> &Material {
        &self.materials[id.index()]
    }

    /// The geometry.
    pub fn accelerator(&self) -> &Accelerator {
        &self.accelerator
    }

    /// Centre and radius of a sphere around all shapes.
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        (self.center, self.radius)
    }

    /// What is inside.
    pub fn statistics(&self) -> &WorldStatistics {
        &self.statistics
    }

    /// What lights are asked with, when the directions they draw are combined as `combination` says.
    #[inline]
    pub fn light_context<'a>(&'a self, emitted: &'a EmittedSpectrum, combination: Combination) -> LightContext<'a> {
        // Without compensation lights draw as if they were alone.
        let combination = if self.mis_compensation { combination } else { Combination::Alone };
        LightContext {
            accelerator: &self.accelerator,
            emissions: &self.emissions,
            textures: &self.textures,
            emitted,
            combination,
        }
    }

    /// The area light with this number.
    #[inline]
    pub fn area_light(&self, light: u32) -> Option<&AreaLight> {
        match &self.lights[light as usize] {
            Light::Area(area) => Some(area),
            _ => None,
        }
    }

    /// The first surface along a ray, holes in alpha masks excepted.
    #[inline(always)]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        if self.has_passages {
            self.accelerator.closest_hit_filtered(ray, |hit| self.stops_path(ray, hit))
        } else {
            self.accelerator.closest_hit(ray)
        }
    }

    /// What stands where a ray has hit.
    #[inline]
    pub fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction {
        let (material, light) = self.identity(hit);
        Interaction { surface: self.accelerator.surface(ray, hit), material, light }
    }

    /// What a ray has hit: the material, and which light, if it emits.
    #[inline]
    pub(crate) fn identity(&self, hit: &Hit) -> (MaterialId, Option<u32>) {
        let shape = &self.shapes[hit.shape as usize];
        (shape.material, shape.first_light.map(|first| first + hit.primitive))
    }

    /// True if nothing stands between a surface point and a target in the unit direction `direction`.
    #[inline(always)]
    pub fn is_visible(&self, from: &SurfacePoint, direction: Vec3, target: Target) -> bool {
        self.is_clear(from.offset_origin(direction), direction, target, from.time, from.primitive_id())
    }

    /// True if nothing stands between a point that is clear of all surfaces, if only just of the primitive that the ray leaves,
    /// and a target in the unit direction `direction`.
    #[inline(always)]
    pub(crate) fn is_clear(
        &self,
        origin: Vec3,
        direction: Vec3,
        target: Target,
        time: f32,
        leaves: PrimitiveId,
    ) -> bool {
        let (direction, t_max) = match target {
            Target::Infinity => (direction, f32::INFINITY),
            Target::Point(position) => (position - origin, SHADOW_END),
        };
        let ray = Ray { origin, direction, t_max, time, leaves };
        !if self.has_passages {
            self.accelerator.any_hit_filtered(&ray, |hit| self.stops_shadow(&ray, hit))
        } else {
            self.accelerator.any_hit(&ray)
        }
    }

    fn stops_path(&self, ray: &Ray, hit: &Hit) -> bool {
        let shape = &self.shapes[hit.shape as usize];
        // An emitting interface must be found to be seen, though the path then goes on behind it.
        (!shape.is_interface || shape.first_light.is_some()) && self.is_covered(shape.alpha, ray, hit)
    }

    fn stops_shadow(&self, ray: &Ray, hit: &Hit) -> bool {
        let shape = &self.shapes[hit.shape as usize];
        !shape.is_interface
            && self.is_covered(shape.alpha, ray, hit)
            && !(shape.is_mixed_interface && self.mix_lets_pass(shape.material, ray, hit))
    }

    /// Whether a mix stands for an interface where a ray meets it, by the choice that a path would make there.
    fn mix_lets_pass(&self, material: MaterialId, ray: &Ray, hit: &Hit) -> bool {
        let surface = self.accelerator.surface(ray, hit);
        let context = SurfaceContext { position: surface.position, uv: surface.uv, ..Default::default() };
        let mut material = self.material(material);
        while let Some(chosen) = material.choose(&self.textures, &context) {
            material = self.material(chosen);
        }
        !material.always_scatters()
    }

    /// Stochastic alpha: whether a hit counts is a pure function of the ray, so that results stay reproducible.
    fn is_covered(&self, alpha: Option<FloatTextureId>, ray: &Ray, hit: &Hit) -> bool {
        let Some(alpha) = alpha else { return true };
        let surface = self.accelerator.surface(ray, hit);
        let context = SurfaceContext { position: surface.position, uv: surface.uv, ..Default::default() };
        let alpha = self.textures.float(alpha, &context);
        alpha >= 1.0 || (alpha > 0.0 && chance_of_ray(ray.origin, ray.direction) < alpha)
    }
}
