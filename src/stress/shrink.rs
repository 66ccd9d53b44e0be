//! Makes a failing case small.

use super::case::{Case, Stage};
use super::judge::{Judged, judge};
use super::meter::Meter;
use crate::light::Placement;
use crate::shape::{CubicBez, Shape};
use glam::{DAffine2, DVec2, DVec3};
use std::sync::Arc;

/// Most cases that are tried.
const TRIES: u32 = 4000;

/// A smaller case that fails in the same way, with what is wrong with it: fewer contours and curves, straight ones, places near
/// the world's origin, rounder numbers, as far as it goes in a bounded number of tries.
pub fn shrink(meter: &dyn Meter, case: &Case) -> (Case, Judged) {
    let mut best = case.clone();
    let mut tries = 0;
    let Some(first) = failing(meter, case) else {
        return (best, judge(meter, case, f64::NAN));
    };
    let mut verdict = first;
    // A pass takes the first smaller case that still fails, and goes on from there.
    'again: while tries < TRIES {
        for smaller in candidates(&best) {
            tries += 1;
            if let Some(judged) = failing(meter, &smaller).filter(|j| j.fault == first.fault) {
                (best, verdict) = (smaller, judged);
                continue 'again;
            }
            if tries >= TRIES {
                break;
            }
        }
        break;
    }
    (best, verdict)
}

/// What is wrong with a case; `None` where nothing is, or the meter will not have it.
fn failing(meter: &dyn Meter, case: &Case) -> Option<Judged> {
    let value = meter.read(&[vec![case.clone()]]).ok()?.first()?.first().copied()?;
    let judged = judge(meter, case, value);
    judged.fault.map(|_| judged)
}

/// Cases that are simpler than this one in one respect, the greatest simplifications first.
fn candidates(case: &Case) -> Vec<Case> {
    let shapes = shapes(&case.stage.shape).into_iter().map(|shape| on(case, |stage| stage.shape = shape));
    let all = shapes.chain(placements(case)).chain(points(case)).chain(rounded(case));
    let size = size(case);
    all.filter(|c| self::size(c) < size).collect()
}

/// What a smaller case has less of: curves, curved ones, a lobe, digits. No chain of candidates is endless.
fn size(case: &Case) -> (usize, usize, u32, usize) {
    let curves = || case.stage.shape.curves();
    let lobe = match case.alpha {
        None => 0,
        Some(1.0) => 1,
        Some(0.0) => 2,
        _ => 3,
    };
    let digits = serde_json::to_string(&case.line(serde_json::Value::Null)).map_or(usize::MAX, |line| line.len());
    (curves().count(), curves().filter(|c| **c != CubicBez::line(c.p0, c.p3)).count(), lobe, digits)
}

fn on(case: &Case, change: impl FnOnce(&mut Stage)) -> Case {
    let mut stage = Stage::clone(&case.stage);
    change(&mut stage);
    Case { stage: Arc::new(stage), ..case.clone() }
}

/// Most curves of which each is tried alone.
const ALONE: usize = 60;

/// With a contour, half of a contour or a curve less, or a curve straight.
fn shapes(shape: &Shape) -> Vec<Shape> {
    let contours: Vec<Vec<CubicBez>> = shape.contours().iter().map(|c| c.curves().to_vec()).collect();
    let mut all = Vec::new();
    let mut add = |contours: Vec<Vec<CubicBez>>| {
        all.extend(Shape::from_contours(contours).ok().filter(|s| !s.is_empty()));
    };
    if contours.len() > 1 {
        let half = contours.len() / 2;
        add(contours[..half].to_vec());
        add(contours[half..].to_vec());
        for i in 0..contours.len().min(ALONE) {
            add(contours.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, c)| c.clone()).collect());
        }
    }
    for (k, contour) in contours.iter().enumerate() {
        let mut with = |curves: Vec<CubicBez>| {
            let mut changed = contours.clone();
            changed[k] = curves;
            add(changed);
        };
        let count = contour.len();
        let step = (count / ALONE).max(1);
        if count > 4 {
            for half in [&contour[..count / 2], &contour[count / 2..]] {
                let mut half = half.to_vec();
                half.push(CubicBez::line(half[half.len() - 1].p3, half[0].p0));
                with(half);
            }
        }
        for i in (0..count).step_by(step) {
            if count > 2 {
                let mut fewer = contour.clone();
                let next = fewer[(i + 1) % count];
                fewer[i] = CubicBez::line(fewer[i].p0, next.p3);
                fewer.remove((i + 1) % count);
                with(fewer);
            }
            let line = CubicBez::line(contour[i].p0, contour[i].p3);
            if contour[i] != line {
                let mut straight = contour.clone();
                straight[i] = line;
                with(straight);
            }
        }
    }
    all
}

