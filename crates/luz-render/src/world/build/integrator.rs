//! The integrator out of a scene's description of it, and out of what the caller wishes instead.

use super::Context;
use crate::film::FilmKind;
use crate::integrator::metropolis::{Metropolis, MultiplexedIntegrator, PathSpaceIntegrator, PrimarySpaceIntegrator};
use crate::integrator::{
    BidirectionalIntegrator, BidirectionalTechniques, Integrator, IntegratorKind, PathIntegrator, Technique,
};
use crate::light::LightSampler;
use crate::settings::{MetropolisOverrides, Overrides};
use luz_sample::markov::Kernel;
use luz_sample::mis::Heuristic;
use luz_sample::roulette::Roulette;
use luz_scene::{Diagnostic, Entity};

/// The probability of large steps, if nothing is said: pbrt-v4's.
const LARGE_STEP_PROBABILITY: f64 = 0.3;

pub(super) fn integrator(context: &mut Context<'_>, overrides: &Overrides) -> Integrator {
    let entity = &context.description.integrator;
    let kind = kind(context, entity, overrides);
    let max_depth = max_depth(context, entity, overrides);
    refuse_what_is_for_others(context, kind, overrides);
    if kind != IntegratorKind::Path && entity.parameters.one_bool("regularize", false, context.diagnostics) {
        let span = entity.parameters.span("regularize");
        let warning = Diagnostic::warning(span, format!("`regularize` is not heeded by the integrator `{kind}`"));
        context.diagnostics.push(warning.with_help("path tracing heeds it"));
    }
    let bidirectional = |techniques| BidirectionalIntegrator {
        max_depth,
        techniques,
        heuristic: overrides.heuristic.unwrap_or_default(),
    };
    match kind {
        IntegratorKind::Path => Integrator::Path(path(context, entity, max_depth, overrides)),
        IntegratorKind::Light => Integrator::Light(bidirectional(BidirectionalTechniques::Light)),
        IntegratorKind::Bidirectional => {
            refuse_pictures_of_strategies(context, entity);
            Integrator::Bidirectional(bidirectional(BidirectionalTechniques::All))
        }
        IntegratorKind::PrimarySpace => Integrator::PrimarySpace(PrimarySpaceIntegrator {
            max_depth,
            metropolis: metropolis(context, entity, &overrides.metropolis),
            estimator: overrides.metropolis.estimator.unwrap_or_default(),
            large_step_probability: large_step_probability(context, entity, &overrides.metropolis),
            kernel: kernel(context, entity, &overrides.metropolis),
        }),
        IntegratorKind::Multiplexed => Integrator::Multiplexed(MultiplexedIntegrator {
            max_depth,
            metropolis: metropolis(context, entity, &overrides.metropolis),
            large_step_probability: large_step_probability(context, entity, &overrides.metropolis),
            kernel: kernel(context, entity, &overrides.metropolis),
        }),
        IntegratorKind::PathSpace => {
            let mutations = overrides.metropolis.mutations.unwrap_or_default();
            let ranges = overrides.metropolis.ranges.unwrap_or_default();
            if let Some(problem) = mutations.problem().or_else(|| ranges.problem()) {
                context.diagnostics.error(None, problem);
            }
            Integrator::PathSpace(PathSpaceIntegrator {
                max_depth,
                metropolis: metropolis(context, entity, &overrides.metropolis),
                mutations,
                ranges,
            })
        }
    }
}

/// Mutations per pixel, where a scene of pbrt-v4 asks for Metropolis light transport: there, the sampler's number of samples means
/// nothing.
pub(super) fn mutations_per_pixel(context: &mut Context<'_>, integrator: &Integrator) -> Option<u32> {
    const NAME: &str = "mutationsperpixel";
    let entity = &context.description.integrator;
    if integrator.metropolis().is_none() || &*entity.kind != "mlt" {
        return None;
    }
    let count = entity.parameters.one_integer(NAME, 100, context.diagnostics);
    if count < 1 {
        let span = entity.parameters.span(NAME);
        context.diagnostics.error(span, format!("a picture needs at least one mutation per pixel, not {count}"));
    }
    Some(count.max(1) as u32)
}

/// Where nobody says how many candidates chains are to begin from: so many there are a sixty-fourth of the mutations, and no fewer
/// than pbrt-v4 has. What brightness is wrong by, all pixels are.
pub(super) fn default_bootstrap(integrator: &mut Integrator, entity: &Entity, overrides: &Overrides, mutations: u64) {
    const SHARE: u64 = 64;
    const MOST: u64 = 1 << 22;
    let is_said =
        overrides.metropolis.bootstrap_samples.is_some() || entity.parameters.get("bootstrapsamples").is_some();
    if !is_said && let Some(metropolis) = integrator.metropolis_mut() {
        metropolis.bootstrap_samples = (mutations / SHARE).clamp(metropolis.bootstrap_samples, MOST);
    }
}

