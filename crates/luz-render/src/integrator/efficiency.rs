//! Efficiency-aware Russian roulette and splitting (Rath et al. 2022, "EARS").
//!
//! While a picture is rendered, a [`EfficiencyGuide`] learns what paths find from where they are, how much that varies and how
//! many rays it takes; from that and from the variance of the pixels follows how often a path should go on
//! ([`luz_sample::roulette::Efficiency`]). It learns in epochs of doubling length, and says within an epoch what the one before has
//! taught. Its sums are of integers, so that their order changes nothing.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use luz_color::SampledSpectrum;
use luz_geometry::SurfacePoint;
use luz_sample::roulette::{Efficiency, Limits};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// The first epoch, in samples per pixel.
const FIRST_EPOCH: u32 = 4;
/// Cells from which more paths have gone on in an epoch are divided into eight.
const CROWDED: u64 = 8192;
/// Cells of which less is known don't have a say.
const KNOWN: u64 = 32;
const MAX_CELLS: usize = 1 << 16;
/// The directions that surfaces face, for this purpose: along ±x, ±y, ±z.
const FACINGS: usize = 6;
/// What is added to the pixels' values, relative to their mean, so that dark pixels don't take all.
const DARKNESS: f64 = 0.05;
/// The pixels' variances above this quantile are left out of their mean.
const QUANTILE: f64 = 0.99;

/// Where and in which direction surfaces are, by number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Octree {
    min: [f32; 3],
    size: f32,
    /// Eight children in a row, or the number of a leaf.
    nodes: Vec<Node>,
    leaves: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
enum Node {
    Inner(u32),
    Leaf(u32),
}

impl Octree {
    fn new(center: Vec3, radius: f32) -> Self {
        let radius = if radius.is_finite() && radius > 0.0 { radius } else { 1.0 };
        Self {
            min: (center - Vec3::splat(radius)).to_array(),
            size: 2.0 * radius,
            nodes: vec![Node::Leaf(0)],
            leaves: 1,
        }
    }

    fn leaf(&self, position: Vec3) -> usize {
        let mut local = ((position - Vec3::from_array(self.min)) / self.size).clamp(Vec3::ZERO, Vec3::splat(0.999_999));
        let mut node = 0;
        loop {
            match self.nodes[node] {
                Node::Leaf(leaf) => return leaf as usize,
                Node::Inner(first) => {
                    local *= 2.0;
                    let upper = local.cmpge(Vec3::ONE);
                    local -= Vec3::select(upper, Vec3::ONE, Vec3::ZERO);
                    node = (first + upper.bitmask()) as usize;
                }
            }
        }
    }

    /// Divides leaves that are crowded; returns for each new leaf the old one that it was part of.
    fn divide(&mut self, is_crowded: impl Fn(usize) -> bool) -> Vec<usize> {
        let mut origin: Vec<usize> = (0..self.leaves).collect();
        for node in 0..self.nodes.len() {
            let Node::Leaf(leaf) = self.nodes[node] else { continue };
            if !is_crowded(leaf as usize) || origin.len() + 7 > MAX_CELLS {
                continue;
            }
            self.nodes[node] = Node::Inner(self.nodes.len() as u32);
            self.nodes.push(Node::Leaf(leaf));
            for _ in 1..8 {
                self.nodes.push(Node::Leaf(origin.len() as u32));
                origin.push(leaf as usize);
            }
        }
        self.leaves = origin.len();
        origin
    }
}

/// Which of the six directions a surface faces.
fn facing(normal: Vec3) -> usize {
    let a = normal.abs();
    let axis = if a.x >= a.y && a.x >= a.z { 0 } else { 1 + usize::from(a.z > a.y) };
    2 * axis + usize::from(normal[axis] < 0.0)
}

/// One, in the fixed point of the sums below: 44 bits behind the point.
const UNIT: f64 = (1u64 << 44) as f64;

/// What the paths that went on from a cell have found in this epoch. Estimates, which are not negative, are summed in fixed
/// point, and saturate at 2²⁰.
#[derive(Clone, Copy, Debug, Default)]
struct CellSums {
    count: u64,
    rays: u64,
    sum: u128,
    squared: u128,
}

impl CellSums {
    fn add(&mut self, estimate: f64, rays: u32) {
        // NaN becomes zero.
        let fixed = |value: f64| u128::from((value * UNIT) as u64);
        self.merge(&Self {
            count: 1,
            rays: u64::from(rays),
            sum: fixed(estimate),
            squared: fixed(estimate * estimate),
        });
    }

