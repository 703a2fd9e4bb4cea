//! Ticks per second of runs against the bare barrier, with memory and start.

use crate::bare;
use crate::cpu;
use crate::figures::Figures;
use crate::real::Run;
use crate::team::Team;
use crate::traffic::{Traffic, computed_alone};

/// Items in each spill: more than a team brings away within the default limit.
const ITEMS: usize = 100;

/// Without the page there are the same processes as in the bare barrier, and the launcher, which waits.
const WAYS: [&[&str]; 4] = [
    &["--log=off", "--no-page"],
    &["--log=summary", "--no-page"],
    &["--log=full", "--no-page"],
    &["--log=off"],
];

/// What several rounds gave for teams of one size.
#[derive(Default)]
struct Results {
    bare: Figures,
    alone: Figures,
    /// By [`WAYS`].
    real: [Figures; WAYS.len()],
    /// Real by bare of the same round, by [`WAYS`].
    share: [Figures; WAYS.len()],
    /// Real by real in the first of the [`WAYS`], without a log, of the same round.
    of_off: [Figures; WAYS.len()],
    /// Processor time of all processes per tick, µs, start and end included.
    bare_cpu: Figures,
    real_cpu: [Figures; WAYS.len()],
    share_cpu: [Figures; WAYS.len()],
    /// In the first of the [`WAYS`] by the others.
    off_cpu: [Figures; WAYS.len()],
    start_s: Figures,
    world_start_s: Figures,
    agent_resident: Figures,
    agent_share: Figures,
    world_resident: Figures,
}

/// Bare and real take turns, so that both see the same noise of the machine.
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

/// The default mission from start to end.
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
            // One bare run next to each real one: their ratio is of the same minute.
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
        let line = |what: &str, figures: &Figures| println!("| {what} | {figures} |");
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
            let what = format!("run {}, processor time per tick", way.join(" "));
            line(&(what.clone() + ", µs"), &self.real_cpu[index]);
            line(&format!("bare / {what}"), &self.share_cpu[index]);
            if index > 0 {
                line(&format!("--log=off / {what}"), &self.off_cpu[index]);
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
