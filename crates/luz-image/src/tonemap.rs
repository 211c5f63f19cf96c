//! From scene-referred light to what a display can show.

use crate::Image;

/// How scene-referred light becomes display light in `[0, 1]`: an exposure, then an operator. The default changes nothing but
/// clips. What leaves here is linear; writing encodes it as sRGB.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ToneMap {
    /// The exposure in stops: light is multiplied by 2 to this power.
    pub exposure: f32,
    /// What happens to light beyond the display's white.
    pub operator: ToneOperator,
}

/// How light of any strength is compressed into `[0, 1]`.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum ToneOperator {
    /// Everything beyond one is white: exact below, as for comparing renderings.
    #[default]
    Clip,
    /// L (1 + L / w²) / (1 + L) of the luminance L, so that `white` w becomes one; hues stay.
    /// Source: Reinhard et al. 2002, "Photographic Tone Reproduction for Digital Images", eq. 4.
    Reinhard {
        /// The luminance that becomes white, above zero.
        white: f32,
    },
    /// A film-like curve with a toe and a shoulder for each component, close to the ACES reference transform.
    /// Source: Narkowicz 2015, "ACES Filmic Tone Mapping Curve".
    Filmic,
}

impl ToneOperator {
    /// The operator of a name: `clip`, `reinhard` (with a white of 4) or `filmic`.
    pub fn parse(name: &str) -> Option<Self> {
        match name.to_ascii_lowercase().as_str() {
            "clip" => Some(Self::Clip),
            "reinhard" => Some(Self::Reinhard { white: 4.0 }),
            "filmic" => Some(Self::Filmic),
            _ => None,
        }
    }

    /// The names that [`ToneOperator::parse`] knows.
    pub const NAMES: [&'static str; 3] = ["clip", "reinhard", "filmic"];
}

impl ToneMap {
    /// Display light in `[0, 1]` of linear RGB light with sRGB's primaries. Negative light and NaN become zero.
    pub fn apply(&self, rgb: [f32; 3]) -> [f32; 3] {
        let exposure = self.exposure.exp2();
        let light = rgb.map(|c| if c > 0.0 { c * exposure } else { 0.0 });
        let mapped = match self.operator {
            ToneOperator::Clip => light,
            ToneOperator::Reinhard { white } => {
                let luminance = 0.2126 * light[0] + 0.7152 * light[1] + 0.0722 * light[2];
                if luminance.is_finite() {
                    let factor = (1.0 + luminance / (white * white)) / (1.0 + luminance);
                    light.map(|c| c * factor)
                } else {
                    light
                }
            }
            ToneOperator::Filmic => light.map(|x| {
                // The curve has reached its limit long before its squares overflow.
                let x = x.min(1e6);
                x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
            }),
        };
        mapped.map(|c| c.clamp(0.0, 1.0))
    }

    /// The image with its colour (R, G and B, or Y) mapped; other channels stay.
    pub fn apply_to(&self, image: &Image) -> Image {
        let mut mapped = image.clone();
        let Some(rgb) = image.rgb() else { return mapped };
        let n = image.channel_count();
        for pixel in mapped.data_mut().chunks_exact_mut(n) {
            let display = self.apply(rgb.map(|c| pixel[c]));
            for (c, value) in rgb.into_iter().zip(display) {
                pixel[c] = value;
            }
        }
        mapped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [ToneOperator; 3] = [ToneOperator::Clip, ToneOperator::Reinhard { white: 4.0 }, ToneOperator::Filmic];

    #[test]
    fn every_operator_maps_black_to_black_rises_and_stays_in_range() {
        for operator in ALL {
            let map = ToneMap { exposure: 0.0, operator };
            assert!(map.apply([0.0; 3])[0].abs() < 1e-6);
            let mut last = 0.0;
            for i in 0..2000 {
                let v = map.apply([1e-4 * 1.01f32.powi(i); 3])[1];
                assert!(v >= last && v <= 1.0, "{operator:?}");
                last = v;
            }
            assert!((last - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn odd_light_is_harmless() {
        for operator in ALL {
            let map = ToneMap { exposure: 10.0, operator };
            for v in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, f32::MAX] {
                assert!(map.apply([v, 0.5, v]).iter().all(|c| (0.0..=1.0).contains(c)), "{operator:?} {v}");
            }
        }
    }

    #[test]
    fn exposure_counts_stops_and_clip_is_exact() {
        let map = ToneMap { exposure: -2.0, ..ToneMap::default() };
        assert_eq!(map.apply([4.0, 1.0, 0.2]), [1.0, 0.25, 0.05]);
        let white = ToneMap { exposure: 0.0, operator: ToneOperator::Reinhard { white: 4.0 } };
        assert!((white.apply([4.0; 3])[0] - 1.0).abs() < 1e-6);
        assert!((white.apply([1.0; 3])[0] - 0.53125).abs() < 1e-6);
    }

    #[test]
    fn only_colour_is_mapped() {
        let image = Image::from_data(1, 1, ["R", "G", "B", "A", "Z"], vec![2.0, 0.5, 3.0, 0.7, 40.0]).unwrap();
        assert_eq!(ToneMap::default().apply_to(&image).data(), [1.0, 0.5, 1.0, 0.7, 40.0]);
        let grey = Image::from_data(1, 1, ["Y"], vec![5.0]).unwrap();
        assert_eq!(ToneMap::default().apply_to(&grey).data(), [1.0]);
        assert!(ToneOperator::NAMES.iter().all(|n| ToneOperator::parse(n).is_some()));
    }
}
