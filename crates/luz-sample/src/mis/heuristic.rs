//! Weights that follow from the densities at a point.

use std::fmt;
use std::str::FromStr;

/// How the weights follow from `qᵢ = nᵢ pᵢ`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Heuristic {
    /// `wᵢ = qᵢ / Σ qₖ` (eq. 9.8).
    Balance,
    /// `wᵢ = qᵢ^β / Σ qₖ^β` (eq. 9.11); `β ≥ 0`, usually 2.
    Power(f32),
    /// Techniques with `qᵢ < α max q` have weight zero, the others balanced weights (eq. 9.10); `α ∈ [0, 1]`.
    Cutoff(f32),
    /// All weight to the technique of largest `q` (eq. 9.12); equal ones share it.
    Maximum,
    /// The same weight, one over their number, to all techniques that can make the point (`qᵢ > 0`), however rarely they do:
    /// the mean of the techniques' own estimates where all of them cover the whole integrand. It is `Power(0)`, and there to
    /// be seen failing: the variance is the mean of the techniques' variances, the worst of them included.
    Average,
    /// Balanced weights, and [`Optimal`](super::Optimal)'s control variate where an integrator has it. As a weight at a
    /// point it is the same as `Balance`, with which integrators combine what they keep no such statistics of.
    Optimal,
}

impl Default for Heuristic {
    /// The power heuristic with `β = 2`.
    fn default() -> Self {
        Self::Power(2.0)
    }
}

impl Heuristic {
    /// The weight of `technique` among techniques of the given counts and densities `(nₖ, pₖ)` at one point, all densities in
    /// the same measure.
    ///
    /// The weights of all techniques sum to one if any `nₖ pₖ` is positive, and are zero otherwise. An infinite density (a
    /// delta distribution that could have made the point) has all weight; several share it by their counts as they would if
    /// their densities were equal. What is negative or NaN counts as zero, and so does a technique that is not there.
    pub fn weight(self, technique: usize, counts_and_pdfs: &[(f32, f32)]) -> f32 {
        let Some(&own) = counts_and_pdfs.get(technique) else { return 0.0 };
        match self {
            Self::Balance | Self::Optimal if is_ordinary(own) => {
                return 1.0 / relative(own, counts_and_pdfs).sum::<f32>();
            }
            Self::Power(2.0) if is_ordinary(own) => {
                return 1.0 / relative(own, counts_and_pdfs).map(|ratio| ratio * ratio).sum::<f32>();
            }
            _ => {}
        }
        // Everything relative to the largest density, then to the largest q, so that no power overflows.
        let largest_pdf = counts_and_pdfs.iter().filter(|(n, p)| *n > 0.0 && *p > 0.0).fold(0.0, |max, t| t.1.max(max));
        let q = |&(n, p): &(f32, f32)| {
            if !(n > 0.0 && p > 0.0) || (largest_pdf.is_infinite() && p.is_finite()) {
                None
            } else if p.is_infinite() {
                Some(n)
            } else {
                Some(n * (p / largest_pdf))
            }
        };
        let Some(own) = q(&own) else { return 0.0 };
        let largest = counts_and_pdfs.iter().filter_map(q).fold(0.0, f32::max);
        let own = self.term(own / largest);
        if own == 0.0 {
            0.0
        } else {
            own / counts_and_pdfs.iter().filter_map(q).map(|q| self.term(q / largest)).sum::<f32>()
        }
    }

    /// [`Self::weight`] of the first of two techniques.
    #[inline]
    pub fn weight2(self, n0: f32, p0: f32, n1: f32, p1: f32) -> f32 {
        if !(n0 > 0.0 && p0 > 0.0) {
            return 0.0;
        }
        if !(n1 > 0.0 && p1 > 0.0) {
            return 1.0;
        }
        let density = match (p0.is_infinite(), p1.is_infinite()) {
            (false, false) => p1 / p0,
            (true, true) => 1.0,
            (true, false) => return 1.0,
            (false, true) => return 0.0,
        };
        // An overflow or underflow here gives the weight its limit, 0 or 1.
        let ratio = (n1 / n0) * density;
        match self {
            Self::Balance | Self::Optimal => 1.0 / (1.0 + ratio),
            Self::Power(2.0) => 1.0 / (1.0 + ratio * ratio),
            Self::Power(beta) => 1.0 / (1.0 + ratio.powf(beta)),
            Self::Cutoff(alpha) => {
                if alpha * ratio > 1.0 {
                    0.0
                } else if ratio < alpha {
                    1.0
                } else {
                    1.0 / (1.0 + ratio)
                }
            }
            Self::Maximum => {
                if ratio < 1.0 {
                    1.0
                } else if ratio > 1.0 {
                    0.0
                } else {
                    0.5
                }
            }
            Self::Average => 0.5,
        }
    }

