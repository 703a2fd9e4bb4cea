//! Every kind of mistake in a scenario file, with the exact error message.

use crate::Registry;
use crate::waste::data::default_scenario;
use proptest::prelude::*;

use scenario::{Scenario, Setup};

fn refusal(text: &str) -> String {
    match Scenario::parse("s.toml", text, &Registry::built_in().vocabulary()) {
        Ok(_) => format!("accepted: {text}"),
        Err(error) => error.to_string(),
    }
}

fn check(table: &[(&str, &str)]) {
    for (text, expected) in table {
        assert_eq!(refusal(text), *expected, "for {text:?}");
    }
}

#[test]
fn not_toml() {
    check(&[
        ("[room", "s.toml:1: unclosed table; TOML expects `]` here"),
        ("x", "s.toml:1: key with no value; TOML expects `=` here"),
        (
            "name = 'a'\nname = 'b'",
            "s.toml:2: duplicate key, 'name'; state it once",
        ),
        (
            "[room]\n[room]",
            "s.toml:2: duplicate key, 'room'; state it once",
        ),
        (
            "a = [1, 2",
            "s.toml:1: unclosed array; TOML expects `]` here",
        ),
        (
            "name = 'x\u{1b}[31m'",
            "s.toml:1: invalid literal string; TOML expects non-single-quote visible characters here",
        ),
    ]);
}

#[test]
fn unknown_keys() {
    check(&[
        (
            "nam = 'a'",
            "s.toml:1: nam: unknown key; did you mean 'name'? (there are name, description, step_ms, limit_s, step_order, allocator, room, body, devices, skills, sensors, radio, energy, robots, obstacles, faults, tasks, alliance, allocators, waste, service, push, observe)",
        ),
        (
            "\n\n[room]\nwidht_m = 3",
            "s.toml:4: room.widht_m: unknown key; did you mean 'width_m'? (there are width_m, height_m)",
        ),
        (
            "a.b.c = 1",
            "s.toml:1: a: unknown key; there are name, description, step_ms, limit_s, step_order, allocator, room, body, devices, skills, sensors, radio, energy, robots, obstacles, faults, tasks, alliance, allocators, waste, service, push, observe",
        ),
        (
            "\"a\\nb\" = 1",
            "s.toml:1: \"a\\nb\": unknown key; there are name, description, step_ms, limit_s, step_order, allocator, room, body, devices, skills, sensors, radio, energy, robots, obstacles, faults, tasks, alliance, allocators, waste, service, push, observe",
        ),
        (
            "[[obstacles]]\nx_m = 1\ny_m = 1\nwidth_m = 1\nheight_m = 1\ncolor = 'red'",
            "s.toml:6: obstacles[0].color: unknown key; there are x_m, y_m, width_m, height_m, penetrability",
        ),
    ]);
}

#[test]
fn wrong_types() {
    check(&[
        (
            "name = 3",
            "s.toml:1: name: 3 does not fit; write a string in quotes",
        ),
        (
            "step_ms = 50.5",
            "s.toml:1: step_ms: 50.5 does not fit; write a whole number that is not negative",
        ),
        (
            "step_ms = -1",
            "s.toml:1: step_ms: -1 does not fit; write a whole number that is not negative",
        ),
        (
            "step_ms = 99999999999999999999",
            "s.toml:1: step_ms: 99999999999999999999 is out of range; write a number of at most 18 digits",
        ),
        (
            "limit_s = true",
            "s.toml:1: limit_s: true does not fit; write a number",
        ),
        ("room = 3", "s.toml:1: room: 3 does not fit; write a table"),
        (
            "robots = 3",
            "s.toml:1: robots: 3 does not fit; write an array",
        ),
        (
            "[robots]",
            "s.toml:1: robots: a table does not fit; write an array",
        ),
        (
            "limit_s = 2020-01-01",
            "s.toml:1: limit_s: the date or time 2020-01-01 does not fit; no key of a scenario accepts one",
        ),
        (
            "[alliance.switches]\nwaiting = 'yes'",
            "s.toml:2: alliance.switches.waiting: the string 'yes' does not fit; write true or false",
        ),
        (
            "[tasks.report-progress]\npriority = 'high'",
            "s.toml:2: tasks.report-progress.priority: the string 'high' does not fit; write a whole number from -2147483648 to 2147483647",
        ),
        (
            "room.width_m = 5\nroom.height_m = [5]",
            "s.toml:2: room.height_m: an array does not fit; write a number",
        ),
        (
            "waste.spills = [{ items = -1 }]",
            "s.toml:1: waste.spills[0].items: -1 does not fit; write a whole number from 0 to 4294967295",
        ),
    ]);
}

