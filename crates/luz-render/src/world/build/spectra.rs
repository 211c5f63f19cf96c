//! From a scene file's spectra to spectral distributions.

use crate::texture::SpectrumKind;
use luz_color::{PiecewiseLinearSpectrum, RgbColorSpace, Spectrum, named_spectrum, spectrum_names};
use luz_scene::diagnostic::did_you_mean;
use luz_scene::{ColorSpace, Diagnostic, Diagnostics, ParameterList, Span, SpectrumParameter};
use std::sync::Arc;

/// The colour space of that name.
pub(super) fn color_space(space: ColorSpace) -> &'static RgbColorSpace {
    match space {
        ColorSpace::Srgb => RgbColorSpace::srgb(),
        ColorSpace::DciP3 => RgbColorSpace::dci_p3(),
        ColorSpace::Rec2020 => RgbColorSpace::rec2020(),
        ColorSpace::Aces2065 => RgbColorSpace::aces2065_1(),
    }
}

/// The spectrum that a parameter stands for; problems are reported at `span`. What would have to be searched or computed
/// at each lookup is tabulated by whole nanometres.
pub(super) fn spectrum(
    parameter: &SpectrumParameter,
    kind: SpectrumKind,
    span: Option<Span>,
    diagnostics: &mut Diagnostics,
) -> Spectrum {
    match exact_spectrum(parameter, kind, span, diagnostics) {
        slow @ (Spectrum::PiecewiseLinear(_) | Spectrum::Blackbody(_)) => Spectrum::Dense(Arc::new(slow.to_dense())),
        fast => fast,
    }
}

fn exact_spectrum(
    parameter: &SpectrumParameter,
    kind: SpectrumKind,
    span: Option<Span>,
    diagnostics: &mut Diagnostics,
) -> Spectrum {
    let fallback = Spectrum::Constant(0.0);
    match parameter {
        SpectrumParameter::Rgb { rgb, color_space: space } => {
            let space = color_space(*space);
            if rgb.iter().any(|v| *v < 0.0) {
                diagnostics.push(
                    Diagnostic::error(span, format!("a color component is negative: {} {} {}", rgb[0], rgb[1], rgb[2]))
                        .with_help("reflectances lie within [0, 1], emissions are not negative"),
                );
                return fallback;
            }
            match kind {
                SpectrumKind::Albedo => {
                    if rgb.iter().any(|v| *v > 1.0) {
                        diagnostics.push(
                            Diagnostic::error(
                                span,
                                format!("a reflectance exceeds 1: {} {} {}", rgb[0], rgb[1], rgb[2]),
                            )
                            .with_help("more light would leave the surface than reaches it; scale it down"),
                        );
                        return fallback;
                    }
                    Spectrum::rgb_albedo(space, *rgb)
                }
                SpectrumKind::Unbounded => Spectrum::rgb_unbounded(space, *rgb),
                SpectrumKind::Illuminant => Spectrum::rgb_illuminant(space, *rgb),
            }
        }
        SpectrumParameter::Blackbody(temperature) if *temperature > 0.0 => Spectrum::blackbody(*temperature),
        SpectrumParameter::Blackbody(temperature) => {
            diagnostics.error(span, format!("a temperature of {temperature} K does not radiate; it must be positive"));
            fallback
        }
        SpectrumParameter::Samples(samples) | SpectrumParameter::File { samples, .. } => {
            match PiecewiseLinearSpectrum::new(samples) {
                Ok(spectrum) => Spectrum::PiecewiseLinear(Arc::new(spectrum)),
                Err(error) => {
                    diagnostics.error(span, error.to_string());
                    fallback
                }
            }
        }
        SpectrumParameter::Named(name) => named_spectrum(name).unwrap_or_else(|| {
            diagnostics.push(
                Diagnostic::error(span, format!("no measured spectrum `{name}` is built in")).with_help(
                    did_you_mean(name, spectrum_names())
                        .unwrap_or_else(|| format!("known are {}", spectrum_names().collect::<Vec<_>>().join(", "))),
                ),
            );
            fallback
        }),
    }
}

/// The spectrum of a parameter, if it is given.
pub(super) fn optional_spectrum(
    parameters: &ParameterList,
    name: &str,
    kind: SpectrumKind,
    diagnostics: &mut Diagnostics,
) -> Option<Spectrum> {
    let parameter = parameters.spectrum(name, diagnostics)?;
    Some(spectrum(parameter, kind, parameters.span(name), diagnostics))
}
