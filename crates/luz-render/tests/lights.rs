//! Lights: what is drawn is what the density says, for ordinary maps and for the extremes; power is what leaves.

use glam::{Vec2, Vec3};
use luz_color::{RgbColorSpace, Spectrum, Wavelengths};
use luz_geometry::Transform;
use luz_render::SphereMap;
use luz_render::light::{
    Combination, GoniometricLight, ImageInfiniteLight, Light, PointLight, ProjectionLight, ScaledSpectrum,
    UniformInfiniteLight,
};
use luz_render::texture::TexelFilter;
use luz_sample::test_support::chi2_sphere;
use std::f64::consts::PI;

/// Of one χ² test among the fewer than fifty here.
const SIGNIFICANCE: f64 = 1e-4;
const COMBINATIONS: [Combination; 2] = [Combination::Alone, Combination::WithBsdf];
const KINDS: [(SphereMap, TexelFilter); 4] = [
    (SphereMap::EqualArea, TexelFilter::Point),
    (SphereMap::EqualArea, TexelFilter::Bilinear),
    (SphereMap::LatitudeLongitude, TexelFilter::Point),
    (SphereMap::LatitudeLongitude, TexelFilter::Bilinear),
];

type Kind = (SphereMap, TexelFilter);

fn map((map, filter): Kind, size: [usize; 2], texel: impl Fn(usize, usize) -> f32) -> ImageInfiniteLight {
    let texels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))).map(|(x, y)| [texel(x, y); 3]).collect();
    let turned = Transform::rotate(0.7, Vec3::new(1.0, 2.0, 3.0)).expect("an axis");
    ImageInfiniteLight::new(map, filter, size, texels, RgbColorSpace::srgb(), 1.0, turned).expect("texels are fine")
}

fn size(kind: Kind) -> [usize; 2] {
    if kind.0 == SphereMap::EqualArea { [16, 16] } else { [16, 8] }
}

/// Mostly smooth, with some black texels.
fn bumpy(x: usize, y: usize) -> f32 {
    if (x + 3 * y) % 11 == 0 { 0.0 } else { 1.0 + ((x * 7 + y * 13) % 5) as f32 }
}

fn at(i: u32, n: u32) -> Vec2 {
    Vec2::new((i as f32 * 0.618_034) % 1.0, (i as f32 + 0.5) / n as f32)
}

/// χ² of directions against densities, which are wrong by a factor.
fn passes(light: &ImageInfiniteLight, combination: Combination, factor: f64) -> bool {
    let wavelengths = Wavelengths::sample_visible(0.4);
    let sample = |u: Vec2| light.sample(combination, u, &wavelengths).map(|s| s.direction);
    // A direction drawn within rounding of a texel's border may fall into the next, which may be black.
    let pdf = |d: Vec3| factor * f64::from(light.pdf(combination, d)) + 1e-9;
    chi2_sphere(sample, pdf, 200_000, 3).passes(SIGNIFICANCE)
}

#[test]
fn directions_follow_the_density() {
    for kind in KINDS {
        let light = map(kind, size(kind), bumpy);
        for combination in COMBINATIONS {
            assert!(passes(&light, combination, 1.0), "{kind:?} {combination:?}");
            assert!(!passes(&light, combination, 0.95), "{kind:?}: a density 5 % too low must be noticed");
        }
    }
}

#[test]
fn samples_carry_their_own_density_and_radiance() {
    let wavelengths = Wavelengths::sample_visible(0.4);
    for kind in KINDS {
        let light = map(kind, size(kind), bumpy);
        for combination in COMBINATIONS {
            let mut off = 0;
            for i in 0..1000 {
                let sample = light.sample(combination, at(i, 1000), &wavelengths);
                // On a border of the density's support it is zero.
                let Some(sample) = sample else {
                    off += 1;
                    continue;
                };
                // A direction within rounding of a texel's border may be looked up in the next texel.
                let near = |a: f32, b: f32| (a - b).abs() <= 1e-3 * b.max(0.3);
                off += i32::from(
                    !near(light.pdf(combination, sample.direction), sample.pdf)
                        || !near(light.radiance(sample.direction, &wavelengths)[0], sample.radiance[0]),
                );
            }
            assert!(off <= 3, "{kind:?}: {off} of 1000");
        }
    }
}

