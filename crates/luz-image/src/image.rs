//! The image type.

use rayon::prelude::*;

use crate::{Encoding, ImageError, ImageMetadata};

/// A rectangle of pixels with named `f32` channels.
///
/// Samples are interleaved: pixel by pixel from left to right, row by row from the top. Channel names follow OpenEXR:
/// `R`, `G`, `B`, `A` (opacity), `Y` (grey), and `Layer.Name` for everything else (`Albedo.R`, `Ns.X`, `Variance.R`).
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    channels: Vec<String>,
    data: Vec<f32>,
    /// What the image knows beside its pixels.
    pub metadata: ImageMetadata,
}

impl Image {
    /// A black image.
    ///
    /// # Errors
    /// As [`Image::from_data`].
    pub fn new<S: Into<String>>(
        width: usize,
        height: usize,
        channels: impl IntoIterator<Item = S>,
    ) -> Result<Self, ImageError> {
        let channels: Vec<String> = channels.into_iter().map(Into::into).collect();
        let samples = sample_count(width, height, channels.len())?;
        Self::from_data(width, height, channels, vec![0.0; samples])
    }

    /// An image of interleaved samples, `width · height · channels` of them.
    ///
    /// # Errors
    /// When a size is zero, a channel has no name or one that exists already, or the number of samples is wrong.
    pub fn from_data<S: Into<String>>(
        width: usize,
        height: usize,
        channels: impl IntoIterator<Item = S>,
        data: Vec<f32>,
    ) -> Result<Self, ImageError> {
        let channels: Vec<String> = channels.into_iter().map(Into::into).collect();
        let samples = sample_count(width, height, channels.len())?;
        if data.len() != samples {
            return Err(ImageError::Invalid(format!(
                "{width}×{height} pixels of {} channels need {samples} samples, not {}",
                channels.len(),
                data.len()
            )));
        }
        for (index, name) in channels.iter().enumerate() {
            if name.is_empty() {
                return Err(ImageError::Invalid("a channel has no name".to_owned()));
            }
            if channels[..index].contains(name) {
                return Err(ImageError::Invalid(format!("two channels are named `{name}`")));
            }
        }
        Ok(Self { width, height, channels, data, metadata: ImageMetadata::default() })
    }

    /// The width in pixels, at least one.
    #[inline(always)]
    pub fn width(&self) -> usize {
        self.width
    }

    /// The height in pixels, at least one.
    #[inline(always)]
    pub fn height(&self) -> usize {
        self.height
    }

    /// The channels' names in the order of the samples.
    pub fn channels(&self) -> &[String] {
        &self.channels
    }

    /// How many channels there are, at least one.
    #[inline(always)]
    pub fn channel_count(&self) -> usize {
        self.channels.len()
    }

