//! Merging is commutative, associative and idempotent; files that are not whole, not ours or not honest are refused.

use super::file::{FileError, VERSION};
use super::{Checkpoint, Identity, MergeError, content_hash};
use crate::Scene;
use luz_render::{Failure, Incident, Overrides, Part, Shard};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::LazyLock;
use xxhash_rust::xxh3::xxh3_128;

const SCENE: &str = r#"
    Film "rgb" "integer xresolution" 40 "integer yresolution" 20
    Sampler "sobol" "integer pixelsamples" 4
    Camera "perspective" "float fov" 40
    WorldBegin
    LightSource "infinite" "rgb L" [ 1 0.9 0.8 ]
    Translate 0 0 5
    Material "diffuse" "rgb reflectance" [ 0.8 0.2 0.1 ]
    Shape "sphere"
"#;

const SHARDS: u32 = 3;
const MOST_ROUNDS: u32 = 4;

fn scene(text: &str) -> Scene {
    Scene::from_text("scene.pbrt", text).expect("the scene is sound")
}

fn identity(scene: &Scene) -> Identity {
    Identity::new(scene, Path::new("scene.pbrt"), &Overrides::default(), Vec::new()).expect("there are no files")
}

/// Every shard after every number of rounds.
static STATES: LazyLock<Vec<Vec<Checkpoint>>> = LazyLock::new(|| {
    let scene = scene(SCENE);
    let of_shard = |index| {
        let mut renderer = scene.renderer();
        renderer.set_shard(Shard { index, count: SHARDS });
        let state = |_| {
            let checkpoint = Checkpoint::of(identity(&scene), &renderer);
            renderer.pass(1);
            checkpoint
        };
        (0..=MOST_ROUNDS).map(state).collect()
    };
    (0..SHARDS).map(of_shard).collect()
});

/// The whole frame in one part.
fn whole(text: &str) -> Checkpoint {
    let scene = scene(text);
    let mut renderer = scene.renderer();
    renderer.finish();
    Checkpoint::of(identity(&scene), &renderer)
}

fn bytes(checkpoint: &Checkpoint) -> Vec<u8> {
    checkpoint.to_bytes().expect("it has a file")
}

/// Checkpoints as they come from several machines and several runs: each run takes its own time, calls the scene as it is
/// called there, and may have seen other incidents first.
fn checkpoints() -> impl Strategy<Value = Vec<Checkpoint>> {
    let one = (0..SHARDS as usize, 0..=MOST_ROUNDS as usize, 0..3_u32, 0..3_u32, 0..3_u32);
    let build = |(shard, rounds, seconds, name, sample): (usize, usize, u32, u32, u32)| {
        let mut checkpoint = STATES[shard][rounds].clone();
        checkpoint.identity.scene = format!("{name}/scene.pbrt").into();
        checkpoint.identity.arguments = vec![format!("--spp={name}")];
        let header = &mut checkpoint.parts[0].header;
        header.cost.seconds = f64::from(seconds) / 3.0;
        if sample > 0 {
            header.incidents.push(Incident { pixel: [1, 2], half: 0, sample, failure: Failure::NotFinite });
        }
        checkpoint
    };
    prop::collection::vec(one.prop_map(build), 1..9)
}

