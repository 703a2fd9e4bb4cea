//! Whole teams without processes.

use crate::testkit::check_mission;

#[test]
fn waste_passes_the_checks_of_every_mission() {
    let scenario = "[waste]\nborder_known = true\nspills = [{ name = 'only', items = 2 }]\n";
    check_mission(crate::waste::MISSION, scenario);
}

#[test]
fn service_passes_the_checks_of_every_mission() {
    let kinds = "[[service.kinds]]\nname = 'garbage'\nwork_s = { min = 2, max = 4 }\n\
        [[service.kinds]]\nname = 'dust'\nwork_s = { min = 1, max = 3 }\nperiod_s = 20\nkept = false\n";
    for known in ["all", "sight"] {
        for tasks in ["points", "kinds"] {
            let section = format!(
                "[service]\nknown = '{known}'\ntasks = '{tasks}'\nduration_s = 50\n{kinds}\
                 [[service.random]]\nn = 8\nrate_hz = 0.5\n"
            );
            check_mission(crate::service::MISSION, &section);
        }
    }
}

#[test]
fn push_passes_the_checks_of_every_mission() {
    let bar = |y_m: u8| format!("[[push.bars]]\nx_m = 2\ny_m = {y_m}\ngoal_x_m = 4\n");
    check_mission(crate::push::MISSION, &(bar(2) + &bar(6)));
}

#[test]
fn observe_passes_the_checks_of_every_mission() {
    for policy in ["fixed", "random", "local", "a-cmommt"] {
        let text = format!("[observe]\nn = 8\nduration_s = 40\npolicy = '{policy}'\n");
        check_mission(crate::observe::MISSION, &text);
    }
}
