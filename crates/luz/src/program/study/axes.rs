//! What can be varied: one table from names to setters of [`Overrides`].

use crate::program::metropolis::{Mutations, Perturbations, SmallStep};
use crate::program::values::{FilterName, IntegratorName, SamplerName, Share};
use clap::ValueEnum;
use luz::render::Overrides;
use luz::render::bsdf::CoatWeights;
use luz::scene::diagnostic::{did_you_mean, nearest};
use std::str::FromStr;

/// Something that can be varied.
pub struct AxisKind {
    /// The option of `luz render` that sets it.
    pub name: &'static str,
    /// Values that have names, for help and suggestions; numbers are described in `other`.
    values: &'static [&'static str],
    /// What else may be said, in words.
    other: &'static str,
    /// Does it change what the world is made of? Variants that do not can share one.
    pub changes_world: bool,
    /// Sets it, if the value is one.
    set: fn(&mut Overrides, &str) -> Option<()>,
}

/// Everything that can be varied.
pub const AXES: &[AxisKind] = &[
    AxisKind {
        name: "technique",
        values: &["bsdf", "light", "both"],
        other: "",
        changes_world: false,
        set: |o, v| parsed(v).map(|technique| o.technique = Some(technique)),
    },
    AxisKind {
        name: "mis",
        values: &["balance", "power", "cutoff", "maximum", "average", "optimal"],
        other: "power:BETA, cutoff:ALPHA",
        changes_world: false,
        set: |o, v| parsed(v).map(|heuristic| o.heuristic = Some(heuristic)),
    },
    AxisKind {
        name: "roulette",
        values: &["none", "throughput", "efficiency"],
        other: "",
        changes_world: false,
        set: |o, v| parsed(v).map(|roulette| o.roulette = Some(roulette)),
    },
    AxisKind {
        name: "light-sampler",
        values: &["bvh", "power", "uniform"],
        other: "",
        changes_world: true,
        set: |o, v| parsed(v).map(|sampler| o.light_sampler = Some(sampler)),
    },
    AxisKind {
        name: "mis-compensation",
        values: &["on", "off"],
        other: "",
        changes_world: true,
        set: |o, v| switch(v).map(|on| o.mis_compensation = Some(on)),
    },
    AxisKind {
        name: "emission-images",
        values: &["on", "off"],
        other: "",
        changes_world: true,
        set: |o, v| switch(v).map(|on| o.emission_images = Some(on)),
    },
    AxisKind {
        name: "sampler",
        values: &["independent", "stratified", "halton", "sobol", "zsobol"],
        other: "",
        changes_world: false,
        set: |o, v| named::<SamplerName>(v).map(|sampler| o.sampler = Some(sampler.into())),
    },
    AxisKind {
        name: "adaptive",
        values: &["off"],
        other: "a relative error, 2% say",
        changes_world: false,
        set: |o, v| {
            o.adaptive = if v == "off" { None } else { Some(parsed::<Share>(v)?.0) };
            Some(())
        },
    },
    AxisKind {
        name: "spp",
        values: &[],
        other: "a number above zero",
        changes_world: false,
        set: |o, v| parsed(v).filter(|spp| *spp > 0u32).map(|spp| o.samples_per_pixel = Some(spp)),
    },
    AxisKind {
        name: "max-depth",
        values: &[],
        other: "a number",
        changes_world: false,
        set: |o, v| parsed(v).map(|depth| o.max_depth = Some(depth)),
    },
    AxisKind {
        name: "filter",
        values: &["box", "triangle", "gaussian", "mitchell", "sinc"],
        other: "",
        changes_world: false,
        set: |o, v| named::<FilterName>(v).map(|filter| o.filter = Some(filter.into())),
    },
    AxisKind {
        name: "integrator",
        values: &["path", "light", "bdpt", "pssmlt", "mmlt", "mlt"],
        other: "",
        changes_world: false,
        set: |o, v| named::<IntegratorName>(v).map(|integrator| o.integrator = Some(integrator.into())),
    },
    AxisKind {
        name: "chains",
        values: &[],
        other: "a number",
        changes_world: false,
        set: |o, v| parsed(v).map(|chains| o.metropolis.chains = Some(chains)),
    },
    AxisKind {
        name: "bootstrap-samples",
        values: &[],
        other: "a number",
        changes_world: false,
        set: |o, v| parsed(v).map(|samples| o.metropolis.bootstrap_samples = Some(samples)),
    },
    AxisKind {
        name: "batches",
        values: &[],
        other: "a number from 16",
        changes_world: false,
        set: |o, v| parsed(v).map(|batches| o.metropolis.batches = Some(batches)),
    },
    AxisKind {
        name: "direct-light",
        values: &["inside", "separate"],
        other: "",
        changes_world: false,
        set: |o, v| parsed(v).map(|direct| o.metropolis.direct_light = Some(direct)),
    },
    AxisKind {
        name: "two-stage",
        values: &["off", "on"],
        other: "",
        changes_world: false,
        set: |o, v| switch(v).map(|on| o.metropolis.two_stage = on),
    },
    AxisKind {
        name: "chain-estimator",
        values: &["path", "bdpt"],
        other: "",
        changes_world: false,
        set: |o, v| parsed(v).map(|estimator| o.metropolis.estimator = Some(estimator)),
    },
    AxisKind {
        name: "large-step-probability",
        values: &[],
        other: "a probability",
        changes_world: false,
        set: |o, v| parsed(v).map(|probability| o.metropolis.large_step_probability = Some(probability)),
    },
    AxisKind {
        name: "small-step",
        values: &[],
        other: "FROM:TO",
        changes_world: false,
        set: |o, v| parsed::<SmallStep>(v).map(|step| o.metropolis.kernel = Some(step.kernel)),
    },
    AxisKind {
        name: "mutations",
        values: &[],
        other: "NAME:P+…",
        changes_world: false,
        set: |o, v| parsed::<Mutations>(v).map(|mutations| o.metropolis.mutations = Some(mutations.0)),
    },
    AxisKind {
        name: "perturbations",
        values: &[],
        other: "NAME:VALUE+…",
        changes_world: false,
        set: |o, v| parsed::<Perturbations>(v).map(|ranges| o.metropolis.ranges = Some(ranges.0)),
    },
    AxisKind {
        name: "pbrt-coats",
        values: &["off", "on"],
        other: "",
        changes_world: true,
        set: |o, v| {
            o.coat_weights = if switch(v)? { CoatWeights::PbrtV4 } else { CoatWeights::Exact };
            Some(())
        },
    },
];

