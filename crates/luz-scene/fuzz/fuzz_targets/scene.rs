//! Any bytes as a scene: no panic, no hang, and every diagnostic can be shown.
#![no_main]

use libfuzzer_sys::fuzz_target;
use luz_scene::ReadOptions;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    // No such directory: scenes that include files find none.
    let result = luz_scene::read_bytes("scene", bytes.to_vec(), Path::new("/nowhere"), &ReadOptions::default());
    match result {
        Ok((scene, warnings)) => drop(warnings.render(&scene.sources)),
        Err(errors) => assert!(!errors.to_string().is_empty()),
    }
});
