//! The robots of an instance: those of its file, its vehicles, or a number from the command line.

use scenario::{MAX_ROBOTS, Problem};

use super::model::Robot;
use super::source::{Loaded, Source};

/// Adds the robots of a file that states only their number, or none at all. `count` is the number from the command line.
///
/// # Errors
/// Returns an error if the file has robots and `count` is given, or if neither states a number.
pub fn add_robots(
    loaded: &mut Loaded,
    count: Option<usize>,
    source: Source<'_>,
) -> Result<(), Problem> {
    let depots = &loaded.depots;
    let robots = &mut loaded.instance.robots;
    if !robots.is_empty() {
        return match count {
            None => Ok(()),
            Some(_) => Err(Problem::with_source(
                "--robots",
                format!("{} has {} robots", source.name, robots.len()),
                "leave it out",
            )),
        };
    }
    let of_file = depots
        .iter()
        .map(|depot| depot.vehicles)
        .sum::<Option<usize>>();
    let Some(count) = count.or(of_file.filter(|count| *count > 0)) else {
        let what = "the file has no robots";
        return Err(Problem::with_source(
            source.name,
            what,
            "state their number with --robots",
        ));
    };
    if count > MAX_ROBOTS {
        let what = format!("{count} robots");
        let remedy = format!("use at most {MAX_ROBOTS} (--robots)");
        return Err(Problem::with_source(source.name, what, remedy));
    }
    // Without a number from the command line, each depot has its own vehicles. Otherwise the depots take turns.
    let fleets = depots.iter().flat_map(|depot| {
        let own = depot.vehicles.unwrap_or(0);
        std::iter::repeat_n(depot, own)
    });
    let starts: Vec<_> = match of_file {
        Some(of_file) if of_file == count => fleets.map(Some).collect(),
        _ if depots.is_empty() => vec![None; count],
        _ => depots.iter().cycle().take(count).map(Some).collect(),
    };
    robots.extend((1..).zip(starts).map(|(number, depot)| Robot {
        id: format!("v{number}"),
        x_m: depot.map(|depot| depot.x),
        y_m: depot.map(|depot| depot.y),
        capacity: depot.and_then(|depot| depot.capacity),
        ..Robot::default()
    }));
    Ok(())
}