#[test]
fn unknown_choices() {
    check(&[
        (
            "[alliance]\npreset = 'teem'",
            "s.toml:2: alliance.preset: there is no choice 'teem'; did you mean 'team'? (there are thesis, par98, team)",
        ),
        (
            "[alliance]\npreset = 3",
            "s.toml:2: alliance.preset: the integer does not fit; write one of thesis, par98, team",
        ),
        (
            "step_order = 'in-order'\n[alliance.switches]\nstep_order = 'in-order'",
            "s.toml:3: alliance.switches.step_order: step_order at the top of the scenario already states it; state it once",
        ),
        (
            "[alliance.switches]\nhistory_origin = 'start'",
            "s.toml:2: alliance.switches.history_origin: there is no choice 'start'; there are mission-start, progress",
        ),
    ]);
}

#[test]
fn missing_keys() {
    check(&[
        (
            "[[robots]]\nside_sensor = true",
            "s.toml:1: robots[0].name: the key is missing; give it a value",
        ),
        (
            "[[robots]]\nname = 'blue'\n[robots.start]\nx_m = 2\n",
            "s.toml:3: robots[0].start.y_m: the key is missing; give it a value",
        ),
        (
            "[[obstacles]]\nx_m = 1.5\ny_m = 0.5\nwidth_m = 1",
            "s.toml:1: obstacles[0].height_m: the key is missing; give it a value",
        ),
    ]);
}

