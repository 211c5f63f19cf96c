//! Spectra as functions of wavelength.

use std::fmt;
use std::sync::Arc;

use crate::observer::{NANOMETRES, nanometre};
use crate::{Blackbody, RgbColorSpace, SampledSpectrum, SigmoidPolynomial, Wavelengths};

/// A spectral distribution; cheap to clone.
///
/// The unit is whatever the spectrum stands for: reflectances are dimensionless, emission is radiance per nm.
#[derive(Clone, Debug)]
pub enum Spectrum {
    /// The same value at every wavelength.
    Constant(f32),
    /// A value for every whole nanometre.
    Dense(Arc<DenseSpectrum>),
    /// Values at given wavelengths, linear in between.
    PiecewiseLinear(Arc<PiecewiseLinearSpectrum>),
    /// An ideal black body.
    Blackbody(Blackbody),
    /// A reflectance in `[0, 1]` made from an RGB colour.
    RgbAlbedo(SigmoidPolynomial),
    /// A scaled reflectance without upper bound, made from an RGB colour.
    RgbUnbounded {
        /// What the polynomial is multiplied by.
        scale: f32,
        /// The shape.
        polynomial: SigmoidPolynomial,
    },
    /// Light made from an RGB colour: a scaled polynomial times the white of the colour space.
    RgbIlluminant {
        /// What polynomial and illuminant are multiplied by.
        scale: f32,
        /// The shape.
        polynomial: SigmoidPolynomial,
        /// The colour space's white.
        illuminant: Arc<DenseSpectrum>,
    },
}

impl Spectrum {
    /// The reflectance of an RGB colour; components are clamped to `[0, 1]`. Grey gives an exact constant.
    pub fn rgb_albedo(space: &RgbColorSpace, rgb: [f32; 3]) -> Self {
        Self::RgbAlbedo(space.to_sigmoid(rgb))
    }

    /// A spectrum for an RGB triple of any size, as for scattering coefficients; negative components count as zero.
    pub fn rgb_unbounded(space: &RgbColorSpace, rgb: [f32; 3]) -> Self {
        let (scale, polynomial) = scaled_polynomial(space, rgb);
        Self::RgbUnbounded { scale, polynomial }
    }

    /// Light of an RGB colour of any size: `[1, 1, 1]` is the colour space's white. Negative components count as zero.
    pub fn rgb_illuminant(space: &RgbColorSpace, rgb: [f32; 3]) -> Self {
        let (scale, polynomial) = scaled_polynomial(space, rgb);
        Self::RgbIlluminant { scale, polynomial, illuminant: space.illuminant().clone() }
    }

    /// The black body of `temperature` kelvin, scaled so that its peak over all wavelengths is one.
    pub fn blackbody(temperature: f32) -> Self {
        Self::Blackbody(Blackbody::new(temperature))
    }

    /// The spectrum through the given `(λ in nm, value)`, linear in between and zero outside.
    ///
    /// # Errors
    /// As [`PiecewiseLinearSpectrum::new`].
    pub fn piecewise_linear(points: &[(f32, f32)]) -> Result<Self, SpectrumError> {
        Ok(Self::PiecewiseLinear(Arc::new(PiecewiseLinearSpectrum::new(points)?)))
    }

    /// The value at the wavelength `lambda` in nm.
    #[inline]
    pub fn value(&self, lambda: f32) -> f32 {
        match self {
            Self::Constant(value) => *value,
            Self::Dense(dense) => dense.value(lambda),
            Self::PiecewiseLinear(linear) => linear.value(lambda),
            Self::Blackbody(body) => body.value(lambda),
            Self::RgbAlbedo(polynomial) => polynomial.value(lambda),
            Self::RgbUnbounded { scale, polynomial } => scale * polynomial.value(lambda),
            Self::RgbIlluminant { scale, polynomial, illuminant } => {
                scale * polynomial.value(lambda) * illuminant.value(lambda)
            }
        }
    }

    /// The values at a path's wavelengths.
    #[inline(always)]
    pub fn sample(&self, wavelengths: &Wavelengths) -> SampledSpectrum {
        match self {
            Self::RgbAlbedo(polynomial) => polynomial.sample(wavelengths),
            other => other.sample_other(wavelengths),
        }
    }

