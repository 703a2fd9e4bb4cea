//! Whole teams without processes.

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
            crate::testkit::check_mission(super::MISSION, &section);
        }
    }
}