fn parsed<T: FromStr>(value: &str) -> Option<T> {
    value.parse().ok()
}

fn switch(value: &str) -> Option<bool> {
    match value {
        "on" => Some(true),
        "off" => Some(false),
        _ => None,
    }
}

fn named<T: ValueEnum>(value: &str) -> Option<T> {
    T::from_str(value, true).ok()
}

impl AxisKind {
    /// The axis of a name, or why there is none.
    pub fn find(name: &str) -> Result<&'static Self, String> {
        AXES.iter().find(|axis| axis.name == name).ok_or_else(|| {
            let names = || AXES.iter().map(|axis| axis.name);
            let known = names().collect::<Vec<_>>().join(", ");
            match did_you_mean(name, names()) {
                Some(suggestion) => format!("nothing called `{name}` can be varied: {suggestion} Known are {known}"),
                None => format!("nothing called `{name}` can be varied; known are {known}"),
            }
        })
    }

    /// Sets it in `overrides`, or says why not.
    pub fn apply(&self, overrides: &mut Overrides, value: &str) -> Result<(), String> {
        (self.set)(overrides, value).ok_or_else(|| {
            let known = self.known();
            match nearest(value, self.values.iter().copied()) {
                Some(near) => format!("`{value}` is no {}: did you mean `{near}`? Known are {known}", self.name),
                None => format!("`{value}` is no {}: expected {known}", self.name),
            }
        })
    }

    /// Its values in words.
    pub fn known(&self) -> String {
        let other = Some(self.other).filter(|o| !o.is_empty());
        self.values.iter().copied().chain(other).collect::<Vec<_>>().join(", ")
    }

    /// How a variant is called by this axis, where `axes` are all that are varied: values that say nothing alone, or that another
    /// axis knows as well, bring the axis along.
    pub fn label(&self, value: &str, axes: &[&Self]) -> String {
        let is_ambiguous = axes.iter().any(|axis| axis.name != self.name && axis.values.contains(&value));
        let speaks = self.values.contains(&value) && !is_ambiguous && !matches!(value, "on" | "off" | "none");
        if speaks || value.contains(':') { value.to_owned() } else { format!("{} {value}", self.name) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::arguments::OverrideArguments;
    use clap::Args;

    #[test]
    fn all_values_that_are_named_are_known() {
        for axis in AXES {
            for value in axis.values {
                assert!((axis.set)(&mut Overrides::default(), value).is_some(), "{} {value}", axis.name);
            }
            assert!(axis.apply(&mut Overrides::default(), "nonsense").is_err(), "{}", axis.name);
            assert!(axis.apply(&mut Overrides::default(), "").is_err(), "{}", axis.name);
        }
    }

    #[test]
    fn setters_set() {
        let set = |name: &str, value: &str| {
            let mut overrides = Overrides::default();
            AxisKind::find(name).unwrap().apply(&mut overrides, value).unwrap();
            format!("{overrides:?}")
        };
        for axis in AXES {
            let mut seen: Vec<String> = axis.values.iter().map(|value| set(axis.name, value)).collect();
            seen.dedup();
            assert_eq!(seen.len(), axis.values.len(), "{}", axis.name);
        }
        assert!(set("spp", "7").contains("samples_per_pixel: Some(7)"));
        assert!(set("max-depth", "3").contains("max_depth: Some(3)"));
        assert!(set("adaptive", "5%").contains("adaptive: Some(0.05)"));
        assert!(set("mis", "power:3").contains("Power(3.0)"));
    }

    /// Every option of `luz render` that changes a setting can be varied, or is one of those that cannot, for a reason.
    #[test]
    fn the_table_is_complete() {
        let command = OverrideArguments::augment_args(clap::Command::new("x"));
        // Pictures of other sizes or places cannot be compared; seeds are repetitions; films and layers measure more of the same.
        let excluded = ["resolution", "crop", "seed", "film", "technique-images"];
        for option in command.get_arguments().filter_map(|argument| argument.get_long()) {
            let is_axis = AXES.iter().any(|axis| axis.name == option);
            assert!(is_axis != excluded.contains(&option), "--{option}");
        }
    }

    #[test]
    fn what_is_wrong_is_answered_with_what_was_meant() {
        let error = AxisKind::find("sampeler").err().unwrap();
        assert!(error.contains("did you mean `sampler`?") && error.contains("technique, mis"), "{error}");
        assert!(AxisKind::find("colour").err().unwrap().contains("known are"));
        let error = AxisKind::find("sampler").unwrap().apply(&mut Overrides::default(), "sobal").unwrap_err();
        assert!(error.contains("did you mean `sobol`?"), "{error}");
        let error = AxisKind::find("spp").unwrap().apply(&mut Overrides::default(), "0").unwrap_err();
        assert!(error.contains("a number above zero"), "{error}");
    }

    #[test]
    fn labels_speak_for_themselves() {
        let axes = ["sampler", "mis", "max-depth", "pbrt-coats"].map(|name| AxisKind::find(name).unwrap());
        let label = |name: &str, value: &str| AxisKind::find(name).unwrap().label(value, &axes);
        assert_eq!(label("sampler", "sobol"), "sobol");
        assert_eq!(label("mis", "power:3"), "power:3");
        assert_eq!(label("max-depth", "3"), "max-depth 3");
        assert_eq!(label("pbrt-coats", "on"), "pbrt-coats on");
        assert_eq!(label("mis", "power"), "power");
        assert_eq!(label("light-sampler", "power"), "light-sampler power");
    }
}
