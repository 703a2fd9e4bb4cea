//! The slots of a coalition: places for robots with different skills that work together.

/// Fills slots with robots: a maximum matching by augmenting paths. Each robot fills one slot, at first the one that it
/// wants. A later robot never displaces an earlier one, but may move it to another slot. Returns the robot of each slot.
pub fn fill_slots<R: Copy>(
    slots: usize,
    robots: impl IntoIterator<Item = (R, Option<usize>)>,
    can_fill: impl Fn(R, usize) -> bool,
) -> Vec<Option<R>> {
    let mut filled: Vec<Option<R>> = vec![None; slots];
    for (robot, wanted) in robots {
        let is_free = |slot: &usize| filled[*slot].is_none() && can_fill(robot, *slot);
        match wanted.filter(is_free) {
            Some(slot) => filled[slot] = Some(robot),
            None => {
                place(robot, &mut filled, &mut vec![false; slots], &can_fill);
            }
        }
    }
    filled
}

/// Gives a robot a slot, and moves other robots if necessary. Returns whether that succeeded.
fn place<R: Copy>(
    robot: R,
    filled: &mut [Option<R>],
    tried: &mut [bool],
    can_fill: &impl Fn(R, usize) -> bool,
) -> bool {
    for slot in 0..filled.len() {
        if tried[slot] || !can_fill(robot, slot) {
            continue;
        }
        tried[slot] = true;
        if filled[slot].is_none_or(|other| place(other, filled, tried, can_fill)) {
            filled[slot] = Some(robot);
            return true;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::fill_slots;

    /// Returns the largest number of slots that robots can fill, by trying all assignments.
    fn most(slots: usize, robots: u32, can_fill: &impl Fn(u8, usize) -> bool) -> usize {
        let Some(slot) = slots.checked_sub(1) else {
            return 0;
        };
        let of_slot =
            (0..4_u8).filter(|robot| robots & (1 << robot) != 0 && can_fill(*robot, slot));
        let filled = of_slot.map(|robot| 1 + most(slot, robots & !(1 << robot), can_fill));
        filled.max().unwrap_or(0).max(most(slot, robots, can_fill))
    }

    #[test]
    fn a_robot_moves_to_another_slot_for_a_later_one() {
        let can_fill = |robot: u8, slot: usize| robot == 0 || slot == 0;
        let robots = [(0, Some(0)), (1, Some(0)), (2, None)];
        assert_eq!(fill_slots(2, robots, can_fill), [Some(1), Some(0)]);
    }

    /// As many slots as possible are filled, by robots with the skill, each robot at most once. Robots that are placed stay
    /// placed when another one comes. All skills of four robots at three slots are tried.
    #[test]
    fn slots_are_filled_as_far_as_possible() {
        let slots = 3;
        for skills in 0..1_u32 << 12 {
            let can_fill =
                |robot: u8, slot: usize| skills & (1 << (3 * usize::from(robot) + slot)) != 0;
            let wanted = |robot: u8| {
                Some((skills as usize + usize::from(robot)) % 4).filter(|slot| *slot < slots)
            };
            let mut before = BTreeSet::new();
            for count in 0..=4 {
                let robots = (0..count).map(|robot| (robot, wanted(robot)));
                let filled = fill_slots(slots, robots, can_fill);
                let placed: Vec<u8> = filled.iter().copied().flatten().collect();
                for (slot, robot) in filled.iter().enumerate() {
                    assert!(
                        robot.is_none_or(|robot| can_fill(robot, slot)),
                        "{skills:b}"
                    );
                }
                let distinct: BTreeSet<u8> = placed.iter().copied().collect();
                assert_eq!(distinct.len(), placed.len(), "{skills:b}");
                assert_eq!(
                    placed.len(),
                    most(slots, (1 << count) - 1, &can_fill),
                    "{skills:b}"
                );
                assert!(distinct.is_superset(&before), "{skills:b}");
                before = distinct;
            }
        }
    }
}