    /// The unnormalised weight of a technique of which `q / max q` is given, in `[0, 1]`.
    #[inline]
    fn term(self, relative: f32) -> f32 {
        match self {
            Self::Balance | Self::Optimal => relative,
            Self::Power(2.0) => relative * relative,
            Self::Power(beta) => relative.powf(beta),
            Self::Cutoff(alpha) => {
                if relative < alpha {
                    0.0
                } else {
                    relative
                }
            }
            Self::Maximum => {
                if relative < 1.0 {
                    0.0
                } else {
                    1.0
                }
            }
            Self::Average => 1.0,
        }
    }
}

/// Is a density neither zero nor infinite?
#[inline]
fn is_ordinary((count, pdf): (f32, f32)) -> bool {
    count > 0.0 && pdf > 0.0 && count.is_finite() && pdf.is_finite()
}

/// `qᵢ` of all that are positive, in units of an ordinary one. One that overflows takes all weight from that one, as it should.
#[inline]
fn relative((count, pdf): (f32, f32), counts_and_pdfs: &[(f32, f32)]) -> impl Iterator<Item = f32> {
    let one = move |&(n, p): &(f32, f32)| if n > 0.0 && p > 0.0 { (n / count) * (p / pdf) } else { 0.0 };
    counts_and_pdfs.iter().map(one)
}

impl fmt::Display for Heuristic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Balance => f.write_str("balance"),
            Self::Power(beta) => write!(f, "power:{beta}"),
            Self::Cutoff(alpha) => write!(f, "cutoff:{alpha}"),
            Self::Maximum => f.write_str("maximum"),
            Self::Average => f.write_str("average"),
            Self::Optimal => f.write_str("optimal"),
        }
    }
}

/// A text that names no [`Heuristic`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParseHeuristicError {
    text: String,
}

impl fmt::Display for ParseHeuristicError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "`{}` is no heuristic: expected `balance`, `power`, `power:BETA` (BETA ≥ 0), `cutoff`, `cutoff:ALPHA` (ALPHA from \
             0 to 1), `maximum`, `average`, or `optimal`",
            self.text
        )
    }
}

impl std::error::Error for ParseHeuristicError {}

impl FromStr for Heuristic {
    type Err = ParseHeuristicError;

