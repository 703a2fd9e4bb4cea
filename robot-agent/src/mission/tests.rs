//! A mission outside the built-in ones, as an example of the robots' part. Each place is a task: a robot touches it
//! once.

use proto::codec;
use proto::mission::{Action, Bytes, Payload, SensorReading};
use proto::team::{BroadcastContent, BulletinKind, BulletinSubject};
use proto::tick::{ManifestEntry, TickMessage};
use scenario::SetupFile;
use scenario::testkit::{DRILL, default_setup, unlike_robots, vocabulary};
use serde::{Deserialize, Serialize};

use super::*;
use crate::agent::{Agent, TeamConfig, Workspace};
use crate::registry::AgentRegistry;

const BLUE: RobotId = RobotId(0);
const GOLD: RobotId = RobotId(1);
/// The task of the behavior that grows impatient first.
const FASTEST: u16 = 3;

/// Uses the drill's tasks and behaviors.
const VISIT: MissionController = MissionController::new::<Visit>(DRILL);

#[derive(Clone, Debug)]
struct Visit {
    own: Vec<(BehaviorId, TaskId)>,
    /// The touched places, in ascending order.
    touched: Vec<u16>,
}

/// The place at which the robot is.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct At(Option<u16>);

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Touch(u16);

impl Visit {
    fn learn(&mut self, place: u16) {
        if let Err(index) = self.touched.binary_search(&place) {
            self.touched.insert(index, place);
        }
    }
}

impl TypedController for Visit {
    type SensorReading = At;
    type Action = Touch;
    type SharedKnowledge = Vec<u16>;
    type Bulletin = Touch;

    fn new(robot: RobotId, setup: &Setup) -> Self {
        let catalog = &setup.catalog;
        let own = catalog.behaviors_of(&setup.scenario.robots[robot.index()]);
        Self {
            own: own.map(|id| (id, catalog.sets[id.index()].task)).collect(),
            touched: Vec::new(),
        }
    }

