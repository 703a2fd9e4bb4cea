//! Whole teams, without processes.

#[test]
fn push_keeps_the_laws_of_every_mission() {
    let two = "[push]\n[[push.bars]]\nx_m = 2\ny_m = 2\ngoal_x_m = 4\n[[push.bars]]\nx_m = 2\ny_m = 6\ngoal_x_m = 4\n";
    crate::testkit::mission(super::PARTS, two);
}

#[test]
#[ignore = "debug"]
fn debug_parker() {
    use std::sync::Arc;
    use alliance_proto::ids::RobotId;
    use alliance_proto::scenario::{Scenario, Setup};
    use alliance_proto::team::Broadcast;
    use alliance_proto::tick::{ManifestEntry, TickMessage};
    use alliance_proto::time::SimTime;
    use robot_agent::agent::{Agent, TeamConfig, Workspace};
    use world_server::world::World;
    let registry = crate::Registry::built_in();
    let vocabulary = registry.vocabulary();
    let builtin = vocabulary.builtin("parker-box").unwrap();
    let scenario = Scenario::parse(builtin.name, builtin.text, &vocabulary).unwrap();
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    let briefing = setup.briefing();
    let team = TeamConfig::of(&briefing, registry.agents()).unwrap();
    let num = |key: &str, d: f64| std::env::var(key).ok().and_then(|v| v.parse().ok()).unwrap_or(d);
    let (kill, add, babble, end) = (num("KILL", 1e9), num("ADD", 1e9), num("BABBLE", 1e9), num("END", 200.0));
    let mut agents: Vec<Option<Agent>> = (0..3).map(|r| (r < 2).then(|| Agent::new(RobotId(r), 1, &briefing, &team))).collect();
    let mut world = World::new(&setup, super::PARTS.world);
    let mut said: Vec<Vec<Broadcast>> = vec![Vec::new(); 3];
    let mut active = vec![None; 3];
    let mut tick = 0;
    loop {
        let now = SimTime(tick * 50);
        let t = now.as_secs_f64();
        if t >= end || world.mission().end(world.now()).is_some() { println!("END {t}"); break; }
        if t >= kill && agents[1].is_some() { agents[1] = None; println!("{t} KILL blue"); }
        if t >= add && agents[2].is_none() && t < add + 0.01 { world.add_robot(RobotId(2)).unwrap(); agents[2] = Some(Agent::new(RobotId(2), 1, &briefing, &team)); println!("{t} ADD genghis at {:?}", world.pose(RobotId(2))); }
        let heard = std::mem::replace(&mut said, vec![Vec::new(); 3]);
        let mut commands = vec![None; 3];
        for r in 0..3_usize {
            let Some(agent) = &mut agents[r] else { continue };
            let readings = world.readings(RobotId(r as u16));
            let others = (0..3_usize).filter(|o| *o != r && !heard[*o].is_empty());
            let message = TickMessage { incarnation: 1, tick, now, last_counted: tick.checked_sub(1),
                manifest: others.clone().map(|o| ManifestEntry { sender: RobotId(o as u16), tick: tick - 1, incarnation: 1, count: heard[o].len() as u16, link: None }).collect(),
                truth: Vec::new(), held: Vec::new(), readings };
            let mut space = Workspace::default();
            space.arrived = others.flat_map(|o| heard[o].iter()).map(|b| Some(Arc::new(b.clone()))).collect();
            agent.step(&message, &mut space);
            if space.report.active != active[r] {
                active[r] = space.report.active;
                println!("{t:.2} r{r} active {:?} at {:?}", active[r], world.pose(RobotId(r as u16)).position);
            }
            let mut command = space.report.actuation;
            if r == 2 && t >= babble { command = Default::default(); }
            commands[r] = Some(command);
            said[r] = space.broadcasts;
        }
        for event in world.step(&commands) {
            println!("{t:.2} {:?} {:?} {} {} {}", event.kind, event.robot, event.subject, event.reason, event.detail);
        }
        if let Err(v) = world.mission().holds(&world) { panic!("{t}: {v}"); }
        if tick % 10 == 0 && t > num("FROM", 1e9) && t < num("TO", 1e9) { println!("{t:.2} r0 {:?} {:.2} v {:.2}", world.pose(RobotId(0)).position, world.pose(RobotId(0)).heading_rad, world.speed_m_s(RobotId(0))); }
        if tick % 400 == 0 {
            let b = world.bars()[0];
            println!("{t:.2} bar {:?} {:?}; {:?}", b.from, b.to, (0..3).map(|r| world.pose(RobotId(r)).position).collect::<Vec<_>>());
        }
        tick += 1;
    }
}
