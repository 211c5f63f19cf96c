use super::support::{BALL, Folder};

#[test]
fn threads_do_not_change_a_bit() {
    let folder = Folder::with_scene(BALL);
    folder.run("render scene.pbrt -o 1.exr --threads 1 --spp 9 --film gbuffer").ends_with(0);
    let one = std::fs::read(folder.path().join("1.exr")).unwrap();
    for threads in [2, 3, 7] {
        let command = format!("render scene.pbrt -o n.exr --threads {threads} --spp 9 --film gbuffer");
        folder.run(&command).ends_with(0);
        assert!(one == std::fs::read(folder.path().join("n.exr")).unwrap(), "{threads} threads");
    }
}

#[test]
fn seeds_do() {
    let folder = Folder::with_scene(BALL);
    folder.run("render scene.pbrt -o a.exr --seed 1").ends_with(0);
    folder.run("render scene.pbrt -o b.exr --seed 2").ends_with(0);
    assert_ne!(folder.image("a.exr"), folder.image("b.exr"));
}
