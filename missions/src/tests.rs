//! Whole teams without processes.

mod wire;

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
fn service_with_properties_passes_the_checks_of_every_mission() {
    let text = "step_ms = 200\nenergy = { capacity_j = 400, idle_w = 2, drive_w = 16 }\n\
        [service]\nreserve = 0.4\nreach_m = 0.6\ncoalition_wait_s = 6\n\
        chargers = [{ x_m = 2, y_m = 6, rate_w = 90 }]\n\
        kinds = [{ name = 'dust', work_s = { min = 1, max = 3 }, kept = false }]\n\
        points = [\n\
          { name = 'first', kind = 'dust', x_m = 2, y_m = 4, opens_s = 6, deadline_s = 60, value = 3 },\n\
          { kind = 'dust', x_m = 3, y_m = 4, after = ['first'], needs = { dust = 2 }, priority = 2 },\n\
          { kind = 'dust', x_m = 3, y_m = 3, deliver_to = [4, 5] },\n\
          { kind = 'dust', x_m = 1.5, y_m = 3, deadline_s = 4 },\n\
        ]\n\
        [[robots]]\nname = 'gold'\nskills = { dust = 1 }\n[[robots]]\nname = 'blue'\nskills = { dust = 0.7 }\n";
    check_mission(crate::service::MISSION, text);
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
