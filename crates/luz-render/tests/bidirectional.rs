//! Bidirectional path tracing and light tracing against path tracing.

mod common;

use common::transport_scenes::{self, TransportScene};
use common::{load, mean, render};
use glam::Vec2;
use luz_color::Wavelengths;
use luz_render::Overrides;
use luz_render::integrator::{
    BidirectionalIntegrator, BidirectionalTechniques, BidirectionalTracer, CameraStart, PathCost, PixelEstimator,
    Splats,
};
use luz_render::world::Loaded;
use luz_sample::Samples;
use luz_sample::mis::Heuristic;
use luz_sample::random::Random;
use luz_sample::statistics::Running;

/// Means over the whole film of what samples find, with what arrives elsewhere.
fn film_mean(loaded: &Loaded, settings: &BidirectionalIntegrator, samples: u32, seed: u64) -> [Running; 3] {
    let Loaded { world, camera, settings: scene, .. } = loaded;
    let window = scene.film_window();
    let tracer = BidirectionalTracer { settings: *settings, world, camera, window };
    let mut sums = [Running::default(); 3];
    let mut all = Vec::new();
    for y in scene.bounds.y0..scene.bounds.y1 {
        for x in scene.bounds.x0..scene.bounds.x1 {
            for index in 0..samples {
                let mut random = Random::new(seed, u64::from(y << 16 | x), u64::from(index));
                let mut wavelengths = Wavelengths::sample_visible(random.next_1d());
                let film = Vec2::new(x as f32, y as f32) + random.next_2d();
                let start = CameraStart { film, lens_u: random.next_2d(), time_u: random.next_1d() };
                all.clear();
                let mut splats = Splats::new(&scene.sensor, &mut all);
                let mut cost = PathCost::default();
                let value = tracer.sample(&start, &mut wavelengths, &mut random, &mut splats, &mut cost);
                let mut rgb = scene.sensor.to_output_rgb(value, &wavelengths);
                let area = window.area();
                for splat in &all {
                    for c in 0..3 {
                        rgb[c] += splat.rgb[c] / area;
                    }
                }
                for c in 0..3 {
                    sums[c].push(f64::from(rgb[c]));
                }
            }
        }
    }
    sums
}

#[test]
#[ignore]
fn look() {
    let only = std::env::var("ONLY").ok();
    let spp: u32 = std::env::var("SPP").ok().and_then(|s| s.parse().ok()).unwrap_or(64);
    for TransportScene { name, text, has_specular_view } in transport_scenes::all() {
        if only.as_deref().is_some_and(|only| only != name) {
            continue;
        }
        let loaded = load(
            &text,
            &Overrides {
                samples_per_pixel: Some(spp),
                filter: Some(luz_render::film::Filter::unit_box()),
                ..Overrides::default()
            },
        );
        let start = std::time::Instant::now();
        let reference = mean(&render(&loaded));
        let path_time = start.elapsed().as_secs_f64();
        let max_depth = loaded.settings.integrator.max_depth();
        print!("{name:24} path {:8.4} ±{:6.4}", reference[1].0, reference[1].1);
        for (label, techniques) in [("bdpt", BidirectionalTechniques::All), ("light", BidirectionalTechniques::Light)] {
            if label == "light" && has_specular_view {
                continue;
            }
            let settings = BidirectionalIntegrator { max_depth, techniques, heuristic: Heuristic::default() };
            let start = std::time::Instant::now();
            let found = film_mean(&loaded, &settings, spp, 3);
            let time = start.elapsed().as_secs_f64();
            let z: Vec<f64> = (0..3)
                .map(|c| (found[c].mean() - reference[c].0) / found[c].standard_error().hypot(reference[c].1))
                .collect();
            print!(
                "  {label} {:8.4} ±{:6.4} z {:5.1} {:5.1} {:5.1} t {:4.1}×",
                found[1].mean(),
                found[1].standard_error(),
                z[0],
                z[1],
                z[2],
                time / path_time
            );
        }
        println!();
    }
}

/// Means over 4 × 4 tiles of the picture, per channel, of independent renders.
fn tiles(loaded: &Loaded, seeds: u64) -> Vec<Running> {
    let mut tiles = vec![Running::default(); 49];
    let first: u64 = std::env::var("SEED").ok().and_then(|s| s.parse().ok()).unwrap_or(10);
    for seed in first..first + seeds {
        let mut settings = loaded.settings.clone();
        settings.seed = seed;
        let mut renderer = luz_render::Renderer::new(&loaded.world, &loaded.camera, &settings);
        renderer.finish();
        let film = renderer.film();
        let (w, h) = (film.bounds().width() as usize, film.bounds().height() as usize);
        let mut sums = vec![(0.0, 0.0f64); 49];
        for (i, pixel) in film.estimates().enumerate() {
            let tile = (i / w) * 4 / h * 4 + (i % w) * 4 / w;
            for c in 0..3 {
                for t in [tile * 3 + c, 48] {
                    sums[t].0 += pixel.mean[c];
                    sums[t].1 += 1.0;
                }
            }
        }
        for (tile, (sum, n)) in tiles.iter_mut().zip(sums) {
            tile.push(sum / n);
        }
    }
    tiles
}

#[test]
#[ignore]
fn look_mlt() {
    let only = std::env::var("ONLY").ok();
    let which = std::env::var("WHICH").unwrap_or("mlt".into());
    let spp: u32 = std::env::var("SPP").ok().and_then(|s| s.parse().ok()).unwrap_or(64);
    // `pssmlt:bdpt`, say.
    let (kind, estimator) = which.split_once(':').map_or((&*which, None), |(kind, name)| (kind, Some(name)));
    let mutations: Option<Vec<f64>> =
        std::env::var("MUT").ok().map(|s| s.split(',').map(|x| x.parse().unwrap()).collect());
    for TransportScene { name, text, .. } in transport_scenes::all() {
        if only.as_deref().is_some_and(|only| !only.split(',').any(|o| o == name)) {
            continue;
        }
        let base = Overrides {
            samples_per_pixel: Some(spp),
            filter: Some(luz_render::film::Filter::unit_box()),
            ..Overrides::default()
        };
        let mut over = Overrides { integrator: Some(kind.parse().unwrap()), ..base.clone() };
        over.metropolis.estimator = estimator.map(|name| name.parse().unwrap());
        over.metropolis.chains = Some(64);
        over.metropolis.bootstrap_samples = Some(20000);
        if let Some(m) = &mutations {
            over.metropolis.mutations = Some(luz_render::integrator::metropolis::MutationProbabilities::from_array(
                m.clone().try_into().unwrap(),
            ));
        }
        let path = tiles(&load(&text, &Overrides { samples_per_pixel: Some(256), ..base }), 6);
        let mlt = tiles(&load(&text, &over), 12);
        let z: Vec<f64> = path
            .iter()
            .zip(&mlt)
            .map(|(a, b)| {
                let se = a.standard_error().hypot(b.standard_error());
                if se > 0.0 { (b.mean() - a.mean()) / se } else { 0.0 }
            })
            .collect();
        let mean_square = z[..48].iter().map(|z| z * z).sum::<f64>() / 48.0;
        let worst = z.iter().fold(0.0f64, |m, z| if z.abs() > m.abs() { *z } else { m });
        println!(
            "{name:24} path {:.4} ± {:.4} {which} {:.4} ± {:.4} z {:5.1}  tiles mean z² {mean_square:5.2} worst {worst:5.1}",
            path[48].mean(),
            path[48].standard_error(),
            mlt[48].mean(),
            mlt[48].standard_error(),
            z[48]
        );
    }
}