#[test]
fn out_of_range() {
    check(&[
        (
            "step_ms = 0",
            "s.toml:1: step_ms: 0 is out of range; it must be at least 1 and at most 500 ms",
        ),
        (
            "step_ms = 501",
            "s.toml:1: step_ms: 501 is out of range; it must be at least 1 and at most 500 ms",
        ),
        (
            "limit_s = 0",
            "s.toml:1: limit_s: 0 is out of range; it must be above 0 and at most 1000000000 s",
        ),
        (
            "limit_s = nan",
            "s.toml:1: limit_s: NaN is out of range; it must be above 0 and at most 1000000000 s",
        ),
        (
            "limit_s = inf",
            "s.toml:1: limit_s: inf is out of range; it must be above 0 and at most 1000000000 s",
        ),
        (
            "limit_s = 1e400",
            "s.toml:1: limit_s: inf is out of range; it must be above 0 and at most 1000000000 s",
        ),
        (
            "name = 'x'\r\nlimit_s = -1\r\n",
            "s.toml:2: limit_s: -1 is out of range; it must be above 0 and at most 1000000000 s",
        ),
        (
            "[room]\nwidth_m = -1",
            "s.toml:2: room.width_m: -1 is out of range; it must be above 0 and at most 1000 m",
        ),
        (
            "[room]\nheight_m = 1e300",
            "s.toml:2: room.height_m: inf is out of range; it must be above 0 and at most 1000 m",
        ),
        (
            "[body]\nradius_m = 0",
            "s.toml:2: body.radius_m: 0 is out of range; it must be above 0 and at most 1000 m",
        ),
        (
            "[body]\nspeed_m_s = -0.5",
            "s.toml:2: body.speed_m_s: -0.5 is out of range; it must be above 0 and at most 1000 m/s",
        ),
        (
            "[[robots]]\nname = 'a'\nspeed_m_s = 0",
            "s.toml:3: robots[0].speed_m_s: 0 is out of range; it must be above 0 and at most 1000 m/s",
        ),
        (
            "[[robots]]\nname = 'a'\npush_m_s = 0",
            "s.toml:3: robots[0].push_m_s: 0 is out of range; it must be above 0 and at most 1000 m/s",
        ),
        (
            "[body]\npush_m_s = nan",
            "s.toml:2: body.push_m_s: NaN is out of range; it must be above 0 and at most 1000 m/s",
        ),
        (
            "devices = ['side-boarder']",
            "s.toml:1: devices[0]: there is no optional device 'side-boarder'; did you mean 'side-border'? (there is only 'side-border')",
        ),
        (
            "[skills]\ndust = 1",
            "s.toml:2: skills.dust: there is no skill 'dust'; there are none",
        ),
        (
            "[[robots]]\nname = 'a'\nturn_deg_s = -1",
            "s.toml:3: robots[0].turn_deg_s: -1 is out of range; it must be above 0 and at most 3600 deg/s",
        ),
        (
            "[[robots]]\nname = 'a'\ndevices = ['side-boarder']",
            "s.toml:3: robots[0].devices[0]: there is no optional device 'side-boarder'; did you mean 'side-border'? (there is only 'side-border')",
        ),
        (
            "[[robots]]\nname = 'a'\nskills = { dust = 1 }",
            "s.toml:3: robots[0].skills.dust: there is no skill 'dust'; there are none",
        ),
        (
            "[body]\nturn_deg_s = 3601",
            "s.toml:2: body.turn_deg_s: 3601 is out of range; it must be above 0 and at most 3600 deg/s",
        ),
        (
            "[body]\nreach_m = 0",
            "s.toml:2: body.reach_m: 0 is out of range; it must be above 0 and at most 1000 m",
        ),
        (
            "[body]\nrobot_penetrability = -0.1",
            "s.toml:2: body.robot_penetrability: -0.1 is out of range; it must be at least 0 and at most 100",
        ),
        (
            "[sensors]\nborder_range_m = 0",
            "s.toml:2: sensors.border_range_m: 0 is out of range; it must be above 0 and at most 1000 m",
        ),
        (
            "[sensors]\navoidance_range_m = nan",
            "s.toml:2: sensors.avoidance_range_m: NaN is out of range; it must be above 0 and at most 1000 m",
        ),
        (
            "[sensors]\nwaste_range_m = 1001",
            "s.toml:2: sensors.waste_range_m: 1001 is out of range; it must be above 0 and at most 1000 m",
        ),
        (
            "[energy]\ncapacity_j = 0",
            "s.toml:2: energy.capacity_j: 0 is out of range; it must be above 0 and at most 1000000000000 J",
        ),
        (
            "[energy]\nidle_w = -1",
            "s.toml:2: energy.idle_w: -1 is out of range; it must be at least 0 and at most 1000000000 W",
        ),
        (
            "[energy]\ndrive_w = inf",
            "s.toml:2: energy.drive_w: inf is out of range; it must be at least 0 and at most 1000000000 W",
        ),
        (
            "[[waste.spills]]\nname = 'top'\nx_fraction = 1.5",
            "s.toml:3: waste.spills[0].x_fraction: 1.5 is out of range; it must be at least 0 and at most 1",
        ),
        (
            "[[waste.spills]]\nname = 'top'\nitems = 1001",
            "s.toml:3: waste.spills[0].items: 1001 is out of range; it must be at least 0 and at most 1000",
        ),
        (
            "[waste]\nspill_radius_m = 0",
            "s.toml:2: waste.spill_radius_m: 0 is out of range; it must be above 0 and at most 1000 m",
        ),
        (
            "[waste]\nitem_radius_m = 0.9",
            "s.toml:2: waste.item_radius_m: an item of radius 0.9 m is larger than a spill; it must be at most spill_radius_m, 0.8 m",
        ),
        (
            "[waste.deposit]\ny_fraction = -0.1",
            "s.toml:2: waste.deposit.y_fraction: -0.1 is out of range; it must be at least 0 and at most 1",
        ),
        (
            "[waste.report_site]\ncolor_s = -1",
            "s.toml:2: waste.report_site.color_s: -1 is out of range; it must be at least 0 and at most 1000000000 s",
        ),
        (
            "[waste]\nreport_period_s = 0",
            "s.toml:2: waste.report_period_s: 0 is out of range; it must be above 0 and at most 1000000000 s",
        ),
        (
            "[[robots]]\nname = 'blue'\nstart = { x_m = 2, y_m = 3, heading_deg = 361 }",
            "s.toml:3: robots[0].start.heading_deg: 361 is out of range; it must be at least -360 and at most 360 deg",
        ),
        (
            "[[obstacles]]\nx_m = 1\ny_m = 1\nwidth_m = 0\nheight_m = 1",
            "s.toml:4: obstacles[0].width_m: 0 is out of range; it must be above 0 and at most 10000 m",
        ),
        (
            "[[obstacles]]\nx_m = nan\ny_m = 1\nwidth_m = 1\nheight_m = 1",
            "s.toml:2: obstacles[0].x_m: NaN is out of range; it must be at least -10000 and at most 10000 m",
        ),
        (
            "[tasks.report-progress]\nmax_robots = 0",
            "s.toml:2: tasks.report-progress.max_robots: 0 is out of range; it must be at least 1 and at most 4294967295",
        ),
    ]);
}

