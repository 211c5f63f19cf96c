//! The CIE 1931 standard observer and integrals against it.

use std::sync::OnceLock;

use crate::data::cie1931::{X_BAR, Y_BAR, Z_BAR};
use crate::{DenseSpectrum, Spectrum};

/// ∫ ȳ(λ) dλ in nm, the luminance of a spectrum that is one everywhere.
pub const CIE_Y_INTEGRAL: f32 = 106.856895;

/// How many whole nanometres the tables cover: 360, 361 … 830.
pub(crate) const NANOMETRES: usize = 471;

/// The colour-matching function x̄ of the CIE 1931 2° observer.
pub fn x_bar() -> &'static DenseSpectrum {
    static TABLE: OnceLock<DenseSpectrum> = OnceLock::new();
    TABLE.get_or_init(|| DenseSpectrum::from_table(X_BAR))
}

/// The colour-matching function ȳ of the CIE 1931 2° observer, the photopic luminous efficiency.
pub fn y_bar() -> &'static DenseSpectrum {
    static TABLE: OnceLock<DenseSpectrum> = OnceLock::new();
    TABLE.get_or_init(|| DenseSpectrum::from_table(Y_BAR))
}

/// The colour-matching function z̄ of the CIE 1931 2° observer.
pub fn z_bar() -> &'static DenseSpectrum {
    static TABLE: OnceLock<DenseSpectrum> = OnceLock::new();
    TABLE.get_or_init(|| DenseSpectrum::from_table(Z_BAR))
}

/// x̄, ȳ and z̄ at the whole nanometre `LAMBDA_MIN + index`.
#[inline(always)]
pub(crate) fn xyz_bar(index: usize) -> [f32; 3] {
    [X_BAR[index], Y_BAR[index], Z_BAR[index]]
}

/// ∫ a(λ) b(λ) dλ over 360–830 nm as the sum over whole nanometres.
pub fn inner_product(a: &Spectrum, b: &Spectrum) -> f32 {
    (0..NANOMETRES).map(|i| f64::from(a.value(nanometre(i))) * f64::from(b.value(nanometre(i)))).sum::<f64>() as f32
}

/// CIE XYZ of a spectrum, normalised so that the constant spectrum 1 has Y = 1.
pub fn spectrum_to_xyz(spectrum: &Spectrum) -> [f32; 3] {
    integrate_xyz(|lambda| spectrum.value(lambda)).map(|v| (v / f64::from(CIE_Y_INTEGRAL)) as f32)
}

/// CIE luminance Y of a spectrum, normalised so that the constant spectrum 1 has Y = 1.
pub fn spectrum_to_y(spectrum: &Spectrum) -> f32 {
    spectrum_to_xyz(spectrum)[1]
}

/// ∫ ȳ(λ) s(λ) dλ in nm times the spectrum's unit: what a light's spectrum is divided by, so that its scale alone says how
/// bright it is.
///
/// For an RGB illuminant only the illuminant counts and not the colour multiplied onto it, so that its RGB value keeps its
/// meaning. Source: PBR 4e, section 12.1.
pub fn spectrum_to_photometric(spectrum: &Spectrum) -> f32 {
    match spectrum {
        Spectrum::RgbIlluminant { illuminant, .. } => integrate_xyz(|lambda| illuminant.value(lambda))[1] as f32,
        _ => integrate_xyz(|lambda| spectrum.value(lambda))[1] as f32,
    }
}

/// The sums of `f` against the three colour-matching functions over whole nanometres, not normalised.
pub(crate) fn integrate_xyz(f: impl Fn(f32) -> f32) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for i in 0..NANOMETRES {
        let value = f64::from(f(nanometre(i)));
        for (sum, bar) in sum.iter_mut().zip(xyz_bar(i)) {
            *sum += value * f64::from(bar);
        }
    }
    sum
}

/// The wavelength of a table's entry, in nm.
#[inline(always)]
pub(crate) fn nanometre(index: usize) -> f32 {
    (index + 360) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luminous_efficiency_has_the_published_integral() {
        let y = integrate_xyz(|_| 1.0)[1];
        assert!((y / f64::from(CIE_Y_INTEGRAL) - 1.0).abs() < 1e-6, "{y}");
        assert_eq!(y_bar().value(555.0), 1.0);
    }

    #[test]
    fn equal_energy_is_white() {
        let xyz = spectrum_to_xyz(&Spectrum::Constant(2.0));
        assert!(xyz.iter().all(|v| (v - 2.0).abs() < 1e-3), "{xyz:?}");
    }
}
