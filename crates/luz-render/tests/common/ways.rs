//! A scene, and ways to render it that remember something from sample to sample.

use super::{load, overrides};
use luz_render::film::FilmKind;
use luz_render::integrator::IntegratorKind;
use luz_render::integrator::metropolis::{DirectLight, PrimaryEstimator};
use luz_render::world::Loaded;
use luz_render::{MetropolisOverrides, Overrides};
use luz_sample::mis::Heuristic;
use luz_sample::roulette::Roulette;

/// A floor under a lamp and a sky, a ball of glass, a lens, features, a filter with negative lobes.
pub const SCENE: &str = r#"
    LookAt 0 2 -6  0 0.5 0  0 1 0
    Camera "perspective" "float fov" 40 "float lensradius" 0.05 "float focaldistance" 6
    PixelFilter "mitchell"
    Film "gbuffer"
    WorldBegin
    LightSource "infinite" "rgb L" [0.5 0.7 1]
    AttributeBegin
    AreaLightSource "diffuse" "rgb L" [9 8 7]
    Translate 1 2.5 0
    Shape "sphere" "float radius" 0.5
    AttributeEnd
    Material "coateddiffuse" "float roughness" 0.1
    Shape "bilinearmesh" "point3 P" [-3 0 -3  -3 0 3  3 0 -3  3 0 3]
    Material "dielectric"
    Translate 0 0.7 0
    Shape "sphere" "float radius" 0.7
    "#;

/// Ways to render that remember something from sample to sample.
pub fn ways() -> [(&'static str, Overrides); 11] {
    let plain = Overrides { filter: None, ..overrides([33, 17], 12) };
    let longer = Overrides { samples_per_pixel: Some(48), ..plain.clone() };
    let primary =
        Overrides { integrator: Some(IntegratorKind::PrimarySpace), film: Some(FilmKind::Rgb), ..plain.clone() };
    // Three rounds of preparation, and six.
    let chains = MetropolisOverrides {
        chains: Some(50),
        bootstrap_samples: Some(2500),
        direct_light: Some(DirectLight::Inside),
        ..Default::default()
    };
    let both_ways = MetropolisOverrides { estimator: Some(PrimaryEstimator::Bidirectional), ..chains };
    let apart = MetropolisOverrides { direct_light: Some(DirectLight::Separate), two_stage: true, ..chains };
    [
        ("plain", plain),
        ("optimal weights", Overrides { heuristic: Some(Heuristic::Optimal), ..longer.clone() }),
        ("roulette by efficiency", Overrides { roulette: Some(Roulette::Efficiency), ..longer.clone() }),
        ("adaptive", Overrides { adaptive: Some(0.2), ..longer }),
        ("primary-space chains", Overrides { metropolis: chains, ..primary.clone() }),
        ("chains over both walks", Overrides { metropolis: both_ways, ..primary.clone() }),
        (
            "multiplexed chains",
            Overrides { metropolis: chains, integrator: Some(IntegratorKind::Multiplexed), ..primary.clone() },
        ),
        (
            "chains of paths",
            Overrides { metropolis: chains, integrator: Some(IntegratorKind::PathSpace), ..primary.clone() },
        ),
        ("both walks", Overrides { integrator: Some(IntegratorKind::Bidirectional), ..primary.clone() }),
        ("light tracing", Overrides { integrator: Some(IntegratorKind::Light), ..primary.clone() }),
        ("two-stage chains, direct light apart", Overrides { metropolis: apart, ..primary }),
    ]
}

/// The scene, rendered plainly.
pub fn loaded() -> Loaded {
    load(SCENE, &ways()[0].1)
}
