//! Any bytes as a mesh: no panic, no hang, and only good indices.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(mesh) = luz_scene::ply::parse(bytes) {
        let corners = mesh.triangles.as_flattened().iter().chain(mesh.quads.as_flattened());
        assert!(corners.max().is_some_and(|corner| (*corner as usize) < mesh.positions.len()));
    }
});
