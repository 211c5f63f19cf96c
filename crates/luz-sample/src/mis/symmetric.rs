//! Small symmetric systems of equations that may be singular.

/// The solution of least norm of `A x = bᵢ` in the least-squares sense, for each column of `b`; directions along which `A` is
/// smaller than `cutoff` times its largest eigenvalue, or than `least`, are left out.
///
/// `A` is symmetric and positive semidefinite; what is below its diagonal is not read. By its eigenvectors, from cyclic
/// Jacobi rotations (Golub and Van Loan, *Matrix Computations*, section 8.5), which are exact to rounding in few sweeps for
/// sizes such as these.
pub(super) fn pseudo_solve<const K: usize, const C: usize>(
    a: [[f64; K]; K],
    b: &[[f64; C]; K],
    cutoff: f64,
    least: f64,
) -> [[f64; C]; K] {
    let (values, vectors) = eigen(a);
    let largest = values.iter().fold(0.0, |max, &v| f64::max(max, v));
    let limit = (cutoff * largest).max(least);
    let mut x = [[0.0; C]; K];
    for (e, &value) in values.iter().enumerate() {
        if value > limit {
            for channel in 0..C {
                let along: f64 = (0..K).map(|k| vectors[k][e] * b[k][channel]).sum();
                for k in 0..K {
                    x[k][channel] += vectors[k][e] * (along / value);
                }
            }
        }
    }
    x
}

/// Eigenvalues, and eigenvectors as columns.
fn eigen<const K: usize>(a: [[f64; K]; K]) -> ([f64; K], [[f64; K]; K]) {
    /// Convergence is quadratic; a handful of sweeps is what it takes.
    const SWEEPS: usize = 30;
    let mut vectors = [[0.0; K]; K];
    for (k, column) in vectors.iter_mut().enumerate() {
        column[k] = 1.0;
    }
    let mut a: [[f64; K]; K] = std::array::from_fn(|i| std::array::from_fn(|j| a[i.min(j)][i.max(j)]));
    for _ in 0..SWEEPS {
        let mut turned = false;
        for p in 0..K {
            for q in p + 1..K {
                let off = a[p][q];
                if off.abs() <= f64::EPSILON * (a[p][p].abs() * a[q][q].abs()).sqrt() || off.abs() < f64::MIN_POSITIVE {
                    continue;
                }
                turned = true;
                // The smaller angle that makes the element zero.
                let theta = (a[q][q] - a[p][p]) / (2.0 * off);
                let tangent = theta.signum() / (theta.abs() + theta.hypot(1.0));
                let cos = 1.0 / tangent.hypot(1.0);
                let sin = tangent * cos;
                for row in &mut a {
                    (row[p], row[q]) = (cos * row[p] - sin * row[q], sin * row[p] + cos * row[q]);
                }
                let (row_p, row_q) = (a[p], a[q]);
                a[p] = std::array::from_fn(|i| cos * row_p[i] - sin * row_q[i]);
                a[q] = std::array::from_fn(|i| sin * row_p[i] + cos * row_q[i]);
                for row in &mut vectors {
                    (row[p], row[q]) = (cos * row[p] - sin * row[q], sin * row[p] + cos * row[q]);
                }
            }
        }
        if !turned {
            break;
        }
    }
    (std::array::from_fn(|k| a[k][k]), vectors)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// A random matrix `GᵀG` of the given rank.
    fn matrix<const K: usize>(rank: usize, random: &mut Random) -> [[f64; K]; K] {
        let mut a = [[0.0; K]; K];
        for _ in 0..rank {
            let row: [f64; K] = std::array::from_fn(|_| random.next_f64() - 0.5);
            for i in 0..K {
                for j in 0..K {
                    a[i][j] += row[i] * row[j];
                }
            }
        }
        a
    }

    #[test]
    fn solutions_satisfy_their_equations() {
        for case in 0..300 {
            let mut random = Random::new(1, 0, case);
            let rank = 1 + case as usize % 5;
            let a = matrix::<5>(rank, &mut random);
            let truth: [f64; 5] = std::array::from_fn(|_| random.next_f64());
            // In the range of A.
            let b = a.map(|row| [row.iter().zip(truth).map(|(a, t)| a * t).sum::<f64>()]);
            let x = pseudo_solve(a, &b, 1e-12, 0.0);
            for (row, b) in a.iter().zip(b) {
                let ax: f64 = row.iter().zip(x).map(|(a, x)| a * x[0]).sum();
                assert!((ax - b[0]).abs() < 1e-12, "{ax} {b:?}");
            }
            // Of all solutions the shortest.
            let length = |x: [f64; 5]| x.iter().map(|x| x * x).sum::<f64>();
            assert!(length(x.map(|x| x[0])) <= length(truth) + 1e-9);
        }
    }

    #[test]
    fn directions_without_extent_are_left_out() {
        assert_eq!(pseudo_solve([[0.0; 3]; 3], &[[1.0]; 3], 1e-9, 0.0), [[0.0]; 3]);
        let x = pseudo_solve([[4.0, 0.0], [0.0, 1e-14]], &[[2.0], [1.0]], 1e-9, 0.0);
        assert_eq!(x, [[0.5], [0.0]]);
    }
}
