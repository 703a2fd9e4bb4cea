//! Points that need several robots at once: with enough robots for each point, all points are done.

use missions::Registry;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::starve::{outcome, with_points};
use crate::{instances, laws, parse, run};

/// The number of instances, with one allocator each.
const INSTANCES: u64 = 120;

/// The rule of response thresholds promises no end.
const WITHOUT_PROMISE: &str = "threshold";

/// Returns the allocators that leave a point undone where two robots work together at each of these places, with the
/// number of done points.
fn incomplete(places: &[(f32, f32)]) -> Vec<(&'static str, u64)> {
    let text = "step_ms = 200\nroom = { width_m = 8, height_m = 8 }\nlimit_s = 3600\n[service]\n\
         [[service.kinds]]\nname = 't'\nwork_s = { min = 5, max = 5 }\n\
         [[robots]]\nname = 'r0'\nstart = { x_m = 3.2, y_m = 3.2 }\n\
         [[robots]]\nname = 'r1'\nstart = { x_m = 4.2, y_m = 3.2 }\n";
    let text = with_points(text, places, "needs = { t = 2 }");
    let allocators = Registry::built_in().vocabulary().allocators.into_iter();
    let left = allocators.filter_map(|allocator| {
        let (run, [done, total]) = outcome(allocator.name, &text);
        laws::check(&run);
        (done < total).then_some((allocator.name, done))
    });
    left.collect()
}

/// With solid robots and the default reach, robots that work together have room at the point.
#[test]
fn robots_that_work_together_have_room() {
    assert_eq!(incomplete(&[(6.5, 6.5), (6.5, 4.0)]), []);
}

/// Two robots at three free points that need both of them exchange no places for ever.
#[test]
fn robots_at_half_filled_points_meet() {
    for places in [
        [(1.5, 4.0), (6.5, 4.0), (4.0, 1.0)],
        [(1.0, 1.0), (7.0, 7.0), (4.0, 6.5)],
        [(1.5, 3.2), (6.5, 3.2), (4.0, 7.0)],
    ] {
        assert_eq!(incomplete(&places), [], "{places:?}");
    }
}

/// With an endless limit and enough robots for each point, every allocator does all points: no two half-filled points keep
/// each other's robots for ever.
#[test]
fn all_that_the_team_can_do_is_done() {
    let mut left = Vec::new();
    for number in (0..INSTANCES).filter(|number| instances::allocator(*number) != WITHOUT_PROMISE) {
        let text = instances::gatherings(number, &mut ChaCha8Rng::seed_from_u64(number));
        let run = run(parse(&text), number);
        laws::check(&run);
        let mission = &run.log.run.result.mission;
        let [done, total] = ["done", "total"].map(|name| mission.get(name).count());
        if done < total {
            left.push((number, instances::allocator(number), done, total));
        }
    }
    assert_eq!(left, [], "instances with points that are not done");
}
