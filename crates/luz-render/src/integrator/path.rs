//! Unidirectional path tracing with next-event estimation.
//!
//! Kajiya 1986, "The Rendering Equation"; direct light is found both by drawing points on lights and by following the
//! BSDF, combined by multiple importance sampling (Veach and Guibas 1995).

use super::efficiency::{CAMERA_ACCOUNT, Ledger};
use super::observer::{FoundBy, LightEvent, PathEnd, PathEvent, PathObserver, Vertex};
use super::technique::Technique;
use crate::bsdf::{Bsdf, BsdfSample, TransportMode};
use crate::camera::{Camera, RayDifferentials};
use crate::light::{Combination, EmittedSpectrum, LightContext, LightSample, Target};
use crate::material::Shading;
use crate::world::World;
use glam::{Vec2, Vec3};
use luz_color::{SampledSpectrum, Wavelengths};
use luz_geometry::{Ray, Reference, SurfacePoint, renormalized};
use luz_sample::Samples;
use luz_sample::mis::Heuristic;
use luz_sample::roulette::{Continuations, Limits, Roulette, throughput_survival};

/// The path tracer's settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathIntegrator {
    /// The longest path: how many times light may scatter before it reaches the camera.
    pub max_depth: u32,
    /// How the two techniques are weighted.
    pub heuristic: Heuristic,
    /// Which techniques are used.
    pub technique: Technique,
    /// How paths end before they are longest.
    pub roulette: Roulette,
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
/// The place of the direction among them.
const DIRECTION_DIMENSION: u32 = 3;
/// The place of roulette among them.
const ROULETTE_DIMENSION: u32 = 5;
/// The branches of a split path draw from dimensions that are so far apart.
const BRANCH_DIMENSIONS: u32 = BOUNCE_DIMENSIONS << 12;
/// Paths shorter than this go on without roulette by throughput: what it saves early costs more in noise, stratified
/// samples above all.
const ROULETTE_DEPTH: u32 = 5;
/// Paths that have so many branches still to be followed are not split any more.
const MAX_BRANCHES: usize = 256;
/// How often a path may pass through surfaces that do not scatter.
const MAX_PASSAGES: u32 = 1000;

/// The vertex a path has left last: what multiple importance sampling needs to know of it.
#[derive(Clone, Copy)]
struct Departure {
    reference: Reference,
    /// Density of the direction in solid angle; `None` after the camera and after specular scattering, which light
    /// sampling cannot imitate.
    pdf: Option<f32>,
    /// May direct light be left to the observer? It may at the first vertex, where densities are exact.
    is_offered: bool,
}

/// The growing end of a path.
#[derive(Clone, Copy)]
struct Branch {
    ray: Ray,
    throughput: SampledSpectrum,
    /// Radiance is compressed on entering a denser medium, to be spread again on leaving it: roulette looks at the path
    /// without this detour.
    eta_scale: f32,
    departure: Departure,
    depth: u32,
    passages: u32,
    has_scattered: bool,
    /// The first of the dimensions that this branch draws from.
    dimension: u32,
    /// Where the ledger, if there is one, enters what is found.
    account: u32,
}

impl Branch {
    /// The first dimension of the bounce to come.
    #[inline(always)]
    fn bounce_dimension(&self) -> u32 {
        self.dimension.wrapping_add(BOUNCE_DIMENSIONS.wrapping_mul(self.depth))
    }
}

/// A path tracer at work: its settings, and where light goes.
#[derive(Clone, Copy)]
pub struct PathTracer<'a> {
    /// How paths are traced.
    pub settings: &'a PathIntegrator,
    /// What they meet.
    pub world: &'a World,
    /// Where they begin.
    pub camera: &'a Camera,
    /// What lights are drawn for.
    pub combination: Combination,
}