    fn merge(&mut self, other: &Self) {
        self.count = self.count.wrapping_add(other.count);
        self.rays = self.rays.wrapping_add(other.rays);
        self.sum = self.sum.wrapping_add(other.sum);
        self.squared = self.squared.wrapping_add(other.squared);
    }

    /// In the measure of light, not scaled any more.
    fn outcome(&self, scale: f64) -> CellOutcome {
        if self.count < KNOWN {
            return CellOutcome::default();
        }
        let n = self.count as f64;
        let mean = self.sum as f64 / (UNIT * n * scale);
        let second_moment = self.squared as f64 / (UNIT * n * scale * scale);
        CellOutcome { second_moment, variance: (second_moment - mean * mean).max(0.0), rays: self.rays as f64 / n }
    }
}

/// What an epoch has taught of a cell; no rays where it was too little.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct CellOutcome {
    second_moment: f64,
    variance: f64,
    rays: f64,
}

/// What is known of a pixel, in the guide's own measure of light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PixelRecord {
    sum: f64,
    squared: f64,
    rays: u64,
    /// The value that its error is relative to, from the epochs before this; zero in the first.
    value: f64,
}

/// How often paths go on, from where.
#[derive(Debug)]
pub struct EfficiencyGuide {
    octree: Octree,
    sums: Vec<CellSums>,
    outcomes: Vec<CellOutcome>,
    efficiency: Option<Efficiency>,
    /// What estimates are multiplied by before they are summed, to be about one; zero in the first epoch.
    scale: f64,
    epoch_end: u32,
}

/// A guide at rest, to be saved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SavedGuide {
    octree: Octree,
    sums: Vec<[u64; 6]>,
    outcomes: Vec<CellOutcome>,
    efficiency: Option<Efficiency>,
    scale: f64,
    epoch_end: u32,
}

impl EfficiencyGuide {
    /// Knows nothing of a scene within the given sphere.
    pub fn new(center: Vec3, radius: f32) -> Self {
        Self {
            octree: Octree::new(center, radius),
            sums: empty_sums(1),
            outcomes: vec![CellOutcome::default(); FACINGS],
            efficiency: None,
            scale: 0.0,
            epoch_end: FIRST_EPOCH,
        }
    }

    /// The number of samples per pixel at which it is to learn.
    pub fn epoch_end(&self) -> u32 {
        self.epoch_end
    }

    /// The expected number of continuations of a path whose throughput is such a share of the pixel's value; `None` where
    /// nothing is known.
    fn expected(&self, cell: usize, relative_throughput: f64) -> Option<f32> {
        let efficiency = self.efficiency?;
        let CellOutcome { second_moment, variance, rays } = self.outcomes[cell];
        if rays == 0.0 {
            return None;
        }
        let square = relative_throughput * relative_throughput;
        let expected = efficiency.expected_of(square * second_moment, square * variance, rays);
        Some(Limits::SPLITTING.clamp(expected as f32))
    }

    fn cell(&self, surface: &SurfacePoint) -> usize {
        self.octree.leaf(surface.position) * FACINGS + facing(surface.geometric_normal)
    }

    /// Takes in what paths have found. In which order that is done changes nothing.
    pub fn take(&mut self, findings: &Findings) {
        for (&cell, sums) in &findings.cells {
            self.sums[cell as usize].merge(sums);
        }
    }

    /// Ends an epoch: from now on it says what this one has taught. `pixels` are those of the film, `width` in a row.
    pub fn learn(&mut self, samples_done: u32, pixels: &mut [PixelRecord], width: usize) {
        self.epoch_end = samples_done.saturating_mul(2);
        let samples = f64::from(samples_done.max(1));
        let means: Vec<f64> = pixels.iter().map(|pixel| pixel.sum / samples).collect();
        let overall = means.iter().sum::<f64>() / means.len().max(1) as f64;
        let mut relative = Vec::with_capacity(pixels.len());
        for (i, pixel) in pixels.iter_mut().enumerate() {
            pixel.value = smoothed(&means, width, i) + DARKNESS * overall;
            let variance = (pixel.squared / samples - means[i] * means[i]).max(0.0);
            if pixel.value > 0.0 {
                relative.push(variance / (pixel.value * pixel.value));
            }
        }
        relative.sort_by(f64::total_cmp);
        relative.truncate((relative.len() as f64 * QUANTILE).ceil() as usize);
        let variance = relative.iter().sum::<f64>() / relative.len().max(1) as f64;
        let rays = pixels.iter().map(|pixel| pixel.rays).sum::<u64>() as f64 / (samples * pixels.len().max(1) as f64);
        self.efficiency = Efficiency::new(rays, variance);

        if self.scale == 0.0 {
            // The first epoch has but found the measure of things.
            self.scale = if overall > 0.0 { 1.0 / overall } else { 0.0 };
            return;
        }
        let count = |leaf: usize| {
            let sums = &self.sums[leaf * FACINGS..(leaf + 1) * FACINGS];
            sums.iter().map(|sums| sums.count).fold(0, u64::saturating_add)
        };
        let origin = self.octree.divide(|leaf| count(leaf) > CROWDED);
        let scale = self.scale;
        let of_leaf = |leaf: usize| &self.sums[leaf * FACINGS..(leaf + 1) * FACINGS];
        let outcome = |leaf: usize| of_leaf(leaf).iter().map(|sums| sums.outcome(scale));
        self.outcomes = origin.iter().flat_map(|&leaf| outcome(leaf)).collect();
        self.sums = empty_sums(origin.len());
    }

