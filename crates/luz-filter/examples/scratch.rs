//! Scratch.
use luz_filter::*;
use luz_image::Image;
use std::time::Instant;
fn crop(f: &str) -> Image {
    let mut i = Image::read(format!("/work/shared/data/images/{f}.png")).unwrap();
    for v in i.data_mut() {
        *v = luz_color::encoding::linear_to_srgb(*v);
    }
    let (x, y) = ((i.width() - 512) / 2, (i.height() - 512) / 2);
    i.crop(x, y, 512, 512).unwrap()
}
fn mosaic(files: [&str; 4]) -> Image {
    let parts = files.map(crop);
    let mut out = Image::new(1024, 1024, ["R", "G", "B"]).unwrap();
    for y in 0..1024 {
        for x in 0..1024 {
            let p = &parts[y / 512 * 2 + x / 512];
            out.pixel_mut(x, y).copy_from_slice(p.pixel(x % 512, y % 512));
        }
    }
    out
}
fn psnr(a: &Image, b: &Image) -> f64 {
    luz_image::metrics::compare(a, b, &Default::default()).unwrap().mean.psnr
}
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let s: f32 = args[1].parse().unwrap();
    let r: f32 = args[2].parse().unwrap();
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global().unwrap();
    let image = match args[3].as_str() {
        "a" => mosaic(["kodak/05", "kodak/13", "kodak/23", "kodak/15"]),
        _ => mosaic(["astronaut", "kodak/01", "kodak/21", "kodak/07"]),
    };
    let mut filter = BilateralFilter::new(s, r);
    let time = |f: &BilateralFilter| {
        let mut best = f64::INFINITY;
        let mut out = None;
        for _ in 0..3 {
            let t = Instant::now();
            out = Some(f.apply(&image, &[]).unwrap());
            best = best.min(t.elapsed().as_secs_f64());
        }
        (best, out.unwrap())
    };
    let (te, exact) = time(&filter);
    println!("exact {te:.4} raw {:.2}", psnr(&image, &exact.image));
    for quality in [45.0, 50.0, 55.0] {
        filter.method = Method::Auto { quality };
        let (t, f) = time(&filter);
        let Method::Sampled(s) = f.report.method else {
            println!("exact");
            continue;
        };
        println!(
            "auto {quality}: {t:.4} 1/{:.1} {:.2} dB measured {:.2} {:?}",
            te / t,
            psnr(&f.image, &exact.image),
            f.report.measured_quality.unwrap(),
            s.samples
        );
    }
    for n in args[4].split(',') {
        for strategy in Strategy::ALL {
            for precision in [Precision::Full, Precision::Fast] {
                if args.len() > 5 && args[5] != strategy.name() {
                    continue;
                }
                filter.method = Method::Sampled(Sampling {
                    samples: SampleCount::Count(n.parse().unwrap()),
                    precision,
                    strategy,
                    ..Default::default()
                });
                let (t, f) = time(&filter);
                println!(
                    "{:13} {n} {precision:?} {t:.4} 1/{:.1} {:.2} dB used {:.0} ns/px/sample {:.4}",
                    strategy.name(),
                    te / t,
                    psnr(&f.image, &exact.image),
                    f.report.samples_per_pixel,
                    t * 1e9 / (image.width() * image.height()) as f64 / f.report.samples_per_pixel
                );
            }
        }
    }
}
