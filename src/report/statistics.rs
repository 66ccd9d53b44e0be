//! The middle and the spread of a few measured values.

/// The middle value, or the mean of the two in the middle; 0 of none.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    match n {
        0 => 0.0,
        _ if n % 2 == 1 => sorted[n / 2],
        _ => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}

/// 1.4826 times the median of the distances from the median: the standard deviation of a normal distribution, and hardly moved by
/// outliers (Rousseeuw, Croux 1993, "Alternatives to the median absolute deviation", eq. 1.1). Nothing of fewer than three values.
pub fn spread(values: &[f64]) -> Option<f64> {
    let middle = median(values);
    let distances: Vec<f64> = values.iter().map(|v| (v - middle).abs()).collect();
    (values.len() >= 3).then(|| 1.4826 * median(&distances))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_is_where_outliers_do_not_move_it() {
        assert_eq!(median(&[]), 0.0);
        assert_eq!(median(&[3.0, 1.0]), 2.0);
        assert_eq!(median(&[1.0, 1e9, 2.0]), 2.0);
        assert_eq!(spread(&[1.0, 2.0]), None);
        assert_eq!(spread(&[2.0, 1.0, 1e9]), Some(1.4826));
        // Of a normal distribution it is the standard deviation: quantiles of one with mean 5 and deviation 2, by Python's
        // statistics.NormalDist(5, 2).inv_cdf((i + 0.5) / 9).
        let normal = [1.8136, 3.0652, 3.8210, 4.4357, 5.0, 5.5643, 6.1790, 6.9348, 8.1864];
        let deviation = spread(&normal).unwrap_or_default();
        assert!((deviation - 2.0).abs() < 0.3, "{deviation}");
    }
}