/// How lights are chosen.
pub(super) fn light_sampler(context: &mut Context<'_>, overrides: &Overrides) -> LightSampler {
    let parameters = &context.description.integrator.parameters;
    let default = LightSampler::default().to_string();
    let name = parameters.string("lightsampler", context.diagnostics).unwrap_or(&default);
    let named = name.parse().unwrap_or_else(|error: String| {
        context.diagnostics.error(parameters.span("lightsampler"), error);
        LightSampler::default()
    });
    overrides.light_sampler.unwrap_or(named)
}

fn kind(context: &mut Context<'_>, entity: &Entity, overrides: &Overrides) -> IntegratorKind {
    overrides.integrator.or_else(|| IntegratorKind::of_pbrt(&entity.kind)).unwrap_or_else(|| {
        let kind = &entity.kind;
        context.diagnostics.push(
            Diagnostic::error(entity.kind_span, format!("the integrator `{kind}` cannot be rendered yet"))
                .with_help("`--integrator path` renders the scene with path tracing instead"),
        );
        IntegratorKind::Path
    })
}

fn max_depth(context: &mut Context<'_>, entity: &Entity, overrides: &Overrides) -> u32 {
    let max_depth = entity.parameters.one_integer("maxdepth", 5, context.diagnostics);
    if max_depth < 0 {
        let span = entity.parameters.span("maxdepth");
        context.diagnostics.error(span, format!("`maxdepth` must not be negative: {max_depth}"));
    }
    overrides.max_depth.unwrap_or(max_depth.max(0) as u32)
}

fn path(context: &mut Context<'_>, entity: &Entity, max_depth: u32, overrides: &Overrides) -> PathIntegrator {
    if overrides.heuristic == Some(Heuristic::Optimal) && overrides.technique_images {
        context.diagnostics.push(
            Diagnostic::error(None, "optimal weights are no weights of single samples: they have no technique images")
                .with_help("`--mis balance` or `--mis power` have some"),
        );
    }
    if overrides.roulette == Some(Roulette::Efficiency) {
        let mut refuse = |what: &str, why: &str| {
            context.diagnostics.error(None, format!("roulette by efficiency does not go with {what}: {why}"));
        };
        if overrides.adaptive.is_some() {
            refuse("adaptive sampling", "the halves of a pixel would no longer be independent");
        }
        if overrides.heuristic == Some(Heuristic::Optimal) {
            refuse("optimal weights", "they want one sample of each technique");
        }
    }
    PathIntegrator {
        max_depth,
        heuristic: overrides.heuristic.unwrap_or(Heuristic::Power(2.0)),
        technique: overrides.technique.unwrap_or(Technique::Both),
        roulette: overrides.roulette.unwrap_or_default(),
        regularize: entity.parameters.one_bool("regularize", false, context.diagnostics),
    }
}

/// Says what was asked for that only other integrators can do.
fn refuse_what_is_for_others(context: &mut Context<'_>, kind: IntegratorKind, overrides: &Overrides) {
    let gbuffer = overrides.film == Some(FilmKind::GBuffer)
        || overrides.film.is_none() && &*context.description.film.kind == "gbuffer";
    let film_span = if overrides.film.is_none() { Some(context.description.film.kind_span) } else { None };
    let mut refuse = |span: Option<luz_scene::Span>, what: &str, why: &str| {
        context.diagnostics.error(span, format!("{what} does not go with the integrator `{kind}`: {why}"));
    };
    if kind != IntegratorKind::Path {
        let why_not_adaptive = if kind.is_metropolis() {
            "its chains go where the light is, and no pixel is sampled by itself"
        } else {
            "light that others have found reaches a pixel, whose own samples do not know its error"
        };
        const TWO: &str = "path tracing alone has these two techniques of finding direct light";
        let given = [
            (overrides.adaptive.is_some(), "adaptive sampling", why_not_adaptive),
            (overrides.technique_images, "an image of each technique", TWO),
            (overrides.technique.is_some(), "a choice of techniques", TWO),
            (
                overrides.heuristic.is_some() && kind != IntegratorKind::Bidirectional,
                "a choice of the heuristic",
                "`path` and `bdpt` weight techniques",
            ),
            (overrides.roulette.is_some(), "a choice of roulette", "path tracing alone has it"),
        ];
        given.iter().filter(|given| given.0).for_each(|(_, what, why)| refuse(None, what, why));
        if gbuffer {
            refuse(film_span, "the film `gbuffer`", "path tracing alone notes what the camera sees first");
        }
    }
    let MetropolisOverrides { estimator, large_step_probability, kernel, mutations, ranges, .. } = overrides.metropolis;
    let chains = MetropolisOverrides {
        estimator: None,
        large_step_probability: None,
        kernel: None,
        mutations: None,
        ranges: None,
        ..overrides.metropolis
    };
    if !kind.is_metropolis() && chains != MetropolisOverrides::default() {
        refuse(None, "what is said of Markov chains", "`pssmlt`, `mmlt` and `mlt` have some");
    }
    let is_primary = matches!(kind, IntegratorKind::PrimarySpace | IntegratorKind::Multiplexed);
    if !is_primary && (large_step_probability.is_some() || kernel.is_some()) {
        refuse(None, "a choice of large or small steps", "`pssmlt` and `mmlt` have them");
    }
    if kind != IntegratorKind::PrimarySpace && estimator.is_some() {
        refuse(None, "a choice of the estimator below the chains", "`pssmlt` has it");
    }
    if kind != IntegratorKind::PathSpace && (mutations.is_some() || ranges.is_some()) {
        refuse(None, "a choice of mutations or their ranges", "`mlt` has it");
    }
}

