//! comm_received, its origin, releases, and the memory use of the history.

use proto::mission::Payload;
use proto::team::BulletinSubject;
use proto::team::{Bulletin, BulletinKind};

use super::*;
use crate::allocators::alliance::history::{History, Record};

use TaskState::{Executing, Released, Waiting};

/// Returns the record of gold about move(top).
fn gold(history: &History) -> &Record {
    let mut about = history.records_of(task(TOP).index()).iter();
    let (_, record) = about.find(|(teammate, _)| *teammate == GOLD).unwrap();
    record
}

struct Gold {
    history: History,
    switches: Switches,
    incarnation: u32,
    seq: u64,
}

impl Gold {
    fn new(switches: Switches) -> Self {
        Self {
            history: History::new(ALL.len()),
            switches,
            incarnation: 1,
            seq: 0,
        }
    }

    fn reports(&mut self, at: u64, state: TaskState, progress: u32) -> &mut Self {
        self.seq += 1;
        let mut message = heartbeat(GOLD, self.seq, ms(at), state, ms(0), TOP);
        message.incarnation = self.incarnation;
        if let BroadcastContent::Heartbeat(heartbeat) = &mut message.body {
            heartbeat.progress = progress;
        }
        self.history
            .receive(ms(at), &message, &self.switches, |task| Some(task.index()));
        self
    }

    fn restarts(&mut self) {
        self.incarnation += 1;
        self.seq = 0;
    }

    fn record(&self) -> &Record {
        gold(&self.history)
    }

    fn begins(&self, at: u64) -> bool {
        self.record().begins(ms(at))
    }

    fn until(&self, span: u64, at: u64) -> bool {
        self.record().until(ms(span), ms(at))
    }

    fn within(&self, span: u64, at: u64) -> bool {
        self.record().within(ms(span), ms(at))
    }
}

#[test]
fn progress_starts_the_history_anew() {
    let mut gold = Gold::new(Preset::Team.switches());
    assert!(gold.reports(1000, Executing, 0).begins(1000));
    assert!(!gold.reports(2000, Executing, 0).begins(2000));
    assert!(gold.until(30_000, 31_000));
    // A delivered item causes one more reset, and φ counts from here.
    assert!(gold.reports(31_000, Executing, 1).begins(31_000));
    assert!(!gold.until(30_000, 60_999));
    assert!(gold.until(30_000, 61_000));
    assert!(!gold.reports(32_000, Executing, 1).begins(32_000));
}

#[test]
fn literal_history_ignores_progress() {
    let mut gold = Gold::new(Preset::Par98.switches());
    gold.reports(1000, Executing, 0);
    assert!(!gold.reports(31_000, Executing, 1).begins(31_000));
    assert!(gold.until(30_000, 31_000));
}

#[test]
fn progress_reported_with_a_release_counts_from_the_next_message() {
    let mut gold = Gold::new(Preset::Team.switches());
    gold.reports(1000, Executing, 0);
    assert!(!gold.reports(5000, Released, 1).begins(5000));
    assert!(gold.reports(9000, Executing, 1).begins(9000));
}

#[test]
fn messages_in_the_step_of_the_report_belong_to_the_new_history() {
    let mut gold = Gold::new(Preset::Team.switches());
    gold.reports(1000, Executing, 0);
    gold.reports(5000, Executing, 0);
    assert!(gold.reports(5000, Released, 1).begins(5000));
    assert!(!gold.reports(9000, Executing, 1).begins(9000));
}

#[test]
fn a_claim_released_before_the_report_in_the_same_step_belongs_to_the_new_history() {
    let mut gold = Gold::new(Preset::Team.switches());
    gold.reports(5000, Executing, 0).reports(5000, Released, 0);
    assert!(gold.reports(5000, Released, 1).begins(5000));
    assert!(!gold.within(5000, 5000));
    assert!(!gold.reports(9000, Executing, 1).begins(9000));
}

#[test]
fn new_stints_releases_and_incarnations_do_not_move_the_origin() {
    let mut gold = Gold::new(Preset::Team.switches());
    gold.reports(1000, Executing, 3);
    gold.reports(2000, Released, 3);
    assert!(!gold.reports(3000, Executing, 3).begins(3000));
    for incarnation in 0..100 {
        // A flapping robot starts and claims, but never works.
        gold.restarts();
        let at = 4000 + 1000 * incarnation;
        assert!(!gold.reports(at, Executing, 0).begins(at));
    }
    assert!(gold.until(30_000, 31_000));
}

#[test]
fn first_progress_of_a_new_incarnation_is_progress() {
    let mut gold = Gold::new(Preset::Team.switches());
    gold.reports(1000, Executing, 3);
    gold.restarts();
    assert!(!gold.reports(2000, Executing, 0).begins(2000));
    assert!(gold.reports(3000, Executing, 1).begins(3000));
}

