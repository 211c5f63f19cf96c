//! Numbers with their intervals, in words.

use crate::study::html::escape;
use crate::study::number::{percent, significant};
use crate::study::plot::key;
use crate::study::statistics::{CONFIDENCE, Interval};
use crate::study::table::Cell;

/// A variant's name with its line and mark.
pub(super) fn name_cell(style: usize, name: &str) -> Cell {
    Cell::Html(format!("{} {}", key(style), escape(name)))
}

/// 95 % interval 1.1 to 1.3
pub(super) fn interval_words(interval: &Interval, write: impl Fn(f64) -> String) -> String {
    if interval.is_bounded() {
        let share = percent(CONFIDENCE);
        format!("{share} interval {} to {}", write(interval.low), write(interval.high))
    } else {
        "no interval: one seed".to_owned()
    }
}

/// 1.2 (1.1 – 1.3)
pub(super) fn with_interval(interval: &Interval, write: impl Fn(f64) -> String) -> String {
    if interval.is_bounded() {
        let number = |v: f64| significant(v, 3);
        format!("{} ({} – {})", write(interval.value), number(interval.low), number(interval.high))
    } else {
        write(interval.value)
    }
}

/// −1.02 ± 0.03
pub(super) fn with_spread(interval: &Interval) -> String {
    let value = format!("{:.2}", interval.value).replace('-', "−");
    if interval.is_bounded() { format!("{value} ± {:.2}", interval.high - interval.value) } else { value }
}
