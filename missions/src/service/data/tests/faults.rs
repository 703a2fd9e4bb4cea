//! Additional points of faults.

use scenario::Catalog;
use scenario::fault::{Fault, MissionFault, Order};

use super::*;

#[test]
fn orders_for_points_without_a_task_are_refused() {
    let check = |spare: usize, kind: &str, at_s: Option<f64>, every_s: Option<f64>| {
        let section = format!("limit_s = 100\n[service]\nspare = {spare}");
        let text = TWO_KINDS.replace("[service]", &section);
        let scenario = parse(&format!("{text}[[service.random]]\nn = 1\n"));
        let fault = MissionFault::new(POINT, &[("x_m", 1.0), ("y_m", 1.0)]);
        let order = Order {
            at_s,
            every_s,
            ..Order::now(Fault::Mission(fault.with_name("kind", kind)))
        };
        let checked = order.check(&scenario, &Catalog::new(&scenario));
        checked.map_err(|error| error.to_string())
    };
    assert_eq!(check(1, "dust", None, None), Ok(()));
    // At 0 and 50 s: the run ends before 100 s.
    assert_eq!(check(2, "dust", Some(0.0), Some(50.0)), Ok(()));
    // From now on, of which only the run has the time.
    assert_eq!(check(2, "dust", None, Some(40.0)), Ok(()));
    let refused = [
        (1, "dusk", None, None),
        (0, "dust", None, None),
        (2, "dust", Some(0.0), Some(40.0)),
    ]
    .map(|(spare, kind, at_s, every_s)| check(spare, kind, at_s, every_s).unwrap_err());
    insta::assert_snapshot!(refused.join("\n"));
}

#[test]
fn faults_that_add_points_in_vain_give_a_warning() {
    let warnings = |spare: usize, timeline: &str| {
        let text = format!(
            "limit_s = 100\nobstacles = [{{ x_m = 3, y_m = 3, width_m = 1, height_m = 1 }}]\n\
             [service]\nspare = {spare}\n[[service.kinds]]\nname = 't'\nwork_s = {{ min = 3, max = 5 }}\n\
             {}[faults]\ntimeline = [{timeline}]\n",
            point("t", 1.0, 1.0)
        );
        let warnings = SERVICE.faults_in_vain(&parse(&text));
        let lines: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        lines.join("\n")
    };
    let free = "{ fault.point = { x_m = 1, y_m = 4 }, at_s = 9 }";
    let walled = "{ fault.point = { x_m = 3.5, y_m = 3.5 }, at_s = 9 }";
    let late = "{ fault.point = { x_m = 1, y_m = 4 }, at_s = 100 }";
    assert_eq!(warnings(2, &[free; 2].join(", ")), "");
    assert_eq!(warnings(1, &[free, late].join(", ")), "");
    assert_eq!(
        warnings(2, &[free, walled].join(", ")),
        "faults.timeline[1]: no robot can work at (3.5, 3.5); move the point away from walls and obstacles"
    );
    assert_eq!(
        warnings(2, &[free; 3].join(", ")),
        "faults.timeline: the faults add 3 points, more than service.spare, 2; increase service.spare"
    );
}
