//! Scratch.
use luz_filter::*;
use luz_image::Image;
fn cpu() -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat").unwrap().split(' ').next().unwrap().parse::<f64>().unwrap()
        * 1e-9
}
fn psnr(a: &Image, b: &Image) -> f64 {
    luz_image::metrics::compare(a, b, &Default::default()).unwrap().mean.psnr
}
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let s: f32 = args[1].parse().unwrap();
    let r: f32 = args[2].parse().unwrap();
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global().unwrap();
    let mut image = Image::read(&args[3]).unwrap();
    for v in image.data_mut() {
        *v = luz_color::encoding::linear_to_srgb(*v);
    }
    let mut filter = BilateralFilter::new(s, r);
    let time = |f: &BilateralFilter| {
        let mut best = f64::INFINITY;
        let mut out = None;
        for _ in 0..3 {
            let t = cpu();
            out = Some(f.apply(&image, &[]).unwrap());
            best = best.min(cpu() - t);
        }
        (best, out.unwrap())
    };
    let (te, exact) = time(&filter);
    println!("exact {te:.4} raw {:.2}", psnr(&image, &exact.image));
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