    /// [`sample`](Self::sample) of the kinds that are not inlined everywhere.
    #[inline(never)]
    fn sample_other(&self, wavelengths: &Wavelengths) -> SampledSpectrum {
        match self {
            Self::Constant(value) => SampledSpectrum::splat(*value),
            Self::Dense(dense) => dense.sample(wavelengths),
            Self::PiecewiseLinear(linear) => linear.sample(wavelengths),
            Self::Blackbody(body) => body.sample(wavelengths),
            Self::RgbAlbedo(polynomial) => polynomial.sample(wavelengths),
            Self::RgbUnbounded { scale, polynomial } => polynomial.sample(wavelengths) * *scale,
            Self::RgbIlluminant { scale, polynomial, illuminant } => {
                polynomial.sample(wavelengths) * illuminant.sample(wavelengths) * *scale
            }
        }
    }

    /// An upper bound of the values over 360–830 nm: exact, except that an RGB illuminant multiplies its factors' maxima.
    pub fn max_value(&self) -> f32 {
        match self {
            Self::Constant(value) => *value,
            Self::Dense(dense) => dense.max_value(),
            Self::PiecewiseLinear(linear) => linear.max_value(),
            Self::Blackbody(body) => body.max_value(),
            Self::RgbAlbedo(polynomial) => polynomial.max_value(),
            Self::RgbUnbounded { scale, polynomial } => scale * polynomial.max_value(),
            Self::RgbIlluminant { scale, polynomial, illuminant } => {
                scale * polynomial.max_value() * illuminant.max_value()
            }
        }
    }

    /// True for [`Spectrum::Constant`]: a dielectric with such an index of refraction doesn't disperse.
    #[inline(always)]
    pub fn is_constant(&self) -> bool {
        matches!(self, Self::Constant(_))
    }

    /// True where the spectrum is zero at every whole nanometre.
    pub fn is_black(&self) -> bool {
        (0..NANOMETRES).all(|i| self.value(nanometre(i)) == 0.0)
    }

    /// The same spectrum tabulated at every whole nanometre, which is fast to sample.
    pub fn to_dense(&self) -> DenseSpectrum {
        DenseSpectrum::from_fn(|lambda| self.value(lambda))
    }

    /// The spectrum multiplied by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f32) -> Self {
        match self {
            Self::Constant(value) => Self::Constant(value * factor),
            Self::Dense(dense) => Self::Dense(Arc::new(dense.scaled(factor))),
            Self::PiecewiseLinear(linear) => Self::PiecewiseLinear(Arc::new(linear.scaled(factor))),
            Self::Blackbody(body) => Self::Blackbody(body.scaled(factor)),
            Self::RgbAlbedo(polynomial) => Self::RgbUnbounded { scale: factor, polynomial: *polynomial },
            Self::RgbUnbounded { scale, polynomial } => {
                Self::RgbUnbounded { scale: scale * factor, polynomial: *polynomial }
            }
            Self::RgbIlluminant { scale, polynomial, illuminant } => {
                Self::RgbIlluminant { scale: scale * factor, polynomial: *polynomial, illuminant: illuminant.clone() }
            }
        }
    }
}

/// Splits an unbounded colour into a scale and a polynomial of a colour at most ½, which leaves the shape smooth.
fn scaled_polynomial(space: &RgbColorSpace, rgb: [f32; 3]) -> (f32, SigmoidPolynomial) {
    let scale = 2.0 * rgb[0].max(rgb[1]).max(rgb[2]).max(0.0);
    let shape = if scale > 0.0 { rgb.map(|c| c / scale) } else { [0.0; 3] };
    (scale, space.to_sigmoid(shape))
}

/// A spectrum tabulated at every whole nanometre of 360–830 nm, zero outside.
#[derive(Clone, Debug, PartialEq)]
pub struct DenseSpectrum {
    values: Box<[f32; NANOMETRES]>,
}

impl DenseSpectrum {
    /// Tabulates a function of the wavelength in nm.
    pub fn from_fn(f: impl Fn(f32) -> f32) -> Self {
        Self::from_table(std::array::from_fn(|i| f(nanometre(i))))
    }

    /// The spectrum with these values at 360, 361 … 830 nm.
    pub fn from_table(values: [f32; 471]) -> Self {
        Self { values: Box::new(values) }
    }

    /// The values at 360, 361 … 830 nm.
    pub fn values(&self) -> &[f32; 471] {
        &self.values
    }

    /// The value at the whole nanometre nearest to `lambda`.
    #[inline(always)]
    pub fn value(&self, lambda: f32) -> f32 {
        self.values.get(nearest_nanometre(lambda)).copied().unwrap_or(0.0)
    }

    /// The values at a path's wavelengths.
    #[inline]
    pub fn sample(&self, wavelengths: &Wavelengths) -> SampledSpectrum {
        SampledSpectrum(wavelengths.lambda).map(|lambda| self.value(lambda))
    }

