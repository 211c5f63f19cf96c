//! Between planes of Y′CbCr and R′G′B′.
//!
//! Sources: ITU-R BT.601-7 and BT.709-6 for the matrices and the limited range, T.871 (JFIF) for the full range.
//!
//! Chroma of half the size is interpolated linearly from where it is sited, and reduced again by the shortest symmetric filter
//! that undoes the interpolation exactly: −1 3 3 −1 (/4) where chroma lies between two pixels, −1 2 6 2 −1 (/8, the low-pass of
//! the 5/3 wavelet) where it lies on one. So frames survive the way to R′G′B′ and back bit by bit.

use rayon::prelude::*;

use crate::{Encoding, Image, ImageError, SampleType};

/// How many chroma samples there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subsampling {
    /// No chroma at all.
    Mono,
    /// One for two by two pixels.
    Yuv420,
    /// One for two pixels of a row.
    Yuv422,
    /// One for each pixel.
    Yuv444,
}

/// Where chroma of half the size lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Siting {
    /// Between the pixels, in both directions: JPEG, MPEG-1.
    Center,
    /// On the left of two pixels of a row, between rows: MPEG-2, H.264 and what follows them.
    Left,
    /// On the upper left of four pixels: DV (whose Cb and Cr are both taken to lie there), BT.2020.
    TopLeft,
}

/// Which luma R′, G′ and B′ make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Matrix {
    /// ITU-R BT.601: standard definition, JPEG.
    Bt601,
    /// ITU-R BT.709: high definition.
    Bt709,
    /// ITU-R BT.2020, non-constant luminance.
    Bt2020,
}

impl Matrix {
    /// What is usual where a video doesn't say: BT.709 from 720 rows on, BT.601 below.
    pub const fn usual(height: usize) -> Self {
        if height >= 720 { Self::Bt709 } else { Self::Bt601 }
    }

    /// The weights of red and blue in luma; green has the rest.
    const fn weights(self) -> (f32, f32) {
        match self {
            Self::Bt601 => (0.299, 0.114),
            Self::Bt709 => (0.2126, 0.0722),
            Self::Bt2020 => (0.2627, 0.0593),
        }
    }
}

/// Which numbers stand for black and white.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Range {
    /// 16 and 235 for eight bits; chroma from 16 to 240.
    Limited,
    /// The smallest and the largest.
    Full,
}

/// How the samples of a video are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct YuvFormat {
    /// How many chroma samples there are.
    pub subsampling: Subsampling,
    /// Where they lie; of no meaning for [`Subsampling::Yuv444`] and [`Subsampling::Mono`].
    pub siting: Siting,
    /// Bits of a sample, 8 to 16; two bytes, little-endian, above 8.
    pub bits: u8,
    /// Which numbers stand for black and white.
    pub range: Range,
    /// Which luma R′, G′ and B′ make.
    pub matrix: Matrix,
}

impl YuvFormat {
    /// Width and height of a chroma plane; zero without chroma.
    pub fn chroma_size(&self, width: usize, height: usize) -> (usize, usize) {
        match self.subsampling {
            Subsampling::Mono => (0, 0),
            Subsampling::Yuv420 => (width.div_ceil(2), height.div_ceil(2)),
            Subsampling::Yuv422 => (width.div_ceil(2), height),
            Subsampling::Yuv444 => (width, height),
        }
    }

    /// Bytes of a frame; none where they are too many to be counted.
    pub fn frame_bytes(&self, width: usize, height: usize) -> Option<usize> {
        let (chroma_width, chroma_height) = self.chroma_size(width, height);
        let luma = width.checked_mul(height)?;
        let chroma = chroma_width.checked_mul(chroma_height)?.checked_mul(2)?;
        luma.checked_add(chroma)?.checked_mul(self.sample_bytes())
    }

    fn sample_bytes(&self) -> usize {
        if self.bits > 8 { 2 } else { 1 }
    }

    /// Black and the span to white of luma, zero and the span of chroma, as stored numbers.
    fn scales(&self) -> [(f32, f32); 2] {
        let step = (1u32 << (self.bits - 8)) as f32;
        let top = ((1u32 << self.bits) - 1) as f32;
        match self.range {
            Range::Limited => [(16.0 * step, 219.0 * step), (128.0 * step, 224.0 * step)],
            Range::Full => [(0.0, top), (128.0 * step, top)],
        }
    }

