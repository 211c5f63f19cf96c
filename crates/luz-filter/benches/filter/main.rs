//! The sampled bilateral filter against the exact one and against a permutohedral lattice, on one thread, for photographs of
//! one megapixel; and both filters on two threads.
//!
//!     LUZ_DATA=../shared/data cargo bench -p luz-filter -- [--rounds N] [--sigmas 4,8,16,32] [--save FOLDER]
//!
//! `LUZ_DATA` names a folder with `images/`, the photographs. Times are processor seconds where the system tells them, so that
//! others on the machine disturb little, else seconds; the contestants take turns, and medians over rounds count. `--save`
//! writes inputs and exact results for `bench/opencv_filter.py`.

mod lattice;
mod stopwatch;

use std::path::{Path, PathBuf};

use luz_color::encoding::linear_to_srgb;
use luz_filter::{BilateralFilter, Method, Precision, SampleCount, Sampling};
use luz_image::Image;
use stopwatch::Stopwatch;

/// The quality in dB that counts.
const QUALITY: f64 = 50.0;

/// The goals: the time relative to the exact filter and to the lattice, by σ_s.
const GOALS: [(f32, f64, f64); 4] = [
    (4.0, 1.0 / 5.0, 1.0 / 8.0),
    (8.0, 1.0 / 12.0, 1.0 / 5.0),
    (16.0, 1.0 / 30.0, 1.0 / 3.0),
    (32.0, 1.0 / 100.0, 1.0 / 2.0),
];

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let option = |name: &str| arguments.iter().position(|a| a == name).and_then(|i| arguments.get(i + 1));
    let rounds: usize = option("--rounds").and_then(|n| n.parse().ok()).unwrap_or(3);
    let sigmas: Vec<f32> =
        option("--sigmas").map_or("4,8,16,32", String::as_str).split(',').filter_map(|s| s.parse().ok()).collect();
    let save = option("--save").map(PathBuf::from);
    let data = std::env::var_os("LUZ_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from);
    let pictures = [
        ("detailed", ["kodak/05", "kodak/13", "kodak/23", "kodak/15"]),
        ("mixed", ["astronaut", "kodak/01", "kodak/21", "kodak/07"]),
    ];
    println!(
        "{:9} {:>3} {:>5} | {:>9} {:>6} | {:>5} {:>9} {:>6} {:>7} | {:>9} {:>6} | {:>7} {:>8} | {:>7} {:>8}",
        "picture",
        "σ_s",
        "σ_r",
        "exact s",
        "in dB",
        "n",
        "sampled s",
        "dB",
        "auto dB",
        "lattice s",
        "dB",
        "/exact",
        "goal",
        "/lattice",
        "goal"
    );
    for (name, files) in pictures {
        let image = match mosaic(&data.join("images"), files) {
            Ok(image) => image,
            Err(error) => {
                eprintln!("{error}\nLUZ_DATA must name the folder of photographs");
                std::process::exit(1);
            }
        };
        for &sigma in &sigmas {
            for range in [0.1, 0.05] {
                race(name, &image, sigma, range, rounds, save.as_deref());
            }
        }
    }
    threads(&data);
}

/// Four crops of 512×512 pixels at native resolution, as they are encoded.
fn mosaic(folder: &Path, files: [&str; 4]) -> Result<Image, luz_image::ImageError> {
    let mut picture = Image::new(1024, 1024, ["R", "G", "B"])?;
    for (i, file) in files.into_iter().enumerate() {
        let whole = Image::read(folder.join(format!("{file}.png")))?;
        let part = whole.crop((whole.width() - 512) / 2, (whole.height() - 512) / 2, 512, 512)?;
        for y in 0..512 {
            for x in 0..512 {
                let to = picture.pixel_mut(i % 2 * 512 + x, i / 2 * 512 + y);
                to.iter_mut().zip(part.pixel(x, y)).for_each(|(to, &v)| *to = linear_to_srgb(v));
            }
        }
    }
    Ok(picture)
}

fn psnr(a: &Image, b: &Image) -> f64 {
    let squares: f64 = a.data().iter().zip(b.data()).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    -10.0 * (squares / a.data().len() as f64).log10()
}

/// Runs on a thread alone.
fn alone<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
        Ok(pool) => pool.install(work),
        Err(_) => work(),
    }
}