fn merged(all: &[Checkpoint]) -> Checkpoint {
    let mut all = all.iter().cloned();
    let first = all.next().expect("there is one");
    all.fold(first, |a, b| a.merge(b).expect("they go together"))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn order_and_grouping_do_not_matter(
        (all, shuffled) in checkpoints().prop_flat_map(|all| (Just(all.clone()), Just(all).prop_shuffle())),
        pairs in prop::collection::vec(any::<(prop::sample::Index, prop::sample::Index)>(), 8),
    ) {
        let expected = bytes(&merged(&all));
        prop_assert_eq!(&bytes(&merged(&shuffled)), &expected);
        // Any two are merged, put into a file and read again, until one is left.
        let mut heap = shuffled;
        for (a, b) in pairs {
            if heap.len() > 1 {
                let first = heap.swap_remove(a.index(heap.len()));
                let second = heap.swap_remove(b.index(heap.len()));
                let both = first.merge(second).expect("they go together");
                heap.push(Checkpoint::from_bytes(&bytes(&both)).expect("it is sound"));
            }
        }
        prop_assert_eq!(heap.len(), 1);
        prop_assert_eq!(&bytes(&heap[0]), &expected);
    }

    #[test]
    fn duplicates_count_once(all in checkpoints(), again in any::<prop::sample::Index>()) {
        let once = merged(&all);
        let twice = once.clone().merge(all[again.index(all.len())].clone()).expect("they go together");
        prop_assert_eq!(bytes(&twice), bytes(&once));
        prop_assert_eq!(bytes(&once.clone().merge(once.clone()).expect("it goes with itself")), bytes(&once));
    }

    #[test]
    fn of_each_shard_the_most_samples_are_taken(all in checkpoints()) {
        let once = merged(&all);
        for part in once.parts() {
            let same = |c: &&Checkpoint| c.parts[0].header.shard == part.header.shard;
            let most = all.iter().filter(same).map(|c| c.parts[0].header.rounds_done).max();
            prop_assert_eq!(Some(part.header.rounds_done), most);
            let (index, rounds) = (part.header.shard.index as usize, part.header.rounds_done as usize);
            prop_assert_eq!(&part.data, &STATES[index][rounds].parts[0].data);
        }
    }

    #[test]
    fn files_come_back_as_they_were(all in checkpoints(), seconds in 0.0..1e9_f64) {
        let mut whole = merged(&all);
        whole.parts[0].header.cost.seconds = seconds;
        let file = bytes(&whole);
        let read = Checkpoint::from_bytes(&file).expect("it is sound");
        prop_assert_eq!(read.identity, whole.identity.clone());
        prop_assert_eq!(read.parts[0].header.cost, whole.parts[0].header.cost);
        prop_assert_eq!(bytes(&Checkpoint::from_bytes(&file).expect("it is sound")), file);
    }

    #[test]
    fn random_bytes_are_no_checkpoint(noise in prop::collection::vec(any::<u8>(), 0..600), magic in any::<bool>()) {
        let mut file = if magic { bytes(&STATES[0][1])[..12].to_vec() } else { Vec::new() };
        file.extend(noise);
        prop_assert!(Checkpoint::from_bytes(&file).is_err());
    }

    /// As somebody might write it who knows the checksum: refused or taken, but without a panic.
    #[test]
    fn headers_of_noise_are_survived(
        places in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        length in prop::option::of(any::<u32>()),
        cut in 0..64_usize,
    ) {
        let (mut header, data) = opened(&STATES[1][2]);
        for (place, byte) in places {
            // Digits for digits make the more interesting headers.
            let at = place.index(header.len());
            header[at] = if header[at].is_ascii_digit() { b'0' + byte % 10 } else { byte };
        }
        let length = length.unwrap_or(header.len() as u32);
        survive(&signed(length, &header, &data[..data.len() - cut.min(data.len())]));
    }
}

/// The header's text and the data of a checkpoint's file.
fn opened(checkpoint: &Checkpoint) -> (Vec<u8>, Vec<u8>) {
    let file = bytes(checkpoint);
    let data: usize = checkpoint.parts.iter().map(|part| part.data.len()).sum();
    let end = file.len() - 16 - data;
    (file[16..end].to_vec(), file[end..file.len() - 16].to_vec())
}

/// A file with a right checksum.
fn signed(length: u32, header: &[u8], data: &[u8]) -> Vec<u8> {
    let start = [b"\x89luz\r\n\x1a\n".as_slice(), &VERSION.to_le_bytes(), &length.to_le_bytes()].concat();
    let mut file = [start.as_slice(), header, data].concat();
    file.extend(xxh3_128(&file).to_le_bytes());
    file
}

/// Whatever comes of it, it is no panic. Returns whether there is a picture.
fn survive(file: &[u8]) -> bool {
    let Ok(checkpoint) = Checkpoint::from_bytes(file) else { return false };
    let _ = (checkpoint.missing(), checkpoint.unfinished(), checkpoint.totals(), checkpoint.samples());
    let _ = checkpoint.clone().merge(STATES[0][1].clone());
    checkpoint.picture().is_ok()
}

