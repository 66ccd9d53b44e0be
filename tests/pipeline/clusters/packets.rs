//! Tiles and points that walk the clusters together get, lane by lane, the bits that each alone gets.

use super::{Lister, Point, cloud, gather, prepare};
use crate::cases::Rng;
use glam::DVec3;
use glyphlight::backend::cluster_packets::{Handed, Lists, WalkingPacket};
use glyphlight::kernel::packet::{MAX_LANES, Processor};
use glyphlight::kernel::receiver::Receiver;
use glyphlight::kernel::tile::TileBounds;

/// Walks random points of a tile, and tiles, in lanes and one by one; returns how many lanes differ, and how many clusters were
/// listed, lights handed on and clusters answered for by the tile. What is in the lanes is shifted.
fn disagreements(processor: Processor, shift: f64) -> (usize, [usize; 3]) {
    let lanes = processor.lanes();
    let mut rng = Rng(5);
    let (mut wrong, mut seen) = (0, [0; 3]);
    for case in 0..60 {
        let (ours, _) = prepare(cloud(&mut rng, 24, [10.0, 60.0, 180.0][case % 3], case % 4 == 0));
        let tree = ours.clustered.tree.view();
        let place = rng.direction() * rng.log_within(0.3, 20.0);
        let count = if case % 5 == 0 { 1 + case % lanes } else { lanes };
        let near = |rng: &mut Rng| place + rng.direction() * rng.log_within(1e-3, 1.0);
        let points: Vec<Point> = (0..count)
            .map(|_| {
                let at = near(&mut rng);
                Point::random(&mut rng, at)
            })
            .collect();
        let moved = |p: &Point| Point { position: p.position + DVec3::splat(shift), ..*p };
        let bounds = |p: &Point| {
            let mut bounds = TileBounds::EMPTY;
            p.add_to(&mut bounds);
            Point { position: p.position * 1.001, ..*p }.add_to(&mut bounds);
            Receiver::of_tile(&bounds, true, tree.per_metre)
        };
        let tolerance = 10.0_f32.powf(-2.0 - 2.0 * rng.unit() as f32);
        let tiles: Vec<Receiver> = points.iter().map(|p| bounds(&moved(p))).collect();
        let lists = Lists::new(processor, tree, &tiles, &[tolerance; MAX_LANES]);
        for (lane, point) in points.iter().enumerate() {
            let alone = Lister::new(tree, &bounds(point), tolerance);
            let together: Vec<_> = lists.of_tile(lane).collect();
            let same = alone.listed == together && (alone.local, alone.locals) == lists.local(lane);
            wrong += usize::from(!same || alone.budget != lists.budget(lane) || alone.visited != lists.visited(lane));
            seen[0] += alone.listed.len();
            seen[2] += alone.locals as usize;
        }
        let tile = Lister::new(tree, &tiles[0], tolerance);
        let mut packet = WalkingPacket::default();
        points.iter().for_each(|p| packet.push(&moved(p).receiver(tree.per_metre)));
        packet.walk(processor, tree, &tile.listed, Some((tile.middle, &tile.local)), tolerance, tile.budget);
        for (lane, point) in points.iter().enumerate() {
            let alone = gather(tree, &point.receiver(tree.per_metre), &tile, tolerance);
            let is = |bits: u32| bits >> lane & 1;
            let of = |h: &Handed| (h.emitter, is(h.points[0]) | is(h.points[1]) << 1);
            let mine: Vec<_> = packet.handed().iter().map(of).filter(|h| h.1 != 0).collect();
            let sum = packet.reflected(lane, 0) + packet.reflected(lane, 1);
            wrong += usize::from(mine != alone.handed || sum.as_dvec3() != alone.radiance);
            seen[1] += mine.len();
        }
    }
    (wrong, seen)
}

#[test]
fn every_lane_has_the_bits_of_the_point_alone_on_all_processors() {
    for processor in Processor::all() {
        let (wrong, seen) = disagreements(processor, 0.0);
        println!("{processor}: {wrong} differ; {seen:?}");
        assert_eq!(wrong, 0, "{processor}");
        assert!(
            seen[0] > 60 * processor.lanes() && seen[1] > 6 * processor.lanes() && seen[2] > 30 * processor.lanes(),
            "{processor}: {seen:?}"
        );
    }
}

#[test]
fn lanes_that_are_moved_differ() {
    for processor in Processor::all() {
        assert!(disagreements(processor, 1e-5).0 > 15 * processor.lanes(), "{processor}");
    }
}