impl PathTracer<'_> {
    /// The radiance that arrives against `ray`, at `wavelengths` (of which all but one are given up at a dispersive
    /// surface). `differentials` belong to `ray`. Roulette by efficiency needs a ledger, and is that by throughput without.
    pub fn radiance<S: Samples, O: PathObserver>(
        &self,
        ray: Ray,
        differentials: Option<&RayDifferentials>,
        wavelengths: &mut Wavelengths,
        samples: &mut S,
        observer: &mut O,
        ledger: Option<Ledger<'_>>,
        cost: &mut PathCost,
    ) -> SampledSpectrum {
        let emitted = EmittedSpectrum::default();
        let lights = self.world.light_context(&emitted, self.combination);
        let mut walk = Walk {
            tracer: *self,
            lights,
            wavelengths,
            samples,
            observer,
            ledger,
            cost,
            radiance: SampledSpectrum::ZERO,
            waiting: Vec::new(),
            splits: 0,
        };
        let mut branch = Branch {
            ray,
            throughput: SampledSpectrum::ONE,
            eta_scale: 1.0,
            departure: Departure { reference: Reference::point(ray.origin), pdf: None, is_offered: false },
            depth: 0,
            passages: 0,
            has_scattered: false,
            dimension: CAMERA_DIMENSIONS,
            account: CAMERA_ACCOUNT,
        };
        // (For all vertices, one after the other.)
        let mut shading = Shading::black();
        loop {
            if let Err(end) = walk.step(&mut branch, &mut shading, differentials) {
                walk.observe(PathEvent::End(end));
                if end == PathEnd::NotFinite {
                    // The film counts it, and says so.
                    return SampledSpectrum::splat(f32::NAN);
                }
                match walk.waiting.pop() {
                    Some(next) => branch = next,
                    None => break,
                }
            }
        }
        let Walk { ledger, radiance, .. } = walk;
        if let Some(ledger) = ledger {
            ledger.close();
        }
        radiance
    }
}

/// One path, with all its branches.
struct Walk<'a, S, O> {
    tracer: PathTracer<'a>,
    lights: LightContext<'a>,
    wavelengths: &'a mut Wavelengths,
    samples: &'a mut S,
    observer: &'a mut O,
    ledger: Option<Ledger<'a>>,
    cost: &'a mut PathCost,
    radiance: SampledSpectrum,
    /// Branches that are still to be followed.
    waiting: Vec<Branch>,
    /// How often the path has been split.
    splits: u32,
}

impl<'a, S: Samples, O: PathObserver> Walk<'a, S, O> {
    #[inline(always)]
    fn observe(&mut self, event: PathEvent<'_>) {
        self.observer.observe(event, self.wavelengths);
    }

    #[inline(always)]
    fn enter(&mut self, account: u32, light: SampledSpectrum, rays: u32) {
        if let Some(ledger) = &mut self.ledger {
            ledger.enter(account, light, rays);
        }
    }

    /// Follows a branch to the next surface and beyond.
    #[inline(always)]
    fn step(
        &mut self,
        branch: &mut Branch,
        shading: &mut Shading<'a>,
        differentials: Option<&RayDifferentials>,
    ) -> Result<(), PathEnd> {
        let PathTracer { settings, world, camera, .. } = self.tracer;
        self.cost.rays += 1;
        self.enter(branch.account, SampledSpectrum::ZERO, 1);
        self.observe(PathEvent::Ray { ray: &branch.ray, depth: branch.depth, throughput: branch.throughput });
        let Some(hit) = world.intersect(&branch.ray) else {
            self.infinite_light(branch);
            return Err(PathEnd::Escaped);
        };
        let surface = world.accelerator().surface(&branch.ray, &hit);
        let (material, light) = world.identity(&hit);
        if let Some(light) = light {
            self.emission_at(branch, &surface, light);
        }
        let is_last = branch.depth == settings.max_depth;
        if is_last && !self.observer.wants_vertex() && world.material(material).always_scatters() {
            return Err(PathEnd::MaxDepth);
        }
        let outgoing = -branch.ray.direction;
        let seen = if branch.depth == 0 { differentials } else { None };
        if !shading.set(world, camera, &surface, material, seen, self.wavelengths) {
            // Nothing scatters here: the path goes on behind, as if it had met nothing.
            self.observe(PathEvent::Passage { surface: &surface });
            branch.passages += 1;
            branch.ray = surface.leave(branch.ray.direction);
            return if branch.passages > MAX_PASSAGES { Err(PathEnd::TooManyPassages) } else { Ok(()) };
        }
        self.observe(PathEvent::Vertex(Vertex {
            depth: branch.depth,
            ray: &branch.ray,
            surface: &surface,
            shading,
            outgoing,
        }));
        if is_last {
            return Err(PathEnd::MaxDepth);
        }
        if settings.regularize && branch.has_scattered {
            shading.bsdf.regularize();
        }
        if self.ledger.is_none() {
            return self.scatter(branch, &surface, shading, true);
        }
        self.split(branch, &surface, shading)
    }

