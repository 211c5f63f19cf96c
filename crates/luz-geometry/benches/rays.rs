//! Rays per second on one thread: primary, diffuse-bounce and shadow rays, in a room with a displaced sphere of a million
//! triangles and in an interior. Where Embree 4 is found, the same rays go through it too, by turns, and ratios are printed:
//!
//!     LUZ_EMBREE_LIB=/path/to/libembree4.so cargo bench -p luz-geometry --bench rays

mod embree;
mod scenes;

use std::hint::black_box;
use std::time::{Duration, Instant};

use glam::{Vec2, Vec3};
use luz_geometry::{Accelerator, AcceleratorBuilder, Frame, Ray, Shape, SimdLevel, TriangleMesh};

const SIDE: u32 = 512;
const ROUNDS: usize = 12;

/// SplitMix64.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }
}

struct Rays {
    primary: Vec<Ray>,
    bounce: Vec<Ray>,
    shadow: Vec<Ray>,
}

fn rays(accelerator: &Accelerator, eye: Vec3, target: Vec3) -> Rays {
    let mut random = Random(1);
    let frame = Frame::from_zx((target - eye).normalize(), Vec3::X);
    let mut out = Rays { primary: Vec::new(), bounce: Vec::new(), shadow: Vec::new() };
    // In tiles of 16×16, as a renderer goes.
    for tile in 0..(SIDE / 16) * (SIDE / 16) {
        for pixel in 0..256 {
            let x = (tile % (SIDE / 16)) * 16 + pixel % 16;
            let y = (tile / (SIDE / 16)) * 16 + pixel / 16;
            let at = (Vec2::new(x as f32 + random.unit(), y as f32 + random.unit()) / SIDE as f32 - 0.5) * 1.4;
            let ray = Ray::new(eye, frame.to_world(Vec3::new(at.x, at.y, 1.0).normalize()), 0.0);
            out.primary.push(ray);
            let Some(hit) = accelerator.closest_hit(&ray) else { continue };
            let point = accelerator.surface(&ray, &hit);
            let normal = if point.geometric_normal.dot(ray.direction) > 0.0 {
                -point.geometric_normal
            } else {
                point.geometric_normal
            };
            let (r, phi) = (random.unit(), std::f32::consts::TAU * random.unit());
            let local = Vec3::new(r.sqrt() * phi.cos(), r.sqrt() * phi.sin(), (1.0 - r).sqrt());
            let direction = Frame::from_z(normal).to_world(local);
            let ray = point.leave(direction);
            let origin = ray.origin;
            out.bounce.push(ray);
            let light = Vec3::new(random.unit() - 0.5, random.unit() - 0.5, 1.98);
            out.shadow.push(Ray { direction: light - origin, t_max: 0.999, ..ray });
        }
    }
    out
}

/// A way to shoot rays: how many of them hit.
type Shoot<'a> = Box<dyn Fn(&[Ray]) -> usize + 'a>;

/// Lets the contestants shoot the same rays, by turns and in short slices; the least time of each slice over all rounds,
/// summed, and the hits. So what else the machine does disturbs little, and all alike.
fn race(contestants: &[Shoot], rays: &[Ray]) -> Vec<(Duration, usize)> {
    let mut out = vec![(Duration::ZERO, 0); contestants.len()];
    for slice in rays.chunks(1 << 14) {
        let mut best = vec![(Duration::MAX, 0); contestants.len()];
        for _ in 0..ROUNDS {
            for (shoot, best) in contestants.iter().zip(&mut best) {
                let start = Instant::now();
                let hits = shoot(slice);
                *best = (start.elapsed().min(best.0), hits);
            }
        }
        for (out, best) in out.iter_mut().zip(&best) {
            *out = (out.0 + best.0, out.1 + best.1);
        }
    }
    out
}

/// The time that this thread has computed, where the system says it; other work on the machine then counts less.
fn thread_time() -> Duration {
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    let wall = || START.get_or_init(Instant::now).elapsed();
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|s| s.split_whitespace().next()?.parse().ok())
        .map_or_else(wall, Duration::from_nanos)
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let start = thread_time();
    let out = work();
    (out, thread_time().saturating_sub(start))
}