    /// Reads `balance`, `power` (β = 2), `power:BETA`, `cutoff` (α = 0.1, Veach's choice), `cutoff:ALPHA`,
    /// `maximum`, `average`, or `optimal`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let error = || ParseHeuristicError { text: text.to_owned() };
        let (name, parameter) = match text.split_once(':') {
            Some((name, parameter)) => (name, Some(parameter.parse::<f32>().map_err(|_| error())?)),
            None => (text, None),
        };
        match (name, parameter) {
            ("balance", None) => Ok(Self::Balance),
            ("maximum", None) => Ok(Self::Maximum),
            ("average", None) => Ok(Self::Average),
            ("optimal", None) => Ok(Self::Optimal),
            ("power", None) => Ok(Self::Power(2.0)),
            ("power", Some(beta)) if beta.is_finite() && beta >= 0.0 => Ok(Self::Power(beta)),
            ("cutoff", None) => Ok(Self::Cutoff(0.1)),
            ("cutoff", Some(alpha)) if (0.0..=1.0).contains(&alpha) => Ok(Self::Cutoff(alpha)),
            _ => Err(error()),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    use super::*;

    const HEURISTICS: [Heuristic; 11] = [
        Heuristic::Balance,
        Heuristic::Power(2.0),
        Heuristic::Power(1.0),
        Heuristic::Power(0.0),
        Heuristic::Power(7.5),
        Heuristic::Cutoff(0.0),
        Heuristic::Cutoff(0.1),
        Heuristic::Cutoff(1.0),
        Heuristic::Maximum,
        Heuristic::Average,
        Heuristic::Optimal,
    ];

    fn count() -> impl Strategy<Value = f32> {
        prop_oneof![Just(0.0f32), Just(1.0), Just(1e-3), 1e-6f32..1e6]
    }

    fn pdf() -> impl Strategy<Value = f32> {
        let extremes = [0.0f32, 1.0, f32::INFINITY, f32::MAX, f32::MIN_POSITIVE, 1e-45, f32::NAN, -1.0];
        prop_oneof![prop::sample::select(extremes.to_vec()), 0f32..2.0, (-87f32..88.0).prop_map(f32::exp)]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

        #[test]
        fn weights_sum_to_one(techniques in prop::collection::vec((count(), pdf()), 1..9)) {
            for heuristic in HEURISTICS {
                let weights: Vec<f32> = (0..techniques.len()).map(|i| heuristic.weight(i, &techniques)).collect();
                let any = techniques.iter().any(|&(n, p)| n > 0.0 && p > 0.0);
                let sum: f32 = weights.iter().sum();
                prop_assert!((sum - f32::from(any)).abs() < 1e-5, "{heuristic} {weights:?}");
                for (&w, &(n, p)) in weights.iter().zip(&techniques) {
                    prop_assert!((0.0..=1.000_001).contains(&w));
                    prop_assert!(w == 0.0 || (n > 0.0 && p > 0.0));
                }
            }
        }

        #[test]
        fn two_techniques_agree_with_many(a in (count(), pdf()), b in (count(), pdf())) {
            for heuristic in HEURISTICS {
                let (first, second) = (heuristic.weight2(a.0, a.1, b.0, b.1), heuristic.weight2(b.0, b.1, a.0, a.1));
                let any = (a.0 > 0.0 && a.1 > 0.0) || (b.0 > 0.0 && b.1 > 0.0);
                prop_assert!((first + second - f32::from(any)).abs() < 1e-5, "{heuristic}: {first} + {second}");
                let general = heuristic.weight(0, &[a, b]);
                // The two round differently where a technique is just at the threshold.
                let threshold = matches!(heuristic, Heuristic::Cutoff(_) | Heuristic::Maximum);
                prop_assert!(threshold || (first - general).abs() < 1e-5, "{heuristic}: {first} {general}");
            }
        }

        #[test]
        fn names_are_read_back(beta in 0f32..100.0, alpha in 0f32..=1.0) {
            let more = [Heuristic::Power(beta), Heuristic::Cutoff(alpha)];
            for heuristic in HEURISTICS.into_iter().chain(more) {
                prop_assert_eq!(heuristic.to_string().parse(), Ok(heuristic));
            }
        }
    }

    #[test]
    fn known_weights() {
        let techniques = [(1.0, 1.0), (2.0, 2.0), (1.0, 0.3)];
        let near = |w: f32, expected: f32| assert!((w - expected).abs() < 1e-6, "{w} {expected}");
        near(Heuristic::Balance.weight(1, &techniques), 4.0 / 5.3);
        near(Heuristic::Power(2.0).weight(0, &techniques), 1.0 / 17.09);
        near(Heuristic::Cutoff(0.2).weight(0, &techniques), 1.0 / 5.0);
        near(Heuristic::Cutoff(0.2).weight(2, &techniques), 0.0);
        near(Heuristic::Maximum.weight(1, &techniques), 1.0);
        near(Heuristic::Maximum.weight(0, &[(1.0, 2.0), (2.0, 1.0), (1.0, 1.0)]), 0.5);
        near(Heuristic::Power(2.0).weight2(1.0, f32::INFINITY, 1.0, 5.0), 1.0);
        near(Heuristic::Balance.weight(0, &[(1.0, f32::INFINITY), (3.0, f32::INFINITY), (1.0, 1.0)]), 0.25);
        near(Heuristic::Power(2.0).weight2(1.0, 1e30, 1.0, 1e30), 0.5);
        near(Heuristic::Power(2.0).weight2(1.0, 1e-30, 1.0, 1e-30), 0.5);
        near(Heuristic::Balance.weight(7, &techniques), 0.0);
        near(Heuristic::Average.weight(0, &techniques), 1.0 / 3.0);
        near(Heuristic::Average.weight(0, &[(1.0, 1e-30), (9.0, 0.0), (0.0, 1.0), (1.0, 1e30)]), 0.5);
        near(Heuristic::Optimal.weight(1, &techniques), 4.0 / 5.3);
    }

    #[test]
    fn other_names_are_errors() {
        for text in [
            "",
            "Balance",
            "power:",
            "power:-1",
            "power:nan",
            "power:inf",
            "cutoff:1.1",
            "balance:1",
            "veach",
            "average:2",
            "optimal:",
        ] {
            assert!(text.parse::<Heuristic>().is_err(), "{text}");
        }
        assert_eq!("power".parse(), Ok(Heuristic::Power(2.0)));
        assert_eq!("cutoff".parse(), Ok(Heuristic::Cutoff(0.1)));
    }
}
