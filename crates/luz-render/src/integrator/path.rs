//! Unidirectional path tracing with next-event estimation.
//!
//! Kajiya 1986, "The Rendering Equation"; direct light is found both by drawing points on lights and by following the
//! BSDF, combined by multiple importance sampling (Veach and Guibas 1995).

use crate::bsdf::{Bsdf, BsdfSample, TransportMode};
use crate::camera::{Camera, RayDifferentials};
use crate::film::Features;
use crate::light::{Combination, EmittedSpectrum, LightContext};
use crate::material::Shading;
use crate::world::{Interaction, World};
use glam::{Vec2, Vec3};
use luz_color::{SampledSpectrum, Wavelengths};
use luz_geometry::{Ray, Reference, SurfacePoint};
use luz_sample::Samples;
use luz_sample::mis::Heuristic;
use std::fmt;
use std::str::FromStr;

/// Which techniques look for direct light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Technique {
    /// Only points drawn on lights (and what only the BSDF can find: light seen directly or through specular chains).
    Light,
    /// Only directions drawn from the BSDF (and what only lights can find: those without extent).
    Bsdf,
    /// Both, combined by the heuristic.
    #[default]
    Both,
}

impl FromStr for Technique {
    type Err = String;
    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "light" => Ok(Self::Light),
            "bsdf" => Ok(Self::Bsdf),
            "both" => Ok(Self::Both),
            _ => Err(format!("unknown technique `{name}`; known are light, bsdf, both")),
        }
    }
}

impl fmt::Display for Technique {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Light => "light",
            Self::Bsdf => "bsdf",
            Self::Both => "both",
        })
    }
}

/// The path tracer's settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathIntegrator {
    /// The longest path: how many times light may scatter before it reaches the camera.
    pub max_depth: u32,
    /// How the two techniques are weighted.
    pub heuristic: Heuristic,
    /// Which techniques are used.
    pub technique: Technique,
    /// Roughens near-specular BSDFs after the first non-specular bounce.
    pub regularize: bool,
}

/// What one path cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PathCost {
    /// Rays that asked for the closest hit.
    pub rays: u32,
    /// Rays that asked for any hit.
    pub shadow_rays: u32,
}

/// Dimensions drawn before the first bounce: wavelength (1), film (2), lens (2), time (1).
pub const CAMERA_DIMENSIONS: u32 = 6;
/// Dimensions of one bounce: which light and where on it (2), which lobe (1), direction (2), roulette (1).
pub const BOUNCE_DIMENSIONS: u32 = 6;
/// Paths shorter than this go on without roulette: what it saves early costs more in noise, stratified samples above all.
const ROULETTE_DEPTH: u32 = 5;
/// Even a path that has lost nothing ends at some time.
const MAX_SURVIVAL: f32 = 0.95;
/// How often a path may pass through surfaces that do not scatter.
const MAX_PASSAGES: u32 = 1000;

/// The vertex a path has left last: what multiple importance sampling needs to know of it.
struct Departure {
    reference: Reference,
    /// Density of the direction in solid angle; `None` after the camera and after specular scattering, which light
    /// sampling cannot imitate.
    pdf: Option<f32>,
}

