//! `luz plan`

use super::exit::{Exit, print};
use super::pieces::PlanArguments;
use super::render::{overrides, refuse};
use super::{output, problems};
use luz::Scene;
use luz::geometry::SimdLevel;
use luz::render::Shard;
use luz::sample::roulette::Roulette;

/// Prints the commands that render a scene in shards.
pub fn run(arguments: &PlanArguments) -> Exit {
    if arguments.overrides.roulette == Some(Roulette::Efficiency) {
        problems::error(NO_SHARDS_BY_EFFICIENCY);
        return Exit::Usage;
    }
    // So that mistakes are found here, and not on every machine.
    let scene = match Scene::open_with(&arguments.scene, &overrides(&arguments.overrides), SimdLevel::Auto) {
        Ok(scene) => scene,
        Err(errors) => return refuse(&errors),
    };
    problems::print_all(&scene.diagnostics, &scene.sources);
    let path = quoted(&arguments.scene.display().to_string());
    let options: String = arguments.overrides.to_arguments().iter().map(|a| format!(" {}", quoted(a))).collect();
    let stem = output::scene_name(scene.settings.filename.as_deref(), &arguments.scene);
    let name = |index: u32| quoted(&format!("{stem}-{index}-of-{}.luz", arguments.shards));
    let mut text = String::new();
    for index in 0..arguments.shards {
        let shard = Shard { index, count: arguments.shards };
        text.push_str(&format!("luz render {path}{options} --shard {shard} -o {}\n", name(index + 1)));
    }
    let parts: Vec<String> = (1..=arguments.shards).map(name).collect();
    let [exr, png] = ["exr", "png"].map(|extension| quoted(&format!("{stem}.{extension}")));
    text.push_str(&format!("luz merge {} -o {exr} -o {png}\n", parts.join(" ")));
    print(&text)
}

/// Why not.
pub const NO_SHARDS_BY_EFFICIENCY: &str =
    "roulette by efficiency learns from the whole frame, and so cannot be rendered in shards";

/// As a shell reads it as one word.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=%+@".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_they_must_be() {
        assert_eq!(quoted("a/b-1.pbrt"), "a/b-1.pbrt");
        assert_eq!(quoted("a b"), "'a b'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted(""), "''");
    }
}
