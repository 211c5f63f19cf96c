//! Where two images differ, in false colours.

use rayon::prelude::*;

use super::{RELATIVE_EPSILON, common_channels, false_color};
use crate::{Image, ImageError};

/// What an error map shows of each pixel, as the mean over its channels, for an image a and a reference b.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum ErrorMeasure {
    /// |a − b|.
    #[default]
    Absolute,
    /// (a − b)².
    Squared,
    /// |a − b| / √(b² + [`RELATIVE_EPSILON`]).
    Relative,
}

/// The errors of all pixels in false colours.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorMap {
    /// R, G and B in linear light, to be written without exposure. Pixels that are not finite in either image are green.
    pub image: Image,
    /// The error that has the brightest colour.
    pub scale: f32,
}

/// The errors of an image against a reference in the colours of [`false_color`].
///
/// `scale` is the error that gets the brightest colour; none takes the error that 99 % of the pixels stay below.
/// Channels are chosen as in [`super::compare`].
///
/// # Errors
/// As [`super::compare`].
pub fn error_map(
    image: &Image,
    reference: &Image,
    measure: ErrorMeasure,
    scale: Option<f32>,
) -> Result<ErrorMap, ImageError> {
    let (a, b) = common_channels(image, reference, &[])?;
    let n = a.channel_count();
    let errors: Vec<f32> = a
        .data()
        .par_chunks_exact(n)
        .zip(b.data().par_chunks_exact(n))
        .map(|(a, b)| {
            let sum: f64 = a.iter().zip(b).map(|(&a, &b)| error(a.into(), b.into(), measure)).sum();
            (sum / n as f64) as f32
        })
        .collect();
    let scale = scale.unwrap_or_else(|| percentile(&errors, 0.99));
    let inverse = if scale > 0.0 { 1.0 / scale } else { 0.0 };
    // Infinite minus infinite is NaN already; make every other infinity one too.
    let colors: Vec<f32> =
        errors.par_iter().flat_map_iter(|&e| false_color(if e.is_finite() { e * inverse } else { f32::NAN })).collect();
    Ok(ErrorMap { image: Image::from_data(a.width(), a.height(), ["R", "G", "B"], colors)?, scale })
}

fn error(a: f64, b: f64, measure: ErrorMeasure) -> f64 {
    let d = a - b;
    match measure {
        ErrorMeasure::Absolute => d.abs(),
        ErrorMeasure::Squared => d * d,
        ErrorMeasure::Relative => d.abs() / (b * b + RELATIVE_EPSILON).sqrt(),
    }
}

/// The value that this fraction of the finite values stays below; zero where there are none.
fn percentile(values: &[f32], fraction: f64) -> f32 {
    let mut finite: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
    if finite.is_empty() {
        return 0.0;
    }
    let index = ((finite.len() - 1) as f64 * fraction).round() as usize;
    *finite.select_nth_unstable_by(index, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_scaled_into_colours() {
        let reference = Image::from_data(4, 1, ["Y"], vec![1.0, 1.0, 1.0, 1.0]).unwrap();
        let image = Image::from_data(4, 1, ["Y"], vec![1.0, 2.0, 5.0, f32::INFINITY]).unwrap();
        let map = error_map(&image, &reference, ErrorMeasure::Absolute, Some(2.0)).unwrap();
        assert_eq!(map.image.pixel(0, 0), false_color(0.0));
        assert_eq!(map.image.pixel(1, 0), false_color(0.5));
        assert_eq!(map.image.pixel(2, 0), false_color(1.0));
        assert_eq!(map.image.pixel(3, 0), [0.0, 1.0, 0.0]);
        assert_eq!(error_map(&image, &reference, ErrorMeasure::Squared, None).unwrap().scale, 16.0);
        assert_eq!(error_map(&reference, &reference, ErrorMeasure::Relative, None).unwrap().scale, 0.0);
    }
}