    /// The offset of chroma within a pair of samples, in each direction: is it on the first of two, or between them?
    fn phases(&self) -> [Phase; 2] {
        let horizontal = match (self.subsampling, self.siting) {
            (Subsampling::Yuv444 | Subsampling::Mono, _) => Phase::Whole,
            // 4:2:2 is co-sited in all standards but JPEG's.
            (_, Siting::Center) => Phase::Between,
            (_, Siting::Left | Siting::TopLeft) => Phase::OnFirst,
        };
        let vertical = match (self.subsampling, self.siting) {
            (Subsampling::Yuv420, Siting::TopLeft) => Phase::OnFirst,
            (Subsampling::Yuv420, _) => Phase::Between,
            _ => Phase::Whole,
        };
        [horizontal, vertical]
    }

    /// The frame of these bytes: R′, G′, B′ or Y′ in `[0, 1]`, and beyond where the samples are.
    ///
    /// # Errors
    /// When the frame is empty or doesn't have [`YuvFormat::frame_bytes`] bytes.
    pub fn decode(&self, width: usize, height: usize, bytes: &[u8]) -> Result<Image, ImageError> {
        if self.frame_bytes(width, height) != Some(bytes.len()) {
            return Err(ImageError::Invalid(format!("{} bytes are no frame of {width}×{height} pixels", bytes.len())));
        }
        let (luma_bytes, chroma_bytes) = bytes.split_at(width * height * self.sample_bytes());
        let [luma_scale, chroma_scale] = self.scales();
        let luma = self.plane(luma_bytes, luma_scale);
        let mut image = if self.subsampling == Subsampling::Mono {
            Image::from_data(width, height, ["Y"], luma)?
        } else {
            let (cb, cr) = chroma_bytes.split_at(chroma_bytes.len() / 2);
            let [cb, cr] = [cb, cr].map(|plane| self.enlarge(self.plane(plane, chroma_scale), width, height));
            let (kr, kb) = self.matrix.weights();
            let kg = 1.0 - kr - kb;
            let mut data = vec![0.0; width * height * 3];
            data.par_chunks_exact_mut(3 * width).enumerate().for_each(|(row, out)| {
                let at = row * width;
                let samples = luma[at..].iter().zip(&cb[at..]).zip(&cr[at..]);
                for (rgb, ((&y, &cb), &cr)) in out.chunks_exact_mut(3).zip(samples) {
                    let (red, blue) = (2.0 * (1.0 - kr) * cr, 2.0 * (1.0 - kb) * cb);
                    rgb.copy_from_slice(&[y + red, y - (kr * red + kb * blue) / kg, y + blue]);
                }
            });
            Image::from_data(width, height, ["R", "G", "B"], data)?
        };
        image.metadata.sample_type = Some(SampleType::Unsigned(self.bits));
        image.metadata.encoding = Some(Encoding::Linear);
        // Video's own transfer functions are meant for displays that undo something close to this.
        image.metadata.stored_encoding = Some(Encoding::Srgb);
        Ok(image)
    }

    /// The bytes of a frame of stored values (R′, G′ and B′, or Y′): rounded, and clamped to what the bits can hold. NaN is
    /// black.
    ///
    /// # Errors
    /// When the image has no colour.
    pub fn encode(&self, image: &Image) -> Result<Vec<u8>, ImageError> {
        let (width, height, n) = (image.width(), image.height(), image.channel_count());
        let rgb = image
            .rgb()
            .or((n == 1).then_some([0; 3]))
            .ok_or_else(|| ImageError::NoSuchChannel { name: "R".to_owned(), known: image.channels().to_vec() })?;
        let [luma_scale, chroma_scale] = self.scales();
        let (kr, kb) = self.matrix.weights();
        let luma_of = |p: &[f32]| {
            if rgb[0] == rgb[1] { p[rgb[0]] } else { kr * p[rgb[0]] + (1.0 - kr - kb) * p[rgb[1]] + kb * p[rgb[2]] }
        };
        let luma: Vec<f32> = image.data().par_chunks_exact(n).map(luma_of).collect();
        let mut bytes = Vec::with_capacity(self.frame_bytes(width, height).unwrap_or(0));
        self.push_plane(&mut bytes, &luma, luma_scale);
        if self.subsampling != Subsampling::Mono {
            for (channel, weight) in [(rgb[2], kb), (rgb[0], kr)] {
                let pixels = image.data().par_chunks_exact(n).zip(luma.par_iter());
                let chroma: Vec<f32> = pixels.map(|(p, y)| (p[channel] - y) / (2.0 * (1.0 - weight))).collect();
                self.push_plane(&mut bytes, &self.reduce(chroma, width, height), chroma_scale);
            }
        }
        Ok(bytes)
    }