    /// The largest tabulated value.
    pub fn max_value(&self) -> f32 {
        self.values.iter().copied().fold(f32::NEG_INFINITY, f32::max)
    }

    /// The spectrum multiplied by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f32) -> Self {
        Self { values: Box::new(self.values.map(|v| v * factor)) }
    }
}

/// The index of the whole nanometre nearest to `lambda` in tables that begin at 360 nm; out of every table's bounds for
/// wavelengths that are out of range.
#[inline(always)]
pub(crate) fn nearest_nanometre(lambda: f32) -> usize {
    // Adding 2²³ rounds to a whole number and leaves it in the low bits: no conversion instruction, so lanes stay SIMD.
    const TWO_TO_23: f32 = 8_388_608.0;
    ((lambda + TWO_TO_23).to_bits().wrapping_sub(TWO_TO_23.to_bits() + 360)) as usize
}

/// Values at given wavelengths, linear in between and zero outside.
#[derive(Clone, Debug, PartialEq)]
pub struct PiecewiseLinearSpectrum {
    points: Arc<[(f32, f32)]>,
    /// How many points lie at or below each whole nanometre from [`LAMBDA_MIN`](crate::LAMBDA_MIN) on, so that hardly any need to be
    /// searched.
    points_up_to: Arc<[u32]>,
}

impl PiecewiseLinearSpectrum {
    /// The spectrum through the given `(λ in nm, value)`.
    ///
    /// # Errors
    /// When there is no point, a number isn't finite, or the wavelengths don't rise strictly.
    pub fn new(points: &[(f32, f32)]) -> Result<Self, SpectrumError> {
        if points.is_empty() {
            return Err(SpectrumError::Empty);
        }
        for (index, pair) in points.iter().enumerate() {
            if !pair.0.is_finite() || !pair.1.is_finite() {
                return Err(SpectrumError::NotFinite { index });
            }
            if index > 0 && pair.0 <= points[index - 1].0 {
                return Err(SpectrumError::NotIncreasing { index, previous: points[index - 1].0, lambda: pair.0 });
            }
        }
        Ok(Self::through(points.into()))
    }

    /// Through points that rise.
    fn through(points: Arc<[(f32, f32)]>) -> Self {
        let nanometres = crate::LAMBDA_MIN as u32..=crate::LAMBDA_MAX as u32 + 1;
        let points_up_to = nanometres.map(|nm| points.partition_point(|p| p.0 <= nm as f32) as u32).collect();
        Self { points, points_up_to }
    }

    /// How many points lie at or below a wavelength.
    #[inline]
    fn count_up_to(&self, lambda: f32) -> usize {
        let nanometre = (lambda - crate::LAMBDA_MIN) as usize;
        let bounds = (self.points_up_to.get(nanometre), self.points_up_to.get(nanometre + 1));
        let (first, last) = match bounds {
            (Some(&first), Some(&last)) if lambda >= crate::LAMBDA_MIN => (first as usize, last as usize),
            _ => (0, self.points.len()),
        };
        first + self.points[first..last].partition_point(|p| p.0 <= lambda)
    }

    /// As [`PiecewiseLinearSpectrum::new`], but the end values continue over the rest of 360–830 nm.
    ///
    /// # Errors
    /// As [`PiecewiseLinearSpectrum::new`].
    pub fn extended(points: &[(f32, f32)]) -> Result<Self, SpectrumError> {
        let mut all = Self::new(points)?.points.to_vec();
        if let (Some(&first), Some(&last)) = (points.first(), points.last()) {
            if last.0 < crate::LAMBDA_MAX {
                all.push((crate::LAMBDA_MAX + 1.0, last.1));
            }
            if first.0 > crate::LAMBDA_MIN {
                all.insert(0, (crate::LAMBDA_MIN - 1.0, first.1));
            }
        }
        Ok(Self::through(all.into()))
    }

    /// The points, by rising wavelength in nm.
    pub fn points(&self) -> &[(f32, f32)] {
        &self.points
    }

    /// The value at the wavelength `lambda` in nm.
    pub fn value(&self, lambda: f32) -> f32 {
        let upper = self.count_up_to(lambda);
        let Some(&(l0, v0)) = upper.checked_sub(1).and_then(|i| self.points.get(i)) else { return 0.0 };
        match self.points.get(upper) {
            Some(&(l1, v1)) => {
                let t = (lambda - l0) / (l1 - l0);
                (1.0 - t) * v0 + t * v1
            }
            None if lambda == l0 => v0,
            None => 0.0,
        }
    }

