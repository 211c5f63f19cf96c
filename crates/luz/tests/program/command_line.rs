use super::support::Folder;

#[test]
fn the_help_shows_commands_examples_and_exit_codes() {
    let help = Folder::new().run("--help").ends_with(0).stdout;
    for part in ["render", "info", "compare", "study", "completions", "Examples:", "Exit codes:", "130  interrupted"] {
        assert!(help.contains(part), "{part} is not in {help}");
    }
    for command in ["render", "info", "compare", "study", "completions"] {
        let help = Folder::new().run(&format!("{command} --help")).ends_with(0).stdout;
        assert!(help.contains("Examples:"), "{help}");
    }
}

#[test]
fn without_arguments_the_help_is_shown() {
    assert!(Folder::new().run("").ends_with(2).stderr.contains("Usage: luz"));
}

#[test]
fn completions_are_made_for_every_shell() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = Folder::new().run(&format!("completions {shell}")).ends_with(0).stdout;
        assert!(script.contains("render"), "{shell}");
    }
}

#[test]
fn a_wrong_command_line_exits_with_2_and_says_why() {
    let folder = Folder::new();
    for (arguments, reason) in [
        ("paint scene.pbrt", "paint"),
        ("render", "SCENE"),
        ("render s.pbrt --spp 0", "--spp"),
        ("render s.pbrt --spp many", "--spp"),
        ("render s.pbrt --threads 0", "--threads"),
        ("render s.pbrt --resolution 100", "WxH"),
        ("render s.pbrt --resolution 0x10", "size"),
        ("render s.pbrt --crop 0,1,0", "four numbers"),
        ("render s.pbrt --crop 0.5,0.5,0,1", "empty"),
        ("render s.pbrt --exposure bright", "--exposure"),
        ("render s.pbrt --integrator guess", "possible values: path"),
        ("render s.pbrt --sampler sobal", "sobol"),
        ("render s.pbrt -o picture", "extension"),
        ("render s.pbrt -o picture.gif", "exr"),
        ("compare a.exr", "REFERENCE"),
        ("compare a.exr b.exr --threshold relmse", "METRIC=VALUE"),
        ("compare a.exr b.exr --threshold foo=1", "relmse"),
    ] {
        folder.run(arguments).ends_with(2).complains(&[reason]);
    }
    assert!(folder.files().is_empty());
}
