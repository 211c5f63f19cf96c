//! Axes, linear and logarithmic, and the round numbers that stand at them.

use super::number::power_of_ten;

/// How numbers become lengths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// In proportion.
    Linear,
    /// By their logarithm; what is not positive is left out.
    Log,
}

/// An axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// What it measures.
    pub label: String,
    /// How.
    pub scale: Scale,
    /// What follows each number: ` s`, ` dB`.
    pub unit: &'static str,
}

impl Axis {
    /// A logarithmic axis without a unit.
    pub fn log(label: &str) -> Self {
        Self { label: label.to_owned(), scale: Scale::Log, unit: "" }
    }

    /// A linear axis without a unit.
    pub fn linear(label: &str) -> Self {
        Self { label: label.to_owned(), scale: Scale::Linear, unit: "" }
    }

    /// The same with a unit.
    pub fn with_unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }
}

/// From numbers to lengths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mapping {
    scale: Scale,
    /// The numbers at both ends.
    pub(super) from: [f64; 2],
    /// The lengths there.
    pub(super) to: [f64; 2],
}

impl Mapping {
    /// Numbers from `from[0]` to `from[1]` become lengths from `to[0]` to `to[1]`.
    pub(super) fn new(scale: Scale, from: [f64; 2], to: [f64; 2]) -> Self {
        Self { scale, from, to }
    }

    /// Where a number is.
    pub(super) fn at(&self, value: f64) -> f64 {
        let along = |v: f64| if self.scale == Scale::Log { v.log10() } else { v };
        let [a, b] = self.from.map(along);
        self.to[0] + (along(value) - a) / (b - a) * (self.to[1] - self.to[0])
    }
}

/// A line of the grid; without a label, a thin one.
pub(super) struct Tick {
    /// Where.
    pub(super) value: f64,
    /// What it says.
    pub(super) label: Option<String>,
}

/// The lines of the grid, of which about `most` have labels.
pub(super) fn ticks(mapping: &Mapping, unit: &str, most: usize) -> Vec<Tick> {
    let [low, high] = mapping.from;
    match mapping.scale {
        Scale::Linear => linear_ticks(low, high, unit, most),
        Scale::Log => log_ticks(low, high, unit, most),
    }
}

fn linear_ticks(low: f64, high: f64, unit: &str, most: usize) -> Vec<Tick> {
    let rough = (high - low) / most.max(1) as f64;
    let magnitude = 10f64.powf(rough.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].map(|s| s * magnitude).into_iter().find(|s| *s >= rough).unwrap_or(10.0 * magnitude);
    if !(step > 0.0 && step.is_finite()) {
        return Vec::new();
    }
    let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    (first..=last.min(first.saturating_add(50)))
        .map(|i| {
            let value = i as f64 * step;
            Tick { value, label: Some(format!("{value:.decimals$}{unit}").replace('-', "−")) }
        })
        .collect()
}

fn log_ticks(low: f64, high: f64, unit: &str, most: usize) -> Vec<Tick> {
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let span = (high / low).log10();
    let is_short = span < 1.5;
    let every = ((span / most.max(1) as f64).ceil() as i32).max(1);
    // One way of writing for all labels.
    let is_plain = first >= -3 && last <= 5;
    let write = |mantissa: i32, exponent: i32| {
        let number = if is_plain {
            let value = f64::from(mantissa) * 10f64.powi(exponent);
            format!("{value:.*}", (-exponent).max(0) as usize)
        } else if mantissa == 1 {
            power_of_ten(exponent)
        } else {
            format!("{mantissa}·{}", power_of_ten(exponent))
        };
        number + unit
    };
    let mut out = Vec::new();
    for exponent in first..=last {
        for mantissa in 1..=9 {
            let value = f64::from(mantissa) * 10f64.powi(exponent);
            if value < low || value > high {
                continue;
            }
            let is_labelled = match mantissa {
                1 => exponent.rem_euclid(every) == 0,
                2 | 5 => is_short,
                _ => false,
            };
            if is_labelled || (mantissa == 1) || every == 1 && span < 5.0 {
                out.push(Tick { value, label: is_labelled.then(|| write(mantissa, exponent)) });
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale, low: f64, high: f64, unit: &str) -> Vec<String> {
        ticks(&Mapping::new(scale, [low, high], [0.0, 1.0]), unit, 6).into_iter().filter_map(|t| t.label).collect()
    }

    #[test]
    fn ticks_are_round_numbers() {
        assert_eq!(labels(Scale::Linear, -1.0, 4.9, " dB"), ["−1 dB", "0 dB", "1 dB", "2 dB", "3 dB", "4 dB"]);
        assert_eq!(labels(Scale::Linear, 0.0, 0.5, ""), ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(labels(Scale::Log, 0.5, 2000.0, " s"), ["1 s", "10 s", "100 s", "1000 s"]);
        assert_eq!(labels(Scale::Log, 1.5, 12.0, ""), ["2", "5", "10"]);
        assert_eq!(labels(Scale::Log, 0.9e-7, 0.9e-6, ""), ["10⁻⁷", "2·10⁻⁷", "5·10⁻⁷"]);
        assert!(labels(Scale::Log, 1e-30, 1e30, "").len() <= 8);
        assert!(labels(Scale::Linear, f64::NAN, 1.0, "").is_empty());
    }

    #[test]
    fn mappings_reach_both_ends() {
        let log = Mapping::new(Scale::Log, [1.0, 100.0], [10.0, 20.0]);
        assert_eq!((log.at(1.0), log.at(10.0), log.at(100.0)), (10.0, 15.0, 20.0));
        assert_eq!(Mapping::new(Scale::Linear, [0.0, 2.0], [1.0, 0.0]).at(1.0), 0.5);
    }
}