impl PathIntegrator {
    /// The radiance that arrives against `ray`, at `wavelengths` (of which all but one are given up at a dispersive
    /// surface). `differentials` belong to `ray`; `features` receive what the ray meets first.
    pub fn radiance<S: Samples>(
        &self,
        world: &World,
        camera: &Camera,
        mut ray: Ray,
        differentials: Option<&RayDifferentials>,
        wavelengths: &mut Wavelengths,
        samples: &mut S,
        mut features: Option<&mut FeatureSink<'_>>,
        cost: &mut PathCost,
    ) -> SampledSpectrum {
        let emitted = EmittedSpectrum::default();
        let lights = world.light_context(&emitted, self.combination());
        let mut radiance = SampledSpectrum::ZERO;
        let mut throughput = SampledSpectrum::ONE;
        let mut eta_scale = 1.0;
        let mut departure = Departure { reference: Reference::point(ray.origin), pdf: None };
        let mut depth = 0;
        let mut passages = 0;
        let mut has_scattered = false;
        loop {
            cost.rays += 1;
            let Some(hit) = world.intersect(&ray) else {
                radiance += throughput * self.infinite_light(world, lights, &departure, ray.direction, wavelengths);
                break;
            };
            let interaction = world.interaction(&ray, &hit);
            radiance += throughput * self.emission_at(world, lights, &departure, &ray, &interaction, wavelengths);
            if depth == self.max_depth && features.is_none() && world.material(interaction.material).always_scatters() {
                break;
            }
            let seen = if depth == 0 { differentials } else { None };
            let shading = Shading::at(world, camera, &interaction, -ray.direction, seen, wavelengths);
            let Some(mut shading) = shading else {
                // Nothing scatters here: the path goes on behind, as if it had met nothing.
                passages += 1;
                if passages > MAX_PASSAGES {
                    break;
                }
                ray.origin = interaction.surface.offset_origin(ray.direction);
                continue;
            };
            let outgoing = -ray.direction;
            if let Some(sink) = features.take() {
                sink.record(&ray, &interaction.surface, &shading, outgoing, wavelengths);
            }
            if depth == self.max_depth {
                break;
            }
            if self.regularize && has_scattered {
                shading.bsdf.regularize();
            }
            samples.set_dimension(CAMERA_DIMENSIONS + BOUNCE_DIMENSIONS * depth);
            depth += 1;
            let light_u = samples.next_2d();
            let bsdf_u = (samples.next_1d(), samples.next_2d());
            if !world.lights().is_empty() && shading.bsdf.flags().has_non_specular() {
                radiance += throughput
                    * self.direct_light(
                        world,
                        lights,
                        &interaction.surface,
                        &shading,
                        outgoing,
                        light_u,
                        wavelengths,
                        cost,
                    );
            }

            let wo = shading.frame.to_local(outgoing);
            let Some(sample) = shading.bsdf.sample(wo, bsdf_u.0, bsdf_u.1, TransportMode::Radiance) else { break };
            let direction = shading.frame.to_world(sample.wi).normalize();
            throughput *= sample.f * (sample.wi.z.abs() / sample.pdf);
            if !throughput.is_finite() {
                // The film counts it, and says so.
                return SampledSpectrum::splat(f32::NAN);
            }
            departure = Departure {
                reference: Reference::surface(interaction.surface.position, shading.frame.n),
                pdf: departure_pdf(&shading.bsdf, wo, &sample),
            };
            has_scattered |= !sample.flags.is_specular();
            if sample.flags.is_transmission() {
                // Radiance is compressed on entering a denser medium, to be spread again on leaving it: roulette looks
                // at the path without this detour.
                eta_scale *= sample.eta * sample.eta;
            }
            ray = Ray::new(interaction.surface.offset_origin(direction), direction, ray.time);

            let survival = (throughput * eta_scale).max_component();
            if depth >= ROULETTE_DEPTH {
                let survival = survival.min(MAX_SURVIVAL);
                if samples.next_1d() >= survival {
                    break;
                }
                throughput *= 1.0 / survival;
            }
        }
        radiance
    }

    /// What the directions that lights draw are combined with.
    fn combination(&self) -> Combination {
        match self.technique {
            Technique::Both => Combination::WithBsdf,
            Technique::Light | Technique::Bsdf => Combination::Alone,
        }
    }

    /// The share of a light that was found by following the BSDF, when light sampling would have found it with density
    /// `light_pdf`.
    fn bsdf_weight(&self, departure: &Departure, light_pdf: impl FnOnce() -> f32) -> f32 {
        match (departure.pdf, self.technique) {
            (None, _) | (_, Technique::Bsdf) => 1.0,
            (_, Technique::Light) => 0.0,
            (Some(pdf), Technique::Both) => self.heuristic.weight2(1.0, pdf, 1.0, light_pdf()),
        }
    }

    fn infinite_light(
        &self,
        world: &World,
        lights: LightContext<'_>,
        departure: &Departure,
        direction: Vec3,
        wavelengths: &Wavelengths,
    ) -> SampledSpectrum {
        let mut sum = SampledSpectrum::ZERO;
        for &number in world.infinite_lights() {
            let light = &world.lights()[number as usize];
            let reference = &departure.reference;
            let weight = self.bsdf_weight(departure, || {
                world.light_selection().probability(lights.combination, reference, number as usize)
                    * light.pdf_infinite(lights, reference, direction)
            });
            if weight > 0.0 {
                sum += light.radiance_infinite(reference, direction, wavelengths) * weight;
            }
        }
        sum
    }

