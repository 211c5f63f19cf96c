//! Optimal weights for the direct light of a pixel (Kondapaneni et al. 2019).
//!
//! Each pixel learns from its own samples how light sampling and BSDF sampling are best combined at the first vertex. The
//! weights of a sample come from earlier samples, so that every sample is unbiased by itself. Deeper vertices use the balance
//! heuristic.

use crate::integrator::{FoundBy, Vertex};
use luz_color::SampledSpectrum;
use luz_sample::mis::Optimal;

/// The estimator of a pixel's direct light: two techniques, three channels.
pub(super) type OptimalDirect = Optimal<2, 3>;

/// The estimator of a pixel without samples.
pub(super) fn estimator() -> OptimalDirect {
    Optimal::new([1, 1])
}

/// The place of a technique where each has a place.
pub(super) const fn technique_index(found_by: FoundBy) -> usize {
    match found_by {
        FoundBy::Bsdf => 0,
        FoundBy::Light => 1,
    }
}

/// What both techniques have found at a path's first vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DirectAttempts {
    /// Has the path met a surface where both techniques look for light?
    has_looked: bool,
    /// Integrand and the densities of both techniques.
    found: [Option<(SampledSpectrum, [f32; 2])>; 2],
}

impl DirectAttempts {
    /// The first vertex.
    pub fn meet(&mut self, vertex: &Vertex<'_>) {
        let bsdf = &vertex.shading.bsdf;
        self.has_looked = bsdf.has_exact_pdf() && bsdf.flags().has_non_specular();
    }

    /// A technique has found light.
    pub fn add(&mut self, found_by: FoundBy, f: SampledSpectrum, light_pdf: f32, bsdf_pdf: f32) {
        self.found[technique_index(found_by)] = Some((f, [bsdf_pdf, light_pdf]));
    }

    /// The sample's estimate of direct light.
    pub fn end_round(&self, estimator: &mut OptimalDirect, to_rgb: impl Fn(SampledSpectrum) -> [f32; 3]) -> [f32; 3] {
        if !self.has_looked {
            return estimator.end_empty_round().map(|v| v as f32);
        }
        for (technique, found) in self.found.iter().enumerate() {
            match found {
                Some((f, pdfs)) => estimator.push(technique, &pdfs.map(f64::from), &to_rgb(*f).map(f64::from)),
                None => estimator.push_failure(technique),
            }
        }
        estimator.end_round().map(|v| v as f32)
    }
}
