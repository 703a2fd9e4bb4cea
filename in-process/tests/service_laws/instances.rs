//! Random instances of each class, as scenario files.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use missions::Registry;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Returns the allocator of an instance: all take turns.
pub fn allocator(number: u64) -> &'static str {
    let all = Registry::built_in().vocabulary().allocators;
    all[number as usize % all.len()].name
}

/// Returns the first lines of a scenario and a team of 2 to 4 robots, up to the keys of `[service]`. Each skill belongs
/// to about two of three robots, and the first robot has all. `more` contains lines before the robots.
pub fn team(number: u64, chance: &mut ChaCha8Rng, more: &str, service: &str) -> String {
    let mut text = format!(
        "allocator = '{}'\nlimit_s = 200\nstep_ms = 200\nroom = {{ width_m = 8, height_m = 6 }}\n{more}",
        allocator(number)
    );
    for robot in 0..chance.random_range(2..5) {
        write!(text, "[[robots]]\nname = 'r{robot}'\nskills = {{ ").unwrap();
        let skills = ["a", "b", "c", "arm"]
            .into_iter()
            .filter(|skill| *skill != "arm" || service.contains("uncovered"));
        let skills = skills.filter(|_| robot == 0 || chance.random_bool(0.7));
        let mut skills: Vec<String> = skills.map(|skill| format!("{skill} = 1")).collect();
        if skills.is_empty() {
            skills.push("a = 0.5".to_owned());
        }
        writeln!(text, "{} }}", skills.join(", ")).unwrap();
    }
    write!(text, "[service]\n{service}").unwrap();
    for kind in ["a", "b", "c"] {
        writeln!(
            text,
            "[[service.kinds]]\nname = '{kind}'\nwork_s = {{ min = 2, max = 8 }}\nkept = {}",
            chance.random_bool(0.5)
        )
        .unwrap();
    }
    text
}

/// A point of each kind, so that each robot has a task.
pub const ONE_OF_EACH: &str = "\
    [[service.points]]\nkind = 'a'\nx_m = 4\ny_m = 3\nvalue = 1.5\n\
    [[service.points]]\nkind = 'b'\nx_m = 5\ny_m = 3\n\
    [[service.points]]\nkind = 'c'\nx_m = 4\ny_m = 4\n";

/// Returns the lines of a point at a random place.
pub fn point(chance: &mut ChaCha8Rng) -> String {
    let kind = ["a", "b", "c"][chance.random_range(0..3)];
    let (x_m, y_m) = (chance.random_range(1.0..7.0), chance.random_range(1.0..5.0));
    let mut text = format!("[[service.points]]\nkind = '{kind}'\nx_m = {x_m:.2}\ny_m = {y_m:.2}\n");
    if chance.random_bool(0.3) {
        let arrival_s: f64 = chance.random_range(0.0..60.0);
        writeln!(text, "arrival_s = {arrival_s:.1}").unwrap();
    }
    text
}

/// Returns the lines of a random window and value, each with some probability.
pub fn window(chance: &mut ChaCha8Rng) -> String {
    let mut text = String::new();
    let opens_s: f64 = chance.random_range(0.0..60.0);
    if chance.random_bool(0.6) {
        writeln!(text, "opens_s = {opens_s:.1}").unwrap();
    }
    if chance.random_bool(0.6) {
        let deadline_s = opens_s + chance.random_range(5.0..60.0);
        writeln!(text, "deadline_s = {deadline_s:.1}").unwrap();
    }
    if chance.random_bool(0.6) {
        writeln!(text, "value = {}", chance.random_range(1..20)).unwrap();
    }
    text
}

/// Returns an instance of the class windows.
pub fn windows_and_values(number: u64, chance: &mut ChaCha8Rng) -> String {
    let mut text = team(number, chance, "", "");
    for _ in 0..chance.random_range(3..9) {
        text += &point(chance);
        text += &window(chance);
    }
    text + ONE_OF_EACH + "[[service.random]]\nn = 2\n"
}

/// Returns an instance of the class precedence.
pub fn precedence(number: u64, chance: &mut ChaCha8Rng) -> String {
    let mut text = team(number, chance, "", "");
    for index in 0..chance.random_range(3..10) {
        text += &point(chance);
        if chance.random_bool(0.3) {
            text += &window(chance);
        }
        let before = (0..index).filter(|_| chance.random_bool(0.4));
        let before: Vec<String> = before.map(|point| format!("'p{point}'")).collect();
        writeln!(text, "after = [{}]", before.join(", ")).unwrap();
    }
    text + ONE_OF_EACH
}

