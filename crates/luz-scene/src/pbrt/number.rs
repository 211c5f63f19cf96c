//! Numbers of scene files, straight from bytes: correctly rounded, without a string per token.

/// What is wrong with a token that should be a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NumberFault {
    /// It isn't a number.
    NotANumber,
    /// It's a number with a fraction or an exponent where an integer should be.
    NotAnInteger,
    /// It's too large for `f32` or `i32`.
    OutOfRange,
}

/// Powers of ten that `f64` holds exactly.
const EXACT_POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// Does this byte end a token?
#[inline]
pub(crate) fn is_delimiter(byte: u8) -> bool {
    matches!(byte, b' ' | b'\n' | b'\t' | b'\r' | b'"' | b'[' | b']')
}

/// The byte behind the last byte of the token that starts at `start`.
pub(crate) fn token_end(text: &[u8], start: usize) -> usize {
    text[start..].iter().position(|&b| is_delimiter(b)).map_or(text.len(), |length| start + length)
}

/// Reads decimal digits into `value` until it holds 19 of them; further digits are counted in the result's second part.
#[inline]
fn digits(text: &[u8], mut at: usize, value: &mut u64, count: &mut u32, dropped: &mut i32) -> usize {
    while let Some(digit) = text.get(at).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
        if *count < 19 {
            *value = *value * 10 + u64::from(digit);
            *count += u32::from(*value != 0);
        } else {
            *dropped += 1;
        }
        at += 1;
    }
    at
}

/// Parses the number that starts at `start` as an `f32`, rounded to nearest, ties to even. Returns it and the index
/// behind its token.
#[inline]
pub(crate) fn parse_f32(text: &[u8], start: usize) -> Result<(f32, usize), NumberFault> {
    let mut at = start;
    let negative = match text.get(at) {
        Some(b'-') => {
            at += 1;
            true
        }
        Some(b'+') => {
            at += 1;
            false
        }
        _ => false,
    };
    let (mut mantissa, mut count, mut dropped) = (0u64, 0u32, 0i32);
    let first = at;
    at = digits(text, at, &mut mantissa, &mut count, &mut dropped);
    let mut length = at - first;
    let mut exponent = dropped;
    if text.get(at) == Some(&b'.') {
        let fraction = at + 1;
        dropped = 0;
        at = digits(text, fraction, &mut mantissa, &mut count, &mut dropped);
        length += at - fraction;
        // Digits that did not fit any more don't move the point.
        exponent = exponent.saturating_sub((at - fraction) as i32 - dropped);
    }
    if length == 0 {
        return Err(NumberFault::NotANumber);
    }
    if matches!(text.get(at), Some(b'e' | b'E')) {
        at += 1;
        let negative_exponent = text.get(at) == Some(&b'-');
        at += usize::from(matches!(text.get(at), Some(b'-' | b'+')));
        let (mut value, first) = (0i32, at);
        while let Some(digit) = text.get(at).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
            value = value.saturating_mul(10).saturating_add(i32::from(digit)).min(1_000_000);
            at += 1;
        }
        if at == first {
            return Err(NumberFault::NotANumber);
        }
        exponent = exponent.saturating_add(if negative_exponent { -value } else { value });
    }
    if text.get(at).is_some_and(|&b| !is_delimiter(b)) {
        return Err(NumberFault::NotANumber);
    }
    let magnitude = match round_to_f32(mantissa, exponent) {
        Some(value) => value,
        None => slow(&text[start..at])?.abs(),
    };
    if magnitude.is_infinite() {
        return Err(NumberFault::OutOfRange);
    }
    Ok((if negative { -magnitude } else { magnitude }, at))
}

/// `mantissa · 10^exponent` as `f32`, if double precision decides the rounding.
///
/// The `f64` product carries at most three roundings (mantissa, digits beyond the 19th, product), less than 2 units in
/// its last place together; so rounding it again is right unless it lies within 4 units of a midpoint between two
/// neighbouring `f32` values.
#[inline]
fn round_to_f32(mantissa: u64, exponent: i32) -> Option<f32> {
    if mantissa == 0 {
        return Some(0.0);
    }
    let power = *EXACT_POWERS.get(exponent.unsigned_abs() as usize)?;
    let value = if exponent < 0 { mantissa as f64 / power } else { mantissa as f64 * power };
    // The 29 bits that f32 does not keep.
    let rest = (value.to_bits() & 0x1fff_ffff) as i64;
    let decided = (rest - 0x1000_0000).abs() > 4;
    // Subnormal f32 keep fewer bits.
    (decided && value >= f64::from(f32::MIN_POSITIVE)).then_some(value as f32)
}