    /// Goes on from a vertex as often as it is worth the rays.
    fn split(&mut self, branch: &mut Branch, surface: &SurfacePoint, shading: &Shading<'_>) -> Result<(), PathEnd> {
        let known = self.ledger.as_ref().and_then(|ledger| ledger.expected(surface, branch.throughput));
        let Continuations { count, weight } = match known {
            Some(expected) => {
                let expected = if self.waiting.len() < MAX_BRANCHES { expected } else { expected.min(1.0) };
                self.samples.set_dimension(branch.bounce_dimension().wrapping_add(ROULETTE_DIMENSION));
                let drawn = Continuations::draw(expected, self.samples.next_1d());
                self.observe(PathEvent::Roulette { expected, continuations: drawn.count });
                drawn
            }
            None => Continuations::ONE,
        };
        let mut parent = *branch;
        parent.throughput *= weight;
        let mut end = PathEnd::Roulette;
        let mut last = None;
        for i in 0..count {
            if i > 0 {
                self.splits = self.splits.wrapping_add(1);
                parent.dimension = CAMERA_DIMENSIONS.wrapping_add(BRANCH_DIMENSIONS.wrapping_mul(self.splits));
            }
            if let Some(ledger) = &mut self.ledger {
                parent.account = ledger.open(branch.account, surface, parent.throughput);
            }
            let mut child = parent;
            match self.scatter(&mut child, surface, shading, known.is_none()) {
                Ok(()) => self.waiting.extend(last.replace(child)),
                Err(PathEnd::NotFinite) => return Err(PathEnd::NotFinite),
                Err(why) => end = why,
            }
        }
        *branch = last.ok_or(end)?;
        Ok(())
    }

    /// Looks for direct light at a vertex, and sends the branch on from it, unless roulette by throughput ends the path.
    #[inline(always)]
    fn scatter(
        &mut self,
        branch: &mut Branch,
        surface: &SurfacePoint,
        shading: &Shading<'_>,
        may_end: bool,
    ) -> Result<(), PathEnd> {
        let first_dimension = branch.bounce_dimension();
        self.samples.set_dimension(first_dimension);
        let light_u = self.samples.next_2d();
        let lobe_u = if shading.bsdf.has_choices() { self.samples.next_1d() } else { 0.0 };
        self.samples.set_dimension(first_dimension.wrapping_add(DIRECTION_DIMENSION));
        let direction_u = self.samples.next_2d();
        let wo = shading.frame.to_local(-branch.ray.direction);
        // Drawn before light is looked for, for the processor to do both at once.
        let sample = shading.bsdf.sample(wo, lobe_u, direction_u, TransportMode::Radiance);
        if !self.tracer.world.lights().is_empty() && shading.bsdf.flags().has_non_specular() {
            self.direct_light(branch, surface, shading, wo, light_u);
        }
        let Some(sample) = sample else { return Err(PathEnd::Absorbed) };
        let direction = renormalized(shading.frame.to_world(sample.wi));
        let mut throughput = branch.throughput * (sample.f * (sample.wi.z.abs() / sample.pdf));
        self.observe(PathEvent::Scatter { sample, direction, throughput });
        if !throughput.is_finite() {
            return Err(PathEnd::NotFinite);
        }
        let depth = branch.depth + 1;
        let eta_scale =
            if sample.flags.is_transmission() { branch.eta_scale * sample.eta * sample.eta } else { branch.eta_scale };
        if may_end && depth >= ROULETTE_DEPTH && self.tracer.settings.roulette != Roulette::None {
            self.samples.set_dimension(first_dimension.wrapping_add(ROULETTE_DIMENSION));
            let expected = throughput_survival((throughput * eta_scale).max_component(), &Limits::ROULETTE);
            let Continuations { count, weight } = Continuations::draw(expected, self.samples.next_1d());
            self.observe(PathEvent::Roulette { expected, continuations: count });
            if count == 0 {
                return Err(PathEnd::Roulette);
            }
            throughput *= weight;
        }
        branch.departure = Departure {
            reference: Reference::surface(surface.position, shading.frame.n),
            pdf: departure_pdf(&shading.bsdf, wo, &sample),
            is_offered: is_offered(branch, shading),
        };
        branch.ray = surface.leave(direction);
        (branch.throughput, branch.eta_scale, branch.depth) = (throughput, eta_scale, depth);
        branch.has_scattered |= !sample.flags.is_specular();
        Ok(())
    }

    /// Adds light that the BSDF has found, which light sampling would have found with density `light_pdf`.
    #[inline(always)]
    fn add_found(
        &mut self,
        branch: &Branch,
        emitted: SampledSpectrum,
        is_offered: bool,
        light_pdf: impl FnOnce(&Self) -> f32,
    ) {
        let alone = branch.throughput * emitted;
        let (weight, light_pdf) = match (branch.departure.pdf, self.tracer.settings.technique) {
            (None, _) => (1.0, None),
            (_, Technique::Bsdf) => (1.0, None),
            (_, Technique::Light) => (0.0, None),
            (Some(pdf), Technique::Both) => {
                let light_pdf = light_pdf(self);
                if is_offered && self.observer.take_direct(FoundBy::Bsdf, alone * pdf, light_pdf, pdf) {
                    return;
                }
                (self.tracer.settings.heuristic.weight2(1.0, pdf, 1.0, light_pdf), Some(light_pdf))
            }
        };
        self.observe(PathEvent::Light(LightEvent {
            found_by: FoundBy::Bsdf,
            depth: branch.depth,
            alone,
            weight,
            light_pdf,
            bsdf_pdf: branch.departure.pdf,
        }));
        self.enter(branch.account, alone * weight, 0);
        self.radiance += alone * weight;
    }