    /// All that it knows.
    pub fn save(&self) -> SavedGuide {
        let sums = |s: &CellSums| {
            let parts = |sum: u128| [sum as u64, (sum >> 64) as u64];
            let ([a, b], [c, d]) = (parts(s.sum), parts(s.squared));
            [s.count, s.rays, a, b, c, d]
        };
        SavedGuide {
            octree: self.octree.clone(),
            sums: self.sums.iter().map(sums).collect(),
            outcomes: self.outcomes.clone(),
            efficiency: self.efficiency,
            scale: self.scale,
            epoch_end: self.epoch_end,
        }
    }

    /// The guide that was saved; `None` if its parts don't fit each other.
    pub fn restore(saved: SavedGuide) -> Option<Self> {
        let SavedGuide { octree, sums, outcomes, efficiency, scale, epoch_end } = saved;
        let fits = |node: &Node| match *node {
            Node::Leaf(leaf) => (leaf as usize) < octree.leaves,
            Node::Inner(first) => (first as usize).checked_add(8).is_some_and(|end| end <= octree.nodes.len()),
        };
        let cells = octree.leaves.checked_mul(FACINGS)?;
        // Children stand behind their parents, so that every walk from the root ends.
        let is_forward =
            octree.nodes.iter().enumerate().all(|(i, node)| !matches!(node, Node::Inner(f) if *f as usize <= i));
        if !octree.nodes.iter().all(fits) || !is_forward || octree.nodes.is_empty() {
            return None;
        }
        if sums.len() != cells || outcomes.len() != cells {
            return None;
        }
        let sums = sums
            .into_iter()
            .map(|[count, rays, a, b, c, d]| CellSums {
                count,
                rays,
                sum: u128::from(b) << 64 | u128::from(a),
                squared: u128::from(d) << 64 | u128::from(c),
            })
            .collect();
        Some(Self { octree, sums, outcomes, efficiency, scale, epoch_end })
    }
}

fn empty_sums(leaves: usize) -> Vec<CellSums> {
    vec![CellSums::default(); leaves * FACINGS]
}

/// The mean over a pixel and its eight neighbours.
fn smoothed(values: &[f64], width: usize, index: usize) -> f64 {
    let width = width.max(1);
    let (x, y) = (index % width, index / width);
    let (mut sum, mut count) = (0.0, 0.0);
    for row in y.saturating_sub(1)..(y + 2).min(values.len() / width) {
        for column in x.saturating_sub(1)..(x + 2).min(width) {
            sum += values[row * width + column];
            count += 1.0;
        }
    }
    if count > 0.0 { sum / count } else { 0.0 }
}

/// What some paths have found, until the guide takes it in.
#[derive(Debug, Default)]
pub struct Findings {
    cells: HashMap<u32, CellSums>,
    /// Room for the books of the next path.
    accounts: Vec<Account>,
}

/// The books of one path: what each of its continuations has found and cost.
#[derive(Debug)]
pub struct Ledger<'a> {
    guide: &'a EfficiencyGuide,
    pixel: &'a mut PixelRecord,
    findings: &'a mut Findings,
}

#[derive(Clone, Copy, Debug)]
struct Account {
    /// Where the path came from; the first account is its own.
    parent: u32,
    /// `u32::MAX` for the camera.
    cell: u32,
    throughput: f32,
    found: f32,
    rays: u32,
}

/// The account of the whole path.
pub const CAMERA_ACCOUNT: u32 = 0;

impl<'a> Ledger<'a> {
    /// The books of a new path of a pixel.
    pub fn new(guide: &'a EfficiencyGuide, pixel: &'a mut PixelRecord, findings: &'a mut Findings) -> Self {
        findings.accounts.clear();
        let camera = Account { parent: CAMERA_ACCOUNT, cell: u32::MAX, throughput: 1.0, found: 0.0, rays: 0 };
        findings.accounts.push(camera);
        Self { guide, pixel, findings }
    }