/// Returns an instance of the class coalitions.
pub fn coalitions(number: u64, chance: &mut ChaCha8Rng) -> String {
    let service = "uncovered = true\nreach_m = 0.6\ncoalition_wait_s = 12\n";
    let mut text = team(number, chance, "", service);
    for index in 0..chance.random_range(3..8) {
        text += &point(chance);
        if chance.random_bool(0.3) {
            text += &window(chance);
        }
        if index > 0 && chance.random_bool(0.2) {
            writeln!(text, "after = ['p{}']", index - 1).unwrap();
        }
        if chance.random_bool(0.7) {
            let skills = ["a", "b", "c", "arm"].into_iter();
            let needs = skills.filter(|_| chance.random_bool(0.35));
            let mut needs: Vec<String> = needs.map(|skill| format!("{skill} = 1")).collect();
            if needs.is_empty() {
                needs.push("a = 2".to_owned());
            }
            writeln!(text, "needs = {{ {} }}", needs.join(", ")).unwrap();
        }
    }
    text + ONE_OF_EACH
        + "[[service.points]]\nkind = 'a'\nx_m = 3\ny_m = 4\nneeds = { a = 1, arm = 1 }\n"
}

/// Batteries last for about 40 s of driving, so that most robots have to charge.
pub fn endurance(number: u64, chance: &mut ChaCha8Rng) -> String {
    let capacity_j = 800.0;
    let energy = format!("energy = {{ capacity_j = {capacity_j}, idle_w = 4, drive_w = 16 }}\n");
    let reserve = format!("reserve = {:.2}\n", chance.random_range(0.2..0.5));
    let mut text = team(number, chance, &energy, &reserve);
    for _ in 0..chance.random_range(4..10) {
        text += &point(chance);
        if chance.random_bool(0.3) {
            text += &window(chance);
        }
    }
    for _ in 0..chance.random_range(1..3) {
        let (x_m, y_m) = (chance.random_range(1.0..7.0), chance.random_range(1.0..5.0));
        let rate_w = chance.random_range(20.0..100.0);
        write!(
            text,
            "[[service.chargers]]\nx_m = {x_m:.2}\ny_m = {y_m:.2}\nrate_w = {rate_w:.1}\n"
        )
        .unwrap();
    }
    text + ONE_OF_EACH
}

/// Returns an instance of the class deliveries.
pub fn deliveries(number: u64, chance: &mut ChaCha8Rng) -> String {
    let mut text = team(number, chance, "", "");
    for _ in 0..chance.random_range(3..9) {
        text += &point(chance);
        if chance.random_bool(0.4) {
            text += &window(chance);
        }
        if chance.random_bool(0.7) {
            let (x_m, y_m) = (chance.random_range(1.0..7.0), chance.random_range(1.0..5.0));
            writeln!(text, "deliver_to = [{x_m:.2}, {y_m:.2}]").unwrap();
        }
    }
    text + ONE_OF_EACH
}

/// Returns an instance with demands. Robots have capacities for some of the points, or carry any load.
pub fn loads(number: u64, chance: &mut ChaCha8Rng) -> String {
    let mut text = team(number, chance, "", "")
        .replace("[service]", "[service]\nuncovered = true")
        .replace("kept = false", "kept = true");
    for robot in 0..4 {
        if chance.random_bool(0.7) {
            let name = format!("name = 'r{robot}'\n");
            text = text.replace(
                &name,
                &format!("{name}capacity = {}\n", chance.random_range(0..12)),
            );
        }
    }
    for _ in 0..chance.random_range(3..9) {
        text += &point(chance);
        if chance.random_bool(0.3) {
            text += &window(chance);
        }
        if chance.random_bool(0.5) {
            let (x_m, y_m) = (chance.random_range(1.0..7.0), chance.random_range(1.0..5.0));
            writeln!(text, "deliver_to = [{x_m:.2}, {y_m:.2}]").unwrap();
        }
        if chance.random_bool(0.8) {
            writeln!(text, "demand = {:.1}", chance.random_range(0.0..7.0)).unwrap();
        }
    }
    text + ONE_OF_EACH
}

/// Returns an instance with walls and costs by path. A wall may leave no way to some of the points.
pub fn paths(number: u64, chance: &mut ChaCha8Rng) -> String {
    let kinds = chance.random_bool(0.3);
    let tasks = if kinds {
        "costs = 'path'\ntasks = 'kinds'\n"
    } else {
        "costs = 'path'\n"
    };
    // Points are at whole and half metres, and walls between them.
    let mut walls = String::new();
    for _ in 0..chance.random_range(1..4) {
        let x_m = f64::from(chance.random_range(1..7)) + 0.25;
        let low_m = if chance.random_bool(0.5) {
            0.0
        } else {
            chance.random_range(0.5..3.0)
        };
        let high_m = if chance.random_bool(0.4) {
            6.0
        } else {
            chance.random_range(3.0..5.5)
        };
        let size_m = high_m - low_m;
        write!(
            walls,
            "[[obstacles]]\nx_m = {x_m}\ny_m = {low_m:.2}\nwidth_m = 0.01\nheight_m = {size_m:.2}\n"
        )
        .unwrap();
    }
    let mut text = team(number, chance, &walls, tasks);
    for _ in 0..chance.random_range(3..9) {
        let kind = ["a", "b", "c"][chance.random_range(0..3)];
        let (x_m, y_m) = (chance.random_range(2..14), chance.random_range(2..10));
        let (x_m, y_m) = (f64::from(x_m) / 2.0, f64::from(y_m) / 2.0);
        write!(
            text,
            "[[service.points]]\nkind = '{kind}'\nx_m = {x_m}\ny_m = {y_m}\n"
        )
        .unwrap();
        if chance.random_bool(0.3) {
            text += &window(chance);
        }
    }
    text + ONE_OF_EACH
}