    /// The values at a path's wavelengths.
    pub fn sample(&self, wavelengths: &Wavelengths) -> SampledSpectrum {
        SampledSpectrum(wavelengths.lambda).map(|lambda| self.value(lambda))
    }

    /// The largest value at any of the points.
    pub fn max_value(&self) -> f32 {
        self.points.iter().map(|p| p.1).fold(f32::NEG_INFINITY, f32::max)
    }

    /// The spectrum multiplied by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f32) -> Self {
        let points = self.points.iter().map(|&(l, v)| (l, v * factor)).collect();
        Self { points, points_up_to: self.points_up_to.clone() }
    }
}

/// Why a list of points isn't a spectrum.
#[derive(Clone, Debug, PartialEq)]
pub enum SpectrumError {
    /// There are no points.
    Empty,
    /// The point with this index has a number that isn't finite.
    NotFinite {
        /// The point, counted from zero.
        index: usize,
    },
    /// Wavelengths must rise strictly, and the point with this index doesn't.
    NotIncreasing {
        /// The point, counted from zero.
        index: usize,
        /// The wavelength before it, in nm.
        previous: f32,
        /// Its own wavelength, in nm.
        lambda: f32,
    },
}

impl fmt::Display for SpectrumError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "a spectrum needs at least one pair of wavelength and value"),
            Self::NotFinite { index } => write!(f, "pair {} of the spectrum has a number that isn't finite", index + 1),
            Self::NotIncreasing { index, previous, lambda } => write!(
                f,
                "wavelengths of a spectrum must rise, but pair {} is at {lambda} nm after {previous} nm",
                index + 1
            ),
        }
    }
}

