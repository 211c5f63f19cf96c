//! Renders at rest: files from which a render goes on, or from which parts of it are put together.
//!
//! A file holds one or more parts of one frame ([`Part`]) with the [`Identity`] of what they are parts of. Parts of equal
//! identity can be put together in any order and grouping ([`Checkpoint::merge`] is commutative, associative and
//! idempotent), and give the bits that one render of the whole frame gives.

mod file;
mod identity;

pub use file::{FileError, VERSION};
pub use identity::{Identity, SIMD_OPTION, content_hash};

use luz_image::{Chromaticities, Image, ImageError, Placement};
use luz_render::film::Film;
use luz_render::{Incidents, Part, RenderCost, Renderer};
use std::collections::BTreeMap;

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
    pub fn merge(self, other: Self) -> Result<Self, MergeError> {
        let differences = self.identity.differences(&other.identity);
        if !differences.is_empty() {
            return Err(MergeError::Different(differences));
        }
        let (ours, theirs) = (self.shard_count(), other.shard_count());
        if ours != theirs {
            return Err(MergeError::ShardCounts(ours.min(theirs), ours.max(theirs)));
        }
        let identity = self.identity.older(other.identity);
        let mut parts: BTreeMap<u32, Part> = BTreeMap::new();
        for part in self.parts.into_iter().chain(other.parts) {
            let index = part.header.shard.index;
            let better = match parts.remove(&index) {
                Some(known) => better(known, part).ok_or(MergeError::Conflict(index + 1))?,
                None => part,
            };
            parts.insert(index, better);
        }
        Ok(Self { identity, parts: parts.into_values().collect() })
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
        let halves = self.identity.contents.buffers() as u32;
        let samples = |part: &Part| part.header.rounds_done.saturating_mul(halves);
        let counts = || self.parts.iter().map(samples);
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

/// Of two states of one shard the later; `None` if they contradict each other.
fn better(a: Part, b: Part) -> Option<Part> {
    let progress = |part: &Part| (part.header.rounds_done, part.header.is_finished);
    match progress(&a).cmp(&progress(&b)) {
        std::cmp::Ordering::Less => Some(b),
        std::cmp::Ordering::Greater => Some(a),
        // Times differ from run to run; the shorter is taken, whichever comes first.
        std::cmp::Ordering::Equal => {
            (a.data == b.data).then(|| if b.header.cost.seconds < a.header.cost.seconds { b } else { a })
        }
    }
}