#[test]
fn names() {
    check(&[
        (
            "name = 'a b'",
            "s.toml:1: name: 'a b' is not a name; use at most 32 letters, digits, '-' and '_', with a letter or a digit first",
        ),
        (
            "\u{feff}name = 'a b'",
            "s.toml:1: name: 'a b' is not a name; use at most 32 letters, digits, '-' and '_', with a letter or a digit first",
        ),
        (
            "[[robots]]\nname = 'a/b'",
            "s.toml:2: robots[0].name: 'a/b' is not a name; use at most 32 letters, digits, '-' and '_', with a letter or a digit first",
        ),
        (
            "[[robots]]\nname = 'blue'\n[[robots]]\nname = 'blue'",
            "s.toml:4: robots[1].name: 'blue' is already the name of robots[0]; give each its own name",
        ),
        (
            "robots = []",
            "s.toml:1: robots: 0 entries; give 1 to 10000",
        ),
        (
            "[[robots]]\nname = 'a'\ntasks = ['find-locations', 'move-spill(tip)']",
            "s.toml:3: robots[0].tasks[1]: there is no task 'move-spill(tip)'; did you mean 'move-spill(top)'? (there are find-locations, move-spill(top), move-spill(bottom), report-progress)",
        ),
        (
            "radio.range_m = 0.0",
            "s.toml:1: radio.range_m: 0 is out of range; it must be above 0 and at most 10000 m",
        ),
        (
            "[[waste.further_deposits]]\nx_fraction = 1.5\ny_fraction = 0.5",
            "s.toml:2: waste.further_deposits[0].x_fraction: 1.5 is out of range; it must be at least 0 and at most 1",
        ),
        (
            "[[waste.spills]]\nitems = 3",
            "s.toml:1: waste.spills[0].name: '' is not a name; use at most 32 letters, digits, '-' and '_', with a letter or a digit first",
        ),
        (
            "[[waste.spills]]\nname = 'top'\n[[waste.spills]]\nname = 'top'",
            "s.toml:4: waste.spills[1].name: 'top' is already the name of waste.spills[0]; give each its own name",
        ),
        (
            "waste.spills = []",
            "s.toml:1: waste.spills: 0 entries; give 1 to 10000",
        ),
        (
            "[tasks.\"move-spill(left)\"]\npriority = 1",
            "s.toml:1: tasks.\"move-spill(left)\": there is no task 'move-spill(left)'; did you mean 'move-spill(top)'? (there are find-locations, move-spill(top), move-spill(bottom), report-progress)",
        ),
        (
            "[tasks.cleaning]\npriority = 1",
            "s.toml:1: tasks.cleaning: there is no task 'cleaning'; there are find-locations, move-spill(top), move-spill(bottom), report-progress",
        ),
        (
            "[alliance.sets.report]\nfast_impatience = 3",
            "s.toml:1: alliance.sets.report: there is no behavior set 'report'; there are find-locations-methodical, find-locations-wander, move-spill(top), move-spill(bottom), report-progress",
        ),
        (
            "[alliance.robots.red.defaults]\nfast_impatience = 3",
            "s.toml:1: alliance.robots.red: there is no robot 'red'; there are blue, gold, green",
        ),
        (
            "[alliance.robots.gold.sets.find-locations-methodical]\nfast_impatience = 3",
            "s.toml:1: alliance.robots.gold.sets.find-locations-methodical: there is no behavior set of gold 'find-locations-methodical'; there are find-locations-wander, move-spill(top), move-spill(bottom), report-progress",
        ),
        (
            "[alliance.defaults.slow_impatience_toward]\nred = 1",
            "s.toml:2: alliance.defaults.slow_impatience_toward.red: there is no teammate 'red'; there are blue, gold, green",
        ),
        (
            "[alliance.robots.blue.defaults.willing_to_affect_toward_s]\nblue = 1",
            "s.toml:2: alliance.robots.blue.defaults.willing_to_affect_toward_s.blue: there is no teammate 'blue'; there are gold, green",
        ),
    ]);
}

