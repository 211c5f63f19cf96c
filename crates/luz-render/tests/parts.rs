//! Renders that rest and go on, and renders put together from shards, have the bits of those that do neither.

mod common;

use common::load;
use common::ways::{SCENE, loaded, ways};
use luz_render::film::PixelBounds;
use luz_render::world::Loaded;
use luz_render::{Overrides, Part, PartError, PartHeader, Renderer, Shard};
use luz_sample::roulette::Roulette;
use proptest::prelude::*;
use serde_json::{Value, json};

fn renderer(loaded: &Loaded) -> Renderer<'_> {
    Renderer::new(&loaded.world, &loaded.camera, &loaded.settings)
}

/// A part as it comes back from a file.
fn filed(part: &Part) -> Part {
    let text = serde_json::to_string(&part.header).expect("headers have a text");
    Part { header: serde_json::from_str(&text).expect("and come back from it"), data: part.data.clone() }
}

/// Renders all, but rests after each of the given rounds and goes on in another renderer.
fn with_rests(loaded: &Loaded, shard: Shard, rests: &[u32]) -> Part {
    let mut render = renderer(loaded);
    render.set_shard(shard);
    let mut done = 0;
    for &rest in rests {
        render.pass(rest - done);
        done = rest;
        let part = filed(&render.part());
        assert!(part.header.rounds_done == rest || part.header.is_finished);
        render = renderer(loaded);
        render.restore(&part).expect("it is a part of this render");
        assert!(render.part() == part, "a part at rest stays as it is");
        assert_eq!(render.shard(), shard);
    }
    render.finish();
    render.part()
}

/// What decides the picture: times differ from run to run, and which incidents come first with the passes.
fn bits(part: &Part) -> (&[u8], u32, u64, u64, u64) {
    let PartHeader { rounds_done, cost, .. } = &part.header;
    (&part.data, *rounds_done, cost.paths, cost.rays, cost.shadow_rays)
}

#[test]
fn rests_change_nothing() {
    for (way, wishes) in ways() {
        let loaded = load(SCENE, &wishes);
        let whole = with_rests(&loaded, Shard::WHOLE, &[]);
        assert!(whole.header.is_finished);
        let rounds = whole.header.rounds_done;
        let each: Vec<u32> = (0..=rounds).collect();
        // Before, at and after the ends of pilots and epochs, and in between.
        for rests in [&[0][..], &[1], &[7], &[15], &[16], &[17], &[3, 11, 20], &[rounds - 1], &[rounds], &each] {
            let rests: Vec<u32> = rests.iter().copied().filter(|&rest| rest <= rounds).collect();
            let rested = with_rests(&loaded, Shard::WHOLE, &rests);
            assert!(bits(&rested) == bits(&whole), "{way}, rests after {rests:?}");
        }
    }
}

#[test]
fn a_render_that_forgets_its_rest_is_noticed() {
    // The test above would be worth nothing if another state gave the same bits.
    for (way, wishes) in ways() {
        let loaded = load(SCENE, &wishes);
        let whole = with_rests(&loaded, Shard::WHOLE, &[]);
        let mut render = renderer(&loaded);
        render.pass(7);
        let mut part = render.part();
        part.data[3] ^= 0x10;
        let mut other = renderer(&loaded);
        other.restore(&part).expect("sums can have any bits");
        other.finish();
        assert!(bits(&other.part()) != bits(&whole), "{way}");
    }
}

#[test]
fn going_on_for_more_samples_is_rendering_more() {
    let with_limit = |limit| {
        let wishes = Overrides { sample_limit: limit, ..ways()[0].1.clone() };
        load(SCENE, &wishes)
    };
    let (short, long) = (with_limit(None), with_limit(Some(29)));
    let begun = with_rests(&short, Shard::WHOLE, &[]);
    assert_eq!(begun.header.rounds_done, 12);
    let mut render = renderer(&long);
    render.restore(&begun).expect("it is the same render");
    assert!(!render.is_finished());
    render.finish();
    assert_eq!(render.samples_done(), 29);
    assert!(bits(&render.part()) == bits(&with_rests(&long, Shard::WHOLE, &[])));
}

