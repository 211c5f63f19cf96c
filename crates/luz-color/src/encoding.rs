//! How numbers in image files stand for linear light.

use std::sync::OnceLock;

/// A transfer function between encoded values and linear light, both with 1 for white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Encoding {
    /// Values are proportional to light.
    Linear,
    /// The piecewise function of IEC 61966-2-1.
    Srgb,
    /// Light is the encoded value raised to this exponent.
    Gamma(f32),
}

impl Encoding {
    /// The encoding of a name: `linear`, `sRGB` (in any case), or `gamma` followed by a positive exponent, as `gamma 2.2`.
    pub fn parse(name: &str) -> Option<Self> {
        let name = name.trim().to_ascii_lowercase();
        match name.as_str() {
            "linear" => Some(Self::Linear),
            "srgb" => Some(Self::Srgb),
            _ => {
                let exponent: f32 = name.strip_prefix("gamma")?.trim().parse().ok()?;
                (exponent.is_finite() && exponent > 0.0).then_some(Self::Gamma(exponent))
            }
        }
    }

    /// Linear light of an encoded value.
    pub fn to_linear(self, encoded: f32) -> f32 {
        match self {
            Self::Linear => encoded,
            Self::Srgb => srgb_to_linear(encoded),
            Self::Gamma(exponent) => signed_power(encoded, exponent),
        }
    }

    /// The encoded value of linear light.
    pub fn from_linear(self, linear: f32) -> f32 {
        match self {
            Self::Linear => linear,
            Self::Srgb => linear_to_srgb(linear),
            Self::Gamma(exponent) => signed_power(linear, 1.0 / exponent),
        }
    }

    /// The linear light of every 8-bit value.
    pub fn table_8bit(self) -> [f32; 256] {
        std::array::from_fn(|i| self.to_linear(i as f32 / 255.0))
    }
}

/// sRGB's electro-optical transfer function (IEC 61966-2-1), odd for negative values.
pub fn srgb_to_linear(encoded: f32) -> f32 {
    let v = f64::from(encoded.abs());
    let linear = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
    (linear as f32).copysign(encoded)
}

/// The inverse of [`srgb_to_linear`].
pub fn linear_to_srgb(linear: f32) -> f32 {
    let v = f64::from(linear.abs());
    let encoded = if v <= 0.04045 / 12.92 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (encoded as f32).copysign(linear)
}

/// Linear light of an 8-bit sRGB value, by table.
pub fn srgb8_to_linear(encoded: u8) -> f32 {
    static TABLE: OnceLock<[f32; 256]> = OnceLock::new();
    TABLE.get_or_init(|| Encoding::Srgb.table_8bit())[usize::from(encoded)]
}

/// The 8-bit sRGB value nearest to linear light, clamped to 0–255; NaN gives 0.
pub fn linear_to_srgb8(linear: f32) -> u8 {
    (linear_to_srgb(linear).clamp(0.0, 1.0) * 255.0).round() as u8
}

fn signed_power(value: f32, exponent: f32) -> f32 {
    value.abs().powf(exponent).copysign(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_8bit_value_survives() {
        for i in 0..=255 {
            assert_eq!(linear_to_srgb8(srgb8_to_linear(i)), i);
        }
        assert_eq!(linear_to_srgb8(f32::NAN), 0);
        assert_eq!(linear_to_srgb8(f32::INFINITY), 255);
        assert_eq!(linear_to_srgb8(-1.0), 0);
    }

    #[test]
    fn known_values() {
        assert!((srgb_to_linear(0.5) - 0.21404114).abs() < 1e-7);
        assert!((linear_to_srgb(0.18) - 0.46135613).abs() < 1e-6);
        assert_eq!(srgb_to_linear(1.0), 1.0);
        assert_eq!(srgb_to_linear(-0.5), -srgb_to_linear(0.5));
    }

    #[test]
    fn encodings_invert_and_parse() {
        for (name, encoding) in
            [("linear", Encoding::Linear), ("sRGB", Encoding::Srgb), ("gamma 2.2", Encoding::Gamma(2.2))]
        {
            assert_eq!(Encoding::parse(name), Some(encoding));
            for i in 0..=1000 {
                let v = i as f32 / 1000.0;
                assert!((encoding.to_linear(encoding.from_linear(v)) - v).abs() < 1e-6);
            }
        }
        for bad in ["", "gamma", "gamma 0", "gamma -1", "gamma nan", "rec709"] {
            assert_eq!(Encoding::parse(bad), None, "{bad}");
        }
    }
}
