//! The trees find exactly what testing every primitive finds, on every instruction set.

mod common;

use common::{LEVELS, Random, accelerate, random_ray, soup};
use luz_geometry::{Accelerator, Hit, Ray, Shape, SimdLevel};

/// The hits of all levels, checked to be the same to the last bit.
fn agreed(levels: &[Accelerator], ray: &Ray) -> Option<Hit> {
    let hit = levels[0].closest_hit(ray);
    for accelerator in levels {
        assert_eq!(accelerator.closest_hit(ray), hit, "{:?} {ray:?}", accelerator.simd());
        assert_eq!(accelerator.any_hit(ray), hit.is_some(), "{:?} {ray:?}", accelerator.simd());
    }
    hit
}

#[test]
fn trees_agree_with_brute_force() {
    let mut random = Random(1);
    for (n, size) in [(1, 1.0), (3, 1.0), (5, 0.7), (40, 0.5), (300, 0.2)] {
        let mesh = soup(&mut random, n, size);
        let levels = LEVELS.map(|level| accelerate([Shape::Triangles(mesh.clone())], level));
        // One accelerator per triangle has nothing to choose.
        let singles: Vec<Accelerator> = (0..n)
            .map(|i| {
                let mut one = mesh.clone();
                one.indices = vec![mesh.indices[i]];
                accelerate([Shape::Triangles(one)], SimdLevel::Scalar)
            })
            .collect();
        for _ in 0..2_000 {
            let ray = random_ray(&mut random);
            let brute = singles
                .iter()
                .enumerate()
                .filter_map(|(i, a)| a.closest_hit(&ray).map(|h| Hit { primitive: i as u32, ..h }))
                .min_by(|a, b| a.t.total_cmp(&b.t).then(a.primitive.cmp(&b.primitive)));
            assert_eq!(agreed(&levels, &ray), brute, "{ray:?}");
        }
    }
}

#[test]
fn all_levels_find_the_same_hits() {
    let mut random = Random(2);
    let mesh = soup(&mut random, 20_000, 0.03);
    let levels = LEVELS.map(|level| accelerate([Shape::Triangles(mesh.clone())], level));
    let mut hits = 0;
    for _ in 0..1_000_000 / 4 {
        hits += usize::from(agreed(&levels, &random_ray(&mut random)).is_some());
    }
    assert!(hits > 50_000, "{hits}");
}