impl std::error::Error for SpectrumError {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LANES, illuminant, named_spectrum, spectrum_to_photometric, spectrum_to_xyz};

    #[test]
    fn black_body_at_illuminant_a_has_its_chromaticity() {
        // CIE A is Planck's law at 2856 K: (x, y) = (0.44757, 0.40745).
        for spectrum in [Spectrum::blackbody(2856.0), named_spectrum("stdillum-A").unwrap()] {
            let [x, y] = crate::color_space::chromaticity(spectrum_to_xyz(&spectrum));
            assert!((x - 0.44757).abs() < 3e-4 && (y - 0.40745).abs() < 3e-4, "{x} {y}");
        }
    }

    #[test]
    fn daylight_at_6500_is_d65() {
        let [a, b] = [illuminant::daylight(6500.0), named_spectrum("stdillum-D65").unwrap()]
            .map(|s| crate::color_space::chromaticity(spectrum_to_xyz(&s)));
        assert!((a[0] - b[0]).abs() < 2e-4 && (a[1] - b[1]).abs() < 2e-4, "{a:?} {b:?}");
        for temperature in [f32::NAN, f32::INFINITY, 0.0, 3000.0, 25_000.0, 1e30] {
            assert!(illuminant::daylight(temperature).value(560.0).is_finite());
        }
    }

    #[test]
    fn piecewise_linear_interpolates_and_is_zero_outside() {
        let s = Spectrum::piecewise_linear(&[(400.0, 1.0), (500.0, 3.0), (501.0, 0.0)]).unwrap();
        for (lambda, value) in
            [(399.9, 0.0), (400.0, 1.0), (450.0, 2.0), (500.0, 3.0), (500.5, 1.5), (501.0, 0.0), (600.0, 0.0)]
        {
            assert!((s.value(lambda) - value).abs() < 1e-6, "{lambda}");
        }
        assert_eq!(s.max_value(), 3.0);
        let single = Spectrum::piecewise_linear(&[(550.0, 2.0)]).unwrap();
        assert_eq!((single.value(550.0), single.value(550.1)), (2.0, 0.0));
        let extended = PiecewiseLinearSpectrum::extended(&[(400.0, 1.0), (500.0, 3.0)]).unwrap();
        assert_eq!((extended.value(360.0), extended.value(830.0), extended.value(300.0)), (1.0, 3.0, 0.0));
    }

    /// Points at whole nanometres, between them, many within one, and outside of the visible range.
    #[test]
    fn points_are_found_wherever_they_lie() {
        let within = (0..50).map(|i| (550.25 + 0.01 * i as f32, (i % 7) as f32));
        let points: Vec<_> = [(-5.0, 1.0), (100.5, 2.0), (360.0, 4.0), (400.0, 1.0), (401.0, 3.0), (410.7, 0.0)]
            .into_iter()
            .chain(within)
            .chain([(829.9, 5.0), (830.0, 6.0), (831.0, 7.0), (1e5, 8.0)])
            .collect();
        let spectrum = PiecewiseLinearSpectrum::new(&points).unwrap();
        let between = points.windows(2).flat_map(|w| [0.0, 0.3, 0.999].map(|t| w[0].0 + t * (w[1].0 - w[0].0)));
        for lambda in between.chain([-1e9, -5.1, 1e5, 1e6, f32::INFINITY, f32::NEG_INFINITY, f32::NAN]) {
            let expected = points.partition_point(|p| p.0 <= lambda);
            assert_eq!(spectrum.count_up_to(lambda), expected, "{lambda}");
        }
    }

    #[test]
    fn bad_points_are_named() {
        let error = |points: &[(f32, f32)]| Spectrum::piecewise_linear(points).unwrap_err().to_string();
        assert_eq!(error(&[]), "a spectrum needs at least one pair of wavelength and value");
        assert_eq!(error(&[(400.0, f32::NAN)]), "pair 1 of the spectrum has a number that isn't finite");
        assert_eq!(
            error(&[(400.0, 1.0), (400.0, 2.0)]),
            "wavelengths of a spectrum must rise, but pair 2 is at 400 nm after 400 nm"
        );
    }

    #[test]
    fn sampling_agrees_with_values_for_every_kind() {
        let space = RgbColorSpace::srgb();
        let spectra = [
            Spectrum::Constant(0.7),
            Spectrum::Dense(Arc::new(named_spectrum("stdillum-F4").unwrap().to_dense())),
            named_spectrum("metal-Cu-k").unwrap(),
            Spectrum::blackbody(4000.0).scaled(2.0),
            Spectrum::rgb_albedo(space, [0.2, 0.7, 0.1]),
            Spectrum::rgb_unbounded(space, [4.0, 0.1, 2.0]),
            Spectrum::rgb_illuminant(space, [17.0, 12.0, 4.0]),
        ];
        for spectrum in spectra {
            let doubled = spectrum.scaled(2.0);
            for i in 0..64 {
                let w = Wavelengths::sample_visible((i as f32 + 0.5) / 64.0);
                let (once, twice) = (spectrum.sample(&w), doubled.sample(&w));
                for lane in 0..LANES {
                    let value = spectrum.value(w.lambda[lane]);
                    assert!((once[lane] - value).abs() <= 1e-6 * value.abs());
                    assert!((twice[lane] - 2.0 * value).abs() <= 1e-5 * value.abs());
                    assert!(value <= spectrum.max_value() * (1.0 + 1e-6));
                }
            }
        }
    }

    #[test]
    fn unbounded_colours_and_lights_keep_their_rgb() {
        let space = RgbColorSpace::srgb();
        for rgb in [[17.0, 12.0, 4.0], [0.01, 0.5, 0.02], [3.0, 3.0, 3.0]] {
            let light = Spectrum::rgb_illuminant(space, rgb);
            let back = space.from_xyz(spectrum_to_xyz(&light));
            let unbounded = Spectrum::rgb_unbounded(space, rgb);
            let product = DenseSpectrum::from_fn(|l| unbounded.value(l) * space.illuminant().value(l));
            let same = space.from_xyz(spectrum_to_xyz(&Spectrum::Dense(Arc::new(product))));
            for c in 0..3 {
                assert!((back[c] - rgb[c]).abs() < 2e-5 * 17.0, "{rgb:?} {back:?}");
                assert!((same[c] - rgb[c]).abs() < 2e-5 * 17.0, "{rgb:?} {same:?}");
            }
            // What the light is divided by doesn't depend on its colour.
            let photometric = spectrum_to_photometric(&light);
            assert!((photometric / crate::CIE_Y_INTEGRAL - 1.0).abs() < 1e-6);
        }
        assert!(Spectrum::rgb_illuminant(space, [0.0, -1.0, f32::NAN]).is_black());
    }

    #[test]
    fn dense_spectra_round_to_whole_nanometres() {
        let dense = DenseSpectrum::from_fn(|l| l);
        for (lambda, value) in [(360.0, 360.0), (360.4, 360.0), (559.6, 560.0), (830.0, 830.0), (830.4, 830.0)] {
            assert_eq!(dense.value(lambda), value);
        }
        for outside in [0.0, 359.0, 831.0, 1e4, -5.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(dense.value(outside), 0.0, "{outside}");
        }
    }
}