#[test]
fn places() {
    check(&[
        (
            "[room]\nwidth_m = 0.3",
            "s.toml:1: room: 0.3 x 9 m is too small for 3 robots of diameter 0.4 m; enlarge the room, or make body.radius_m smaller",
        ),
        (
            "[body]\nradius_m = 4",
            "s.toml:2: body.radius_m: 12 x 9 m is too small for 3 robots of diameter 8 m; enlarge the room, or make body.radius_m smaller",
        ),
        (
            "[[robots]]\nname = 'blue'\nstart = { x_m = 0.1, y_m = 1 }",
            "s.toml:3: robots[0].start.x_m: 0.1 puts 'blue' into a wall; keep body.radius_m, 0.2 m, away from both walls",
        ),
        (
            "[[robots]]\nname = 'blue'\n[robots.start]\nx_m = 2\ny_m = 9",
            "s.toml:5: robots[0].start.y_m: 9 puts 'blue' into a wall; keep body.radius_m, 0.2 m, away from both walls",
        ),
        (
            "[[robots]]\nname = 'blue'\n[robots.start]\nx_m = 2\ny_m = 1\n[[obstacles]]\nx_m = 1.5\ny_m = 0.5\nwidth_m = 1\nheight_m = 1",
            "s.toml:6: obstacles[0]: covers the start of 'blue'; move it or robots[0].start until they are apart",
        ),
        (
            "[[robots]]\nname = 'blue'\n[robots.start]\nx_m = 2.3\ny_m = 1\n[[robots]]\nname = 'gold'\n[robots.start]\nx_m = 2\ny_m = 1",
            "s.toml:8: robots[1].start: 'gold' starts inside 'blue'; keep their centers 0.400 m apart",
        ),
    ]);
}

