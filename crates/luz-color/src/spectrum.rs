//! Spectra as functions of wavelength.

use std::fmt;
use std::sync::Arc;

use crate::observer::{NANOMETRES, nanometre};
use crate::{RgbColorSpace, SampledSpectrum, SigmoidPolynomial, Wavelengths};

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
    #[inline]
    pub fn sample(&self, wavelengths: &Wavelengths) -> SampledSpectrum {
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
        Ok(Self { points: points.into() })
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
        Ok(Self { points: all.into() })
    }

    /// The points, by rising wavelength in nm.
    pub fn points(&self) -> &[(f32, f32)] {
        &self.points
    }

    /// The value at the wavelength `lambda` in nm.
    pub fn value(&self, lambda: f32) -> f32 {
        let upper = self.points.partition_point(|p| p.0 <= lambda);
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
        Self { points: self.points.iter().map(|&(l, v)| (l, v * factor)).collect() }
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

/// An ideal black body, scaled so that its peak over all wavelengths is `scale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blackbody {
    temperature: f32,
    scale: f32,
    /// `scale` over Planck's law at its peak.
    factor: f64,
}

impl Blackbody {
    /// The black body of `temperature` kelvin with a peak of one; zero everywhere if the temperature isn't positive.
    pub fn new(temperature: f32) -> Self {
        let peak = planck(wien_peak(temperature), f64::from(temperature));
        let factor = if peak > 0.0 { 1.0 / peak } else { 0.0 };
        Self { temperature, scale: 1.0, factor }
    }

    /// The temperature in kelvin.
    pub fn temperature(&self) -> f32 {
        self.temperature
    }

    /// The value at the wavelength `lambda` in nm.
    pub fn value(&self, lambda: f32) -> f32 {
        (planck(f64::from(lambda), f64::from(self.temperature)) * self.factor) as f32
    }

    /// The values at a path's wavelengths.
    pub fn sample(&self, wavelengths: &Wavelengths) -> SampledSpectrum {
        SampledSpectrum(wavelengths.lambda).map(|lambda| self.value(lambda))
    }

    /// The peak over all wavelengths, visible or not.
    pub fn max_value(&self) -> f32 {
        if self.factor == 0.0 { 0.0 } else { self.scale }
    }

    /// The black body multiplied by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f32) -> Self {
        Self { scale: self.scale * factor, factor: self.factor * f64::from(factor), ..*self }
    }
}

/// The wavelength in nm at which a black body of `temperature` kelvin peaks (Wien's displacement law).
fn wien_peak(temperature: f32) -> f64 {
    2.8977721e-3 / f64::from(temperature) * 1e9
}

/// Planck's law: the radiance of a black body in W·m⁻²·sr⁻¹·m⁻¹ at `lambda` nm and `temperature` kelvin; zero for
/// temperatures that aren't positive.
pub(crate) fn planck(lambda: f64, temperature: f64) -> f64 {
    // CODATA 2010, as in PBR 4e, eq. 4.17.
    const C: f64 = 299_792_458.0;
    const H: f64 = 6.62606957e-34;
    const K: f64 = 1.3806488e-23;
    if temperature.is_nan() || temperature <= 0.0 {
        return 0.0;
    }
    let l = lambda * 1e-9;
    2.0 * H * C * C / (l.powi(5) * (H * C / (l * K * temperature)).exp_m1())
}