fn refuse_pictures_of_strategies(context: &mut Context<'_>, entity: &Entity) {
    for name in ["visualizestrategies", "visualizeweights"] {
        if entity.parameters.one_bool(name, false, context.diagnostics) {
            let span = entity.parameters.span(name);
            context.diagnostics.error(span, format!("`{name}`: no pictures of single strategies can be had"));
        }
    }
}

/// What chains have in common: what the caller wishes, or else what a pbrt-v4 `mlt` says, or else the default.
fn metropolis(context: &mut Context<'_>, entity: &Entity, wishes: &MetropolisOverrides) -> Metropolis {
    let default = Metropolis::default();
    let is_pbrt = &*entity.kind == "mlt";
    let mut count = |name: &str, wish: Option<u64>, default: u64, range: std::ops::RangeInclusive<u64>| {
        let said = if is_pbrt {
            entity.parameters.one_integer(name, default as i32, context.diagnostics)
        } else {
            default as i32
        };
        let value = wish.unwrap_or(u64::try_from(said).unwrap_or(0));
        if !range.contains(&value) {
            let span = if wish.is_none() { entity.parameters.span(name) } else { None };
            let (from, to) = (range.start(), range.end());
            context.diagnostics.error(span, format!("`{name}` must lie within {from} and {to}, not {value}"));
        }
        value.clamp(*range.start(), *range.end())
    };
    let batches = u64::from(wishes.batches.unwrap_or(default.batches));
    let batches = batches.clamp(u64::from(Metropolis::FEWEST_BATCHES), u64::from(Metropolis::MOST_BATCHES));
    // Each batch, on whose spread the errors rest, has at least one chain.
    let chains = count("chains", wishes.chains, default.chains, batches..=Metropolis::MOST_CHAINS);
    let bootstrap_samples = count(
        "bootstrapsamples",
        wishes.bootstrap_samples,
        default.bootstrap_samples,
        1..=Metropolis::MOST_BOOTSTRAP_SAMPLES,
    );
    if wishes.batches.is_some_and(|wish| u64::from(wish) != batches) {
        let (fewest, most) = (Metropolis::FEWEST_BATCHES, Metropolis::MOST_BATCHES);
        context.diagnostics.error(None, format!("batches of chains must number within {fewest} and {most}"));
    }
    Metropolis {
        chains,
        bootstrap_samples,
        batches: batches as u32,
        direct_light: wishes.direct_light.unwrap_or(default.direct_light),
        two_stage: wishes.two_stage,
    }
}

fn large_step_probability(context: &mut Context<'_>, entity: &Entity, wishes: &MetropolisOverrides) -> f64 {
    const NAME: &str = "largestepprobability";
    let default = LARGE_STEP_PROBABILITY as f32;
    let said =
        if &*entity.kind == "mlt" { entity.parameters.one_float(NAME, default, context.diagnostics) } else { default };
    let probability = wishes.large_step_probability.unwrap_or(f64::from(said));
    if !(probability > 0.0 && probability <= 1.0) {
        let span = if wishes.large_step_probability.is_none() { entity.parameters.span(NAME) } else { None };
        context.diagnostics.push(
            Diagnostic::error(
                span,
                format!("the probability of large steps must lie above 0 and not above 1: {probability}"),
            )
            .with_help("without large steps, chains never leave the part of the scene where they begin"),
        );
        return LARGE_STEP_PROBABILITY;
    }
    probability
}

/// How far small steps go. pbrt-v4 draws them from a normal distribution of standard deviation `sigma`; ours of the same variance are
/// made of it.
fn kernel(context: &mut Context<'_>, entity: &Entity, wishes: &MetropolisOverrides) -> Kernel {
    if let Some(kernel) = wishes.kernel {
        return kernel;
    }
    if &*entity.kind != "mlt" || entity.parameters.get("sigma").is_none() {
        return Kernel::default();
    }
    let sigma = entity.parameters.one_float("sigma", 0.01, context.diagnostics);
    // The variance of steps between l/16 and l is (l² − (l/16)²) / (2 ln 16).
    const RATIO: f32 = 16.0;
    let largest = sigma * (2.0 * RATIO.ln() / (1.0 - 1.0 / (RATIO * RATIO))).sqrt();
    Kernel::new(largest / RATIO, largest).unwrap_or_else(|| {
        let span = entity.parameters.span("sigma");
        context.diagnostics.error(span, format!("small steps cannot have a standard deviation of {sigma}"));
        Kernel::default()
    })
}