#[test]
fn absent_robots() {
    check(&[
        (
            "[[robots]]\nname = 'a'\nabsent = true\n[[robots]]\nname = 'b'\nabsent = true",
            "s.toml:1: robots: all robots are absent; make at least one present from the start",
        ),
        (
            "[[robots]]\nname = 'a'\nabsent = 1",
            "s.toml:3: robots[0].absent: 1 does not fit; write true or false",
        ),
    ]);
    // Absent robots do not block others, but may not start in a wall.
    let team = |x_m| {
        format!(
            "[[robots]]\nname = 'a'\nstart = {{ x_m = 3, y_m = 3 }}\n\
             [[robots]]\nname = 'b'\nabsent = true\nstart = {{ x_m = {x_m}, y_m = 3 }}"
        )
    };
    Scenario::parse("s.toml", &team(3.1), &Registry::built_in().vocabulary()).unwrap();
    assert_eq!(
        refusal(&team(0.1)),
        "s.toml:7: robots[1].start.x_m: 0.1 puts 'b' into a wall; keep body.radius_m, 0.2 m, away from both walls"
    );
}

#[test]
fn faults() {
    let timeline = |rest: &str| format!("[[faults.timeline]]\n{rest}");
    let table = [
        (
            "fault.drop = { p = 1.5 }",
            "s.toml:2: faults.timeline[0].fault.drop.p: 1.5 is out of range; it must be at least 0 and at most 1",
        ),
        (
            "[faults.timeline.fault.drop]\nfrom = 'red'\np = 0.5",
            "s.toml:3: faults.timeline[0].fault.drop.from: the scenario has no robot 'red'; there are blue, gold, green",
        ),
        (
            "fault.drop = { from = 'blue' }",
            "s.toml:2: faults.timeline[0].fault.drop.p: the key is missing; give it a value",
        ),
        (
            "fault.drop = { p = 0.5, form = 'blue' }",
            "s.toml:2: faults.timeline[0].fault.drop.form: unknown key; did you mean 'from'? (there are from, to, p, burst_s)",
        ),
        (
            "at_s = 3",
            "s.toml:1: faults.timeline[0].fault: the key is missing; give it a value",
        ),
        (
            "fault.mute = 3",
            "s.toml:2: faults.timeline[0].fault.mute: 3 does not fit; write a string in quotes",
        ),
        (
            "fault.kil = 'blue'",
            "s.toml:2: faults.timeline[0].fault: there is no choice 'kil'; did you mean 'kill'? (there are kill, terminate, pause, continue, restart, add, remove, drop, delay, duplicate, reorder, hold, partition, mute, deaf, range, radio, sensor, actuator, skill, power, babble, obstacle, move-robot)",
        ),
        (
            "at_s = -1\nfault.kill = 'blue'",
            "s.toml:2: faults.timeline[0].at_s: -1 is out of range; it must be at least 0 and at most 1000000000 s",
        ),
        (
            "when = 'blue naps'\nfault.kill = 'blue'",
            "s.toml:2: faults.timeline[0].when: there is no event 'naps'; there are activates, hibernates, waits, picks, drops, delivers, reports, finds, joins, dies",
        ),
        (
            "fault.add = 'blue'",
            "s.toml:2: faults.timeline[0].fault.add: 'blue' is in the mission from its start; name a robot that the scenario marks as absent: there are none",
        ),
        (
            "fault.sensor = { robot = 'blue', device = 'zone', mode = 'dead' }",
            "s.toml:2: faults.timeline[0].fault.sensor.device: there is no choice 'zone'; there are position, front-border, side-border, avoidance, waste, spill-zone, report-site, gripper, ground",
        ),
        (
            "fault.actuator = { robot = 'blue', mode = { slowed = 2 } }",
            "s.toml:2: faults.timeline[0].fault.actuator.mode: 2 is out of range; it must be at least 0 and at most 1",
        ),
        (
            "id = 'a'\nfault.mute = 'blue'\n[[faults.timeline]]\nid = 'a'\nfault.deaf = 'blue'",
            "s.toml:5: faults.timeline[1].id: 'a' is already the id of faults.timeline[0]; give each its own id",
        ),
        (
            "id = 'random-1'\nfault.mute = 'blue'\n[faults.random]",
            "s.toml:2: faults.timeline[0].id: 'random-1' may become the id of a random fault; choose an id that does not begin with 'random-'",
        ),
    ];
    for (rest, expected) in table {
        assert_eq!(refusal(&timeline(rest)), expected, "for {rest:?}");
    }
    check(&[
        (
            "[faults.random]\nmtbf_s = 0",
            "s.toml:2: faults.random.mtbf_s: 0 is out of range; it must be above 0 and at most 1000000000 s",
        ),
        (
            "[faults.random]\nmttr_s = -1",
            "s.toml:2: faults.random.mttr_s: -1 is out of range; it must be above 0 and at most 1000000000 s",
        ),
        (
            "[faults.random]\nmtbf_h = 8",
            "s.toml:2: faults.random.mtbf_h: unknown key; did you mean 'mtbf_s'? (there are mtbf_s, mttr_s, mix)",
        ),
        (
            "[faults.random.mix]\nkill = -1",
            "s.toml:2: faults.random.mix.kill: -1 is out of range; it must be at least 0 and at most 1000000",
        ),
        (
            "[faults.random.mix]\nkill = 0\npause = 0\nlink = 0\nsensor = 0\nactuator = 0\npower = 0\nbabble = 0",
            "s.toml:1: faults.random.mix: every weight is 0; set one above 0",
        ),
        (
            "[faults.random]\nmtbf_s = 0.01\nmttr_s = 0.02",
            "s.toml:2: faults.random.mtbf_s: about 360000 faults are expected until limit_s; increase it or reduce limit_s, for at most 100000",
        ),
    ]);
    Scenario::parse(
        "s.toml",
        "[faults.random]",
        &Registry::built_in().vocabulary(),
    )
    .unwrap();
}

