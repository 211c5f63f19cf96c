//! The normal distribution.

use glam::Vec2;

use crate::trigonometry::sin_cos_turns;

/// Two independent standard normal numbers (Box and Muller 1958). Always finite: at most 5.8 from zero, for `u.x` has 24
/// bits.
#[inline]
pub fn box_muller(u: Vec2) -> Vec2 {
    let r = (-2.0 * (-u.x).ln_1p()).sqrt();
    let (sin, cos) = sin_cos_turns(u.y);
    Vec2::new(r * cos, r * sin)
}

/// The density of [`box_muller`], in area: `exp(−|x|²/2) / 2π`.
#[inline]
pub fn box_muller_pdf(x: Vec2) -> f32 {
    (-0.5 * x.length_squared()).exp() / std::f32::consts::TAU
}

/// A normal number by inversion of the distribution function, which keeps the stratification of `u`. Always finite: `u`
/// stands for the middle of its `2⁻²⁴` wide cell.
#[inline]
pub fn normal(u: f32, mean: f32, standard_deviation: f32) -> f32 {
    let z = normal_quantile(f64::from(u) + 0.5 / f64::from(1u32 << 24));
    mean + standard_deviation * z as f32
}

/// The density of [`normal`], in length.
#[inline]
pub fn normal_pdf(x: f32, mean: f32, standard_deviation: f32) -> f32 {
    let z = (x - mean) / standard_deviation;
    (-0.5 * z * z).exp() / (standard_deviation * std::f32::consts::TAU.sqrt())
}

/// The standard normal quantile of the probability `p`: the `z` below which that much lies; infinite at 0 and 1, NaN
/// outside. Relative error about 1e-16 (Wichura 1988, algorithm AS 241, PPND16).
pub fn normal_quantile(p: f64) -> f64 {
    const CENTRE: ([f64; 8], [f64; 8]) = (
        [
            3.387_132_872_796_366_608_0e0,
            1.331_416_678_917_843_774_5e2,
            1.971_590_950_306_551_442_7e3,
            1.373_169_376_550_946_112_5e4,
            4.592_195_393_154_987_145_7e4,
            6.726_577_092_700_870_085_3e4,
            3.343_057_558_358_812_810_5e4,
            2.509_080_928_730_122_672_7e3,
        ],
        [
            1.0,
            4.231_333_070_160_091_125_2e1,
            6.871_870_074_920_579_083_0e2,
            5.394_196_021_424_751_107_7e3,
            2.121_379_430_158_659_586_7e4,
            3.930_789_580_009_271_061_0e4,
            2.872_908_573_572_194_267_4e4,
            5.226_495_278_852_854_561_0e3,
        ],
    );
    const MIDDLE: ([f64; 8], [f64; 8]) = (
        [
            1.423_437_110_749_683_577_34e0,
            4.630_337_846_156_545_295_90e0,
            5.769_497_221_460_691_405_50e0,
            3.647_848_324_763_204_605_04e0,
            1.270_458_252_452_368_382_58e0,
            2.417_807_251_774_506_117_70e-1,
            2.272_384_498_926_918_458_33e-2,
            7.745_450_142_783_414_076_40e-4,
        ],
        [
            1.0,
            2.053_191_626_637_758_821_87e0,
            1.676_384_830_183_803_849_40e0,
            6.897_673_349_851_000_045_50e-1,
            1.481_039_764_274_800_745_90e-1,
            1.519_866_656_361_645_719_66e-2,
            5.475_938_084_995_344_946_00e-4,
            1.050_750_071_644_416_843_24e-9,
        ],
    );
    const FAR: ([f64; 8], [f64; 8]) = (
        [
            6.657_904_643_501_103_777_20e0,
            5.463_784_911_164_114_369_90e0,
            1.784_826_539_917_291_335_80e0,
            2.965_605_718_285_048_912_30e-1,
            2.653_218_952_657_612_309_30e-2,
            1.242_660_947_388_078_438_60e-3,
            2.711_555_568_743_487_578_15e-5,
            2.010_334_399_292_288_132_65e-7,
        ],
        [
            1.0,
            5.998_322_065_558_879_376_90e-1,
            1.369_298_809_227_358_053_10e-1,
            1.487_536_129_085_061_485_25e-2,
            7.868_691_311_456_132_591_00e-4,
            1.846_318_317_510_054_681_80e-5,
            1.421_511_758_316_445_888_70e-7,
            2.044_263_103_389_939_785_64e-15,
        ],
    );
    fn rational((numerator, denominator): ([f64; 8], [f64; 8]), x: f64) -> f64 {
        let horner = |c: [f64; 8]| c.iter().rev().fold(0.0, |sum, &c| sum * x + c);
        horner(numerator) / horner(denominator)
    }
    if !(0.0..=1.0).contains(&p) {
        return f64::NAN;
    }
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        return q * rational(CENTRE, 0.180_625 - q * q);
    }
    let tail = if q < 0.0 { p } else { 1.0 - p };
    if tail == 0.0 {
        return f64::INFINITY.copysign(q);
    }
    let r = (-tail.ln()).sqrt();
    let z = if r <= 5.0 { rational(MIDDLE, r - 1.6) } else { rational(FAR, r - 5.0) };
    z.copysign(q)
}