    fn emission_at(
        &self,
        world: &World,
        lights: LightContext<'_>,
        departure: &Departure,
        ray: &Ray,
        interaction: &Interaction,
        wavelengths: &Wavelengths,
    ) -> SampledSpectrum {
        let Some(number) = interaction.light else { return SampledSpectrum::ZERO };
        let Some(light) = world.area_light(number) else { return SampledSpectrum::ZERO };
        let surface = &interaction.surface;
        let emitted = lights.radiance(light, surface.geometric_normal, surface.uv, -ray.direction, wavelengths);
        if emitted.is_black() {
            return emitted;
        }
        let reference = &departure.reference;
        let weight = self.bsdf_weight(departure, || {
            world.light_selection().probability(lights.combination, reference, number as usize)
                * light.pdf(lights, reference, surface)
        });
        emitted * weight
    }

    /// One light, one point on it.
    fn direct_light(
        &self,
        world: &World,
        lights: LightContext<'_>,
        surface: &SurfacePoint,
        shading: &Shading,
        outgoing: Vec3,
        u: Vec2,
        wavelengths: &Wavelengths,
        cost: &mut PathCost,
    ) -> SampledSpectrum {
        let black = SampledSpectrum::ZERO;
        // One pair of numbers chooses the light and the point on it, so that the points of all lights together are
        // stratified: the triangles of a lamp share one pattern.
        let reference = Reference::surface(surface.position, shading.frame.n);
        let chosen = world.light_selection().sample(lights.combination, &reference, u.x);
        let Some((number, probability, u_x)) = chosen else { return black };
        let u = Vec2::new(u_x, u.y);
        let light = &world.lights()[number];
        let Some(arriving) = light.sample(lights, &reference, u, wavelengths) else { return black };
        if self.technique == Technique::Bsdf && !arriving.is_delta {
            return black;
        }
        let wo = shading.frame.to_local(outgoing);
        let wi = shading.frame.to_local(arriving.direction);
        let (f, bsdf_pdf) = shading.bsdf.evaluate(wo, wi, TransportMode::Radiance);
        let f = f * wi.z.abs();
        if f.is_black() {
            return black;
        }
        cost.shadow_rays += 1;
        if !world.is_visible(surface, arriving.direction, arriving.target) {
            return black;
        }
        let pdf = probability * arriving.pdf;
        let weight = if arriving.is_delta || self.technique == Technique::Light {
            1.0
        } else {
            self.heuristic.weight2(1.0, pdf, 1.0, bsdf_pdf)
        };
        f * arriving.radiance * (weight / pdf)
    }
}

/// The density by which multiple importance sampling judges a direction drawn from a BSDF.
fn departure_pdf(bsdf: &Bsdf, wo: Vec3, sample: &BsdfSample) -> Option<f32> {
    if sample.flags.is_specular() {
        None
    } else if sample.pdf_is_proportional {
        Some(bsdf.pdf(wo, sample.wi, TransportMode::Radiance))
    } else {
        Some(sample.pdf)
    }
}

/// Takes down what a camera ray meets first.
pub struct FeatureSink<'a> {
    features: &'a mut Features,
    to_rgb: &'a dyn Fn(SampledSpectrum, &Wavelengths) -> [f32; 3],
}

impl<'a> FeatureSink<'a> {
    /// Writes into `features`; reflectances become colours by `to_rgb`.
    pub fn new(features: &'a mut Features, to_rgb: &'a dyn Fn(SampledSpectrum, &Wavelengths) -> [f32; 3]) -> Self {
        Self { features, to_rgb }
    }

    fn record(
        &mut self,
        ray: &Ray,
        surface: &SurfacePoint,
        shading: &Shading,
        outgoing: Vec3,
        wavelengths: &Wavelengths,
    ) {
        let albedo = shading.bsdf.albedo(shading.frame.to_local(outgoing));
        *self.features = Features {
            albedo: (self.to_rgb)(albedo, wavelengths),
            normal: surface.geometric_normal.to_array(),
            shading_normal: shading.frame.n.to_array(),
            position: surface.position.to_array(),
            depth: surface.position.distance(ray.origin),
        };
    }
}