#[test]
fn adaptive_renders_go_on_for_other_numbers_of_samples() {
    let with_limit = |limit| {
        let wishes = Overrides {
            adaptive: Some(0.01),
            samples_per_pixel: Some(512),
            sample_limit: Some(limit),
            ..ways()[0].1.clone()
        };
        load(SCENE, &Overrides { resolution: Some([6, 4]), ..wishes })
    };
    // Within the pilot of the first (32 rounds), and after it, for fewer samples and for more.
    for rest in [20, 32, 40] {
        let first = with_limit(512);
        let mut render = renderer(&first);
        render.pass(rest);
        let part = render.part();
        for limit in [16, 64, 256, 512, 1024] {
            let then = with_limit(limit);
            let mut render = renderer(&then);
            render.restore(&part).expect("it is the same render");
            let mut passes = 0;
            while !render.is_finished() {
                render.pass(render.next_pass());
                passes += 1;
                assert!(passes < 1000, "it does not end: rest {rest}, limit {limit}");
            }
            assert!(render.samples_done() <= limit.max(2 * rest), "{rest} {limit}");
        }
    }
}

#[test]
fn shards_are_the_whole() {
    let crop = PixelBounds { x0: 5, y0: 3, x1: 30, y1: 17 };
    for (way, wishes) in ways() {
        if wishes.roulette == Some(Roulette::Efficiency) {
            continue;
        }
        let mut loaded = load(SCENE, &wishes);
        for bounds in [loaded.settings.bounds, crop] {
            loaded.settings.bounds = bounds;
            let mut whole = renderer(&loaded);
            whole.finish();
            // The last has more shards than tiles: some are empty.
            for count in [1, 2, 3, 7] {
                let rests: &[&[u32]] = &[&[], &[5], &[16, 17]];
                let mut parts: Vec<Part> = (0..count)
                    .map(|index| {
                        let rounds = loaded.settings.sample_limit;
                        let rests: Vec<u32> =
                            rests[index as usize % 3].iter().copied().filter(|&rest| rest < rounds).collect();
                        filed(&with_rests(&loaded, Shard { index, count }, &rests))
                    })
                    .collect();
                parts.reverse();
                let film = Part::assemble(&parts, loaded.settings.film_contents(), bounds).expect("they fit");
                assert!(film == *whole.film(), "{way}, {count} shards of {bounds:?}");
                if count > 1 {
                    parts.pop();
                    let film = Part::assemble(&parts, loaded.settings.film_contents(), bounds).expect("they fit");
                    assert!(film != *whole.film(), "{way}, one of {count} shards is missing");
                }
            }
        }
    }
}

/// A part that is not to be restored: nothing has changed then.
fn is_refused(loaded: &Loaded, part: &Part) -> bool {
    let mut render = renderer(loaded);
    let before = render.part();
    let refused = render.restore(part) == Err(PartError);
    assert!(!refused || render.part() == before);
    refused
}

#[test]
fn parts_of_other_renders_are_refused() {
    let parts = ways().map(|(_, wishes)| {
        let loaded = load(SCENE, &wishes);
        let mut render = renderer(&loaded);
        render.pass(20);
        let part = render.part();
        drop(render);
        (loaded, part)
    });
    for (i, (loaded, _)) in parts.iter().enumerate() {
        for (j, (_, part)) in parts.iter().enumerate() {
            let names = [ways()[j].0, ways()[i].0];
            // Splats and samples of paths look the same, whichever techniques have found them.
            if i != j && names.iter().all(|name| ["both walks", "light tracing"].contains(name)) {
                continue;
            }
            assert_eq!(is_refused(loaded, part), i != j, "{} in {}", names[0], names[1]);
        }
    }
    let mut other = loaded();
    other.settings.bounds.x1 -= 1;
    assert!(is_refused(&other, &parts[0].1));
    let bounds = parts[0].0.settings.bounds;
    let contents = parts[3].0.settings.film_contents();
    assert_eq!(Part::assemble(&[parts[0].1.clone()], contents, bounds), Err(PartError));
}

