//! Adaptive numerical integration.

/// Nodes and weights of Gauss and Legendre on `[0, 1]`, exact for polynomials up to degree 5.
const NODES: [(f64, f64); 3] =
    [(0.112_701_665_379_258_31, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// A rectangle `[x0, x1] × [y0, y1]`.
pub(super) type Rectangle = [f64; 4];

fn gauss(f: &impl Fn(f64, f64) -> f64, [x0, x1, y0, y1]: Rectangle) -> f64 {
    let (width, height) = (x1 - x0, y1 - y0);
    let mut sum = 0.0;
    for (s, v) in NODES {
        for (t, w) in NODES {
            sum += v * w * f(x0 + s * width, y0 + t * height);
        }
    }
    sum * width * height
}

/// The rule of the centre and the corners, exact up to degree 3. The corners are drawn in a little, since they may lie on an
/// edge of the domain of `f`.
fn corners(f: &impl Fn(f64, f64) -> f64, [x0, x1, y0, y1]: Rectangle) -> f64 {
    const INSET: f64 = 1e-3;
    let (width, height) = (x1 - x0, y1 - y0);
    let at = |s: f64, t: f64| f(x0 + s * width, y0 + t * height);
    let sum = at(INSET, INSET) + at(1.0 - INSET, INSET) + at(INSET, 1.0 - INSET) + at(1.0 - INSET, 1.0 - INSET);
    (sum / 12.0 + at(0.5, 0.5) * (2.0 / 3.0)) * width * height
}

fn quarters([x0, x1, y0, y1]: Rectangle) -> [Rectangle; 4] {
    let (x, y) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
    [[x0, x, y0, y], [x, x1, y0, y], [x0, x, y, y1], [x, x1, y, y1]]
}

/// The integral of `f` over the rectangle `[x0, x1] × [y0, y1]`, to about the absolute error `tolerance`.
///
/// The rectangle is first cut into `4^depth` parts, which must be fine enough to notice every feature of `f`; then each is
/// quartered as long as that changes its integral by 3 × 3 Gaussian quadrature, or that differs much from a rule which sees
/// the corners; at most nine more times.
pub fn integrate_rectangle(f: &impl Fn(f64, f64) -> f64, rectangle: Rectangle, tolerance: f64, depth: u32) -> f64 {
    if depth > 0 {
        return quarters(rectangle).into_iter().map(|q| integrate_rectangle(f, q, 0.5 * tolerance, depth - 1)).sum();
    }
    refine(f, rectangle, gauss(f, rectangle), tolerance, 9)
}

fn refine(f: &impl Fn(f64, f64) -> f64, rectangle: Rectangle, coarse: f64, tolerance: f64, levels: u32) -> f64 {
    let parts = quarters(rectangle);
    let fine = parts.map(|q| gauss(f, q));
    let sum: f64 = fine.iter().sum();
    let corner_error = (sum - corners(f, rectangle)).abs();
    if levels == 0 || ((sum - coarse).abs() <= tolerance && corner_error <= 20.0 * tolerance) {
        return sum;
    }
    // Errors of the parts are of either sign, so they add as their root mean square.
    parts.into_iter().zip(fine).map(|(q, i)| refine(f, q, i, 0.5 * tolerance, levels - 1)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrates_smooth_and_cut_functions() {
        let smooth = |x: f64, y: f64| (3.0 * x).sin() * (-y).exp();
        let exact = (1.0 - 3f64.cos()) / 3.0 * (1.0 - (-1f64).exp());
        assert!((integrate_rectangle(&smooth, [0.0, 1.0, 0.0, 1.0], 1e-10, 0) - exact).abs() < 1e-9);
        let disk = |x: f64, y: f64| if x * x + y * y < 1.0 { 1.0 } else { 0.0 };
        let exact = std::f64::consts::FRAC_PI_4;
        assert!((integrate_rectangle(&disk, [0.0, 1.0, 0.0, 1.0], 1e-5, 1) - exact).abs() < 3e-5);
    }
}