    /// Stored numbers as values.
    fn plane(&self, bytes: &[u8], (zero, span): (f32, f32)) -> Vec<f32> {
        if self.bits > 8 {
            bytes.chunks_exact(2).map(|b| (f32::from(u16::from_le_bytes([b[0], b[1]])) - zero) / span).collect()
        } else {
            bytes.iter().map(|&b| (f32::from(b) - zero) / span).collect()
        }
    }

    fn push_plane(&self, bytes: &mut Vec<u8>, values: &[f32], (zero, span): (f32, f32)) {
        let top = ((1u32 << self.bits) - 1) as f32;
        // Casts of NaN give zero.
        let numbers = values.iter().map(|v| (v * span + zero).round().clamp(0.0, top) as u16);
        if self.bits > 8 {
            numbers.for_each(|v| bytes.extend_from_slice(&v.to_le_bytes()));
        } else {
            bytes.extend(numbers.map(|v| v as u8));
        }
    }

    /// A chroma plane at the size of luma.
    fn enlarge(&self, plane: Vec<f32>, width: usize, height: usize) -> Vec<f32> {
        let [horizontal, vertical] = self.phases();
        let (chroma_width, chroma_height) = self.chroma_size(width, height);
        let wide = match horizontal {
            Phase::Whole => plane,
            phase => {
                let mut wide = vec![0.0; width * chroma_height];
                wide.par_chunks_exact_mut(width).zip(plane.par_chunks_exact(chroma_width)).for_each(|(out, row)| {
                    for (i, value) in out.iter_mut().enumerate() {
                        let [(a, wa), (b, wb)] = phase.enlarging(i, chroma_width);
                        *value = wa * row[a] + wb * row[b];
                    }
                });
                wide
            }
        };
        if vertical == Phase::Whole {
            return wide;
        }
        let mut full = vec![0.0; width * height];
        full.par_chunks_exact_mut(width).enumerate().for_each(|(i, out)| {
            let [(a, wa), (b, wb)] = vertical.enlarging(i, chroma_height);
            let rows = wide[a * width..].iter().zip(&wide[b * width..]);
            out.iter_mut().zip(rows).for_each(|(out, (a, b))| *out = wa * a + wb * b);
        });
        full
    }

    /// A plane of the size of luma at the size of chroma: the inverse of [`Self::enlarge`] for what that gives.
    fn reduce(&self, plane: Vec<f32>, width: usize, height: usize) -> Vec<f32> {
        let [horizontal, vertical] = self.phases();
        let (chroma_width, chroma_height) = self.chroma_size(width, height);
        let low = match vertical {
            Phase::Whole => plane,
            phase => {
                let mut low = vec![0.0; width * chroma_height];
                low.par_chunks_exact_mut(width).enumerate().for_each(|(j, out)| {
                    for (i, weight) in phase.reducing(j, height).into_iter().filter(|(_, w)| *w != 0.0) {
                        let row = &plane[i * width..][..width];
                        out.iter_mut().zip(row).for_each(|(out, v)| *out += weight * v);
                    }
                });
                low
            }
        };
        if horizontal == Phase::Whole {
            return low;
        }
        let mut small = vec![0.0; chroma_width * chroma_height];
        small.par_chunks_exact_mut(chroma_width).zip(low.par_chunks_exact(width)).for_each(|(out, row)| {
            for (j, value) in out.iter_mut().enumerate() {
                *value = horizontal.reducing(j, width).into_iter().map(|(i, weight)| weight * row[i]).sum();
            }
        });
        small
    }
}