#[test]
fn release_ends_the_window_at_once_and_the_next_message_opens_it() {
    let mut gold = Gold::new(Preset::Team.switches());
    gold.reports(1000, Executing, 0);
    assert!(gold.within(5000, 1000));
    gold.reports(1500, Released, 0);
    assert!(!gold.within(5000, 1500));
    assert!(!gold.record().within_for_acquiescence(ms(5000), ms(1500)));
    gold.reports(2000, Executing, 0);
    assert!(gold.within(5000, 2000));
}

#[test]
fn a_wish_counts_in_acquiescence_and_elsewhere_if_the_switch_is_set() {
    for counts in [false, true] {
        let mut gold = Gold::new(Switches {
            waiting_counts: counts,
            ..Preset::Team.switches()
        });
        gold.reports(1000, Waiting, 0);
        assert!(gold.record().within_for_acquiescence(ms(5000), ms(1000)));
        assert_eq!(gold.within(5000, 1000), counts);
        assert_eq!(gold.begins(1000), counts);
        assert_eq!(gold.reports(2000, Executing, 0).begins(2000), !counts);
    }
}

#[test]
fn a_position_update_counts_for_its_task_and_carries_progress() {
    let mut gold = Gold::new(Preset::Team.switches());
    gold.reports(1000, Executing, 0);
    let mut update = heartbeat(GOLD, 2, ms(4000), Executing, ms(0), TOP);
    update.body = position_update(1);
    gold.history
        .receive(ms(4000), &update, &gold.switches, |task| Some(task.index()));
    assert!(gold.within(5000, 8999));
    assert!(gold.begins(4000));
}

fn position_update(progress: u32) -> BroadcastContent {
    let about = BulletinSubject {
        task: task(TOP),
        set: set(TOP),
        progress,
    };
    BroadcastContent::Bulletin(Bulletin {
        kind: BulletinKind::First,
        about: Some(about),
        payload: Payload::Open(Vec::new()),
    })
}

#[test]
fn idle_and_overtaken_messages_do_not_count() {
    let switches = Preset::Team.switches();
    let mut history = History::new(ALL.len());
    let idle = heartbeat(GOLD, 1, ms(0), TaskState::Idle, ms(0), TOP);
    history.receive(ms(0), &idle, &switches, |task| Some(task.index()));
    assert_eq!(history.records_of(task(TOP).index()).iter().count(), 0);

    let executing = heartbeat(GOLD, 2, ms(0), Executing, ms(0), TOP);
    let released = heartbeat(GOLD, 3, ms(0), Released, ms(0), TOP);
    history.receive(ms(500), &released, &switches, |task| Some(task.index()));
    history.receive(ms(1000), &executing, &switches, |task| Some(task.index()));
    let record = gold(&history);
    assert!(!record.within(ms(5000), ms(1000)));
}

/// A team of 300 robots with 300 tasks has more records than 16 bits can count.
#[test]
fn many_tasks_of_many_teammates_are_kept_apart() {
    const MANY: u16 = 300;
    let switches = Preset::Team.switches();
    let mut history = History::new(usize::from(MANY));
    for task in 0..MANY {
        for robot in 0..MANY {
            let mut message = heartbeat(RobotId(robot), 1, ms(0), Executing, ms(0), 0);
            if let BroadcastContent::Heartbeat(heartbeat) = &mut message.body {
                heartbeat.task = Some(TaskId(task));
            }
            let own_task = |task: TaskId| Some(task.index());
            assert!(history.receive(ms(0), &message, &switches, own_task));
        }
    }
    for task in [0_u16, 217, 218, 219, 299] {
        let about: Vec<u16> = history
            .records_of(usize::from(task))
            .iter()
            .map(|(robot, _)| robot.0)
            .collect();
        assert_eq!(about, (0..MANY).collect::<Vec<_>>(), "task {task}");
    }
}

#[test]
fn memory_does_not_grow_with_the_mission() {
    let mut engine = engine(BLUE, &setup(Preset::Team, 3, 50));
    let mut shape_after = |steps: std::ops::Range<u64>| {
        for step in steps {
            let now = ms(50 * step);
            let received: Vec<_> = [GOLD, GREEN]
                .into_iter()
                .flat_map(|sender| {
                    (0..4).map(move |index| {
                        let state = [Executing, Waiting, Released][(step % 3) as usize];
                        heartbeat(sender, 4 * step + index, now, state, now, index as usize)
                    })
                })
                .collect();
            step_of(
                &mut engine,
                &StepInput {
                    now,
                    received: &shared(&received),
                    applicable: &ALL,
                    progressed: &[],
                },
            );
        }
        // Apart from the digits of times and counts, the debug text keeps its shape while the state holds the same
        // entries.
        let printed = format!("{engine:?}");
        printed.matches("first:").count() + printed.matches("received:").count()
    };
    let early = shape_after(1..31);
    assert_eq!(shape_after(31..30_001), early);
    assert!(early <= 2 * 4 * 2);
}
