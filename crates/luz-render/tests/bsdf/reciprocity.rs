//! Values for exchanged directions.

use luz_render::bsdf::{Bsdf, TransportMode};

use super::specimens::{Coats, direction};

#[test]
fn directions_can_be_exchanged() {
    let coats = Coats::new();
    let cosines = [0.95, 0.6, 0.2, 0.03, -0.9, -0.4, -0.05];
    for (name, bsdf) in coats.densities() {
        let eta = if let Bsdf::Dielectric(interface) = &bsdf { interface.eta() } else { 1.0 };
        for (i, &cos_o) in cosines.iter().enumerate() {
            for (j, &cos_i) in cosines.iter().enumerate() {
                let (wo, wi) = (direction(cos_o, 0.3 * i as f64), direction(cos_i, 2.0 + 0.5 * j as f64));
                let transmitted = cos_o * cos_i < 0.0;
                // Index of refraction on the side of `wi` over that of `wo`.
                let relative = match (transmitted, cos_o > 0.0) {
                    (false, _) => 1.0,
                    (true, true) => eta,
                    (true, false) => 1.0 / eta,
                };
                let radiance = bsdf.f(wo, wi, TransportMode::Radiance)[1];
                let importance = bsdf.f(wo, wi, TransportMode::Importance)[1];
                let exchanged = bsdf.f(wi, wo, TransportMode::Radiance)[1];
                // Veach 1997, eq. 5.14: f(wo, wi)/η_o² = f(wi, wo)/η_i², for the BSDF of radiance.
                let near = |a: f32, b: f32| (a - b).abs() <= 2e-3 * a.abs().max(b.abs()) + 1e-7;
                assert!(near(radiance * relative * relative, exchanged), "{name} {wo} {wi}: {radiance} {exchanged}");
                // The BSDF of importance is its adjoint.
                assert!(near(importance, exchanged), "{name} {wo} {wi}: {importance} {exchanged}");
            }
        }
    }
}