    fn perceive(
        &mut self,
        _: &TypedStepInput<'_, Self>,
        received: &[ReceivedBroadcast<'_, Self>],
        perception: &mut Perception,
    ) {
        for broadcast in received {
            for place in broadcast.shared_knowledge.iter().flatten() {
                self.learn(*place);
            }
            if let Some(Touch(place)) = broadcast.bulletin {
                self.learn(place);
            }
        }
        let is_left = |task: TaskId| !self.touched.contains(&task.0);
        let own = self.own.iter();
        perception
            .applicable
            .extend(own.map(|(_, task)| is_left(*task)));
    }

    fn choices(
        &self,
        _: &TypedStepInput<'_, Self>,
        applicable: &[bool],
        choices: &mut Vec<Choice>,
    ) {
        for ((behavior, task), &applicable) in self.own.iter().zip(applicable) {
            choices.push(Choice {
                behavior: *behavior,
                task: *task,
                round: SimTime::ZERO,
                applicable,
                cost_s: Some(1.0),
                reward: 1.0,
                priority: 0,
                max_robots: 1,
            });
        }
    }

    fn act(
        &mut self,
        input: &TypedStepInput<'_, Self>,
        active: Option<BehaviorId>,
        output: &mut StepOutput,
    ) -> Option<Touch> {
        let (set, task) = *self.own.iter().find(|(id, _)| Some(*id) == active)?;
        if input.reading.0 != Some(task.0) {
            return None;
        }
        self.learn(task.0);
        let about = BulletinSubject {
            task,
            set,
            progress: 1,
        };
        let touched = bulletin(BulletinKind::Second, Some(about), &Touch(task.0));
        output.bulletins.push(touched);
        Some(Touch(task.0))
    }

    fn shared_knowledge(&self) -> Vec<u16> {
        self.touched.clone()
    }

    fn position(&self, _: Option<Vec2>) -> Option<Vec2> {
        None
    }
}

fn setup(allocator: &str) -> Setup {
    let mut setup = default_setup(1);
    setup.scenario.allocator = Some(allocator.to_owned());
    setup
}

fn agent(robot: RobotId, setup: &Setup) -> Agent {
    let registry = AgentRegistry::built_in().with_mission(VISIT);
    Agent::new(robot, 1, setup, &TeamConfig::new(setup, &registry).unwrap())
}

/// Creates a tick with the robot at a place.
fn message(tick: u64, at: Option<u16>) -> TickMessage {
    TickMessage {
        incarnation: 1,
        tick,
        now: SimTime(50 * tick),
        last_counted: None,
        manifest: Vec::new(),
        ground_truth: Vec::new(),
        held: Vec::new(),
        readings: Readings {
            mission: SensorReading::Open(Box::new(Bytes::encode(&At(at)).unwrap())),
            ..Readings::default()
        },
    }
}

/// Runs one step of an agent that receives these broadcasts, without loss.
fn step(agent: &mut Agent, mut message: TickMessage, received: &[Broadcast]) -> Workspace {
    message.manifest = vec![ManifestEntry {
        sender: BLUE,
        tick: 0,
        incarnation: 1,
        count: received.len() as u16,
        link: None,
    }];
    let mut space = Workspace::default();
    let received = received.iter().cloned();
    space.arrived.extend(received.map(Arc::new).map(Some));
    agent.step(&message, &mut space);
    space
}

fn shared_places(space: &Workspace) -> Vec<u16> {
    let mut shared_places = space
        .broadcasts
        .iter()
        .filter_map(|broadcast| match &broadcast.body {
            BroadcastContent::Heartbeat(heartbeat) => match &heartbeat.shared_knowledge {
                SharedKnowledge::Open(bytes) => Some(codec::decode(bytes).unwrap()),
                _ => None,
            },
            _ => None,
        });
    shared_places.next().unwrap()
}

#[test]
fn an_external_mission_senses_acts_and_broadcasts_in_its_own_types() {
    let setup = setup("nearest");
    let mut blue = agent(BLUE, &setup);
    let mut gold = agent(GOLD, &setup);
    let sent = step(&mut blue, message(0, Some(0)), &[]);
    let Action::Open(action) = sent.report.actuation.action else {
        panic!("{:?}", sent.report);
    };
    assert_eq!(action.decode::<Touch>().unwrap(), Touch(0));
    assert_eq!(shared_places(&sent), [0]);
    let bulletin = sent
        .broadcasts
        .iter()
        .find_map(|broadcast| match &broadcast.body {
            BroadcastContent::Bulletin(bulletin) => Some(bulletin),
            _ => None,
        });
    let bulletin = bulletin.unwrap();
    assert_eq!(bulletin.kind, BulletinKind::Second);
    let Payload::Open(bytes) = &bulletin.payload else {
        panic!("{bulletin:?}");
    };
    assert_eq!(codec::decode::<Touch>(bytes).unwrap(), Touch(0));

    // A teammate learns the place from either message and does not visit it.
    let is_heartbeat =
        |broadcast: &Broadcast| matches!(broadcast.body, BroadcastContent::Heartbeat(_));
    let (heartbeats, bulletins): (Vec<_>, Vec<_>) =
        sent.broadcasts.into_iter().partition(is_heartbeat);
    let mut other = agent(GOLD, &setup);
    assert_eq!(
        shared_places(&step(&mut gold, message(1, None), &heartbeats)),
        [0]
    );
    let received = step(&mut other, message(1, None), &bulletins);
    assert_eq!(shared_places(&received), [0]);
    let task_of = |id: BehaviorId| setup.catalog.sets[id.index()].task;
    assert_ne!(received.report.active.map(task_of), Some(TaskId(0)));
}

#[test]
fn alliance_treats_bulletins_as_messages_about_their_task() {
    let setup = setup("alliance");
    let mut blue = agent(BLUE, &setup);
    let mut tick = 0;
    let update = loop {
        let sent = step(&mut blue, message(tick, Some(FASTEST)), &[]);
        let bulletins = sent.broadcasts.into_iter();
        let mut bulletins =
            bulletins.filter(|broadcast| matches!(broadcast.body, BroadcastContent::Bulletin(_)));
        if let Some(update) = bulletins.next() {
            break update;
        }
        tick += 1;
        assert!(tick < 1000, "blue never becomes active");
    };
    // The first message about a task resets the motivation of an impatient teammate.
    let mut gold = agent(GOLD, &setup);
    step(&mut gold, message(tick, None), &[]);
    let BroadcastContent::Bulletin(bulletin) = &update.body else {
        unreachable!("the loop ends only with a bulletin");
    };
    // The message also informs about the touched place. A bulletin about another task shows the reset alone.
    let mut about_another = update.clone();
    about_another.body = BroadcastContent::Bulletin(Bulletin {
        about: bulletin.about.map(|about| BulletinSubject {
            task: TaskId(1),
            ..about
        }),
        ..bulletin.clone()
    });
    let received = step(&mut gold, message(tick + 1, None), &[about_another]);
    let reset =
        received.report.motivations.iter().find(|row| {
            setup.catalog.sets[row.set.index()].task == TaskId(1) && !row.impatience_reset
        });
    assert!(reset.is_some(), "{:?}", received.report.motivations);
}

/// The briefing from the bus is sufficient to create a controller.
#[test]
fn the_briefing_contains_the_abilities_of_all_robots() {
    let sent = serde_json::to_string(&unlike_robots().for_robots()).unwrap();
    let file: SetupFile = serde_json::from_str(&sent).unwrap();
    let setup = file.read(&vocabulary()).unwrap();
    setup.check().unwrap();
    let able = |robot: RobotId| {
        let spec = &setup.scenario.robots[robot.index()];
        let push_m_s = setup.scenario.body_of(spec).push_m_s;
        (push_m_s, spec.has_device("horn"), spec.skill("lift"))
    };
    assert_eq!(able(BLUE), (0.3, true, Some(2.0)));
    assert_eq!(able(GOLD), (0.1, false, Some(0.0)));
}
