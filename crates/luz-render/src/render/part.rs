//! A render, or a part of it, at rest: all that is needed to go on with it, or to put it together with others.

use super::adaptive::SampleLimits;
use super::incident::Incidents;
use super::optimal::OptimalDirect;
use super::pixels::PixelRounds;
use super::shard::Shard;
use super::{RenderCost, Renderer};
use crate::film::{Film, FilmContents, PixelBounds};
use crate::integrator::efficiency::{EfficiencyGuide, PixelRecord, SavedGuide};
use crate::integrator::metropolis::MutationStatistics;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// What is known of a part beside its pixels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartHeader {
    /// Which part of the frame it is.
    pub shard: Shard,
    /// Rounds done: samples per pixel, or per half of each pixel; before those, rounds in which chains are prepared.
    pub rounds_done: u32,
    /// Samples, or mutations, per pixel, of the pixels that have got most.
    pub samples_done: u32,
    /// Is it done?
    pub is_finished: bool,
    /// What it has cost.
    pub cost: RenderCost,
    /// Samples that went wrong.
    pub incidents: Incidents,
    /// What became of mutations.
    pub mutations: MutationStatistics,
    limits: SampleLimits,
    /// Lengths of the sections of its data, in bytes.
    sections: [u64; Section::COUNT],
}

/// The sections of a part's data, in their order. Numbers are little-endian.
#[derive(Clone, Copy)]
enum Section {
    /// Sums of pixels, signed sums, layers: the film's, for the shard's pixels in the order of the film.
    Film,
    /// The limits that adaptive sampling has decided on.
    Limits,
    /// What pixels have learned of their direct light.
    Optimal,
    /// What roulette by efficiency knows of pixels.
    Records,
    /// What roulette by efficiency knows of the scene.
    Guide,
    /// Splats, of the whole frame.
    Splats,
    /// Markov chains, and what they begin from.
    Chains,
}

impl Section {
    const COUNT: usize = 7;
}

/// A render, or a part of it, at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// What is known of it beside its pixels.
    pub header: PartHeader,
    /// Its pixels, and what has been learned.
    pub data: Vec<u8>,
}

/// Data that do not fit what they are said to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("its data do not fit its header")]
pub struct PartError;

impl PartHeader {
    /// How many bytes of data belong to it; `None` if there cannot be so many.
    pub fn data_length(&self) -> Option<u64> {
        self.sections.iter().try_fold(0u64, |sum, &length| sum.checked_add(length))
    }

    fn section(&self, section: Section) -> Option<Range<usize>> {
        let before = &self.sections[..section as usize];
        let start = before.iter().try_fold(0u64, |sum, &length| sum.checked_add(length))?;
        let end = start.checked_add(self.sections[section as usize])?;
        Some(usize::try_from(start).ok()?..usize::try_from(end).ok()?)
    }
}

impl Part {
    fn section(&self, section: Section) -> Result<&[u8], PartError> {
        self.header.section(section).and_then(|range| self.data.get(range)).ok_or(PartError)
    }

    /// The pixels that it has, of those of a film. That there are as many of them in the data is checked before any memory is
    /// asked for that is not in proportion to the data.
    fn runs(&self, contents: FilmContents, bounds: PixelBounds) -> Result<Vec<Range<usize>>, PartError> {
        let bytes = self.section(Section::Film)?.len();
        if !self.header.shard.can_have(bytes / Film::bytes_of(contents, 1).unwrap_or(1), bounds) {
            return Err(PartError);
        }
        let runs = self.header.shard.runs(bounds);
        let pixels = runs.iter().map(Range::len).sum();
        if Film::bytes_of(contents, pixels) == Some(bytes) { Ok(runs) } else { Err(PartError) }
    }