fn filtered(filter: &BilateralFilter, image: &Image) -> (f64, Image, Method) {
    let watch = Stopwatch::start();
    match filter.apply(image, &[]) {
        Ok(filtered) => (watch.seconds(), filtered.image, filtered.report.method),
        Err(error) => panic!("{error}"),
    }
}

fn sampled(count: u32) -> Method {
    let samples = SampleCount::Count(count);
    Method::Sampled(Sampling { samples, precision: Precision::Half, ..Sampling::default() })
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn race(name: &str, image: &Image, sigma: f32, range: f32, rounds: usize, save: Option<&Path>) {
    alone(|| {
        let mut filter = BilateralFilter::new(sigma, range);
        let (first, exact, _) = filtered(&filter, image);
        // The least number of samples for the quality.
        let (mut low, mut high) = (8u32, 4096u32);
        while high - low > 1 {
            let middle = u32::midpoint(low, high);
            filter.method = sampled(middle);
            if psnr(&filtered(&filter, image).1, &exact) >= QUALITY { high = middle } else { low = middle }
        }
        filter.method = Method::Auto { quality: QUALITY };
        let auto = psnr(&filtered(&filter, image).1, &exact);
        let (mut exact_times, mut sampled_times, mut lattice_times) = (vec![first], Vec::new(), Vec::new());
        let (mut quality, mut lattice_quality) = (0.0, 0.0);
        for round in 0..rounds {
            // Short runs are repeated, for their times are uncertain.
            for _ in 0..3 {
                filter.method = sampled(high);
                let (seconds, result, _) = filtered(&filter, image);
                sampled_times.push(seconds);
                quality = psnr(&result, &exact);
            }
            let watch = Stopwatch::start();
            let result = lattice::filter(image, sigma, range);
            lattice_times.push(watch.seconds());
            lattice_quality = psnr(&result, &exact);
            if round > 0 {
                filter.method = Method::Exact;
                exact_times.push(filtered(&filter, image).0);
            }
        }
        let (e, s, l) = (median(exact_times), median(sampled_times), median(lattice_times));
        let goal = GOALS.iter().find(|g| g.0 == sigma).map_or((0.0, 0.0), |g| (g.1, g.2));
        let ratio = |v: f64| format!("1/{:.1}", 1.0 / v);
        println!(
            "{name:9} {sigma:>3} {range:>5} | {e:>9.4} {:>6.2} | {high:>5} {s:>9.4} {quality:>6.2} {auto:>7.2} | {l:>9.4} {lattice_quality:>6.2} | {:>7} {:>8} | {:>7} {:>8}",
            psnr(image, &exact),
            ratio(s / e),
            ratio(goal.0),
            ratio(s / l),
            ratio(goal.1),
        );
        if let Some(folder) = save {
            let write = |kind: &str, image: &Image| {
                let bytes: Vec<u8> = image.data().iter().flat_map(|v| v.to_le_bytes()).collect();
                std::fs::write(folder.join(format!("{name}-{sigma}-{range}-{kind}.f32")), bytes)
            };
            let times = format!("{{\"exact\": {e}, \"sampled\": {s}, \"samples\": {high}, \"quality\": {quality}}}\n");
            let saved = std::fs::create_dir_all(folder)
                .and_then(|()| write("input", image))
                .and_then(|()| write("exact", &exact))
                .and_then(|()| std::fs::write(folder.join(format!("{name}-{sigma}-{range}.json")), times));
            if let Err(error) = saved {
                eprintln!("cannot save to {}: {error}", folder.display());
            }
        }
    });
}

/// Two threads against one, in seconds of the clock.
fn threads(data: &Path) {
    let Ok(image) = mosaic(&data.join("images"), ["kodak/05", "kodak/13", "kodak/23", "kodak/15"]) else { return };
    println!("\nclock seconds on one thread / on two (the machine has {:?})", std::thread::available_parallelism());
    for (name, method, sigma) in [("exact", Method::Exact, 8.0), ("sampled", sampled(300), 16.0)] {
        let mut filter = BilateralFilter::new(sigma, 0.1);
        filter.method = method;
        let mut least = [f64::INFINITY; 2];
        for _ in 0..20 {
            for (threads, least) in [1, 2].into_iter().zip(&mut least) {
                let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(threads).build() else { continue };
                let start = std::time::Instant::now();
                let _ = pool.install(|| filtered(&filter, &image));
                *least = least.min(start.elapsed().as_secs_f64());
            }
        }
        println!("{name:8} {:.4} / {:.4} = {:.2}", least[0], least[1], least[0] / least[1]);
    }
}