fn build(mesh: &TriangleMesh, level: SimdLevel) -> Accelerator {
    let mut builder = AcceleratorBuilder::new();
    builder.simd(level);
    builder.add_shape(Shape::Triangles(mesh.clone()));
    builder.build()
}

fn bench(name: &str, mesh: &TriangleMesh, eye: Vec3, target: Vec3, embree: Option<&embree::Embree>) {
    let levels = if std::env::var_os("LUZ_BENCH_ALL").is_some() {
        vec![SimdLevel::Auto, SimdLevel::Avx2, SimdLevel::Scalar]
    } else {
        vec![SimdLevel::Auto]
    };
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let builds: Vec<(Accelerator, Duration)> =
        (0..5).map(|_| one.install(|| timed(|| build(mesh, SimdLevel::Auto)))).collect();
    let report = builds[0].0.report();
    let time = builds.iter().map(|b| b.1).min().unwrap_or_default();
    println!(
        "{name}: {} triangles, built in {:.3} s on one thread, {:.1} bytes/triangle, {} nodes",
        report.triangles,
        time.as_secs_f64(),
        report.bytes as f64 / report.triangles as f64,
        report.nodes
    );
    drop(builds);
    let ours: Vec<Accelerator> = levels.iter().map(|&level| build(mesh, level)).collect();
    let theirs: Vec<embree::Scene> =
        embree.map(|e| [false, true].iter().filter_map(|&robust| e.scene(mesh, robust)).collect()).unwrap_or_default();
    if let Some(embree) = embree {
        let time = (0..5).map(|_| timed(|| embree.scene(mesh, false)).1).min().unwrap_or_default();
        println!("  Embree built in {:.3} s on one thread", time.as_secs_f64());
    }
    let rays = rays(&ours[0], eye, target);
    for (kind, rays, any) in
        [("primary", &rays.primary, false), ("bounce", &rays.bounce, false), ("shadow", &rays.shadow, true)]
    {
        let mut contestants: Vec<Shoot> = Vec::new();
        for accelerator in &ours {
            contestants.push(if any {
                Box::new(|rays| rays.iter().filter(|r| accelerator.any_hit(black_box(r))).count())
            } else {
                Box::new(|rays| rays.iter().filter(|r| accelerator.closest_hit(black_box(r)).is_some()).count())
            });
        }
        for scene in &theirs {
            contestants.push(if any {
                Box::new(|rays| rays.iter().filter(|r| scene.any_hit(black_box(r))).count())
            } else {
                Box::new(|rays| rays.iter().filter(|r| scene.closest_hit(black_box(r)).is_some()).count())
            });
        }
        let (times, counts): (Vec<Duration>, Vec<usize>) = race(&contestants, rays).into_iter().unzip();
        let speed = |t: &Duration| rays.len() as f64 / t.as_secs_f64() / 1e6;
        print!("  {kind:8}");
        for (level, time) in levels.iter().zip(&times) {
            print!("  {level:?} {:6.2} M/s", speed(time));
        }
        for (name, time) in ["Embree", "Embree robust"].iter().zip(&times[ours.len()..]) {
            print!("  | {name} {:6.2} M/s, ratio {:.2}", speed(time), speed(&times[0]) / speed(time));
        }
        println!("  (hits {counts:?} of {})", rays.len());
    }
}

fn main() {
    // `cargo test --benches` runs this too, and should not take long.
    if std::env::args().any(|a| a == "--test") {
        return;
    }
    let embree = embree::Embree::load();
    if embree.is_none() {
        println!("Embree 4 not found: set LUZ_EMBREE_LIB to compare.");
    }
    let sphere = scenes::displaced_sphere();
    bench("displaced sphere", &sphere, Vec3::new(-1.6, -1.5, 0.8), Vec3::new(0.0, 0.0, -0.1), embree.as_ref());
    let interior = scenes::interior();
    bench("interior", &interior, Vec3::new(-1.8, -1.7, 0.2), Vec3::new(0.6, 0.5, -0.9), embree.as_ref());
}