    fn infinite_light(&mut self, branch: &Branch) {
        let PathTracer { world, .. } = self.tracer;
        let direction = branch.ray.direction;
        let reference = &branch.departure.reference;
        for &number in world.infinite_lights() {
            let light = &world.lights()[number as usize];
            let emitted = light.radiance_infinite(reference, direction, self.wavelengths);
            if !emitted.is_black() {
                // A direction meets all of several infinite lights, but offers one technique's sample at most.
                let is_offered = branch.departure.is_offered && world.infinite_lights().len() == 1;
                self.add_found(branch, emitted, is_offered, |walk| {
                    world.light_selection().probability(walk.lights.combination, reference, number as usize)
                        * light.pdf_infinite(walk.lights, reference, direction)
                });
            }
        }
    }

    #[inline(always)]
    fn emission_at(&mut self, branch: &Branch, surface: &SurfacePoint, number: u32) {
        let world = self.tracer.world;
        let Some(light) = world.area_light(number) else { return };
        let toward = -branch.ray.direction;
        let emitted = self.lights.radiance(light, surface.geometric_normal, surface.uv, toward, self.wavelengths);
        if !emitted.is_black() {
            let reference = &branch.departure.reference;
            self.add_found(branch, emitted, branch.departure.is_offered, |walk| {
                world.light_selection().probability(walk.lights.combination, reference, number as usize)
                    * light.pdf(walk.lights, reference, surface)
            });
        }
    }

    /// One light, one point on it.
    #[inline(always)]
    fn direct_light(&mut self, branch: &Branch, surface: &SurfacePoint, shading: &Shading<'_>, wo: Vec3, u: Vec2) {
        let PathTracer { settings, world, .. } = self.tracer;
        // One pair of numbers chooses the light and the point on it, so that the points of all lights together are
        // stratified: the triangles of a lamp share one pattern.
        let reference = Reference::surface(surface.position, shading.frame.n);
        let chosen = world.light_selection().sample(self.lights.combination, &reference, u.x);
        let Some((number, probability, u_x)) = chosen else { return };
        let light = &world.lights()[number];
        let u = Vec2::new(u_x, u.y);
        let Some(arriving) = light.sample(self.lights, &reference, u, self.wavelengths) else { return };
        let LightSample { radiance, direction, target, pdf: light_pdf, is_delta } = arriving;
        if settings.technique == Technique::Bsdf && !is_delta {
            return;
        }
        let wi = shading.frame.to_local(direction);
        let (f, bsdf_pdf) = shading.bsdf.evaluate(wo, wi, TransportMode::Radiance);
        let f = f * wi.z.abs();
        if f.is_black() {
            return;
        }
        self.cost.shadow_rays += 1;
        self.enter(branch.account, SampledSpectrum::ZERO, 1);
        if !world.is_visible(surface, direction, target) {
            self.observe(PathEvent::Light(LightEvent {
                found_by: FoundBy::Light,
                depth: branch.depth + 1,
                alone: SampledSpectrum::ZERO,
                weight: 1.0,
                light_pdf: Some(probability * light_pdf),
                bsdf_pdf: Some(bsdf_pdf),
            }));
            return;
        }
        let pdf = probability * light_pdf;
        let is_shared = settings.technique == Technique::Both && !is_delta;
        let found = branch.throughput * f * radiance;
        let is_offered = is_shared
            && is_offered(branch, shading)
            && (target != Target::Infinity || world.infinite_lights().len() == 1);
        if is_offered && self.observer.take_direct(FoundBy::Light, found, pdf, bsdf_pdf) {
            return;
        }
        let weight = if is_shared { settings.heuristic.weight2(1.0, pdf, 1.0, bsdf_pdf) } else { 1.0 };
        self.observe(PathEvent::Light(LightEvent {
            found_by: FoundBy::Light,
            depth: branch.depth + 1,
            alone: found * (1.0 / pdf),
            weight,
            light_pdf: Some(pdf),
            bsdf_pdf: is_shared.then_some(bsdf_pdf),
        }));
        self.enter(branch.account, found * (weight / pdf), 0);
        self.radiance += found * (weight / pdf);
    }
}

/// May the direct light of a vertex be left to an observer?
#[inline(always)]
fn is_offered(branch: &Branch, shading: &Shading<'_>) -> bool {
    branch.depth == 0 && shading.bsdf.has_exact_pdf()
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
