//! Options of Metropolis light transport.

use clap::Args;
use luz::render::MetropolisOverrides;
use luz::render::integrator::metropolis::{DirectLight, MutationProbabilities, PerturbationRanges, PrimaryEstimator};
use luz::sample::markov::Kernel;
use std::fmt;
use std::str::FromStr;

/// Options of Metropolis light transport.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Metropolis light transport (pssmlt, mmlt, mlt)")]
pub struct MetropolisArguments {
    /// Markov chains [default: 1024]
    #[arg(long, value_name = "N")]
    pub chains: Option<u64>,
    /// Independent samples that brightness is estimated from and chains are started at [default: 100000, or a sixty-fourth of
    /// the mutations]
    #[arg(long, value_name = "N", alias = "bootstrapsamples")]
    pub bootstrap_samples: Option<u64>,
    /// Groups of chains, at least 16, whose spread gives every pixel its error; more make the error better known, and
    /// take 48 bytes per pixel each [default: 16]
    #[arg(long, value_name = "N")]
    pub batches: Option<u32>,
    /// Who finds direct light: inside (the chains), or separate (a path tracer, one sample for four mutations)
    /// [default: inside]
    #[arg(long, value_name = "inside|separate")]
    pub direct_light: Option<DirectLight>,
    /// Look more often where a coarse first image is dark, so that relative errors are alike everywhere
    #[arg(long)]
    pub two_stage: bool,
    /// The estimator whose numbers pssmlt mutates: path, bdpt [default: path]
    #[arg(long, value_name = "NAME")]
    pub chain_estimator: Option<PrimaryEstimator>,
    /// Probability of large steps, of pssmlt and mmlt [default: 0.3]
    #[arg(long, value_name = "P", alias = "largestepprobability")]
    pub large_step_probability: Option<f64>,
    /// Smallest and largest small step, as shares of the unit interval, of pssmlt and mmlt [default: 1/1024:1/64]
    #[arg(long, value_name = "FROM:TO")]
    pub small_step: Option<SmallStep>,
    /// How often mlt proposes each mutation, relative to the others: NAME:P, joined by `+`; the others stay as they are [default:
    /// bidirectional:0.25+lens-subpath:0.15+lens:0.2+caustic:0.15+multi-chain:0.15+wavelength:0.1]
    #[arg(long, value_name = "NAME:P+…")]
    pub mutations: Option<Mutations>,
    /// How far perturbations of mlt go: NAME:VALUE, joined by `+`; the others stay as they are. The smallest move on the film in
    /// pixels, the area of the largest as a share of the film, and angles in radians [default:
    /// lens-smallest:0.1+lens-area:0.05+caustic-smallest:0.1+caustic-area:0.05+multi-chain-smallest:0.0001+multi-chain-largest:0.1]
    #[arg(long, value_name = "NAME:VALUE+…")]
    pub perturbations: Option<Perturbations>,
}

impl MetropolisArguments {
    /// What is wished.
    pub fn overrides(&self) -> MetropolisOverrides {
        MetropolisOverrides {
            chains: self.chains,
            bootstrap_samples: self.bootstrap_samples,
            batches: self.batches,
            direct_light: self.direct_light,
            two_stage: self.two_stage,
            estimator: self.chain_estimator,
            large_step_probability: self.large_step_probability,
            kernel: self.small_step.map(|step| step.kernel),
            mutations: self.mutations.map(|m| m.0),
            ranges: self.perturbations.map(|p| p.0),
        }
    }

    /// Itself as options and their values; switches have none.
    pub fn to_arguments(&self) -> Vec<(&'static str, Option<String>)> {
        fn text(value: Option<impl fmt::Display>) -> Option<String> {
            value.map(|v| v.to_string())
        }
        let values = [
            ("chains", text(self.chains)),
            ("bootstrap-samples", text(self.bootstrap_samples)),
            ("batches", text(self.batches)),
            ("direct-light", text(self.direct_light)),
            ("chain-estimator", text(self.chain_estimator)),
            ("large-step-probability", text(self.large_step_probability)),
            ("small-step", text(self.small_step)),
            ("mutations", text(self.mutations)),
            ("perturbations", text(self.perturbations)),
        ];
        let given = values.into_iter().filter(|(_, value)| value.is_some());
        given.chain(self.two_stage.then_some(("two-stage", None))).collect()
    }
}