/// Nothing, one texel, one bright texel among black ones, a sun of 10⁵ times the mean in a sky.
#[test]
fn extreme_maps_work() {
    let wavelengths = Wavelengths::sample_visible(0.4);
    let u = Vec2::new(0.3, 0.8);
    for kind in KINDS {
        let black = map(kind, [8, 8], |_, _| 0.0);
        let one = map(kind, [1, 1], |_, _| 2.0);
        for combination in COMBINATIONS {
            assert!(black.sample(combination, u, &wavelengths).is_none());
            assert_eq!(black.pdf(combination, Vec3::X), 0.0);
        }
        for combination in COMBINATIONS {
            let sample = one.sample(combination, u, &wavelengths).expect("light");
            assert!((sample.pdf * 4.0 * std::f32::consts::PI - 1.0).abs() < 1e-4, "{}", sample.pdf);
        }
        let hot = map(kind, [32, 32], |x, y| if (x, y) == (5, 9) { 1e5 } else { 0.0 });
        let sunny = map(kind, [64, 64], |x, y| if (x, y) == (50, 21) { 4e8 } else { 1.0 + (x % 3) as f32 });
        for light in [hot, sunny] {
            for combination in COMBINATIONS {
                for i in 0..500 {
                    let Some(sample) = light.sample(combination, at(i, 500), &wavelengths) else { continue };
                    assert!(sample.radiance[0] > 0.0 && sample.pdf > 0.0 && sample.pdf.is_finite());
                }
            }
        }
    }
}

/// ∫ L dω by the map's own sampling is the mean radiance times 4π, without variance, for any map without colour: that
/// is, the density is in proportion to the radiance, interpolated or not.
#[test]
fn the_estimator_of_the_total_has_no_variance() {
    let wavelengths = Wavelengths::sample_visible(0.4);
    for kind in KINDS {
        let light = map(kind, size(kind), |x, y| 0.5 + ((x * 3 + y) % 4) as f32);
        let totals: Vec<f32> = (0..256)
            .map(|i| {
                let sample = light.sample(Combination::Alone, at(i, 256), &wavelengths);
                sample.map_or(0.0, |s| s.radiance[0] / s.pdf)
            })
            .collect();
        assert!(totals.iter().all(|t| (t / totals[0] - 1.0).abs() < 2e-3), "{kind:?}: {totals:?}");
    }
}

/// The intensity over the sphere adds up to the power, for lamps at a point.
#[test]
fn images_at_a_point_have_their_power() {
    let white = || ScaledSpectrum { spectrum: Spectrum::Constant(1.0), scale: 2.0 };
    let turned = Transform::rotate(0.7, Vec3::new(1.0, 2.0, 3.0)).expect("an axis");
    let n = 400;
    let directions = || {
        (0..n * n).map(move |i| {
            let uv = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
            SphereMap::EqualArea.direction(uv)
        })
    };
    let lamp = GoniometricLight::new(turned, white(), 8, (0..64).map(|i| (i % 5) as f32).collect());
    let total = directions().map(|d| f64::from(lamp.factor(d))).sum::<f64>() * 4.0 * PI / f64::from(n * n);
    assert!((total * white().weight() / lamp.power() - 1.0).abs() < 1e-2, "{total}");

    let wavelengths = Wavelengths::sample_visible(0.4);
    let space = RgbColorSpace::srgb();
    let texels = (0..6 * 4).map(|i| [(i % 5) as f32; 3]).collect();
    let beamer = ProjectionLight::new(turned, 50.0, [6, 4], texels, space, 1.0);
    let total = directions().filter_map(|d| beamer.intensity(d, &wavelengths)).map(|i| f64::from(i[0])).sum::<f64>()
        * (4.0 * PI / f64::from(n * n));
    let unit = ScaledSpectrum { spectrum: Spectrum::Dense(space.illuminant().clone()), scale: 1.0 };
    let expected = beamer.power() / unit.weight() * f64::from(unit.sample(&wavelengths)[0]);
    assert!((total / expected - 1.0).abs() < 1e-2, "{total} {expected}");
}

#[test]
fn delta_lights_are_never_found_by_chance() {
    let white = || ScaledSpectrum { spectrum: Spectrum::Constant(1.0), scale: 1.0 };
    let point = Light::Point(PointLight { position: Vec3::ONE, intensity: white() });
    assert_eq!((point.is_infinite(), point.kind()), (false, "point"));
    let sky = Light::UniformInfinite(UniformInfiniteLight { radiance: white() });
    assert!(sky.is_infinite());
}
