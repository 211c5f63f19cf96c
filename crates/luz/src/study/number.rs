//! Numbers for people.

/// A number with three digits and a prefix of the SI: 12.3 M.
pub fn si(value: f64) -> String {
    let (scaled, prefix) = match value.abs() {
        v if v >= 1e12 => (value / 1e12, " T"),
        v if v >= 1e9 => (value / 1e9, " G"),
        v if v >= 1e6 => (value / 1e6, " M"),
        v if v >= 1e3 => (value / 1e3, " k"),
        _ => (value, " "),
    };
    let digits = match scaled.abs() {
        v if v >= 100.0 || (prefix == " " && v.fract() == 0.0) => 0,
        v if v >= 10.0 => 1,
        _ => 2,
    };
    format!("{scaled:.digits$}{prefix}").trim_end().to_owned()
}

/// A time for people: 350 ms, 12.3 s, 4 min 10 s, 1 h 02 min.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if !s.is_finite() => "?".to_owned(),
        s if s < 1.0 => format!("{:.0} ms", s * 1e3),
        s if s < 60.0 => format!("{s:.1} s"),
        s if s < 3600.0 => format!("{} min {:02} s", (s / 60.0) as u64, (s % 60.0) as u64),
        s => format!("{} h {:02} min", (s / 3600.0) as u64, (s % 3600.0 / 60.0) as u64),
    }
}

/// An amount of memory: 12.3 MB.
pub fn bytes(count: u64) -> String {
    let text = si(count as f64);
    if text.contains(' ') { format!("{text}B") } else { format!("{text} B") }
}

/// A number of any size with so many significant digits: 0.0123, 1.23 × 10⁻⁵, 4560. What is not finite is `–`.
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = digits.max(1);
    // Rounded first, so that 9.999 is 10.0 and not 10.00.
    let text = format!("{value:.*e}", digits - 1);
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-3..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        minus(&format!("{value:.decimals$}"))
    } else {
        format!("{} × {}", minus(mantissa), power_of_ten(exponent))
    }
}

/// 10⁻³
pub fn power_of_ten(exponent: i32) -> String {
    let digits = exponent.to_string();
    let raised = digits.chars().map(|c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' => '⁰',
        other => char::from_u32(other as u32 - '0' as u32 + '⁰' as u32).unwrap_or(other),
    });
    format!("10{}", raised.collect::<String>())
}

/// A factor: 3.21 ×, 0.456 ×, 12.3 ×.
pub fn factor(value: f64) -> String {
    format!("{} ×", significant(value, 3))
}

/// A share of one as per cent, with two digits at least: 12 %, 0.34 %.
pub fn percent(share: f64) -> String {
    if share.is_finite() { format!("{} %", significant(100.0 * share, 2)) } else { "–".to_owned() }
}

/// A number with a true minus sign.
fn minus(text: &str) -> String {
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_for_people() {
        assert_eq!(si(0.0), "0");
        assert_eq!(si(12.0), "12");
        assert_eq!(si(1234.0), "1.23 k");
        assert_eq!(si(12_345_678.0), "12.3 M");
        assert_eq!(bytes(12), "12 B");
        assert_eq!(bytes(2_500_000), "2.50 MB");
        assert_eq!(duration(0.35), "350 ms");
        assert_eq!(duration(12.34), "12.3 s");
        assert_eq!(duration(250.0), "4 min 10 s");
        assert_eq!(duration(3720.0), "1 h 02 min");
        assert_eq!(duration(f64::INFINITY), "?");
    }

    #[test]
    fn significant_digits() {
        assert_eq!(significant(0.012_345, 3), "0.0123");
        assert_eq!(significant(1.2345e-5, 3), "1.23 × 10⁻⁵");
        assert_eq!(significant(-4567.0, 3), "−4567");
        assert_eq!(significant(9.999, 3), "10.0");
        assert_eq!(significant(1e6, 2), "1.0 × 10⁶");
        assert_eq!(significant(2.5e-12, 2), "2.5 × 10⁻¹²");
        assert_eq!(significant(0.0, 3), "0");
        assert_eq!(significant(f64::NAN, 3), "–");
        assert_eq!(factor(3.214), "3.21 ×");
        assert_eq!(percent(0.123_45), "12 %");
        assert_eq!(percent(0.95), "95 %");
        assert_eq!(power_of_ten(-45), "10⁻⁴⁵");
    }
}
