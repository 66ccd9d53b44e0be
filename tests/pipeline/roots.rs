//! Where heights pass through zero: planted roots in f32.

use crate::cases::Rng;
use glyphlight::kernel::roots::crossings;

/// Heights with planted roots, of every degree, as Bernstein coefficients in f32.
fn planted(rng: &mut Rng) -> [f32; 4] {
    let root = |rng: &mut Rng| if rng.unit() < 0.8 { rng.unit() } else { rng.within(-2.0, 3.0) };
    let [r, s, t] = core::array::from_fn(|_| root(rng));
    let t = if rng.unit() < 0.2 { s + rng.log_within(1e-7, 1e-2) } else { t };
    let scale = rng.log_within(1e-6, 1e3) * if rng.unit() < 0.5 { 1.0 } else { -1.0 };
    // Each factor x − root as its values at 0 and 1; blossoming gives the Bernstein coefficients of the product.
    let line = |r: f64| [-r, 1.0 - r];
    let factors = match (rng.unit() * 3.0) as u32 {
        0 => [line(r), line(s), line(t)],
        1 => [line(r), line(s), [1.0, 1.0]],
        _ => [line(r), [1.0, 1.0], [1.0, 1.0]],
    };
    let [f, g, h] = factors;
    let third = |i: usize| {
        // Mean over the ways to choose which factors are taken at 1.
        let ways: Vec<f64> = (0..8_usize)
            .filter(|w| w.count_ones() as usize == i)
            .map(|w| f[w & 1] * g[w >> 1 & 1] * h[w >> 2 & 1])
            .collect();
        ways.iter().sum::<f64>() / ways.len() as f64
    };
    core::array::from_fn(|i| (scale * third(i)) as f32)
}

/// The height in f64, and its scale.
fn height(h: [f32; 4], t: f64) -> (f64, f64) {
    let [a, b, c, d] = h.map(f64::from);
    let s = 1.0 - t;
    let scale = h.iter().fold(0.0_f64, |m, &v| m.max(f64::from(v).abs()));
    (a * s * s * s + 3.0 * b * s * s * t + 3.0 * c * s * t * t + d * t * t * t, scale)
}

/// What is wrong with the crossings found for `h`, if anything: heights that are not zero there, states that do not
/// alternate, or a stretch between two of them on the wrong side.
fn fault(h: [f32; 4], found: &[f32]) -> Option<String> {
    const TOLERANCE: f64 = 2e-6;
    if found.len() % 2 != usize::from((h[0] > 0.0) != (h[3] > 0.0)) {
        return Some("the states do not alternate".into());
    }
    let mut above = h[0] > 0.0;
    let mut from = 0.0;
    for stop in found.iter().map(|&t| f64::from(t)).chain([1.0]) {
        if !(from..=1.0).contains(&stop) {
            return Some(format!("{stop} after {from}"));
        }
        for i in 0..=100 {
            let t = from + (stop - from) * f64::from(i) / 100.0;
            let (value, scale) = height(h, t);
            let side = if above { value } else { -value };
            if side < -TOLERANCE * scale {
                return Some(format!("height {value} at {t}, scale {scale}"));
            }
        }
        let (value, scale) = height(h, stop);
        if stop < 1.0 && value.abs() > TOLERANCE * scale {
            return Some(format!("height {value} at the crossing {stop}, scale {scale}"));
        }
        (from, above) = (stop, !above);
    }
    None
}

#[test]
fn planted_roots_are_found() {
    let mut rng = Rng(43);
    let mut counts = [0; 4];
    let (mut tried, mut noticed) = (0, 0);
    for case in 0..100_000 {
        let h = planted(&mut rng);
        let found = crossings(h);
        let fault_here = fault(h, &found.t[..found.count]);
        assert_eq!(fault_here, None, "case {case}: {h:?} {found:?}");
        counts[found.count] += 1;
        if case % 20 == 0 && found.count > 0 {
            tried += 1;
            let shifted: Vec<f32> = found.t[..found.count].iter().map(|t| (t * 0.99).max(1e-3)).collect();
            noticed += u32::from(fault(h, &shifted).is_some());
            // A root that is dropped is noticed at any rate.
            assert!(fault(h, &found.t[1..found.count]).is_some());
        }
    }
    println!("{counts:?} heights with 0, 1, 2, 3 crossings; roots off by 1 % noticed in {noticed} of {tried}");
    assert!(counts.iter().all(|&n| n > 2000), "{counts:?}");
    assert!(noticed * 10 > tried * 9, "{noticed} of {tried}");
}

/// Quadratics raised to cubics, as in every TrueType font: the two roots where the quadratic has them.
#[test]
fn raised_quadratics_have_their_roots() {
    let mut rng = Rng(47);
    for case in 0..20_000 {
        let (r, s) = (rng.within(0.01, 0.45), rng.within(0.55, 0.99));
        let shift = rng.within(-3.0, 3.0);
        // Heights a·x + b of control points, rounded on the way as the kernel's are.
        let quad = [r * s, -0.5 * (r + s) + r * s, (1.0 - r) * (1.0 - s)];
        let cubic = [quad[0], (quad[0] + 2.0 * quad[1]) / 3.0, (2.0 * quad[1] + quad[2]) / 3.0, quad[2]];
        let h = cubic.map(|v| (v - shift) as f32 + shift as f32);
        let found = crossings(h);
        assert_eq!(found.count, 2, "case {case}: {h:?}");
        let error = (f64::from(found.t[0]) - r).abs().max((f64::from(found.t[1]) - s).abs());
        // Heights rounded by 2⁻²³ over slopes of 0.1 and more.
        assert!(error < 1e-5, "case {case}: {found:?} for {r} and {s}");
        let off = crossings([h[0], h[1] * 1.01, h[2], h[3]]);
        assert!(off.count != 2 || (f64::from(off.t[0]) - r).abs().max((f64::from(off.t[1]) - s).abs()) > 1e-5);
    }
}
