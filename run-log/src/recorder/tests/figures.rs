//! The result figures of run.json.

use super::*;
use scenario::mission::TeamFigures;

#[test]
fn figures_of_the_sample() {
    let (run, _) = log(LogLevel::Off, &sample());
    let result = run.result;
    assert_eq!(result.ticks, 3);
    assert_eq!(result.sim_time_ms, SimTime(150));
    assert_eq!(
        result.robots["blue"],
        RobotFigures {
            incarnations: 1,
            ticks_counted: 3,
            activations: 1,
            mission: Default::default(),
            messages_sent: 0,
            bytes_sent: 0,
            messages_received: 1,
            messages_lost: 1,
            messages_delayed: 0,
            messages_duplicate: 0,
        }
    );
    assert_eq!(result.robots["gold"].messages_sent, 2);
    assert_eq!(result.robots["gold"].bytes_sent, 250);
    assert_eq!(result.robots["green"].ticks_counted, 0);
}

#[test]
fn figures_of_the_mission_are_among_the_others_and_come_back() {
    let mut figures = TeamFigures::new(3);
    figures.mission.add("items.delivered", 1_u32);
    figures.mission.add("report_lateness_mean_ms", None::<f64>);
    figures.robots[1].add("reports_made", 1_u32);
    let ending = Ending {
        figures,
        ..Ending::default()
    };
    let (run, memory) = log_with(LogLevel::Off, &sample(), ending);
    let text = &memory.documents[&Document::Run];
    let json: serde_json::Value = serde_json::from_str(text).unwrap();
    let result = &json["result"];
    assert_eq!(result["items"]["delivered"], 1);
    assert!(result["report_lateness_mean_ms"].is_null());
    assert_eq!(result["robots"]["gold"]["reports_made"], 1);
    let vocabulary = scenario::testkit::vocabulary();
    assert_eq!(RunFile::parse(text.as_bytes(), &vocabulary).unwrap(), run);
}

/// Blue has completed one task, according to the counting column.
#[test]
fn completed_work_is_counted_if_the_mission_has_no_figures() {
    let ending = Ending {
        figures: TeamFigures::new(3),
        ..Ending::default()
    };
    let (run, _) = log_with(LogLevel::Off, &sample(), ending);
    let done = |robot: &str| run.result.robots[robot].mission.count("done");
    assert_eq!((done("blue"), done("gold")), (1, 0));
}