#[test]
fn shards_have_the_picture_of_the_whole() {
    let last: Vec<Checkpoint> = STATES.iter().map(|states| states[MOST_ROUNDS as usize].clone()).collect();
    let merged = merged(&last);
    assert!(merged.missing().is_empty() && merged.unfinished().is_empty());
    let (shards, whole) = (merged.picture().expect("it fits"), whole(SCENE).picture().expect("it fits"));
    assert_eq!(shards.data(), whole.data());
    assert!(shards == whole);
}

#[test]
fn what_is_missing_is_named() {
    let some = merged(&[STATES[2][MOST_ROUNDS as usize].clone(), STATES[0][2].clone()]);
    assert_eq!((some.missing(), some.unfinished(), some.samples()), (vec![2], vec![1], (2, 4)));
    let picture = some.picture().expect("it fits");
    let black = picture.data().chunks_exact(6).filter(|pixel| pixel.iter().all(|&v| v == 0.0)).count();
    let theirs: usize = Shard { index: 1, count: SHARDS }.runs(some.identity.bounds).iter().map(|run| run.len()).sum();
    assert_eq!(black, theirs, "what is not there is black, and nothing else");
}

#[test]
fn what_does_not_belong_together_is_refused_with_the_reason() {
    let ours = STATES[0][2].clone();
    let mut bytes_differ = ours.clone();
    bytes_differ.parts[0].data[5] ^= 1;
    assert_eq!(ours.clone().merge(bytes_differ), Err(MergeError::Conflict(1)));
    let theirs = whole(SCENE);
    assert_eq!(ours.clone().merge(theirs), Err(MergeError::ShardCounts(1, 3)));

    let reason = |checkpoint: Checkpoint| match ours.clone().merge(checkpoint) {
        Err(error @ MergeError::Different(_)) => error.to_string(),
        other => panic!("{other:?}"),
    };
    for (from, to, words) in [
        ("\"integer xresolution\" 40", "\"integer xresolution\" 41", "resolution"),
        ("sobol", "halton", "sampler"),
        ("pixelsamples\" 4", "pixelsamples\" 8", "samples that the sampler is laid out for"),
        ("\"rgb\" \"integer x", "\"gbuffer\" \"integer x", "film"),
        ("Film", "Integrator \"path\" \"integer maxdepth\" 9 Film", "longest path"),
    ] {
        let said = reason(whole(&SCENE.replace(from, to)));
        assert!(said.contains(words), "`{words}` is not in: {said}");
    }
    let mut other = ours.clone();
    other.identity.program = "luz 99.0".to_owned();
    assert!(reason(other).contains("luz 99.0"));
    let mut other = ours.clone();
    other.identity.content = "0".repeat(32);
    assert!(reason(other.clone()).contains("has changed"));
    other.identity.scene = "other.pbrt".into();
    assert!(reason(other).contains("`scene.pbrt` and `other.pbrt` are different"));
}

#[test]
fn the_hash_of_a_scene_is_that_of_its_contents() {
    let folder = tempfile::tempdir().expect("there is room");
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("there is room");
        path
    };
    let hash = |files: &[_]| content_hash(files).expect("they can be read");
    let (a, b, c) = (file("a", "one"), file("b", "two"), file("c", "one"));
    assert_eq!(hash(&[a.clone(), b.clone()]), hash(&[b.clone(), c.clone()]), "neither order nor names count");
    assert_ne!(hash(&[a.clone(), b]), hash(&[a.clone(), c]));
    assert_ne!(hash(std::slice::from_ref(&a)), hash(&[a.clone(), a.clone()]));
    std::fs::remove_file(&a).expect("it is there");
    assert!(content_hash(&[a]).is_err());
}

#[test]
fn files_cut_off_anywhere_are_refused() {
    let file = bytes(&STATES[1][3]);
    assert!(survive(&file));
    for length in 0..file.len() {
        match Checkpoint::from_bytes(&file[..length]) {
            Err(FileError::NotACheckpoint) if length < 8 => {}
            Err(FileError::Damaged) if length >= 8 => {}
            other => panic!("{length} of {} bytes: {other:?}", file.len()),
        }
    }
    let longer = [file.as_slice(), &[0]].concat();
    assert!(matches!(Checkpoint::from_bytes(&longer), Err(FileError::Damaged)));
}