    /// The interleaved samples.
    #[inline(always)]
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// The interleaved samples, to be changed.
    #[inline(always)]
    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }

    /// The interleaved samples, taken out.
    pub fn into_data(self) -> Vec<f32> {
        self.data
    }

    /// The samples of the pixel in column `x` and row `y`.
    ///
    /// # Panics
    /// When the pixel is outside the image.
    #[inline(always)]
    pub fn pixel(&self, x: usize, y: usize) -> &[f32] {
        assert!(x < self.width && y < self.height, "pixel ({x}, {y}) is outside {}×{}", self.width, self.height);
        let n = self.channels.len();
        &self.data[(y * self.width + x) * n..][..n]
    }

    /// The samples of the pixel in column `x` and row `y`, to be changed.
    ///
    /// # Panics
    /// When the pixel is outside the image.
    #[inline(always)]
    pub fn pixel_mut(&mut self, x: usize, y: usize) -> &mut [f32] {
        assert!(x < self.width && y < self.height, "pixel ({x}, {y}) is outside {}×{}", self.width, self.height);
        let n = self.channels.len();
        &mut self.data[(y * self.width + x) * n..][..n]
    }

    /// The position of a channel.
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|channel| channel == name)
    }

    /// The positions of R, G and B; of Y three times for a grey image.
    pub fn rgb(&self) -> Option<[usize; 3]> {
        match (self.channel("R"), self.channel("G"), self.channel("B")) {
            (Some(r), Some(g), Some(b)) => Some([r, g, b]),
            _ => self.channel("Y").map(|y| [y; 3]),
        }
    }

    /// A new image of the named channels in the given order.
    ///
    /// # Errors
    /// When a channel doesn't exist, or is named twice.
    pub fn select(&self, names: &[&str]) -> Result<Self, ImageError> {
        let positions = names
            .iter()
            .map(|&name| {
                self.channel(name)
                    .ok_or_else(|| ImageError::NoSuchChannel { name: name.to_owned(), known: self.channels.clone() })
            })
            .collect::<Result<Vec<usize>, _>>()?;
        let data = self.data.chunks_exact(self.channels.len()).flat_map(|p| positions.iter().map(|&i| p[i])).collect();
        let mut image = Self::from_data(self.width, self.height, names.iter().copied(), data)?;
        image.metadata = self.metadata.clone();
        Ok(image)
    }

    /// Adds the channels of another image of the same size, their names prefixed with `layer` and a dot unless it is empty.
    ///
    /// # Errors
    /// When the sizes differ or a name exists already.
    pub fn append(&mut self, layer: &str, other: &Self) -> Result<(), ImageError> {
        self.check_same_size(other)?;
        let (n, m) = (self.channels.len(), other.channels.len());
        let prefixed = other.channels.iter().map(|c| if layer.is_empty() { c.clone() } else { format!("{layer}.{c}") });
        let channels: Vec<String> = self.channels.iter().cloned().chain(prefixed).collect();
        let mut data = Vec::with_capacity(self.width * self.height * (n + m));
        for (a, b) in self.data.chunks_exact(n).zip(other.data.chunks_exact(m)) {
            data.extend_from_slice(a);
            data.extend_from_slice(b);
        }
        let metadata = std::mem::take(&mut self.metadata);
        *self = Self { metadata, ..Self::from_data(self.width, self.height, channels, data)? };
        Ok(())
    }

    /// The part of the image from column `x` and row `y` on, with its placement noted.
    ///
    /// # Errors
    /// When the part is empty or reaches beyond the image.
    pub fn crop(&self, x: usize, y: usize, width: usize, height: usize) -> Result<Self, ImageError> {
        let fits = |start: usize, size: usize, full: usize| start.checked_add(size).is_some_and(|end| end <= full);
        if !fits(x, width, self.width) || !fits(y, height, self.height) {
            return Err(ImageError::Invalid(format!(
                "{width}×{height} pixels at ({x}, {y}) reach beyond the image's {}×{}",
                self.width, self.height
            )));
        }
        let n = self.channels.len();
        let data = (y..y + height)
            .flat_map(|row| self.data[(row * self.width + x) * n..][..width * n].iter().copied())
            .collect();
        let mut image = Self::from_data(width, height, self.channels.iter().cloned(), data)?;
        image.metadata = self.metadata.clone();
        let whole = self.metadata.placement.unwrap_or(crate::Placement {
            x: 0,
            y: 0,
            full_width: self.width,
            full_height: self.height,
        });
        image.metadata.placement = Some(crate::Placement { x: whole.x + x as i32, y: whole.y + y as i32, ..whole });
        Ok(image)
    }

    /// An image with the same channels and metadata but other pixels, whose number fits and isn't zero.
    pub(crate) fn clone_shape(&self, width: usize, height: usize, data: Vec<f32>) -> Self {
        debug_assert_eq!(data.len(), width * height * self.channels.len());
        Self { width, height, channels: self.channels.clone(), data, metadata: self.metadata.clone() }
    }

    /// Makes linear light of stored values, as [`ReadOptions::stored`](crate::ReadOptions::stored) gives them: the colour
    /// is decoded as the file says. Nothing changes where that has been done, or where light was stored.
    pub fn decode_stored(&mut self) {
        if let (Some(Encoding::Linear), Some(stored)) = (self.metadata.encoding, self.metadata.stored_encoding) {
            self.map_color(|v| stored.to_linear(v));
            self.metadata.encoding = Some(stored);
        }
    }

    /// The inverse of [`Image::decode_stored`]: encodes the colour as the file did that it came from.
    pub fn encode_stored(&mut self) {
        if let (Some(encoding), Some(_)) = (self.metadata.encoding, self.metadata.stored_encoding) {
            self.map_color(|v| encoding.from_linear(v));
            self.metadata.encoding = Some(Encoding::Linear);
        }
    }

    /// Changes every sample of R, G and B, or of Y, or of the only channel.
    fn map_color(&mut self, f: impl Fn(f32) -> f32 + Sync) {
        let channels = match self.rgb() {
            Some([r, g, b]) if r != g => vec![r, g, b],
            Some([y, ..]) => vec![y],
            None if self.channels.len() == 1 => vec![0],
            None => return,
        };
        let n = self.channels.len();
        self.data.par_chunks_exact_mut(n).for_each(|pixel| channels.iter().for_each(|&c| pixel[c] = f(pixel[c])));
    }

    /// How many samples are infinite or NaN.
    pub fn non_finite_count(&self) -> usize {
        self.data.iter().filter(|v| !v.is_finite()).count()
    }

    /// An error unless the other image has the same width and height.
    pub(crate) fn check_same_size(&self, other: &Self) -> Result<(), ImageError> {
        if (self.width, self.height) == (other.width, other.height) {
            return Ok(());
        }
        Err(ImageError::Mismatch(format!(
            "one has {}×{} pixels, the other {}×{}",
            self.width, self.height, other.width, other.height
        )))
    }
}

