//! Whole teams without processes.

mod wire;

use scenario::Catalog;
use scenario::fault::{Fault, Order, RandomFaults};
use world_server::faults::campaign::expand;

use crate::fixtures::{parse, read};
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

/// A trigger by an object that no event has would wait for ever.
#[test]
fn triggers_by_objects_that_do_not_exist_are_refused() {
    let service = "[service]\nspare = 1\n[[service.kinds]]\nname = 't'\nwork_s = { min = 1, max = 1 }\n\
         [[service.points]]\nkind = 't'\nx_m = 3\ny_m = 3\n";
    let push = "[push]\nbars = [{ x_m = 2, y_m = 3, goal_x_m = 9 }]\n";
    for (text, when, remedy) in [
        ("[waste]", "blue picks item-7", None),
        (
            "[waste]",
            "blue picks top",
            Some("name an item, such as item-7"),
        ),
        (
            "[waste]",
            "blue delivers item-07",
            Some("name an item, such as item-7"),
        ),
        ("[waste]", "any finds", None),
        ("[waste]", "any finds top", Some("omit the object")),
        (service, "any begins p1", None),
        (
            service,
            "any finishes p2",
            Some("name a point from p0 to p1"),
        ),
        ("[observe]\nn = 3", "any loses t2", None),
        (
            "[observe]\nn = 3",
            "any finds t3",
            Some("name a target from t0 to t2"),
        ),
        (push, "any pushes left", None),
        (push, "any slips bar", None),
        (
            push,
            "any pushes bar",
            Some("name a bar or an end of it, such as left"),
        ),
    ] {
        let scenario = parse(text);
        let order = Order {
            when: Some(when.parse().unwrap()),
            ..Order::now(Fault::Mute("all".to_owned()))
        };
        let checked = scenario.mission().check_order(&scenario, &order);
        let (_, event) = when.split_once(' ').unwrap();
        let expected = remedy.map(|remedy| format!("when: '{event}' never happens; {remedy}"));
        assert_eq!(
            checked.err().map(|problem| problem.to_string()),
            expected,
            "{when}"
        );
    }
}

/// A gripper can fail only in missions that have one, in files as in orders by hand. Random faults keep to the rule.
#[test]
fn only_existing_grippers_fail() {
    let service = "limit_s = 100000.0\n[service]\n[[service.kinds]]\nname = 't'\nwork_s = { min = 5, max = 5 }\n\
        [[service.random]]\nn = 1\n";
    let push = "[[push.bars]]\nx_m = 2\ny_m = 2\ngoal_x_m = 4\n";
    let robot = "[[robots]]\nname = 'a'\n";
    let fault = "[[faults.timeline]]\nfault.actuator = { robot = 'a', mode = 'gripper' }\n";
    let refusal = |text: &str| read(text).err().map(|problem| problem.to_string());
    for mission in [service, push, "[observe]\nn = 3\n"] {
        let problem = refusal(&format!("{mission}{robot}{fault}")).unwrap();
        let expected = "faults.timeline[0].fault.actuator.mode: \
            the robots of this mission have no gripper; choose another mode";
        assert!(problem.ends_with(expected), "{problem}");
    }
    assert_eq!(refusal(&format!("[waste]\n{robot}{fault}")), None);
    let scenario = parse(&format!("{service}{robot}"));
    let orders = expand(&RandomFaults::default(), &scenario, 1);
    let catalog = Catalog::new(&scenario);
    let actuators = orders
        .iter()
        .filter(|order| order.fault.name() == "actuator");
    assert!(actuators.count() > 100);
    for order in &orders {
        assert_eq!(order.check(&scenario, &catalog), Ok(()), "{order}");
    }
}
