//! What is said of Markov chains, where a picture is made of them.

use super::progress::si;
use luz::render::integrator::metropolis::MutationRecord;
use luz::render::{ChainReport, Settings};
use luz::sample::markov::Outcome;
use std::fmt::Write;

/// What somebody should know who trusts the picture.
pub fn warnings(report: &ChainReport, settings: &Settings) -> Vec<String> {
    let mut all = Vec::new();
    if report.is_dark {
        all.push(format!(
            "no light reaches the camera on any of {} candidates' paths: what chains would find is left black",
            si(report.candidates as f64)
        ));
        return all;
    }
    if report.invalid_candidates > 0 {
        all.push(format!(
            "{} of {} candidates were not finite and count as dark",
            report.invalid_candidates,
            si(report.candidates as f64)
        ));
    }
    let per_chain = report.mutations / report.chains.max(1);
    if report.mutations > 0 && per_chain == 0 {
        all.push(format!(
            "there are more chains ({}) than mutations ({}): most chains are never moved from where they begin; --chains says \
             otherwise",
            report.chains, report.mutations
        ));
    }
    if report.lost_chains > 0 {
        all.push(format!("{} of {} chains were lost: the program failed in them", report.lost_chains, report.chains));
    }
    if report.stuck_chains > 0 {
        let [width, height] = settings.resolution;
        all.push(format!(
            "{} of {} chains were stuck for more than {} mutations, one of them for {}, of {} that each makes: look for bright \
             specks among the {width} × {height} pixels, which more chains or large steps make rarer",
            report.stuck_chains, report.chains, report.stuck_after, report.longest_stay, per_chain
        ));
    }
    all
}

/// A table of mutations: how often each was proposed and accepted, and what it cost.
pub fn table(report: &ChainReport, settings: &Settings) -> String {
    let mut text = String::new();
    if report.is_dark || report.mutations == 0 {
        return text;
    }
    let b = report.normalization;
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "mean brightness {:.5} ± {:.2} % from {} candidates · {} chains in {} batches",
        b.value / f64::from(settings.film_window().area()),
        100.0 * b.standard_error / b.value,
        si(report.candidates as f64),
        report.chains,
        report.batches
    );
    let seconds = |kind: &MutationRecord| kind.seconds_each() * kind.acceptance.steps() as f64;
    let all_seconds: f64 = report.kinds.iter().map(|(_, kind)| seconds(kind)).sum();
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let _ = writeln!(
        text,
        "{:<22}{:>12}{:>12}{:>12}{:>8}{:>12}",
        "mutation", "proposed", "possible", "accepted", "rays", "time"
    );
    for (name, kind) in &report.kinds {
        let steps = kind.acceptance.steps();
        let each = |count: u64| count as f64 / steps.max(1) as f64;
        let time = if all_seconds > 0.0 { percent(seconds(kind) / all_seconds) } else { "–".to_owned() };
        let _ = writeln!(
            text,
            "{name:<22}{:>12}{:>12}{:>12}{:>8.1}{:>12}",
            percent(steps as f64 / report.mutations as f64),
            percent(kind.acceptance.applicability()),
            percent(kind.acceptance.rate()),
            each(kind.rays),
            time
        );
        let invalid = kind.acceptance.count(Outcome::Invalid);
        if invalid > 0 {
            let _ = writeln!(text, "  {invalid} of them were not finite, and rejected");
        }
    }
    text
}