#[test]
fn parameters() {
    check(&[
        (
            "[alliance]\nthreshold = 0",
            "s.toml:2: alliance.threshold: 0 is out of range; it must be finite and above 0",
        ),
        (
            "[alliance.defaults]\nfast_impatience = -1",
            "s.toml:2: alliance.defaults.fast_impatience: -1 is out of range; it must be finite and above 0 motivation/s",
        ),
        (
            "[alliance.defaults]\nfast_impatience = 0.4",
            "s.toml:2: alliance.defaults.fast_impatience: blue's find-locations-methodical has slow impatience 1 toward gold with fast impatience 0.4; the rule is 0 < slow < fast",
        ),
        (
            "[alliance.sets.report-progress]\nbroadcast_rate_hz = 0.2",
            "s.toml:2: alliance.sets.report-progress.broadcast_rate_hz: blue's report-progress has tau = 5 s with rho = 0.2 Hz; the rule is tau > 1/rho",
        ),
        (
            "[alliance.robots.blue.sets.report-progress]\nslow_impatience = inf",
            "s.toml:2: alliance.robots.blue.sets.report-progress.slow_impatience: inf is out of range; it must be finite and above 0 motivation/s",
        ),
        (
            "[alliance.sets.report-progress]\nfast_impatience = 3\n[alliance.robots.blue.sets.report-progress]\nslow_impatience_toward = { gold = 5 }",
            "s.toml:4: alliance.robots.blue.sets.report-progress.slow_impatience_toward.gold: blue's report-progress has slow impatience 5 toward gold with fast impatience 3; the rule is 0 < slow < fast",
        ),
    ]);
}

#[test]
fn deep_nesting() {
    let dots = "a.".repeat(100_000);
    for text in [
        format!("{dots}x = 1"),
        format!("[{dots}x]"),
        format!("x = {}", "[".repeat(100_000)),
    ] {
        let refusal = refusal(&text);
        assert!(
            refusal.starts_with("s.toml:1: ") && refusal.contains("recurs"),
            "{refusal}"
        );
    }
}

