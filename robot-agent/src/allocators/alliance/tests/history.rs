//! The memory of the history. The recomputation of motivations checks its contents.

use super::*;
use crate::allocators::alliance::history::History;

/// A team of 300 robots with 300 tasks has more records than 16 bits can count.
#[test]
fn many_tasks_of_many_teammates_are_kept_apart() {
    const MANY: u32 = 300;
    let switches = Preset::Team.switches();
    let mut history = History::new(MANY as usize);
    for task in 0..MANY {
        for robot in 0..MANY {
            let mut message = heartbeat(RobotId(robot), 1, ms(0), TaskState::Executing, ms(0), 0);
            if let BroadcastContent::Heartbeat(heartbeat) = &mut message.body {
                heartbeat.task = Some(TaskId(task));
            }
            let own_task = |task: TaskId| Some(task.index());
            assert!(history.receive(ms(0), &message, &switches, own_task));
        }
    }
    for task in [0_u32, 217, 218, 219, 299] {
        let about: Vec<u32> = history
            .records_of(task as usize)
            .iter()
            .map(|(robot, _)| robot.0)
            .collect();
        assert_eq!(about, (0..MANY).collect::<Vec<_>>(), "task {task}");
    }
}
