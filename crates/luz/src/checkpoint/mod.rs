//! Renders at rest: files from which a render goes on, or from which parts of it are put together.
//!
//! A file holds one or more parts of one frame ([`Part`]) with the [`Identity`] of what they are parts of. Parts of equal
//! identity can be put together in any order and grouping ([`Checkpoint::merge`] is commutative, associative and
//! idempotent), and give the bits that one render of the whole frame gives.

mod file;
mod identity;
#[cfg(test)]
mod tests;

pub use file::{FileError, VERSION};
pub use identity::{Identity, SIMD_OPTION, content_hash};

use luz_image::{Chromaticities, Image, ImageError, Placement};
use luz_render::film::Film;
use luz_render::{Incidents, Part, RenderCost, Renderer};

/// Parts of a frame, and what they are parts of.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// What the parts are parts of.
    pub identity: Identity,
    /// By the number of their shard, ascending.
    parts: Vec<Part>,
}

/// Checkpoints that don't go together.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MergeError {
    /// They are of different frames.
    #[error("they are not of the same frame: {}", .0.join("; "))]
    Different(Vec<String>),
    /// They cut the frame into different numbers of shards.
    #[error("one is of {0} shards, another of {1}")]
    ShardCounts(u32, u32),
    /// The same samples of the same shard have different values: one of the files is of a different program or machine.
    #[error("both have shard {0}, but with different values")]
    Conflict(u32),
}

impl Checkpoint {
    /// What is there of a render after its last pass.
    pub fn of(identity: Identity, renderer: &Renderer<'_>) -> Self {
        Self { identity, parts: vec![renderer.part()] }
    }

    /// The parts, by the number of their shard.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// Of how many shards the frame is.
    pub fn shard_count(&self) -> u32 {
        self.parts.first().map_or(1, |part| part.header.shard.count)
    }

    /// The shards that are not there, counted from 1.
    pub fn missing(&self) -> Vec<u32> {
        let is_there = |index: &u32| self.parts.iter().any(|part| part.header.shard.index == *index);
        (0..self.shard_count()).filter(|index| !is_there(index)).map(|index| index + 1).collect()
    }

    /// The shards that are there but not done, counted from 1.
    pub fn unfinished(&self) -> Vec<u32> {
        let unfinished = self.parts.iter().filter(|part| !part.header.is_finished);
        unfinished.map(|part| part.header.shard.index + 1).collect()
    }

    /// The parts of both. Of a shard that both have, the one with more samples is taken.
    ///
    /// # Errors
    /// If they are not of the same frame.
    pub fn merge(mut self, other: Self) -> Result<Self, MergeError> {
        self.add(other)?;
        Ok(self)
    }

    /// Takes over the parts of another, as [`merge`](Self::merge) does, and stays as it is where that is an error.
    ///
    /// # Errors
    /// If they are not of the same frame.
    pub fn add(&mut self, other: Self) -> Result<(), MergeError> {
        let differences = self.identity.differences(&other.identity);
        if !differences.is_empty() {
            return Err(MergeError::Different(differences));
        }
        let (ours, theirs) = (self.shard_count(), other.shard_count());
        if ours != theirs {
            return Err(MergeError::ShardCounts(ours.min(theirs), ours.max(theirs)));
        }
        let place = |parts: &[Part], part: &Part| {
            parts.binary_search_by_key(&part.header.shard.index, |p| p.header.shard.index)
        };
        for part in &other.parts {
            if place(&self.parts, part).is_ok_and(|known| are_in_conflict(&self.parts[known], part)) {
                return Err(MergeError::Conflict(part.header.shard.index + 1));
            }
        }
        for part in other.parts {
            match place(&self.parts, &part) {
                Ok(known) if is_preferred(&part, &self.parts[known]) => self.parts[known] = part,
                Ok(_) => {}
                Err(place) => self.parts.insert(place, part),
            }
        }
        if other.identity.is_preferred_to(&self.identity) {
            self.identity = other.identity;
        }
        Ok(())
    }

    /// The film, as far as its parts are there.
    ///
    /// # Errors
    /// If the parts do not fit the frame.
    pub fn film(&self) -> Result<Film, FileError> {
        Part::assemble(&self.parts, self.identity.contents, self.identity.bounds).map_err(|_| FileError::Unfit)
    }

    /// What all parts have cost, and what went wrong in them.
    pub fn totals(&self) -> (RenderCost, Incidents) {
        let (mut cost, mut incidents) = (RenderCost::default(), Incidents::default());
        for part in &self.parts {
            cost.add(&part.header.cost);
            incidents.merge(part.header.incidents.clone());
        }
        (cost, incidents)
    }

    /// The fewest and the most samples that pixels of the parts have got.
    pub fn samples(&self) -> (u32, u32) {
        let counts = || self.parts.iter().map(|part| part.header.samples_done);
        (counts().min().unwrap_or(0), counts().max().unwrap_or(0))
    }

    /// The picture, as far as its parts are there; what is not is black, with zero variance.
    ///
    /// # Errors
    /// If the parts do not fit the frame, or the picture not the memory.
    pub fn picture(&self) -> Result<Image, PictureError> {
        let Identity { bounds, resolution, seed, chromaticities, .. } = self.identity;
        let (fewest, most) = self.samples();
        let samples = if fewest == most { format!("{most}") } else { format!("{fewest} to {most}") };
        let at_most = if self.identity.contents.halves { "at most " } else { "" };
        let comment = format!("{at_most}{samples} samples per pixel, seed {seed}");
        let mut image = self.film()?.to_image()?;
        describe(&mut image, Chromaticities::from(chromaticities), [bounds.x0, bounds.y0], resolution, comment);
        Ok(image)
    }
}

/// A picture that cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The parts are no parts of it.
    #[error(transparent)]
    File(#[from] FileError),
    /// It does not fit in memory.
    #[error(transparent)]
    Image(#[from] ImageError),
}

/// Writes into a picture what a file should know of it.
pub fn describe(
    image: &mut Image,
    chromaticities: Chromaticities,
    [x, y]: [u32; 2],
    resolution: [u32; 2],
    comment: String,
) {
    let [full_width, full_height] = resolution.map(|size| size as usize);
    image.metadata.chromaticities = Some(chromaticities);
    image.metadata.placement = Some(Placement { x: x as i32, y: y as i32, full_width, full_height });
    let text = &mut image.metadata.text;
    text.insert("software".to_owned(), concat!("luz ", env!("CARGO_PKG_VERSION")).to_owned());
    // One comment: attributes without a place in the format's standard are written in any order, and equal pictures
    // should be equal files.
    text.insert("comments".to_owned(), comment);
}

/// How far a part is.
fn progress(part: &Part) -> (u32, bool) {
    (part.header.rounds_done, part.header.is_finished)
}

/// Do two states of one shard contradict each other?
fn are_in_conflict(a: &Part, b: &Part) -> bool {
    progress(a) == progress(b) && a.data != b.data
}

/// Of two states of one shard, is the first the one to keep? The later one is; of equal ones always the same, since times differ from
/// run to run, as does which incidents came first.
fn is_preferred(a: &Part, b: &Part) -> bool {
    let text = |part: &Part| format!("{:?}", part.header);
    let order = progress(b).cmp(&progress(a));
    let order = order.then_with(|| a.header.cost.seconds.total_cmp(&b.header.cost.seconds));
    order.then_with(|| text(a).cmp(&text(b))).is_lt()
}