/// Where a chroma sample lies along one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// There is one for each pixel.
    Whole,
    /// There is one for two pixels, on the first of them.
    OnFirst,
    /// There is one for two pixels, halfway between them.
    Between,
}

impl Phase {
    /// The two chroma samples, out of `size`, that pixel `i` lies between, and their weights.
    fn enlarging(self, i: usize, size: usize) -> [(usize, f32); 2] {
        let at = i / 2;
        let next = (at + 1).min(size - 1);
        match (self, i % 2) {
            (Self::Whole, _) => [(i, 1.0), (i, 0.0)],
            (Self::OnFirst, 0) => [(at, 1.0), (at, 0.0)],
            (Self::OnFirst, _) => [(at, 0.5), (next, 0.5)],
            (Self::Between, 0) => [(at, 0.75), (at.saturating_sub(1), 0.25)],
            (Self::Between, _) => [(at, 0.75), (next, 0.25)],
        }
    }

    /// The pixels, out of `size`, that make the chroma sample `j`, and their weights.
    fn reducing(self, j: usize, size: usize) -> [(usize, f32); 5] {
        let (at, last) = (2 * j as i64, size as i64 - 1);
        match self {
            Self::Whole => [(j, 1.0), (j, 0.0), (j, 0.0), (j, 0.0), (j, 0.0)],
            // Whatever lies beyond an edge is mirrored at the pixel on it.
            Self::OnFirst => [(-2, -0.125), (-1, 0.25), (0, 0.75), (1, 0.25), (2, -0.125)].map(|(offset, weight)| {
                let mirrored = (at + offset as i64).abs();
                let mirrored = if mirrored > last { 2 * last - mirrored } else { mirrored };
                (mirrored.clamp(0, last) as usize, weight)
            }),
            // The last pixel of an odd number has no partner: the line through it and the one before is continued.
            Self::Between if at == last && last > 0 => {
                let last = last as usize;
                [(last, 1.5), (last - 1, -0.5), (last, 0.0), (last, 0.0), (last, 0.0)]
            }
            Self::Between => [(-1, -0.25), (0, 0.75), (1, 0.75), (2, -0.25), (0, 0.0)]
                .map(|(offset, weight)| ((at + offset as i64).clamp(0, last) as usize, weight)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn formats() -> impl Iterator<Item = YuvFormat> {
        let subsamplings = [Subsampling::Mono, Subsampling::Yuv420, Subsampling::Yuv422, Subsampling::Yuv444];
        let mut all = Vec::new();
        for subsampling in subsamplings {
            for siting in [Siting::Center, Siting::Left, Siting::TopLeft] {
                for bits in [8, 10, 12, 16] {
                    for range in [Range::Limited, Range::Full] {
                        for matrix in [Matrix::Bt601, Matrix::Bt709, Matrix::Bt2020] {
                            all.push(YuvFormat { subsampling, siting, bits, range, matrix });
                        }
                    }
                }
            }
        }
        all.into_iter()
    }

    /// Any numbers that the bits can hold, legal or not.
    fn noise(format: &YuvFormat, width: usize, height: usize) -> Vec<u8> {
        let bytes = format.frame_bytes(width, height).unwrap();
        let mut state = 12345u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state >> 8
        };
        if format.bits == 8 {
            (0..bytes).map(|_| next() as u8).collect()
        } else {
            (0..bytes / 2).flat_map(|_| ((next() & ((1 << format.bits) - 1)) as u16).to_le_bytes()).collect()
        }
    }

    #[test]
    fn every_frame_survives_the_way_to_rgb_and_back() {
        for format in formats() {
            for (width, height) in [(16, 8), (7, 5), (1, 1), (2, 1), (1, 2), (3, 3), (1, 5), (6, 4), (4, 3)] {
                let bytes = noise(&format, width, height);
                let image = format.decode(width, height, &bytes).unwrap();
                assert!(format.encode(&image).unwrap() == bytes, "{format:?} {width}×{height}");
            }
        }
    }

    #[test]
    fn primaries_have_the_standards_numbers() {
        // ITU-R BT.601 and BT.709: 75 % colour bars, limited range, eight bits, as commonly tabulated.
        for (matrix, rgb, expected) in [
            (Matrix::Bt601, [1.0, 1.0, 1.0], [235, 128, 128]),
            (Matrix::Bt601, [0.0, 0.0, 0.0], [16, 128, 128]),
            (Matrix::Bt601, [1.0, 0.0, 0.0], [81, 90, 240]),
            (Matrix::Bt601, [0.0, 1.0, 0.0], [145, 54, 34]),
            (Matrix::Bt601, [0.0, 0.0, 1.0], [41, 240, 110]),
            (Matrix::Bt709, [1.0, 0.0, 0.0], [63, 102, 240]),
            (Matrix::Bt709, [0.0, 1.0, 0.0], [173, 42, 26]),
            (Matrix::Bt709, [0.0, 0.0, 1.0], [32, 240, 118]),
        ] {
            let format = YuvFormat {
                subsampling: Subsampling::Yuv444,
                siting: Siting::Center,
                bits: 8,
                range: Range::Limited,
                matrix,
            };
            let image = Image::from_data(1, 1, ["R", "G", "B"], rgb.to_vec()).unwrap();
            assert_eq!(format.encode(&image).unwrap(), expected, "{matrix:?} {rgb:?}");
            let full = YuvFormat { range: Range::Full, ..format };
            let [y, ..] = full.encode(&image).unwrap()[..] else { panic!("no samples") };
            let (kr, kb) = matrix.weights();
            let luma = kr * rgb[0] + (1.0 - kr - kb) * rgb[1] + kb * rgb[2];
            assert!((f32::from(y) - 255.0 * luma).abs() <= 0.5);
        }
    }

    #[test]
    fn chroma_lies_where_its_siting_says() {
        // A ramp, sampled where each siting has its chroma, is the same ramp again wherever no edge is near.
        let (width, height) = (16, 12);
        for (siting, [dx, dy]) in
            [(Siting::Center, [0.5, 0.5]), (Siting::Left, [0.0, 0.5]), (Siting::TopLeft, [0.0, 0.0])]
        {
            let format = YuvFormat {
                subsampling: Subsampling::Yuv420,
                siting,
                bits: 16,
                range: Range::Full,
                matrix: Matrix::Bt709,
            };
            let ramp = |x: f32, y: f32| 0.01 * x + 0.02 * y;
            let plane = (0..8 * 6).map(|i| ramp(2.0 * (i % 8) as f32 + dx, 2.0 * (i / 8) as f32 + dy)).collect();
            let full = format.enlarge(plane, width, height);
            for y in 1..height - 2 {
                for x in 1..width - 2 {
                    let expected = ramp(x as f32, y as f32);
                    assert!((full[y * width + x] - expected).abs() < 1e-5, "{siting:?} {x} {y}");
                }
            }
        }
    }

    #[test]
    fn odd_values_are_clamped_and_wrong_sizes_refused() {
        let format = YuvFormat {
            subsampling: Subsampling::Yuv420,
            siting: Siting::Left,
            bits: 10,
            range: Range::Limited,
            matrix: Matrix::Bt601,
        };
        let data = vec![f32::NAN, 1e30, -5.0, f32::INFINITY, 0.2, f32::NEG_INFINITY];
        let image = Image::from_data(2, 1, ["R", "G", "B"], data).unwrap();
        let bytes = format.encode(&image).unwrap();
        assert_eq!(bytes.len(), format.frame_bytes(2, 1).unwrap());
        assert!(bytes.chunks(2).all(|b| u16::from_le_bytes([b[0], b[1]]) < 1024));
        assert!(format.decode(2, 1, &bytes[1..]).is_err());
        assert_eq!(format.frame_bytes(usize::MAX, 2), None);
        let grey = Image::from_data(1, 1, ["Y"], vec![1.0]).unwrap();
        assert_eq!(format.encode(&grey).unwrap(), [172, 3, 0, 2, 0, 2]);
        assert!(format.encode(&Image::new(1, 1, ["a", "b"]).unwrap()).is_err());
    }
}
