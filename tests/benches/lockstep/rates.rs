//! The ticks per second of runs and of the bare barrier, with memory and start time.

use alliance_tests::harness::Lab;

use crate::bare;
use crate::figures::{Figures, print};
use crate::mission::{Mission, Traffic};
use crate::real::{Run, cpu_of_ended_children_s};

/// The items in each spill: more than a team can carry away within the limit.
const ITEMS: usize = 100;

/// The options of the measured runs. Without the page a run has the processes of the bare barrier and the waiting
/// launcher.
const WAYS: [&str; 3] = ["--log=off --no-page", "--log=full --no-page", "--log=off"];

/// Measures the bare barrier and real runs in turn, so that both have the same background load.
pub fn measure(agents: usize, rounds: usize, limit_s: f64) {
    let mission = Mission::busy(agents, 0.5, ITEMS, limit_s);
    let traffic = Traffic::of(&mission.setup);
    println!("\n## {agents} agents\n\n{traffic:?}\n");
    let [mut bare, mut bare_cpu, mut start_s] = [(); 3].map(|()| Figures::default());
    let [mut agent, mut world] = [(); 2].map(|()| Figures::default());
    // The rate, its ratio to the bare barrier and to the run without a log of the same round, and the processor time.
    let mut ways = WAYS.map(|_| [(); 4].map(|()| Figures::default()));
    for _ in 0..rounds {
        let mut off = None;
        for (way, [rate, of_bare, of_off, cpu]) in WAYS.into_iter().zip(&mut ways) {
            // Each real run follows a bare run, so that their ratio has the same background load.
            let before_s = cpu_of_ended_children_s();
            let bare_rate = bare::ticks_per_s(agents, &traffic);
            let between_s = cpu_of_ended_children_s();
            let lab = Lab::new();
            let real = Run::start(&lab, &mission, way).finish();
            let per_tick = 1e6 / traffic.ticks as f64;
            bare_cpu.push((between_s - before_s) * per_tick);
            cpu.push((cpu_of_ended_children_s() - between_s) * per_tick);
            bare.push(bare_rate);
            rate.push(real.ticks_per_s);
            of_bare.push(real.ticks_per_s / bare_rate);
            of_off.push(real.ticks_per_s / *off.get_or_insert(real.ticks_per_s));
            start_s.push(real.start_s);
            agent.push(real.agent);
            world.push(real.world);
        }
    }
    let ways = WAYS.iter().zip(&ways).flat_map(|(way, figures)| {
        let [rate, of_bare, of_off, cpu] = figures;
        [
            (format!("run {way}, ticks/s"), rate),
            (format!("run {way} / bare"), of_bare),
            (format!("run {way} / {}", WAYS[0]), of_off),
            (format!("run {way}, processor time per tick, µs"), cpu),
        ]
    });
    let others = [
        ("bare barrier, ticks/s", &bare),
        ("bare barrier, processor time per tick, µs", &bare_cpu),
        ("start of the command to first tick, s", &start_s),
        ("memory of an agent, resident, MB", &agent),
        ("memory of the world, resident, MB", &world),
    ];
    let others = others.map(|(label, figures)| (label.to_owned(), figures));
    print(ways.chain(others));
}

pub fn default_mission(rounds: usize) {
    let mission = Mission::new("name = \"default\"\n".to_owned());
    let [mut simulated, mut real] = [(); 2].map(|()| Figures::default());
    for _ in 0..rounds {
        let lab = Lab::new();
        let finished = Run::start(&lab, &mission, "--log=full").finish();
        simulated.push(finished.simulated_s);
        real.push(finished.running_s);
    }
    println!("\n## Default mission\n\nsimulated {simulated} s in {real} s");
}
