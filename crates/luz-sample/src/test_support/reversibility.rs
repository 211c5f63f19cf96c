//! Detailed balance of Markov chains.

use super::chi_square::Chi2Result;
use super::gamma::chi2_survival;

/// Pairs of states with fewer moves between them, both ways, are pooled.
const POOL_BELOW: u64 = 10;

/// Tests that moves between any two of `states` states are as frequent one way as the other (Bowker 1948): detailed balance, if
/// the moves are those of independent states of the target distribution, one move of each.
///
/// `moves[i * states + j]` counts those from state `i` to state `j`; states may be cells of a continuous space. Each pair has
/// the statistic `(mᵢⱼ − mⱼᵢ)² / (mᵢⱼ + mⱼᵢ)`, of χ² distribution with one degree of freedom.
///
/// Draw *independent* states: moves of a single chain are correlated, and balance each other whatever it does. A chain that
/// passes need not be ergodic.
pub fn reversibility(moves: &[u64], states: usize) -> Chi2Result {
    let (mut statistic, mut degrees_of_freedom) = (0.0, 0.0f64);
    let mut add = |there: u64, back: u64| {
        let difference = there as f64 - back as f64;
        statistic += difference * difference / (there + back) as f64;
        degrees_of_freedom += 1.0;
    };
    let (mut there_pool, mut back_pool) = (0, 0);
    for i in 0..states {
        for j in i + 1..states {
            let count = |from: usize, to: usize| moves.get(from * states + to).copied().unwrap_or(0);
            let (there, back) = (count(i, j), count(j, i));
            if there + back < POOL_BELOW {
                there_pool += there;
                back_pool += back;
            } else {
                add(there, back);
            }
        }
    }
    if there_pool + back_pool >= POOL_BELOW {
        add(there_pool, back_pool);
    }
    let p_value = if degrees_of_freedom > 0.0 { chi2_survival(statistic, degrees_of_freedom) } else { 1.0 };
    Chi2Result { p_value, statistic, degrees_of_freedom, pdf_integral: f64::NAN, valid: 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symmetric_moves_pass_and_a_current_does_not() {
        let symmetric = [50, 30, 12, 28, 9, 100, 14, 95, 7];
        let result = reversibility(&symmetric, 3);
        assert!(result.passes(0.5) && result.degrees_of_freedom == 3.0, "{result:?}");
        // Every state is left as often as it is entered, but they go around in a circle.
        let circle = [50, 300, 200, 200, 9, 300, 300, 200, 7];
        assert!(!reversibility(&circle, 3).passes(1e-6));
        // Rare ones are pooled.
        let rare = [0, 9, 9, 0, 0, 9, 0, 0, 0];
        let result = reversibility(&rare, 3);
        assert!(result.degrees_of_freedom == 1.0 && !result.passes(1e-5), "{result:?}");
        assert!(reversibility(&[], 0).passes(1.0));
    }
}