#[test]
fn files_with_a_flipped_bit_are_refused() {
    let file = bytes(&STATES[1][3]);
    // All bits of the start and the end, and every seventh in between.
    let bits = file.len() * 8;
    for bit in (0..bits).filter(|bit| *bit < 2048 || *bit + 256 > bits || bit % 7 == 0) {
        let mut flipped = file.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        match Checkpoint::from_bytes(&flipped) {
            Err(FileError::NotACheckpoint) if bit < 64 => {}
            Err(FileError::Version(_)) if (64..96).contains(&bit) => {}
            Err(FileError::Damaged) if bit >= 96 => {}
            other => panic!("bit {bit}: {other:?}"),
        }
    }
}

#[test]
fn other_versions_and_other_files_are_refused_as_such() {
    let mut file = bytes(&STATES[0][1]);
    file[8..12].copy_from_slice(&(VERSION + 1).to_le_bytes());
    let error = Checkpoint::from_bytes(&file).expect_err("it is of another version").to_string();
    assert!(error.contains("another version of luz"), "{error}");
    for foreign in [&b""[..], b"PNG", b"\x89PNG\r\n\x1a\n and so on", &[0; 4096]] {
        assert!(matches!(Checkpoint::from_bytes(foreign), Err(FileError::NotACheckpoint)));
    }
}

/// Headers that ask for more than there is in the file are refused before any memory is asked for.
#[test]
fn absurd_headers_with_right_checksums_are_refused() {
    let checkpoint = &STATES[1][2];
    let (header, data) = opened(checkpoint);
    let with = |path: &str, lie: Value| {
        let mut header: Value = serde_json::from_slice(&header).expect("it is JSON");
        *header.pointer_mut(path).unwrap_or_else(|| panic!("there is no {path}")) = lie;
        let header = serde_json::to_vec(&header).expect("it is JSON");
        signed(header.len() as u32, &header, &data)
    };
    assert!(survive(&signed(header.len() as u32, &header, &data)));
    let huge = u32::MAX;
    for (path, lie) in [
        ("/identity/bounds", json!({"x0": 0, "y0": 0, "x1": huge, "y1": huge})),
        ("/identity/bounds", json!({"x0": 9, "y0": 9, "x1": 3, "y1": 3})),
        ("/identity/bounds", json!({"x0": 0, "y0": 0, "x1": 0, "y1": 0})),
        ("/parts/0/shard", json!({"index": 0, "count": 0})),
        ("/parts/0/shard", json!({"index": 3, "count": 3})),
        ("/parts/0/shard", json!({"index": 1, "count": huge})),
        ("/parts/0/sections", json!([u64::MAX, 1, 0, 0, 0])),
        ("/parts/0/sections", json!([u64::MAX, 0, 0, 0, 0])),
        ("/parts/0/sections", json!([u64::MAX - 1, u64::MAX, 2, 0, 0])),
        ("/parts/0/sections", json!([1, 0, 0, 0, 0])),
        ("/parts", json!([])),
        ("/identity", json!(null)),
        ("/identity/contents", json!({})),
    ] {
        let file = with(path, lie.clone());
        assert!(matches!(Checkpoint::from_bytes(&file), Err(FileError::Unfit)), "{path}: {lie}");
    }
    // Frames that their resolutions allow.
    for (width, height) in [(huge, huge), (huge, 1), (1, huge), (1 << 16, 1 << 14), (1 << 15, 1 << 15)] {
        let mut header: Value = serde_json::from_slice(&header).expect("it is JSON");
        header["identity"]["resolution"] = json!([width, height]);
        header["identity"]["bounds"] = json!({"x0": 0, "y0": 0, "x1": width, "y1": height});
        for count in [1, 3, 1 << 16] {
            header["parts"][0]["shard"] = json!({"index": 0, "count": count});
            let header = serde_json::to_vec(&header).expect("it is JSON");
            assert!(!survive(&signed(header.len() as u32, &header, &data)), "{width} × {height}, {count} shards");
        }
    }
    for length in [header.len() as u32 + 1, header.len() as u32 - 1, huge, 0] {
        assert!(!survive(&signed(length, &header, &data)), "{length}");
    }
}

#[test]
fn parts_twice_in_a_file_are_refused() {
    let mut twice = STATES[1][2].clone();
    let part: Part = twice.parts[0].clone();
    twice.parts.push(part);
    assert!(matches!(Checkpoint::from_bytes(&bytes(&twice)), Err(FileError::Unfit)));
}
