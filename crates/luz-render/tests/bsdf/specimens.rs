//! The BSDFs and directions that the tests look at.

use glam::{Vec2, Vec3};
use luz_color::SampledSpectrum;
use luz_render::bsdf::{
    Base, Bsdf, CoatInterface, CoatMedium, CoatedDiffuse, Conductor, Dielectric, Diffuse, DiffuseTransmission, Layered,
    ThinDielectric, TransportMode, TrowbridgeReitz,
};

/// The direction with the given cosine and azimuth.
pub fn direction(cos: f64, phi: f64) -> Vec3 {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    Vec3::new((sin * phi.cos()) as f32, (sin * phi.sin()) as f32, cos as f32)
}

/// A spectrum that is different in every lane, around `mean`.
pub fn coloured(mean: f32) -> SampledSpectrum {
    let mut lane = 0;
    SampledSpectrum::ZERO.map(|_| {
        lane += 1;
        mean * (0.7 + 0.3 * lane as f32 / 4.5)
    })
}

pub fn conductor(alpha_x: f32, alpha_y: f32) -> Bsdf<'static> {
    Bsdf::Conductor(metal(alpha_x, alpha_y))
}

fn metal(alpha_x: f32, alpha_y: f32) -> Conductor {
    Conductor::new(TrowbridgeReitz::new(alpha_x, alpha_y), coloured(0.3), coloured(3.0))
}

/// A metal that reflects everything.
pub fn ideal_conductor(alpha_x: f32, alpha_y: f32) -> Bsdf<'static> {
    let distribution = TrowbridgeReitz::new(alpha_x, alpha_y);
    Bsdf::Conductor(Conductor::new(distribution, SampledSpectrum::ZERO, SampledSpectrum::ONE))
}

pub fn dielectric(alpha_x: f32, alpha_y: f32, eta: f32) -> Bsdf<'static> {
    Bsdf::Dielectric(Dielectric::new(TrowbridgeReitz::new(alpha_x, alpha_y), eta))
}

/// A layered BSDF over a Lambertian base.
pub fn layered_diffuse(reflectance: SampledSpectrum, alpha: f32, eta: f32, medium: CoatMedium) -> Layered {
    let top = Dielectric::new(TrowbridgeReitz::new(alpha, alpha), eta);
    Layered::new(top, Base::Diffuse(Diffuse::new(reflectance)), medium, 10, 1, 7)
}

/// A layered BSDF over a metal.
pub fn layered_conductor(top_alpha: f32, base_alpha: f32, medium: CoatMedium) -> Layered {
    let top = Dielectric::new(TrowbridgeReitz::new(top_alpha, top_alpha), 1.5);
    Layered::new(top, Base::Conductor(metal(base_alpha, base_alpha)), medium, 10, 1, 7)
}

/// A coat that only attenuates.
pub fn clear(thickness: f32) -> CoatMedium {
    CoatMedium { thickness, albedo: SampledSpectrum::ZERO, g: 0.0 }
}

/// A coat that scatters.
pub fn milky(thickness: f32, albedo: f32, g: f32) -> CoatMedium {
    CoatMedium { thickness, albedo: coloured(albedo), g }
}

/// Coats for the specimens to borrow.
pub struct Coats(pub Vec<CoatInterface>);

impl Coats {
    pub fn new() -> Self {
        let coat = |x, y, eta| CoatInterface::new(x, y, eta, 0.01, 10);
        Self(vec![
            coat(0.0, 0.0, 1.5),
            coat(0.05, 0.05, 1.5),
            coat(0.3, 0.3, 1.5),
            coat(0.7, 0.7, 1.8),
            coat(0.1, 0.4, 1.5),
            coat(0.3, 0.3, 1.0),
            CoatInterface::textured(1.5, 0.01, 10),
        ])
    }

    /// Every BSDF whose density is exact and that has a part which is not specular.
    pub fn densities(&self) -> Vec<(String, Bsdf<'_>)> {
        let mut all = vec![
            ("diffuse".into(), Bsdf::Diffuse(Diffuse::new(coloured(0.6)))),
            (
                "diffuse transmission".into(),
                Bsdf::DiffuseTransmission(DiffuseTransmission::new(coloured(0.6), coloured(0.2))),
            ),
        ];
        for (x, y) in [(0.03, 0.03), (0.2, 0.2), (0.6, 0.6), (1.0, 1.0), (0.05, 0.3), (0.6, 0.15)] {
            all.push((format!("conductor {x} {y}"), conductor(x, y)));
            for eta in [1.5, 1.0 / 1.33] {
                all.push((format!("dielectric {x} {y} eta {eta}"), dielectric(x, y, eta)));
            }
        }
        for (i, coat) in self.0.iter().enumerate() {
            let bsdf = CoatedDiffuse::textured(coloured(0.5), coat, 0.2, 0.35);
            all.push((format!("coated diffuse {i}"), Bsdf::CoatedDiffuse(bsdf)));
        }
        all
    }

    /// Every kind of BSDF.
    pub fn all(&self) -> Vec<(String, Bsdf<'_>)> {
        let mut all = self.densities();
        all.push(("mirror".into(), conductor(0.0, 0.0)));
        for eta in [1.5, 1.0, 0.75] {
            all.push((format!("glass {eta}"), dielectric(0.0, 0.0, eta)));
        }
        all.push(("plate".into(), Bsdf::ThinDielectric(ThinDielectric::new(1.5))));
        for (top, base) in [(0.0, 0.0), (0.0, 0.3), (0.2, 0.0), (0.2, 0.3)] {
            for (name, medium) in [("clear", clear(0.01)), ("milky", milky(0.5, 0.8, 0.3))] {
                all.push((
                    format!("{name} coat {top} over metal {base}"),
                    Bsdf::Layered(layered_conductor(top, base, medium)),
                ));
            }
        }
        for alpha in [0.0, 0.3] {
            let bsdf = layered_diffuse(coloured(0.6), alpha, 1.5, milky(0.5, 0.8, -0.3));
            all.push((format!("milky coat {alpha} over diffuse"), Bsdf::Layered(bsdf)));
        }
        all
    }
}

/// Directions on both sides, from the normal to grazing.
pub fn outgoing() -> Vec<Vec3> {
    vec![
        direction(1.0, 0.0),
        direction(0.8, 0.4),
        direction(0.4, 2.0),
        direction(0.08, -1.0),
        direction(-0.9, 1.0),
        direction(-0.3, -2.5),
    ]
}

/// Both transport modes.
pub const MODES: [TransportMode; 2] = [TransportMode::Radiance, TransportMode::Importance];

/// The point `i` of a two-dimensional low-discrepancy sequence, and a third coordinate.
pub fn point(i: u32) -> (f32, Vec2) {
    let x = |step: f64| (0.5 + step * f64::from(i)).fract() as f32;
    let below_one = |x: f32| x.min(luz_sample::ONE_MINUS_EPSILON);
    // The generalised golden ratio in three dimensions.
    (
        below_one(x(0.819_172_513_396_164_4)),
        Vec2::new(below_one(x(0.671_043_606_703_789_2)), below_one(x(0.549_700_477_901_970_3))),
    )
}
