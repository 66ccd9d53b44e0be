//! Student's distribution with 15 degrees of freedom: that of a mean of 16 batches.

/// P(|T| > |t|). Abramowitz, Stegun 1964, 26.7.3 (odd degrees of freedom).
pub fn two_sided(t: f64) -> f64 {
    const DEGREES: f64 = 15.0;
    let theta = (t.abs() / DEGREES.sqrt()).atan();
    let (sin, cos) = theta.sin_cos();
    let (mut term, mut sum) = (cos, 0.0);
    for k in 1..=7 {
        sum += term;
        term *= cos * cos * f64::from(2 * k) / f64::from(2 * k + 1);
    }
    (1.0 - (theta + sin * sum) * core::f64::consts::FRAC_2_PI).max(0.0)
}

#[test]
fn quantiles_are_those_of_the_tables() {
    for (t, p) in [(0.0, 1.0), (0.691, 0.5), (2.131, 0.05), (2.947, 0.01), (4.073, 0.001)] {
        assert!((two_sided(t) - p).abs() < 1e-3 * p + 1e-6, "{t}: {}", two_sided(t));
    }
    assert!(two_sided(20.0) < 1e-10 && two_sided(f64::INFINITY) < 1e-15);
}
