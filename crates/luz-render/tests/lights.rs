//! Environment maps: what is drawn is what the density says, for ordinary maps and for the extremes.

use glam::{Vec2, Vec3};
use luz_color::{RgbColorSpace, Wavelengths};
use luz_geometry::Transform;
use luz_render::SphereMap;
use luz_render::light::{ImageInfiniteLight, Light, PointLight, ScaledSpectrum, UniformInfiniteLight};
use luz_sample::test_support::chi2_sphere;

const SIGNIFICANCE: f64 = 1e-4;

fn map(kind: SphereMap, size: [usize; 2], texel: impl Fn(usize, usize) -> f32) -> ImageInfiniteLight {
    let texels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))).map(|(x, y)| [texel(x, y); 3]).collect();
    let turned = Transform::rotate(0.7, Vec3::new(1.0, 2.0, 3.0)).expect("an axis");
    ImageInfiniteLight::new(kind, size, texels, RgbColorSpace::srgb(), 1.0, turned).expect("texels are fine")
}

/// χ² of directions against densities.
fn passes(light: &ImageInfiniteLight, factor: f64) -> bool {
    let wavelengths = Wavelengths::sample_visible(0.4);
    let sample = |u: Vec2| light.sample(u, &wavelengths).map(|s| s.direction);
    chi2_sphere(sample, |d| factor * f64::from(light.pdf(d)), 200_000, 3).passes(SIGNIFICANCE)
}

#[test]
fn directions_follow_the_density() {
    for (kind, size) in [(SphereMap::EqualArea, [16, 16]), (SphereMap::LatitudeLongitude, [16, 8])] {
        let smooth = map(kind, size, |x, y| 1.0 + ((x * 7 + y * 13) % 5) as f32);
        assert!(passes(&smooth, 1.0), "{kind:?}");
        assert!(!passes(&smooth, 0.95), "{kind:?}: a density 5 % too low must be noticed");
    }
}

#[test]
fn samples_carry_their_own_density_and_radiance() {
    let wavelengths = Wavelengths::sample_visible(0.4);
    for (kind, size) in [(SphereMap::EqualArea, [16, 16]), (SphereMap::LatitudeLongitude, [32, 16])] {
        let light = map(kind, size, |x, y| 0.1 + ((x * 7 + y * 13) % 5) as f32);
        let mut off = 0;
        for i in 0..1000 {
            let u = Vec2::new((i as f32 * 0.618_034) % 1.0, (i as f32 + 0.5) / 1000.0);
            let sample = light.sample(u, &wavelengths).expect("the map is not black");
            // A direction within rounding of a texel's border may be looked up in the next texel.
            off += i32::from(
                (light.pdf(sample.direction) / sample.pdf - 1.0).abs() > 1e-3
                    || (light.radiance(sample.direction, &wavelengths)[0] / sample.radiance[0] - 1.0).abs() > 1e-3,
            );
        }
        assert!(off <= 3, "{kind:?}: {off} of 1000");
    }
}

#[test]
fn black_one_texel_and_one_hot_maps_work() {
    let wavelengths = Wavelengths::sample_visible(0.4);
    let u = Vec2::new(0.3, 0.8);
    for kind in [SphereMap::EqualArea, SphereMap::LatitudeLongitude] {
        let black = map(kind, [8, 8], |_, _| 0.0);
        assert!(black.sample(u, &wavelengths).is_none());
        let one = map(kind, [1, 1], |_, _| 2.0);
        let sample = one.sample(u, &wavelengths).expect("light");
        assert!((sample.pdf * 4.0 * std::f32::consts::PI - 1.0).abs() < 1e-4, "{}", sample.pdf);
        let hot = map(kind, [32, 32], |x, y| if (x, y) == (5, 9) { 1e5 } else { 0.0 });
        for i in 0..500 {
            let u = Vec2::new((i as f32 + 0.5) / 500.0, (i as f32 * 0.618_034) % 1.0);
            let sample = hot.sample(u, &wavelengths).expect("light");
            assert!(sample.radiance[0] > 0.0 && sample.pdf > 0.0 && sample.pdf.is_finite());
        }
    }
}

/// ∫ L dω by the map's own sampling is the mean radiance times 4π, without variance, for any map without colour.
#[test]
fn the_estimator_of_the_total_has_no_variance() {
    let wavelengths = Wavelengths::sample_visible(0.4);
    let light = map(SphereMap::LatitudeLongitude, [16, 8], |x, y| 0.5 + ((x * 3 + y) % 4) as f32);
    let totals: Vec<f32> = (0..64)
        .map(|i| {
            let sample = light.sample(Vec2::new((i as f32 * 0.618_034) % 1.0, (i as f32 + 0.5) / 64.0), &wavelengths);
            sample.map_or(0.0, |s| s.radiance[0] / s.pdf)
        })
        .collect();
    assert!(totals.iter().all(|t| (t / totals[0] - 1.0).abs() < 2e-3), "{totals:?}");
}

#[test]
fn delta_lights_are_never_found_by_chance() {
    let white = || ScaledSpectrum { spectrum: luz_color::Spectrum::Constant(1.0), scale: 1.0 };
    let point = Light::Point(PointLight { position: Vec3::ONE, intensity: white() });
    assert_eq!((point.is_infinite(), point.kind()), (false, "point"));
    let sky = Light::UniformInfinite(UniformInfiniteLight { radiance: white() });
    assert!(sky.is_infinite());
}
