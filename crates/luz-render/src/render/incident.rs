//! Samples that went wrong: counted, and the first of them remembered with all that is needed to trace them again.

use serde::{Deserialize, Serialize};

/// How many incidents are remembered.
const REMEMBERED: usize = 64;

/// What went wrong.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Failure {
    /// The radiance is infinite or not a number.
    NotFinite,
    /// The program is wrong: it came to a state that it thought impossible.
    Panic(String),
}

/// A sample that went wrong, which counts as black.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Incident {
    /// The pixel in the frame.
    pub pixel: [u32; 2],
    /// The half of the pixel; 0 unless sampling is adaptive.
    pub half: u32,
    /// The number of the sample.
    pub sample: u32,
    /// What went wrong.
    pub failure: Failure,
}

/// All that went wrong.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Incidents {
    /// Samples that were not finite.
    pub not_finite: u64,
    /// Samples in which the program failed.
    pub panics: u64,
    /// The first of them.
    pub first: Vec<Incident>,
}

impl Incidents {
    /// Has nothing gone wrong?
    pub fn is_empty(&self) -> bool {
        self.not_finite == 0 && self.panics == 0
    }

    /// Counts one more.
    pub fn push(&mut self, incident: Incident) {
        match incident.failure {
            Failure::NotFinite => self.not_finite += 1,
            Failure::Panic(_) => self.panics += 1,
        }
        if self.first.len() < REMEMBERED {
            self.first.push(incident);
        }
    }

    /// Counts all that others have counted.
    pub fn merge(&mut self, other: Self) {
        self.not_finite = self.not_finite.saturating_add(other.not_finite);
        self.panics = self.panics.saturating_add(other.panics);
        let room = REMEMBERED.saturating_sub(self.first.len());
        self.first.extend(other.first.into_iter().take(room));
    }
}

/// The words of a panic.
pub(super) fn panic_message(payload: &(dyn std::any::Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied().or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("a panic without words").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn incident(sample: u32) -> Incident {
        Incident { pixel: [1, 2], half: 0, sample, failure: Failure::NotFinite }
    }

    #[test]
    fn all_are_counted_and_the_first_remembered() {
        let (mut all, mut more) = (Incidents::default(), Incidents::default());
        (0..40).for_each(|i| all.push(incident(i)));
        (40..140).for_each(|i| more.push(incident(i)));
        all.merge(more);
        assert_eq!((all.not_finite, all.first.len()), (140, 64));
        assert!(all.first.iter().enumerate().all(|(i, incident)| incident.sample == i as u32));
    }

    #[test]
    fn panics_have_words() {
        let caught = std::panic::catch_unwind(|| panic!("at {}", 7)).expect_err("it panics");
        assert_eq!(panic_message(&*caught), "at 7");
    }
}
