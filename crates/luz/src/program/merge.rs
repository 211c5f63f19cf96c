//! `luz merge`

use super::exit::{Exit, print};
use super::piece_values::RenderOutput;
use super::pieces::MergeArguments;
use super::{output, problems, progress};
use luz::checkpoint::Checkpoint;
use luz::image::ToneMap;

/// Puts parts of a frame together.
pub fn run(arguments: &MergeArguments) -> Exit {
    match merge(arguments) {
        Ok(exit) | Err(exit) => exit,
    }
}

fn merge(arguments: &MergeArguments) -> Result<Exit, Exit> {
    let unwritable = output::problems(arguments.output.iter().map(RenderOutput::path));
    if !unwritable.is_empty() {
        unwritable.iter().for_each(|problem| problems::error(problem));
        return Err(Exit::Output);
    }
    let whole = read_all(arguments)?;
    let list = |shards: Vec<u32>| shards.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
    let (missing, unfinished) = (list(whole.missing()), list(whole.unfinished()));
    let mut gaps = Vec::new();
    if !missing.is_empty() {
        gaps.push(format!("of {} shards these are missing: {missing}", whole.shard_count()));
    }
    if !unfinished.is_empty() {
        gaps.push(format!("these shards are not finished: {unfinished}"));
    }
    if !gaps.is_empty() && !arguments.partial {
        gaps.iter().for_each(|gap| problems::error(gap));
        problems::error("nothing was written; --partial merges what is there");
        return Err(Exit::Checkpoint);
    }
    if !arguments.quiet {
        gaps.iter().for_each(|gap| problems::warning(gap));
    }
    let picture = whole.picture().map_err(|error| {
        problems::error(&error.to_string());
        Exit::Checkpoint
    })?;
    let tone_map = ToneMap { exposure: arguments.exposure, operator: arguments.tone_map.into() };
    let mut is_whole = true;
    for file in &arguments.output {
        let written = match file {
            RenderOutput::Image(file) => output::write_image(&picture, file, tone_map).map_err(|e| e.to_string()),
            RenderOutput::Checkpoint(path) => output::write_checkpoint(&whole, path),
        };
        if let Err(error) = written {
            problems::error(&error);
            is_whole = false;
        }
    }
    if !arguments.quiet {
        let (cost, incidents) = whole.totals();
        let mut words = format!(
            "{} of {} shards · {} paths · {} of rendering",
            whole.parts().len(),
            whole.shard_count(),
            progress::si(cost.paths as f64),
            progress::duration(cost.seconds)
        );
        if !incidents.is_empty() {
            words.push_str(&format!(" · {} samples dropped", incidents.not_finite + incidents.panics));
        }
        print(&format!("{words}\n"));
    }
    if is_whole { Ok(Exit::Success) } else { Err(Exit::Output) }
}

/// All parts in one, or everything that is wrong with them.
fn read_all(arguments: &MergeArguments) -> Result<Checkpoint, Exit> {
    let mut whole: Option<Checkpoint> = None;
    let mut is_sound = true;
    for path in &arguments.parts {
        let added = match (Checkpoint::read(path), &mut whole) {
            (Err(error), _) => Err(format!("`{}` {error}", path.display())),
            (Ok(part), None) => {
                whole = Some(part);
                Ok(())
            }
            (Ok(part), Some(whole)) => {
                whole.add(part).map_err(|error| format!("`{}` does not go with those before: {error}", path.display()))
            }
        };
        if let Err(error) = added {
            problems::error(&error);
            is_sound = false;
        }
    }
    whole.filter(|_| is_sound).ok_or(Exit::Checkpoint)
}