#[cold]
fn slow(token: &[u8]) -> Result<f32, NumberFault> {
    std::str::from_utf8(token).ok().and_then(|t| t.parse().ok()).ok_or(NumberFault::NotANumber)
}

/// Parses the integer that starts at `start`. Returns it and the index behind its token.
#[inline]
pub(crate) fn parse_i32(text: &[u8], start: usize) -> Result<(i32, usize), NumberFault> {
    let mut at = start;
    let negative = text.get(at) == Some(&b'-');
    at += usize::from(matches!(text.get(at), Some(b'-' | b'+')));
    let (mut value, first) = (0i64, at);
    while let Some(digit) = text.get(at).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
        value = (value * 10 + i64::from(digit)).min(1 << 40);
        at += 1;
    }
    if at == first || text.get(at).is_some_and(|&b| !is_delimiter(b)) {
        return Err(match parse_f32(text, start) {
            Err(NumberFault::NotANumber) => NumberFault::NotANumber,
            _ => NumberFault::NotAnInteger,
        });
    }
    let value = if negative { -value } else { value };
    i32::try_from(value).map(|value| (value, at)).map_err(|_| NumberFault::OutOfRange)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    fn f32_of(text: &str) -> Result<f32, NumberFault> {
        parse_f32(text.as_bytes(), 0).map(|(value, _)| value)
    }

    #[test]
    fn forms_of_numbers() {
        for (text, value) in [
            ("0", 0.0),
            ("-0", -0.0),
            ("+1.5", 1.5),
            (".25", 0.25),
            ("3.", 3.0),
            ("1e3", 1e3),
            ("1E-3", 1e-3),
            ("000000000000000000000000000001.5", 1.5),
            ("340282346638528859811704183484516925440", f32::MAX),
            ("1e-45", 1e-45),
            ("1e-999999999999", 0.0),
            ("0e999999999999", 0.0),
            ("0.000000000000000000000000000000000000000000001", 1e-45),
        ] {
            let parsed = f32_of(text).unwrap();
            assert_eq!((parsed.to_bits(), text), (f32::to_bits(value), text));
        }
        for text in ["", "-", ".", "e5", "1e", "1e+", "nan", "inf", "0x10", "1.2.3", "1,5", "--1", "1f", "1#"] {
            assert_eq!((f32_of(text), text), (Err(NumberFault::NotANumber), text));
        }
        for text in ["1e39", "1e999", "-1e999", "340282366920938463463374607431768211456"] {
            assert_eq!((f32_of(text), text), (Err(NumberFault::OutOfRange), text));
        }
    }

    #[test]
    fn integers() {
        let int = |text: &str| parse_i32(text.as_bytes(), 0).map(|(value, _)| value);
        assert_eq!(int("-2147483648"), Ok(i32::MIN));
        assert_eq!(int("+7]"), Ok(7));
        assert_eq!(int("2147483648"), Err(NumberFault::OutOfRange));
        assert_eq!(int("99999999999999999999999999"), Err(NumberFault::OutOfRange));
        assert_eq!(int("1.0"), Err(NumberFault::NotAnInteger));
        assert_eq!(int("1e3"), Err(NumberFault::NotAnInteger));
        assert_eq!(int("x"), Err(NumberFault::NotANumber));
        assert_eq!(int("-"), Err(NumberFault::NotANumber));
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 4000, rng_seed: RngSeed::Fixed(1), ..Default::default() })]

        #[test]
        fn rounds_as_the_standard_library(mantissa in 0u64.., point in 0usize..22, exponent in -60i32..40) {
            let mut text = format!("{mantissa:022}");
            text.insert(point, '.');
            text += &format!("e{exponent}");
            let expected: f32 = text.parse().unwrap();
            match f32_of(&text) {
                Ok(value) => prop_assert_eq!(value.to_bits(), expected.to_bits(), "{}", text),
                Err(fault) => prop_assert!(fault == NumberFault::OutOfRange && expected.is_infinite(), "{}", text),
            }
        }

        #[test]
        fn rounds_next_to_midpoints(bits in 1u32..0x7f7f_ffff, digits in 6usize..40) {
            // The decimal expansion of a midpoint between two floats, cut off somewhere.
            let (low, high) = (f64::from(f32::from_bits(bits)), f64::from(f32::from_bits(bits + 1)));
            let text = format!("{:.*e}", digits, (low + high) / 2.0);
            prop_assert_eq!(f32_of(&text).unwrap().to_bits(), text.parse::<f32>().unwrap().to_bits(), "{}", text);
        }

        #[test]
        fn shortest_decimals_come_back(bits in 0u32..0x7f80_0000) {
            let value = f32::from_bits(bits);
            prop_assert_eq!(f32_of(&format!("{value:?}")).unwrap().to_bits(), bits);
        }
    }
}
