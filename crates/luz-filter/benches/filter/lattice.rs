//! The rival: the bilateral filter on a permutohedral lattice (Adams, Baek and Davis 2010, "Fast High-Dimensional Filtering
//! Using the Permutohedral Lattice"), for colour images.
//!
//! Tuned: packed keys, so that a neighbour along an axis is one addition away; open addressing in a table that stays small;
//! values of four floats; places and weights of the splat kept for the slice.

use luz_image::Image;

/// Column, row, and three colours.
const D: usize = 5;
/// Bits of a coordinate in a key.
const BITS: u32 = 12;

struct Table {
    keys: Vec<u64>,
    /// The vertex in each slot.
    slots: Vec<u32>,
    mask: usize,
    vertices: Vec<u64>,
}

const EMPTY: u64 = u64::MAX;

impl Table {
    fn new(log_size: u32) -> Self {
        let size = 1 << log_size;
        Self { keys: vec![EMPTY; size], slots: vec![0; size], mask: size - 1, vertices: Vec::new() }
    }

    #[inline(always)]
    fn slot(&self, key: u64) -> usize {
        let mut slot = (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize & self.mask;
        while self.keys[slot] != key && self.keys[slot] != EMPTY {
            slot = (slot + 1) & self.mask;
        }
        slot
    }

    #[inline(always)]
    fn insert(&mut self, key: u64) -> u32 {
        let slot = self.slot(key);
        if self.keys[slot] == EMPTY {
            self.keys[slot] = key;
            self.slots[slot] = self.vertices.len() as u32;
            self.vertices.push(key);
            if self.vertices.len() * 2 > self.mask {
                self.grow();
                return self.vertices.len() as u32 - 1;
            }
        }
        self.slots[slot]
    }

    #[inline(always)]
    fn find(&self, key: u64) -> Option<u32> {
        let slot = self.slot(key);
        (self.keys[slot] == key).then(|| self.slots[slot])
    }

    fn grow(&mut self) {
        let size = (self.mask + 1) * 2;
        (self.keys, self.slots, self.mask) = (vec![EMPTY; size], vec![0; size], size - 1);
        for i in 0..self.vertices.len() {
            let slot = self.slot(self.vertices[i]);
            (self.keys[slot], self.slots[slot]) = (self.vertices[i], i as u32);
        }
    }
}

/// Filters an image of three channels.
pub fn filter(image: &Image, sigma_spatial: f32, sigma_range: f32) -> Image {
    let (width, height) = (image.width(), image.height());
    let d1 = D as f32 + 1.0;
    // Splat, blur and slice together have the variance one.
    let scale: [f32; D] = std::array::from_fn(|i| {
        let sigma = if i < 2 { sigma_spatial } else { sigma_range };
        d1 * (2.0f32 / 3.0).sqrt() / (((i + 1) * (i + 2)) as f32).sqrt() / sigma
    });
    let mut table = Table::new(14);
    let mut values: Vec<[f32; 4]> = Vec::new();
    let mut places = vec![[0u32; D + 1]; width * height];
    let mut weights = vec![[0.0f32; D + 1]; width * height];
    // Neighbouring pixels mostly lie in the same simplex.
    let (mut last_keys, mut last_places) = ([EMPTY; D + 1], [0u32; D + 1]);
    for y in 0..height {
        for x in 0..width {
            let i = y * width + x;
            let color = &image.data()[i * 3..i * 3 + 3];
            let position = [x as f32, y as f32, color[0], color[1], color[2]];
            let (keys, barycentric) = simplex(std::array::from_fn(|k| position[k] * scale[k]));
            for k in 0..=D {
                let place = if keys[k] == last_keys[k] { last_places[k] } else { table.insert(keys[k]) };
                last_places[k] = place;
                if place as usize >= values.len() {
                    values.resize(place as usize + 1, [0.0; 4]);
                }
                let value = &mut values[place as usize];
                let w = barycentric[k];
                *value = [value[0] + w * color[0], value[1] + w * color[1], value[2] + w * color[2], value[3] + w];
            }
            last_keys = keys;
            (places[i], weights[i]) = (last_places, barycentric);
        }
    }
    let mut blurred = values.clone();
    for axis in 0..=D {
        // One step: +1 along all coordinates but −D along this one; the last coordinate isn't part of the key.
        let step = (0..D).fold(0u64, |sum, c| {
            let v: i64 = if c == axis { -(D as i64) } else { 1 };
            sum.wrapping_add((v as u64).wrapping_shl(BITS * c as u32))
        });
        for (i, (to, &key)) in blurred.iter_mut().zip(&table.vertices).enumerate() {
            let zero = [0.0; 4];
            let a = table.find(key.wrapping_add(step)).map_or(zero, |n| values[n as usize]);
            let b = table.find(key.wrapping_sub(step)).map_or(zero, |n| values[n as usize]);
            *to = std::array::from_fn(|c| 0.5 * values[i][c] + 0.25 * (a[c] + b[c]));
        }
        std::mem::swap(&mut values, &mut blurred);
    }
    let mut out = image.clone();
    for (pixel, (places, weights)) in out.data_mut().chunks_exact_mut(3).zip(places.iter().zip(&weights)) {
        let mut sum = [0.0f32; 4];
        for (&place, &w) in places.iter().zip(weights) {
            let value = values[place as usize];
            sum = std::array::from_fn(|c| sum[c] + w * value[c]);
        }
        (0..3).for_each(|c| pixel[c] = sum[c] / sum[3]);
    }
    out
}

/// The keys of the vertices of the simplex that a scaled position lies in, and its barycentric coordinates.
#[inline(always)]
fn simplex(position: [f32; D]) -> ([u64; D + 1], [f32; D + 1]) {
    let mut elevated = [0.0f32; D + 1];
    let mut sum = 0.0;
    for i in (1..=D).rev() {
        elevated[i] = sum - i as f32 * position[i - 1];
        sum += position[i - 1];
    }
    elevated[0] = sum;
    let n = D as i32 + 1;
    let nearest: [i32; D + 1] = elevated.map(|e| (e / n as f32).round_ties_even() as i32);
    let excess: i32 = nearest.iter().sum();
    let difference: [f32; D + 1] = std::array::from_fn(|i| elevated[i] - (nearest[i] * n) as f32);
    let mut rank = [0i32; D + 1];
    for i in 0..D {
        for j in i + 1..=D {
            let less = difference[i] < difference[j];
            rank[i] += i32::from(less);
            rank[j] += i32::from(!less);
        }
    }
    let mut origin = nearest;
    for i in 0..=D {
        rank[i] += excess;
        if rank[i] < 0 {
            rank[i] += n;
            origin[i] += 1;
        } else if rank[i] > D as i32 {
            rank[i] -= n;
            origin[i] -= 1;
        }
    }
    let mut barycentric = [0.0f32; D + 2];
    for i in 0..=D {
        let v = (elevated[i] - (origin[i] * n) as f32) / n as f32;
        barycentric[D - rank[i] as usize] += v;
        barycentric[D + 1 - rank[i] as usize] -= v;
    }
    barycentric[0] += 1.0 + barycentric[D + 1];
    let keys = std::array::from_fn(|k| {
        let mut key = 0u64;
        for i in 0..D {
            let k = k as i32;
            let coordinate = origin[i] * n + if rank[i] <= D as i32 - k { k } else { k - n };
            key |= ((coordinate + (1 << (BITS - 1))) as u64 & ((1 << BITS) - 1)) << (BITS * i as u32);
        }
        key
    });
    (keys, std::array::from_fn(|k| barycentric[k]))
}