/// Returns an instance that a lone robot can do: points that open late, in an order and with deliveries, without a
/// deadline.
pub fn lone(number: u64, chance: &mut ChaCha8Rng) -> String {
    let mut text = format!(
        "allocator = '{}'\nlimit_s = 20000\nstep_ms = 500\nroom = {{ width_m = 8, height_m = 6 }}\n\
         [[robots]]\nname = 'r0'\n[service]\n",
        allocator(number)
    );
    for kind in ["a", "b", "c"] {
        write!(
            text,
            "[[service.kinds]]\nname = '{kind}'\nwork_s = {{ min = 2, max = 8 }}\n"
        )
        .unwrap();
    }
    for index in 0..chance.random_range(2..6) {
        text += &point(chance);
        if chance.random_bool(0.5) {
            let (opens_s, value) = (chance.random_range(0..60), chance.random_range(1..20));
            writeln!(text, "opens_s = {opens_s}\nvalue = {value}").unwrap();
        }
        if index > 0 && chance.random_bool(0.4) {
            writeln!(text, "after = ['p{}']", chance.random_range(0..index)).unwrap();
        }
        if chance.random_bool(0.3) {
            let (x_m, y_m) = (chance.random_range(1.0..7.0), chance.random_range(1.0..5.0));
            writeln!(text, "deliver_to = [{x_m:.2}, {y_m:.2}]").unwrap();
        }
    }
    text + ONE_OF_EACH
}

/// Returns an instance with points that the team can do, most of which need several robots: the needs of a point are the
/// skills of different robots. Points open late and have an order, but no deadline.
pub fn gatherings(number: u64, chance: &mut ChaCha8Rng) -> String {
    const SKILLS: [&str; 3] = ["a", "b", "c"];
    let mut text = format!(
        "allocator = '{}'\nlimit_s = 40000\nstep_ms = 500\nroom = {{ width_m = 8, height_m = 6 }}\n",
        allocator(number)
    );
    let mut team: Vec<Vec<&str>> = Vec::new();
    for robot in 0..chance.random_range(2..5) {
        let mut skills = SKILLS.to_vec();
        skills.retain(|_| robot == 0 || chance.random_bool(0.6));
        if skills.is_empty() {
            skills.push(SKILLS[robot % SKILLS.len()]);
        }
        let stated: Vec<String> = skills.iter().map(|skill| format!("{skill} = 1")).collect();
        write!(
            text,
            "[[robots]]\nname = 'r{robot}'\nskills = {{ {} }}\n",
            stated.join(", ")
        )
        .unwrap();
        team.push(skills);
    }
    text += "[service]\ncoalition_wait_s = 12\n";
    for kind in SKILLS {
        let kept = chance.random_bool(0.5);
        write!(
            text,
            "[[service.kinds]]\nname = '{kind}'\nwork_s = {{ min = 2, max = 8 }}\nkept = {kept}\n"
        )
        .unwrap();
    }
    for index in 0..chance.random_range(2..6) {
        text += &point(chance);
        if chance.random_bool(0.3) {
            writeln!(text, "opens_s = {}", chance.random_range(0..60)).unwrap();
        }
        if index > 0 && chance.random_bool(0.2) {
            writeln!(text, "after = ['p{}']", chance.random_range(0..index)).unwrap();
        }
        let mut needs: BTreeMap<&str, u32> = BTreeMap::new();
        for skills in &team {
            let skill = skills[chance.random_range(0..skills.len())];
            if chance.random_bool(0.7) {
                *needs.entry(skill).or_default() += 1;
            }
        }
        let needs: Vec<String> = needs
            .iter()
            .map(|(skill, count)| format!("{skill} = {count}"))
            .collect();
        writeln!(text, "needs = {{ {} }}", needs.join(", ")).unwrap();
    }
    text + ONE_OF_EACH
}

/// Returns lines of one to three faults: crashes with and without a restart, message loss and reduced skills. The first
/// robot has all skills.
pub fn faults(chance: &mut ChaCha8Rng) -> String {
    let mut text = String::new();
    for _ in 0..chance.random_range(1..4) {
        let at_s: f64 = chance.random_range(1.0..90.0);
        let for_s: f64 = chance.random_range(5.0..60.0);
        let fault = match chance.random_range(0..4) {
            0 => "fault.kill = 'r1'".to_owned(),
            1 => format!("fault.kill = 'r0'\nfor_s = {for_s:.1}"),
            2 => format!(
                "fault.drop = {{ p = {:.2} }}\nfor_s = {for_s:.1}",
                chance.random_range(0.1..0.9)
            ),
            _ => format!(
                "fault.skill = {{ robot = 'r0', skill = 'a', share = 0.3 }}\nfor_s = {for_s:.1}"
            ),
        };
        write!(text, "[[faults.timeline]]\nat_s = {at_s:.1}\n{fault}\n").unwrap();
    }
    text
}
