//! Spectra that scenes call by name.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use crate::data::{glasses, illuminants, metals};
use crate::{CIE_Y_INTEGRAL, PiecewiseLinearSpectrum, Spectrum, spectrum_to_photometric};

/// The spectrum of a name, or none where the name is unknown. See [`spectrum_names`].
///
/// * `stdillum-A`, `stdillum-D50`, `stdillum-D65`, `stdillum-F1` … `stdillum-F12`, `illum-acesD60`: illuminants, scaled to
///   the luminance of the constant spectrum 1 (∫ ȳ s dλ = [`CIE_Y_INTEGRAL`]).
/// * `glass-BK7` …: indices of refraction.
/// * `metal-Au-eta`, `metal-Au-k` …: real and imaginary part of a conductor's index of refraction.
///
/// Tables that end inside 360–830 nm continue with their end values.
pub fn named_spectrum(name: &str) -> Option<Spectrum> {
    table().get(name).cloned()
}

/// All names that [`named_spectrum`] knows, sorted.
pub fn spectrum_names() -> impl Iterator<Item = &'static str> {
    table().keys().copied()
}

fn table() -> &'static BTreeMap<&'static str, Spectrum> {
    static TABLE: OnceLock<BTreeMap<&'static str, Spectrum>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let mut all = BTreeMap::new();
        let measured = [(&illuminants::TABLES[..], true), (&glasses::TABLES[..], false), (&metals::TABLES[..], false)];
        for (tables, is_light) in measured {
            for &(name, points) in tables {
                // The tables are sorted and finite (tested), so none is left out.
                let Ok(linear) = PiecewiseLinearSpectrum::extended(points) else { continue };
                let spectrum = Spectrum::PiecewiseLinear(Arc::new(linear));
                let luminance = spectrum_to_photometric(&spectrum);
                let factor = if is_light { CIE_Y_INTEGRAL / luminance } else { 1.0 };
                all.insert(name, spectrum.scaled(factor));
            }
        }
        all
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum_to_y;

    #[test]
    fn every_table_has_a_name() {
        let n = illuminants::TABLES.len() + glasses::TABLES.len() + metals::TABLES.len();
        assert_eq!(spectrum_names().count(), n);
        assert_eq!(n, 16 + 7 + 14);
        assert!(named_spectrum("glass-unobtainium").is_none());
    }

    #[test]
    fn illuminants_have_unit_luminance() {
        for name in spectrum_names().filter(|n| n.contains("illum")) {
            let y = named_spectrum(name).map(|s| spectrum_to_y(&s));
            assert!(y.is_some_and(|y| (y - 1.0).abs() < 1e-6), "{name}: {y:?}");
        }
    }

    #[test]
    fn indices_have_their_published_values() {
        // n_d of BK7 at 587.6 nm; gold at 587.6 nm; silver's k in the middle of the visible.
        let value = |name: &str, lambda| named_spectrum(name).map_or(f32::NAN, |s| s.value(lambda));
        assert!((value("glass-BK7", 587.6) - 1.5168).abs() < 2e-4);
        assert!((value("metal-Au-eta", 587.6) - 0.27).abs() < 0.05);
        assert!((value("metal-Ag-k", 550.0) - 3.6).abs() < 0.4);
    }
}
