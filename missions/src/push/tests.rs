//! Teams without processes.

#[test]
fn push_satisfies_the_laws_of_every_mission() {
    let two = "[push]\n[[push.bars]]\nx_m = 2\ny_m = 2\ngoal_x_m = 4\n[[push.bars]]\nx_m = 2\ny_m = 6\ngoal_x_m = 4\n";
    crate::testkit::check_mission(super::MISSION, two);
}
