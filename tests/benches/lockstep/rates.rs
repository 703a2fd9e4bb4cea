//! The ticks per second of runs and of the bare barrier, with memory and start time.

use crate::bare;
use crate::cpu;
use crate::figures::Figures;
use crate::real::Run;
use crate::team::Team;
use crate::traffic::{Traffic, computed_alone};

/// The items in each spill: more than a team can carry away within the limit.
const ITEMS: usize = 100;

/// The options of the measured runs. Without the page a run has the processes of the bare barrier and the waiting
/// launcher.
const WAYS: [&[&str]; 4] = [
    &["--log=off", "--no-page"],
    &["--log=summary", "--no-page"],
    &["--log=full", "--no-page"],
    &["--log=off"],
];

/// The results of several rounds for teams of one size.
#[derive(Default)]
struct Results {
    bare: Figures,
    alone: Figures,
    real: [Figures; WAYS.len()],
    /// The ratio of a real run to the bare barrier of the same round, by [`WAYS`].
    share: [Figures; WAYS.len()],
    /// The ratio of a real run to the run without a log of the same round, by [`WAYS`].
    of_off: [Figures; WAYS.len()],
    /// The processor time of all processes per tick in µs, start and end included.
    bare_cpu: Figures,
    real_cpu: [Figures; WAYS.len()],
    share_cpu: [Figures; WAYS.len()],
    /// The ratio of the processor time without a log to that of each of the [`WAYS`].
    off_cpu: [Figures; WAYS.len()],
    start_s: Figures,
    world_start_s: Figures,
    agent_resident: Figures,
    agent_share: Figures,
    world_resident: Figures,
}

/// Measures the bare barrier and real runs in turn, so that both have the same background load.
pub fn measure(sizes: &[usize], rounds: usize, limit_s: f64) {
    let teams: Vec<Team> = sizes
        .iter()
        .map(|size| Team::busy(*size, 0.5, ITEMS, limit_s))
        .collect();
    for team in &teams {
        let traffic = Traffic::of(&team.setup);
        println!("\n## {} agents\n\n{traffic:?}", team.size);
        let mut results = Results::default();
        for _ in 0..rounds {
            results.round(team, &traffic);
        }
        results.print();
    }
}

pub fn default_mission(rounds: usize) {
    let team = Team::default_mission();
    let [mut simulated, mut real] = [(); 2].map(|()| Figures::default());
    for _ in 0..rounds {
        let finished = Run::start(&team, &["--log=full"]).finish();
        simulated.push(finished.run.result.sim_time_ms.0 as f64 / 1000.0);
        real.push(finished.running_s);
    }
    println!("\n## Default mission\n\nsimulated {simulated} s in {real} s");
}

impl Results {
    fn round(&mut self, team: &Team, traffic: &Traffic) {
        self.alone.push(computed_alone(&team.setup));
        let mut off = None;
        for (index, way) in WAYS.into_iter().enumerate() {
            // Each real run follows a bare run, so that their ratio has the same background load.
            let before = cpu::of_ended_children();
            let bare = bare::ticks_per_s(team.size, traffic);
            let between = cpu::of_ended_children();
            let real = Run::start(team, way).finish();
            let per_tick = 1e6 / traffic.ticks as f64;
            let bare_cpu = (between - before) * per_tick;
            let real_cpu = (cpu::of_ended_children() - between) * per_tick;
            self.bare_cpu.push(bare_cpu);
            self.real_cpu[index].push(real_cpu);
            self.share_cpu[index].push(bare_cpu / real_cpu);
            self.bare.push(bare);
            self.real[index].push(real.ticks_per_s);
            self.share[index].push(real.ticks_per_s / bare);
            let (off_rate, off_cpu) = *off.get_or_insert((real.ticks_per_s, real_cpu));
            self.of_off[index].push(real.ticks_per_s / off_rate);
            self.off_cpu[index].push(off_cpu / real_cpu);
            self.start_s.push(real.start_s);
            self.world_start_s.push(real.world_start_s);
            self.agent_resident.push(real.agent.resident);
            self.agent_share.push(real.agent.share);
            self.world_resident.push(real.world.resident);
        }
    }

    fn print(&self) {
        let line = |label: &str, figures: &Figures| println!("| {label} | {figures} |");
        println!("\n| | median [least .. most] |\n|---|---|");
        line("bare barrier, ticks/s", &self.bare);
        for (index, way) in WAYS.into_iter().enumerate() {
            let way = way.join(" ");
            line(&format!("run {way}, ticks/s"), &self.real[index]);
            line(&format!("run {way} / bare"), &self.share[index]);
            if index > 0 {
                line(&format!("run {way} / --log=off"), &self.of_off[index]);
            }
        }
        line("bare barrier, processor time per tick, µs", &self.bare_cpu);
        for (index, way) in WAYS.into_iter().enumerate() {
            let label = format!("run {}, processor time per tick", way.join(" "));
            line(&(label.clone() + ", µs"), &self.real_cpu[index]);
            line(&format!("bare / {label}"), &self.share_cpu[index]);
            if index > 0 {
                line(&format!("--log=off / {label}"), &self.off_cpu[index]);
            }
        }
        line("in one process, no bus, ticks/s", &self.alone);
        line("start of the command to first tick, s", &self.start_s);
        line("start of the world to first tick, s", &self.world_start_s);
        line("memory of an agent, resident, MB", &self.agent_resident);
        line("memory of an agent, its share, MB", &self.agent_share);
        line("memory of the world, resident, MB", &self.world_resident);
    }
}
