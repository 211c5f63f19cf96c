//! Reads scenes and says what is in them: `cargo run --release -p luz-scene --example describe -- SCENE…`.

use std::time::Instant;

fn main() {
    for path in std::env::args().skip(1) {
        let start = Instant::now();
        let result = luz_scene::read(&path);
        let seconds = start.elapsed().as_secs_f64();
        match result {
            Ok((scene, warnings)) => {
                let meshes = scene.shapes.iter().filter_map(|s| s.mesh.as_ref());
                let faces: usize = meshes.map(|m| m.triangles.len() + m.quads.len()).sum();
                println!(
                    "{path}: {} files, {} shapes ({faces} faces in meshes), {} objects, {} instances, {} lights, \
                     {} area lights, {} materials, {} textures, {} media, {seconds:.3} s",
                    scene.sources.files().len(),
                    scene.shapes.len(),
                    scene.objects.len(),
                    scene.instances.len(),
                    scene.lights.len(),
                    scene.area_lights.len(),
                    scene.materials.len(),
                    scene.textures.len(),
                    scene.media.len(),
                );
                print!("{}", warnings.render(&scene.sources));
            }
            Err(errors) => println!("{path}: {} errors, {seconds:.3} s\n{errors}", errors.diagnostics.error_count()),
        }
    }
}
