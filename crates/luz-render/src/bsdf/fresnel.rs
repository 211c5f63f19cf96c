//! The Fresnel equations for unpolarised light.

use luz_color::SampledSpectrum;

/// Reflectance of a smooth dielectric interface, in `[0, 1]`.
///
/// `cos_i` is the cosine at the side of incidence: positive where light comes from the side of the normal, negative from
/// the other. `eta` is the index of refraction of the side below the normal over the one above it. One under total
/// internal reflection. Born and Wolf, *Principles of Optics*, section 1.5.2, eq. 21a.
#[inline]
pub fn dielectric(cos_i: f32, eta: f32) -> f32 {
    let eta = if cos_i > 0.0 { eta } else { 1.0 / eta };
    let cos_i = cos_i.abs().min(1.0);
    let sin2_t = (1.0 - cos_i * cos_i) / (eta * eta);
    if sin2_t >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Reflectance of a smooth conductor at every wavelength, in `[0, 1]`.
///
/// `cos_i ≥ 0` is the cosine of incidence, `eta` and `k` are the real and imaginary part of the metal's index of
/// refraction relative to the outside. Born and Wolf, section 14.2, with the complex square root resolved into
/// `a² + b² = |η̂² − sin²θ|` and `a² − b² = Re(η̂² − sin²θ)`, so that every lane is real arithmetic.
#[inline]
pub fn conductor(cos_i: f32, eta: SampledSpectrum, k: SampledSpectrum) -> SampledSpectrum {
    let cos = cos_i.clamp(0.0, 1.0);
    let cos2 = cos * cos;
    let sin2 = 1.0 - cos2;
    eta.zip(k, |eta, k| {
        let re = eta * eta - k * k - sin2;
        let im = 2.0 * eta * k;
        let modulus = (re * re + im * im).sqrt();
        let a2_twice = 2.0 * (0.5 * (modulus + re)).max(0.0).sqrt() * cos;
        let s = modulus + cos2;
        let perpendicular = (s - a2_twice) / (s + a2_twice).max(f32::MIN_POSITIVE);
        let p = modulus * cos2 + sin2 * sin2;
        let q = a2_twice * sin2;
        let parallel = perpendicular * (p - q) / (p + q).max(f32::MIN_POSITIVE);
        // Rounding must not make a reflectance of nothing negative.
        (0.5 * (perpendicular + parallel)).clamp(0.0, 1.0)
    })
}

/// Reflectance of a plate of a smooth dielectric, with all interreflection between its two faces: with `R` of one face,
/// `R + T²R/(1 − R²) = 2R/(1 + R)`.
#[inline]
pub fn thin_dielectric(cos_i: f32, eta: f32) -> f32 {
    let r = dielectric(cos_i.abs(), eta);
    2.0 * r / (1.0 + r)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_incidence_is_the_textbook_value() {
        assert!((dielectric(1.0, 1.5) - 0.04).abs() < 1e-7);
        assert!((dielectric(-1.0, 1.5) - 0.04).abs() < 1e-7);
        // ((η−1)² + k²) / ((η+1)² + k²)
        let r = conductor(1.0, SampledSpectrum::splat(0.2), SampledSpectrum::splat(3.9))[0];
        let expected = (0.8f32 * 0.8 + 3.9 * 3.9) / (1.2 * 1.2 + 3.9 * 3.9);
        assert!((r - expected).abs() < 1e-6);
    }

    #[test]
    fn a_conductor_without_absorption_is_a_dielectric() {
        for i in 1..=100 {
            let cos = i as f32 / 100.0;
            let c = conductor(cos, SampledSpectrum::splat(1.5), SampledSpectrum::ZERO)[0];
            assert!((c - dielectric(cos, 1.5)).abs() < 2e-6, "at cos {cos}");
        }
    }

    #[test]
    fn both_sides_of_an_interface_reflect_alike() {
        // Nearer to grazing, the cosine inside cannot be rounded finely enough.
        for i in 5..100 {
            let cos_i = i as f32 / 100.0;
            let sin_t = (1.0 - cos_i * cos_i).sqrt() / 1.5;
            let cos_t = (1.0 - sin_t * sin_t).sqrt();
            assert!((dielectric(cos_i, 1.5) - dielectric(-cos_t, 1.5)).abs() < 1e-5);
        }
        assert_eq!(dielectric(-0.5, 1.5), 1.0, "total internal reflection");
    }

    #[test]
    fn brewsters_angle_extinguishes_the_parallel_part() {
        let brewster = 1.5f32.atan();
        let r = dielectric(brewster.cos(), 1.5);
        let (i, t) = (brewster, (brewster.sin() / 1.5).asin());
        let perpendicular = ((i - t).sin() / (i + t).sin()).powi(2);
        assert!((r - 0.5 * perpendicular).abs() < 1e-6);
    }

    #[test]
    fn a_plate_sums_its_interreflections() {
        let r = dielectric(0.7, 1.5);
        let t = 1.0 - r;
        let sum: f32 = r + (0..20).map(|i| t * t * r * r.powi(2 * i)).sum::<f32>();
        assert!((thin_dielectric(0.7, 1.5) - sum).abs() < 1e-6);
        assert_eq!(thin_dielectric(0.0, 1.5), 1.0);
    }
}