#[test]
fn data_of_other_lengths_are_refused() {
    for (way, wishes) in ways() {
        let loaded = load(SCENE, &wishes);
        let mut render = renderer(&loaded);
        render.pass(20);
        let part = render.part();
        let length = part.data.len();
        for cut in (0..length).step_by(length / 97).chain([length - 1]) {
            let short = Part { data: part.data[..cut].to_vec(), ..part.clone() };
            assert!(is_refused(&loaded, &short), "{way}, {cut} of {length} bytes");
        }
    }
}

/// The part with something else in its header.
fn with_header(part: &Part, change: impl FnOnce(&mut Value)) -> Option<Part> {
    let mut header = serde_json::to_value(&part.header).expect("headers have a text");
    change(&mut header);
    Some(Part { header: serde_json::from_value(header).ok()?, data: part.data.clone() })
}

/// Whatever a header says, nothing panics, and no memory is asked for that the data do not justify.
#[test]
fn headers_that_lie_are_survived() {
    let lies = [
        ("sections", json!([u64::MAX, 1, 0, 0, 0])),
        ("sections", json!([u64::MAX, u64::MAX, u64::MAX, u64::MAX, u64::MAX])),
        ("sections", json!([0, 0, 0, 0, 0])),
        ("sections", json!([1, 1, 1, 1, 1])),
        ("sections", json!([u64::MAX - 7, 8, 8, 0, 0])),
        ("shard", json!({"index": 0, "count": 0})),
        ("shard", json!({"index": 7, "count": 3})),
        ("shard", json!({"index": 1, "count": 3})),
        ("shard", json!({"index": 0, "count": u32::MAX})),
        ("shard", json!({"index": 4_000_000_000_u32, "count": u32::MAX})),
        ("limits", json!({"Uniform": 0})),
        ("limits", json!({"Uniform": u32::MAX})),
        ("limits", json!({"Undecided": {"target": -1.0, "pilot": 0, "most": 0}})),
        ("limits", json!({"Undecided": {"target": 1e300, "pilot": u32::MAX, "most": 1}})),
        ("limits", json!({"Decided": {"rounds": u32::MAX}})),
        ("limits", json!({"Decided": {"rounds": 0}})),
        ("rounds_done", json!(u32::MAX)),
        ("rounds_done", json!(0)),
    ];
    for (way, wishes) in ways() {
        let loaded = load(SCENE, &wishes);
        let mut render = renderer(&loaded);
        render.pass(20);
        let part = render.part();
        for (name, lie) in &lies {
            let Some(lying) = with_header(&part, |header| header[name] = lie.clone()) else { continue };
            let refused = is_refused(&loaded, &lying);
            if matches!(*name, "sections" | "shard") {
                assert!(refused, "{way}, {name}: {lie}");
                let contents = loaded.settings.film_contents();
                assert_eq!(Part::assemble(&[lying], contents, loaded.settings.bounds), Err(PartError));
            } else if !refused {
                let mut render = renderer(&loaded);
                assert_eq!(render.restore(&lying), Ok(()));
                for _ in 0..3 {
                    render.pass(render.next_pass());
                }
                // What is left of it comes to an end.
                assert!(render.is_finished() || render.next_pass() > 0, "{way}, {name}: {lie}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Bytes anywhere in the data, in what has been learned above all, are survived: refused, or taken for values.
    #[test]
    fn data_that_lie_are_survived(
        way in 0..11_usize,
        from_end in any::<bool>(),
        place in 0..4096_usize,
        bytes in prop::collection::vec(any::<u8>(), 1..24),
    ) {
        let (_, wishes) = ways()[way].clone();
        let loaded = load(SCENE, &Overrides { resolution: Some([4, 3]), ..wishes });
        let mut render = renderer(&loaded);
        render.pass(20);
        let mut part = render.part();
        let length = part.data.len();
        let place = place % length;
        let place = if from_end { length - 1 - place } else { place };
        for (to, from) in part.data[place..].iter_mut().zip(bytes) {
            *to = from;
        }
        if !is_refused(&loaded, &part) {
            let mut render = renderer(&loaded);
            prop_assert_eq!(render.restore(&part), Ok(()));
            render.pass(2);
        }
    }
}
