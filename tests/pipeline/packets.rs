//! Packets of shading points give, lane by lane, the bits that each point alone gives.

use glam::{DVec2, DVec3};
use glyphlight::backend::Technique;
use glyphlight::backend::emitter::{Emitter, Skip};
use glyphlight::backend::gather::Images;
use glyphlight::backend::packets::{Outcome, PointPacket, Question, tree_of};
use glyphlight::brdf::ltc::{Lobe, Table};
use glyphlight::kernel::frame::ShadingFrame;
use glyphlight::kernel::packet::{MAX_LANES, Processor};
use glyphlight::kernel::tree::Budget;
use glyphlight::light::Placement;
use glyphlight::outline::font::Font;
use glyphlight::outline::text::{TextStyle, layout};
use glyphlight::shape::Shape;

/// Numbers from 0 to 1, in a fixed order (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 * 2.0_f64.powi(-53)
    }

    fn vector(&mut self, extent: f64) -> DVec3 {
        DVec3::new(self.next() - 0.5, self.next() - 0.5, self.next() - 0.5) * (2.0 * extent)
    }
}

fn emitters() -> Vec<Emitter> {
    let text = |text: &str| {
        let style = TextStyle { size: 1.0, ..TextStyle::default() };
        layout(text, &[Font::bundled("DejaVu Sans").expect("bundled")], &style).expect("Latin text").shape
    };
    let square = Shape::rectangle(DVec2::new(-0.4, 0.0), DVec2::new(0.6, 0.5));
    let place = |shape: Shape, two_sided: bool| {
        let mut emitter = Emitter::of_shape(shape, &Technique::Tree).expect("a region");
        emitter.placement =
            Placement::new(DVec3::new(0.1, -0.2, 0.3), DVec3::new(0.3, 0.5, -0.2), DVec2::new(1.0, 1.3));
        emitter.two_sided = two_sided;
        emitter
    };
    vec![place(square, false), place(text("&"), false), place(text("Open all night"), true)]
}

/// A point near or far, above or below, with a view from anywhere, and its lobe.
fn point(random: &mut Random, emitter: &Emitter, table: &Table) -> (DVec3, ShadingFrame, Lobe) {
    let reach = 10.0_f64.powf(random.next() * 4.0 - 3.0);
    let on_light = emitter.placement.point(DVec2::new(random.next(), random.next()));
    let position = on_light + random.vector(reach);
    let frame = ShadingFrame::new(random.vector(1.0).normalize(), random.vector(1.0).normalize());
    let alpha = (random.next() * random.next()) as f32;
    (position, frame, table.lobe(alpha, frame.cos_theta as f32))
}

/// What one point alone gives, and what is left of its budget.
fn alone(
    emitter: &Emitter,
    (position, frame, lobe): &(DVec3, ShadingFrame, Lobe),
    question: &Question<'_>,
    tolerance: f32,
) -> (Result<(f32, u32), Skip>, Budget) {
    let mut budget = Budget::default();
    let images = Images::new(emitter, frame, *position).map(|i| if question.may_be_cut { i } else { i.uncut() });
    let integral = images.and_then(|images| {
        let lobe = question.specular.then_some(lobe);
        images.integral(emitter, lobe, tolerance, &mut budget)
    });
    (integral.map(|i| (i.value.x as f32, i.visited)), budget)
}

/// Asks packets of random points; returns how many lanes differ from the point alone, and of each outcome.
fn disagreements(processor: Processor, shift: f64) -> (usize, [usize; 4]) {
    let table = Table::shipped();
    let mut random = Random(7);
    let (mut wrong, mut outcomes) = (0, [0; 4]);
    for emitter in emitters() {
        let tree = tree_of(&emitter).expect("a tree in a fixed place");
        for round in 0..1500_u32 {
            let points: Vec<_> = (0..processor.lanes()).map(|_| point(&mut random, &emitter, table)).collect();
            // The last packet of a tile is not full.
            let count = if round % 5 == 0 { 1 + round as usize % processor.lanes() } else { processor.lanes() };
            let tolerances: Vec<f32> = (0..count).map(|_| 10.0_f32.powf(-2.0 - 3.0 * random.next() as f32)).collect();
            let mut tolerance = [1.0; MAX_LANES];
            tolerance[..count].copy_from_slice(&tolerances);
            let mut packet = PointPacket::default();
            for (position, frame, lobe) in &points[..count] {
                packet.push(*position + DVec3::splat(shift), frame, lobe);
            }
            assert_eq!(packet.len(), count);
            let asking = if round % 3 == 0 { 0x5b6d } else { u32::MAX };
            let question = Question {
                emitter: &emitter,
                tree,
                specular: round % 2 == 0,
                asking,
                tolerance,
                may_be_cut: round % 7 != 0,
            };
            let answer = packet.ask(processor, &question);
            for (lane, point) in points[..count].iter().enumerate().filter(|(lane, _)| asking >> lane & 1 == 1) {
                let (expected, budget) = alone(&emitter, point, &question, tolerance[lane]);
                let (kind, same) = match answer.lane(lane) {
                    Outcome::Integral(value, visited) => {
                        let left = packet.budget(lane);
                        let spent = left.left == budget.left;
                        (0, spent && expected == Ok((value, visited)))
                    }
                    Outcome::Skipped(skip) => (1 + usize::from(skip == Skip::Behind), expected == Err(skip)),
                    Outcome::Alone => (3, expected.is_ok()),
                };
                outcomes[kind] += 1;
                wrong += usize::from(!same);
            }
        }
    }
    (wrong, outcomes)
}

#[test]
fn every_lane_has_the_bits_of_the_point_alone_on_all_processors() {
    for processor in Processor::all() {
        let (wrong, outcomes) = disagreements(processor, 0.0);
        println!("{processor}: integrals, below, behind, alone: {outcomes:?}; {wrong} differ");
        assert_eq!(wrong, 0, "{processor}");
        assert!(outcomes.iter().all(|&n| n > 50), "{processor}: {outcomes:?}");
    }
}

#[test]
fn a_packet_that_is_moved_by_a_millionth_differs() {
    for processor in Processor::all() {
        assert!(disagreements(processor, 1e-6).0 > 100 * processor.lanes(), "{processor}");
    }
}

#[test]
fn processors_are_this_one_and_lesser_ones() {
    let all = Processor::all();
    let (names, lanes): (Vec<_>, Vec<_>) = all.iter().map(|p| (p.name(), p.lanes())).unzip();
    assert!(lanes.is_sorted() && lanes.iter().all(|lanes| (1..=MAX_LANES).contains(lanes)), "{lanes:?}");
    assert!((1..names.len()).all(|i| !names[i..].contains(&names[i - 1])), "{names:?}");
    let best = all.last().expect("one at least").to_string();
    assert_eq!(Processor::default().to_string(), best);
    assert_eq!(best, format!("{}, {} lanes", names[names.len() - 1], lanes[lanes.len() - 1]));
}