    /// The expected number of continuations at a surface, as far as it is known.
    pub fn expected(&self, surface: &SurfacePoint, throughput: SampledSpectrum) -> Option<f32> {
        if self.pixel.value <= 0.0 {
            return None;
        }
        self.guide.expected(self.guide.cell(surface), f64::from(throughput.average()) / self.pixel.value)
    }

    /// Opens an account for one continuation.
    pub fn open(&mut self, parent: u32, surface: &SurfacePoint, throughput: SampledSpectrum) -> u32 {
        let cell = self.guide.cell(surface) as u32;
        let accounts = &mut self.findings.accounts;
        accounts.push(Account { parent, cell, throughput: throughput.average(), found: 0.0, rays: 0 });
        (accounts.len() - 1) as u32
    }

    /// Enters light that reaches the camera, and rays, into an account and all that it descends from.
    pub fn enter(&mut self, mut account: u32, light: SampledSpectrum, rays: u32) {
        let light = light.average();
        loop {
            let entry = &mut self.findings.accounts[account as usize];
            entry.found += light;
            entry.rays += rays;
            if account == CAMERA_ACCOUNT {
                return;
            }
            account = entry.parent;
        }
    }

    /// Closes the books.
    pub fn close(self) {
        let scale = self.guide.scale;
        let Findings { cells, accounts } = self.findings;
        for account in &accounts[1..] {
            let estimate = f64::from(account.found) / f64::from(account.throughput) * scale;
            if estimate.is_finite() && scale > 0.0 {
                cells.entry(account.cell).or_default().add(estimate, account.rays);
            }
        }
        let whole = accounts[0];
        let found = f64::from(whole.found);
        if found.is_finite() {
            self.pixel.sum += found;
            self.pixel.squared += found * found;
        }
        self.pixel.rays += u64::from(whole.rays);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crowded_leaves_become_eight() {
        let mut octree = Octree::new(Vec3::ZERO, 1.0);
        assert_eq!(octree.divide(|_| true), [0; 8]);
        assert_eq!(octree.leaf(Vec3::splat(-0.5)), 0);
        assert_eq!(octree.leaf(Vec3::splat(0.5)), 7);
        assert_eq!(octree.leaf(Vec3::new(0.5, -0.5, -0.5)), 1);
        let origin = octree.divide(|leaf| leaf == 7);
        assert_eq!((origin.len(), origin[14]), (15, 7));
        assert_eq!(octree.leaf(Vec3::splat(0.1)), 7);
        assert_eq!(octree.leaf(Vec3::splat(9.0)), 14);
        assert_eq!(octree.leaf(Vec3::splat(f32::NAN)), octree.leaf(Vec3::splat(f32::NAN)));
    }

    #[test]
    fn surfaces_face_six_ways() {
        let ways = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
        assert_eq!(ways.map(facing), [0, 1, 2, 3, 4, 5]);
        assert_eq!(facing(Vec3::new(0.2, -0.9, 0.3).normalize()), 3);
        assert_eq!(facing(Vec3::new(0.2, -0.3, 0.9).normalize()), 4);
    }

    #[test]
    fn fixed_sums_saturate_and_do_not_overflow() {
        let mut sums = CellSums::default();
        (0..1000).for_each(|_| sums.add(1000.0, 1));
        sums.add(f64::NAN, 1);
        sums.add(1e-6, 1);
        assert!((sums.sum as f64 / UNIT / (1e6 + 1e-6) - 1.0).abs() < 1e-15);
        assert!((sums.squared as f64 / UNIT / 1e9 - 1.0).abs() < 1e-15);
        sums.add(1e30, 1);
        assert!((sums.sum as f64 / UNIT - 1e6 - 1_048_576.0).abs() < 1.0);
    }

    #[test]
    fn saved_guides_come_back_and_broken_ones_do_not() {
        let mut guide = EfficiencyGuide::new(Vec3::ZERO, 2.0);
        let mut pixels = [PixelRecord { sum: 4.0, squared: 9.0, rays: 40, value: 0.0 }];
        guide.learn(4, &mut pixels, 1);
        guide.sums[3].add(1.5, 7);
        guide.learn(8, &mut pixels, 1);
        guide.sums[2].add(0.25, 3);
        let saved = guide.save();
        assert_eq!(EfficiencyGuide::restore(saved.clone()).map(|guide| guide.save()), Some(saved.clone()));
        let mut broken = saved.clone();
        broken.octree.nodes[0] = Node::Inner(0);
        assert!(EfficiencyGuide::restore(broken).is_none());
        let mut broken = saved;
        broken.sums.pop();
        assert!(EfficiencyGuide::restore(broken).is_none());
    }
}