/// In a simpler place: no camera, the light at the origin, square to the axes, of size 1.
fn placements(case: &Case) -> Vec<Case> {
    let Placement { origin, x, y } = case.stage.placement;
    let mut all = vec![on(case, |stage| stage.eye = DVec3::ZERO)];
    if case.stage.eye == DVec3::ZERO {
        let mut moved = on(case, |stage| stage.placement.origin = DVec3::ZERO);
        moved.position -= origin;
        all.push(moved);
        let axes = [x.try_normalize(), y.try_normalize(), x.cross(y).try_normalize()];
        if let [Some(ux), Some(uy), Some(uz)] = axes {
            let local = |v: DVec3| DVec3::new(ux.dot(v), uy.dot(v), uz.dot(v));
            let placement = Placement { origin: local(origin), x: DVec3::X * x.length(), y: DVec3::Y * y.length() };
            let turned = on(case, |stage| stage.placement = placement);
            all.push(Case {
                position: local(case.position),
                normal: local(case.normal),
                view: local(case.view),
                ..turned
            });
        }
        let scale = 1.0 / x.length().max(y.length());
        let mut scaled = on(case, |stage| {
            stage.placement = Placement { origin: origin * scale, x: x * scale, y: y * scale };
        });
        scaled.position *= scale;
        all.push(scaled);
    }
    let bounds = case.stage.shape.bounds();
    let center = bounds.center();
    let mut centred = on(case, |stage| {
        stage.shape = stage.shape.transformed(DAffine2::from_translation(-center));
        stage.placement.origin = stage.placement.point(center);
    });
    all.push(centred.clone());
    let size = bounds.size().max_element() * 0.5;
    centred = on(case, |stage| {
        stage.shape = stage.shape.transformed(DAffine2::from_scale(DVec2::splat(1.0 / size)));
        let Placement { origin, x, y } = stage.placement;
        stage.placement = Placement { origin, x: x * size, y: y * size };
    });
    all.push(centred);
    all
}

/// With a simpler lobe, view or place.
fn points(case: &Case) -> Vec<Case> {
    let with_alpha = |alpha| Case { alpha, ..case.clone() };
    vec![
        with_alpha(None),
        with_alpha(Some(1.0)),
        with_alpha(Some(0.0)),
        Case { view: case.normal, ..case.clone() },
        Case { position: case.position.with_x(0.0), ..case.clone() },
        Case { position: case.position.with_y(0.0), ..case.clone() },
        Case { position: case.position.with_z(0.0), ..case.clone() },
    ]
}

/// With fewer digits, all numbers of a kind together.
fn rounded(case: &Case) -> Vec<Case> {
    let mut all = Vec::new();
    for digits in [1, 2, 3, 4, 6, 8, 10, 12, 14] {
        let round = |v: f64| to_digits(v, digits);
        let round3 = |v: DVec3| DVec3::from_array(v.to_array().map(round));
        all.push(on(case, |stage| {
            let point = |p: DVec2| DVec2::from_array(p.to_array().map(round));
            let curve = |c: &CubicBez| {
                let [p0, p1, p2, p3] = c.points().map(point);
                // A line's handles are at its thirds, however many digits those have.
                if *c == CubicBez::line(c.p0, c.p3) { CubicBez::line(p0, p3) } else { CubicBez::new(p0, p1, p2, p3) }
            };
            stage.shape = Shape::of_closed(
                stage.shape.contours().iter().map(|c| c.curves().iter().map(curve).collect()).collect(),
            );
        }));
        all.push(Case { position: round3(case.position), ..case.clone() });
        all.push(Case { normal: round3(case.normal), ..case.clone() });
        all.push(Case { view: round3(case.view), ..case.clone() });
        all.push(Case { alpha: case.alpha.map(round), ..case.clone() });
        all.push(on(case, |stage| {
            let Placement { origin, x, y } = stage.placement;
            stage.placement = Placement { origin: round3(origin), x: round3(x), y: round3(y) };
        }));
        all.push(on(case, |stage| stage.eye = round3(stage.eye)));
    }
    all
}

/// A number to that many significant digits.
fn to_digits(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}