#[test]
fn too_many_robots() {
    let robots: String = (0..65_001)
        .map(|number| format!("[[robots]]\nname = 'r{number}'\n"))
        .collect();
    assert_eq!(
        refusal(&robots),
        "s.toml:1: robots: 65001 entries; give 1 to 10000"
    );
}

#[test]
fn too_many_items() {
    let spills: String = (0..201)
        .map(|number| format!("[[waste.spills]]\nname = 's{number}'\nitems = 1000\n"))
        .collect();
    assert_eq!(
        refusal(&spills),
        "s.toml:1: waste.spills: 201000 items in all; give at most 200000"
    );
    let waste = |items: u32, rest: &str| {
        format!(
            "[faults]\ntimeline = [{{ every_s = 1, fault = {{ waste = {{ x_m = 1, y_m = 1, items = {items} }} }} }}]\n{rest}"
        )
    };
    assert_eq!(
        refusal(&waste(1000, "")),
        "s.toml:2: faults.timeline[0].every_s: items = 1000 every 1 s gives 3601000 items until limit_s, 3600 s; keep the total at most \
         200000: add fewer items, or less often"
    );
    Scenario::parse("s.toml", &waste(50, ""), &Registry::built_in().vocabulary()).unwrap();
}

#[test]
fn without_a_file_the_error_starts_with_the_key() {
    let scenario = Scenario {
        step_ms: 0,
        ..default_scenario()
    };
    assert_eq!(
        Setup::resolve(scenario, 1, None).unwrap_err().to_string(),
        "step_ms: 0 is out of range; it must be at least 1 and at most 500 ms"
    );
}

#[test]
fn only_foraging_has_a_duration() {
    let refused = |text: &str, expected: &str| {
        let read = Scenario::parse("s.toml", text, &Registry::built_in().vocabulary());
        assert_eq!(read.unwrap_err().to_string(), expected);
    };
    refused(
        "[waste]\nduration_s = 60",
        "s.toml:2: waste.duration_s: the clean-up ends when all items are delivered; leave it out, or write respawn = true",
    );
    refused(
        "[waste]\nrespawn = 1",
        "s.toml:2: waste.respawn: 1 does not fit; write true or false",
    );
    let read = Scenario::parse(
        "s.toml",
        "[waste]\nrespawn = true\nduration_s = 60",
        &Registry::built_in().vocabulary(),
    );
    let scenario = read.unwrap();
    assert!(!scenario.mission().expected_properties(&scenario).ends);
}

/// Draws fragments of scenario files, similar enough to real ones to reach every check.
fn scraps() -> impl Strategy<Value = String> {
    let scrap = prop::sample::select(vec![
        "[room]",
        "[[robots]]",
        "[[waste.spills]]",
        "[alliance.defaults]",
        "[alliance.robots.blue.defaults]",
        "[energy]",
        "[[obstacles]]",
        "name = 'a'",
        "name = 'blue'",
        "name = 'blue",
        "start = { x_m = 1, y_m = 1 }",
        "start = {}",
        "width_m = 1e-30",
        "width_m = nan",
        "height_m = -inf",
        "x_m = 9223372036854775807",
        "y_m = 0x7fffffffffffffff",
        "slow_impatience = 5",
        "fast_impatience = 5.0",
        "slow_impatience_toward = { gold = 1 }",
        "items = 4294967296",
        "step_ms = 1979-05-27",
        "= =",
        "]",
        "\u{0}",
        "\"\\u0000\" = 1",
    ]);
    prop::collection::vec(scrap, 0..12).prop_map(|scraps| scraps.join("\n"))
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused_in_one_line(text in prop_oneof![any::<String>(), scraps()]) {
        if let Err(error) = Scenario::parse("s.toml", &text, &Registry::built_in().vocabulary()) {
            let line = error.to_string();
            prop_assert!(line.starts_with("s.toml") && !line.contains(char::is_control), "{}", line);
        }
    }
}