    /// Copies the pixels into a film of the whole frame, and adds the splats.
    ///
    /// # Errors
    /// If they are not those of such a film, which then stays as it is.
    pub fn fill(&self, film: &mut Film) -> Result<(), PartError> {
        let runs = self.check(film)?;
        film.read_runs(&runs, self.section(Section::Film)?).ok_or(PartError)?;
        if let Some(sums) = film.splats_mut() {
            let written = sums.read(self.section(Section::Splats)?).ok_or(PartError)?;
            sums.add_written(&written);
        }
        Ok(())
    }

    /// The pixels that it has, of those of a film that it fits.
    fn check(&self, film: &Film) -> Result<Vec<Range<usize>>, PartError> {
        let runs = self.runs(film.contents(), film.bounds())?;
        let splats = self.section(Section::Splats)?;
        let fits = film.splats().map_or(splats.is_empty(), |sums| sums.read(splats).is_some());
        if fits { Ok(runs) } else { Err(PartError) }
    }

    /// The film of a frame, as far as the parts have it.
    ///
    /// # Errors
    /// If they are not parts of such a frame.
    pub fn assemble(parts: &[Self], contents: FilmContents, bounds: PixelBounds) -> Result<Film, PartError> {
        // Before so much memory is asked for.
        if !parts.iter().all(|part| part.runs(contents, bounds).is_ok()) || !Film::fits_in_memory(contents, bounds) {
            return Err(PartError);
        }
        let mut film = Film::new(contents, bounds);
        parts.iter().try_for_each(|part| part.fill(&mut film))?;
        Ok(film)
    }
}

impl Renderer<'_> {
    /// The render as it is after the last pass.
    pub fn part(&self) -> Part {
        let runs = self.shard.runs(self.film.bounds());
        let mut data = self.film.bytes_of_runs(&runs);
        let mut sections = [0; Section::COUNT];
        let mut end_section = |section: Section, data: &Vec<u8>| {
            let before: u64 = sections.iter().sum();
            sections[section as usize] = data.len() as u64 - before;
        };
        end_section(Section::Film, &data);
        let nothing = SampleLimits::new(None, 0);
        let (limits, decided) = self.pixels.as_ref().map_or(&nothing, |pixels| &pixels.limits).saved();
        data.extend_from_slice(bytemuck::cast_slice(decided));
        end_section(Section::Limits, &data);
        if let Some(pixels) = &self.pixels {
            let halves = pixels.samplers.len();
            if !pixels.optimal.is_empty() {
                for run in &runs {
                    write_values(&pixels.optimal[run.start * halves..run.end * halves], &mut data);
                }
            }
        }
        end_section(Section::Optimal, &data);
        data.extend_from_slice(bytemuck::cast_slice(self.pixels.as_ref().map_or(&[][..], |p| &p.pixel_records)));
        end_section(Section::Records, &data);
        if let Some(guide) = self.pixels.as_ref().and_then(|pixels| pixels.guide.as_ref()) {
            write_values(&[guide.save()], &mut data);
        }
        end_section(Section::Guide, &data);
        if let Some(splats) = self.film.splats() {
            splats.write(&mut data);
        }
        end_section(Section::Splats, &data);
        if let Some(chains) = &self.chains {
            data.extend(chains.save());
        }
        end_section(Section::Chains, &data);
        let header = PartHeader {
            shard: self.shard,
            rounds_done: self.rounds_done,
            samples_done: self.samples_done(),
            is_finished: self.is_finished(),
            cost: self.cost,
            incidents: self.incidents.clone(),
            mutations: self.chains.as_ref().map(|chains| chains.statistics().clone()).unwrap_or_default(),
            limits,
            sections,
        };
        Part { header, data }
    }

    /// Goes on from where a part was left. The render must be of the same scene and settings, and none of its passes done.
    ///
    /// # Errors
    /// If the part is none of such a render.
    pub fn restore(&mut self, part: &Part) -> Result<(), PartError> {
        let PartHeader { shard, rounds_done, cost, incidents, limits, .. } = part.header.clone();
        let area = self.film.bounds().area();
        let runs = part.check(&self.film)?;
        let sampled = match &self.pixels {
            Some(pixels) => Some(pixels.restored(part, limits, &runs, area, rounds_done)?),
            None => None,
        };
        let saved = part.section(Section::Chains)?;
        match &mut self.chains {
            Some(chains) => {
                let statistics = part.header.mutations.clone();
                chains.restore(saved, statistics, shard, rounds_done).ok_or(PartError)?;
            }
            None if saved.is_empty() => {}
            None => return Err(PartError),
        }
        // It has been checked that this works, before anything was changed.
        part.fill(&mut self.film)?;
        self.set_shard(shard);
        (self.rounds_done, self.cost, self.incidents) = (rounds_done, cost, incidents);
        // The pace of preparation says nothing of that of chains.
        self.pace = if self.chains.is_some() { (0, 0.0) } else { (rounds_done, cost.seconds) };
        if let (Some(pixels), Some(sampled)) = (&mut self.pixels, sampled) {
            (pixels.limits, pixels.optimal, pixels.guide, pixels.pixel_records) = sampled;
            // For other numbers of samples pilots may be shorter, and this one done by now.
            pixels.limits.decide(self.rounds_done, &self.film);
        }
        Ok(())
    }
}