/// The number of samples of an image.
fn sample_count(width: usize, height: usize, channels: usize) -> Result<usize, ImageError> {
    if width == 0 || height == 0 || channels == 0 {
        return Err(ImageError::Invalid(format!("{width}×{height} pixels of {channels} channels are empty")));
    }
    width
        .checked_mul(height)
        .and_then(|n| n.checked_mul(channels))
        .filter(|&n| n <= isize::MAX as usize / 4)
        .ok_or_else(|| ImageError::Invalid(format!("{width}×{height} pixels of {channels} channels are too many")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient() -> Image {
        Image::from_data(3, 2, ["R", "G", "B"], (0..18).map(|i| i as f32).collect()).unwrap()
    }

    #[test]
    fn pixels_are_interleaved_rows_from_the_top() {
        let mut image = gradient();
        assert_eq!(image.pixel(2, 1), [15.0, 16.0, 17.0]);
        image.pixel_mut(0, 1)[1] = -1.0;
        assert_eq!(image.data()[10], -1.0);
        assert_eq!((image.rgb(), image.channel("A")), (Some([0, 1, 2]), None));
    }

    #[test]
    fn sizes_and_names_are_checked() {
        let message = |r: Result<Image, ImageError>| r.unwrap_err().to_string();
        assert_eq!(message(Image::new(0, 2, ["Y"])), "not an image: 0×2 pixels of 1 channels are empty");
        assert!(message(Image::new(usize::MAX, 2, ["Y"])).ends_with("are too many"));
        assert_eq!(message(Image::new(1, 1, ["Y", "Y"])), "not an image: two channels are named `Y`");
        assert_eq!(message(Image::new(1, 1, [""])), "not an image: a channel has no name");
        assert_eq!(
            message(Image::from_data(2, 2, ["Y"], vec![0.0; 3])),
            "not an image: 2×2 pixels of 1 channels need 4 samples, not 3"
        );
    }

    #[test]
    fn channels_are_selected_and_appended() {
        let image = gradient();
        let swapped = image.select(&["B", "R"]).unwrap();
        assert_eq!(swapped.pixel(1, 0), [5.0, 3.0]);
        assert_eq!(
            image.select(&["Z"]).unwrap_err().to_string(),
            "the image has no channel `Z`; its channels are R, G, B"
        );
        let mut all = image.clone();
        all.append("Albedo", &image).unwrap();
        assert_eq!(all.channels(), ["R", "G", "B", "Albedo.R", "Albedo.G", "Albedo.B"]);
        assert_eq!(all.pixel(0, 1), [9.0, 10.0, 11.0, 9.0, 10.0, 11.0]);
        assert!(all.append("Albedo", &image).is_err());
        let small = image.crop(0, 0, 2, 2).unwrap();
        let error = all.append("x", &small).unwrap_err().to_string();
        assert_eq!(error, "the images don't match: one has 3×2 pixels, the other 2×2");
    }

    #[test]
    fn crops_know_their_place() {
        let part = gradient().crop(1, 1, 2, 1).unwrap();
        assert_eq!(part.data(), [12.0, 13.0, 14.0, 15.0, 16.0, 17.0]);
        let again = part.crop(1, 0, 1, 1).unwrap();
        let place = again.metadata.placement.unwrap();
        assert_eq!((place.x, place.y, place.full_width, place.full_height), (2, 1, 3, 2));
        assert!(part.crop(1, 0, 2, 1).is_err());
        assert!(part.crop(usize::MAX, 0, 2, 1).is_err());
    }
}