/// `FROM:TO`, each a number or a fraction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmallStep {
    smallest: f32,
    largest: f32,
    /// What it stands for.
    pub kernel: Kernel,
}

impl FromStr for SmallStep {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let (smallest, largest) = text.split_once(':').ok_or("expected FROM:TO, 1/1024:1/64 say")?;
        let (smallest, largest) = (fraction(smallest)?, fraction(largest)?);
        let kernel = Kernel::new(smallest, largest)
            .ok_or("small steps go from at least a millionth of the unit interval to more, and at most a half")?;
        Ok(Self { smallest, largest, kernel })
    }
}

impl fmt::Display for SmallStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.smallest, self.largest)
    }
}

fn fraction(text: &str) -> Result<f32, String> {
    let number = |text: &str| text.trim().parse::<f32>().map_err(|_| format!("`{}` is not a number", text.trim()));
    match text.split_once('/') {
        Some((numerator, denominator)) => Ok(number(numerator)? / number(denominator)?),
        None => number(text),
    }
}

/// Probabilities of mutations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mutations(pub MutationProbabilities);

impl FromStr for Mutations {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let names = MutationProbabilities::NAMES;
        let all = named_numbers(text, names, MutationProbabilities::default().as_array())?;
        let all = MutationProbabilities::from_array(all);
        all.problem().map_or(Ok(Self(all)), Err)
    }
}

impl fmt::Display for Mutations {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_named(f, MutationProbabilities::NAMES, self.0.as_array())
    }
}

/// Ranges of perturbations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Perturbations(pub PerturbationRanges);

impl FromStr for Perturbations {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let all = named_numbers(text, PerturbationRanges::NAMES, PerturbationRanges::default().as_array())?;
        let all = PerturbationRanges::from_array(all);
        all.problem().map_or(Ok(Self(all)), Err)
    }
}

impl fmt::Display for Perturbations {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_named(f, PerturbationRanges::NAMES, self.0.as_array())
    }
}

/// Reads `NAME:NUMBER`, joined by `+`, into numbers that have names.
fn named_numbers<const N: usize>(text: &str, names: [&str; N], mut all: [f64; N]) -> Result<[f64; N], String> {
    for part in text.split('+') {
        let (name, number) =
            part.split_once(':').ok_or_else(|| format!("expected NAME:NUMBER, {}:0.1 say", names[0]))?;
        let name = name.trim();
        let place = names
            .iter()
            .position(|known| *known == name)
            .ok_or_else(|| format!("nothing here is called `{name}`; known are {}", names.join(", ")))?;
        all[place] = number.trim().parse().map_err(|_| format!("`{}` is not a number", number.trim()))?;
    }
    Ok(all)
}

fn write_named<const N: usize>(f: &mut fmt::Formatter<'_>, names: [&str; N], all: [f64; N]) -> fmt::Result {
    let parts: Vec<String> = names.iter().zip(all).map(|(name, value)| format!("{name}:{value}")).collect();
    f.write_str(&parts.join("+"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_and_written() {
        let mutations: Mutations = "lens:0.5+wavelength:0".parse().expect("it is sound");
        assert_eq!((mutations.0.lens, mutations.0.wavelength), (0.5, 0.0));
        assert_eq!(mutations.0.caustic, MutationProbabilities::default().caustic);
        assert_eq!(mutations.to_string().parse(), Ok(mutations));
        let ranges: Perturbations = "multi-chain-largest:0.2".parse().expect("it is sound");
        assert_eq!(ranges.0.multi_chain_largest, 0.2);
        assert_eq!(ranges.to_string().parse(), Ok(ranges));
        let step: SmallStep = "1/512:0.1".parse().expect("it is sound");
        assert_eq!(step.to_string().parse(), Ok(step));
    }

    #[test]
    fn what_is_wrong_is_said() {
        for text in ["lense:0.5", "lens", "lens:x", "lens:-1", "bidirectional:0", ""] {
            assert!(text.parse::<Mutations>().is_err(), "{text}");
        }
        for text in ["lens-area:2", "lens-area:0", "multi-chain-smallest:0.5", "lens-smallest:nan"] {
            assert!(text.parse::<Perturbations>().is_err(), "{text}");
        }
        for text in ["0.1", "0.1:0.01", "0:0.1", "1/0:1", "a:b", "0.1:0.9"] {
            assert!(text.parse::<SmallStep>().is_err(), "{text}");
        }
    }
}