/// What samples of pixels have decided and learned.
type Learned = (SampleLimits, Vec<OptimalDirect>, Option<EfficiencyGuide>, Vec<PixelRecord>);

impl PixelRounds<'_> {
    /// What a part has decided and learned by some round, of a film of so many pixels.
    fn restored(
        &self,
        part: &Part,
        limits: SampleLimits,
        runs: &[Range<usize>],
        area: usize,
        rounds_done: u32,
    ) -> Result<Learned, PartError> {
        let decided = part.section(Section::Limits)?;
        let limits = self.limits.restored(limits, decided, area).ok_or(PartError)?;
        let mut optimal = self.optimal.clone();
        let mut values = part.section(Section::Optimal)?;
        if !optimal.is_empty() {
            let halves = self.samplers.len();
            for run in runs {
                for estimator in &mut optimal[run.start * halves..run.end * halves] {
                    *estimator = read_value::<OptimalDirect>(&mut values).ok_or(PartError)?;
                }
            }
        }
        let records = part.section(Section::Records)?;
        let mut pixel_records = self.pixel_records.clone();
        if records.len() != size_of_val(&*pixel_records) || !values.is_empty() {
            return Err(PartError);
        }
        bytemuck::cast_slice_mut::<PixelRecord, u8>(&mut pixel_records).copy_from_slice(records);
        let mut saved = part.section(Section::Guide)?;
        let guide = match &self.guide {
            Some(_) => {
                let saved = read_value::<SavedGuide>(&mut saved).ok_or(PartError)?;
                let guide = EfficiencyGuide::restore(saved).filter(|guide| guide.epoch_end() > rounds_done);
                Some(guide.ok_or(PartError)?)
            }
            None => None,
        };
        if saved.is_empty() { Ok((limits, optimal, guide, pixel_records)) } else { Err(PartError) }
    }
}

/// Values of a type, one after the other, each behind its length.
fn write_values<T: Serialize>(values: &[T], out: &mut Vec<u8>) {
    for value in values {
        // Numbers, arrays and structures of them always have such a form.
        let bytes = postcard::to_allocvec(value).unwrap_or_default();
        out.extend_from_slice(&(bytes.len() as u64).to_le_bytes());
        out.extend_from_slice(&bytes);
    }
}

fn read_value<'a, T: Deserialize<'a>>(bytes: &mut &'a [u8]) -> Option<T> {
    let (length, rest) = bytes.split_first_chunk()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
    let (value, rest) = rest.split_at_checked(length)?;
    *bytes = rest;
    postcard::from_bytes(value).ok()
}
