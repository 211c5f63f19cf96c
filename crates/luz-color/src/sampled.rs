//! A spectrum at the few wavelengths that one path carries.

use std::ops::{Add, AddAssign, Div, DivAssign, Index, IndexMut, Mul, MulAssign, Neg, Sub, SubAssign};

/// How many wavelengths a path carries.
pub const LANES: usize = 8;

/// Values of a spectral quantity at the [`LANES`] wavelengths of a path.
///
/// The wavelengths themselves live in `Wavelengths`; lane `i` here belongs to wavelength `i` there.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub struct SampledSpectrum(pub [f32; LANES]);

impl SampledSpectrum {
    /// Zero at every wavelength.
    pub const ZERO: Self = Self([0.0; LANES]);
    /// One at every wavelength.
    pub const ONE: Self = Self([1.0; LANES]);

    /// The same value at every wavelength.
    #[inline(always)]
    pub const fn splat(value: f32) -> Self {
        Self([value; LANES])
    }

    /// Applies `f` to every lane.
    #[inline(always)]
    pub fn map(self, mut f: impl FnMut(f32) -> f32) -> Self {
        let mut out = self.0;
        for lane in &mut out {
            *lane = f(*lane);
        }
        Self(out)
    }

    /// Applies `f` to every pair of lanes.
    #[inline(always)]
    pub fn zip(self, other: Self, mut f: impl FnMut(f32, f32) -> f32) -> Self {
        let mut out = self.0;
        for (lane, b) in out.iter_mut().zip(other.0) {
            *lane = f(*lane, b);
        }
        Self(out)
    }

    /// True where every lane is exactly zero.
    #[inline(always)]
    pub fn is_black(self) -> bool {
        // (All lanes at once, without branches.)
        self.0.iter().fold(true, |all, &v| all & (v == 0.0))
    }

    /// True where no lane is infinite or NaN.
    #[inline(always)]
    pub fn is_finite(self) -> bool {
        self.0.iter().fold(true, |all, v| all & v.is_finite())
    }

    /// All lanes in one, by an operation whose order does not matter: halves are put together side by side.
    #[inline(always)]
    fn reduce(self, f: impl Fn(f32, f32) -> f32) -> f32 {
        const { assert!(LANES.is_power_of_two()) };
        let mut all = self.0;
        let mut half = LANES / 2;
        while half > 0 {
            for i in 0..half {
                all[i] = f(all[i], all[i + half]);
            }
            half /= 2;
        }
        all[0]
    }

    /// The largest lane.
    #[inline(always)]
    pub fn max_component(self) -> f32 {
        self.reduce(f32::max)
    }

    /// The smallest lane.
    #[inline(always)]
    pub fn min_component(self) -> f32 {
        self.reduce(f32::min)
    }

    /// The mean of the lanes.
    #[inline(always)]
    pub fn average(self) -> f32 {
        self.0.iter().sum::<f32>() * (1.0 / LANES as f32)
    }

    /// The square root of every lane; negative lanes count as zero.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        self.map(|v| v.max(0.0).sqrt())
    }

    /// `e` to the power of every lane.
    #[inline(always)]
    pub fn exp(self) -> Self {
        self.map(f32::exp)
    }

    /// Every lane raised to `exponent`.
    #[inline(always)]
    pub fn powf(self, exponent: f32) -> Self {
        self.map(|v| v.powf(exponent))
    }

    /// Every lane limited to `[low, high]`.
    #[inline(always)]
    pub fn clamp(self, low: f32, high: f32) -> Self {
        self.map(|v| v.clamp(low, high))
    }

    /// Quotient by lanes, zero wherever the divisor is zero.
    #[inline(always)]
    pub fn safe_div(self, divisor: Self) -> Self {
        self.zip(divisor, |a, b| if b == 0.0 { 0.0 } else { a / b })
    }

    /// `self · (1 − t) + other · t`.
    #[inline(always)]
    pub fn lerp(self, other: Self, t: f32) -> Self {
        self.zip(other, |a, b| a * (1.0 - t) + b * t)
    }
}

impl Default for SampledSpectrum {
    fn default() -> Self {
        Self::ZERO
    }
}

impl From<f32> for SampledSpectrum {
    fn from(value: f32) -> Self {
        Self::splat(value)
    }
}

impl Index<usize> for SampledSpectrum {
    type Output = f32;
    #[inline(always)]
    fn index(&self, lane: usize) -> &f32 {
        &self.0[lane]
    }
}

impl IndexMut<usize> for SampledSpectrum {
    #[inline(always)]
    fn index_mut(&mut self, lane: usize) -> &mut f32 {
        &mut self.0[lane]
    }
}

macro_rules! lane_operator {
    ($trait:ident $method:ident $assign_trait:ident $assign_method:ident $op:tt) => {
        impl $trait for SampledSpectrum {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| a $op b)
            }
        }
        impl $trait<f32> for SampledSpectrum {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: f32) -> Self {
                self.map(|a| a $op other)
            }
        }
        impl $trait<SampledSpectrum> for f32 {
            type Output = SampledSpectrum;
            #[inline(always)]
            fn $method(self, other: SampledSpectrum) -> SampledSpectrum {
                other.map(|b| self $op b)
            }
        }
        impl $assign_trait for SampledSpectrum {
            #[inline(always)]
            fn $assign_method(&mut self, other: Self) {
                *self = *self $op other;
            }
        }
        impl $assign_trait<f32> for SampledSpectrum {
            #[inline(always)]
            fn $assign_method(&mut self, other: f32) {
                *self = *self $op other;
            }
        }
    };
}

lane_operator!(Add add AddAssign add_assign +);
lane_operator!(Sub sub SubAssign sub_assign -);
lane_operator!(Mul mul MulAssign mul_assign *);
lane_operator!(Div div DivAssign div_assign /);

impl Neg for SampledSpectrum {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|v| -v)
    }
}
