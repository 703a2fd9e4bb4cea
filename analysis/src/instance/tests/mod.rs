mod formats;
mod frames;
mod maps;
mod refusals;
mod round_trip;
mod runs;

use missions::Registry;
use scenario::{Problem, Scenario};

use super::convert::{Converted, Options, convert};
use super::source::Source;

/// A problem of vehicle routing with time windows in Solomon's form, by this project: a depot and four customers.
pub const SOLOMON: &str = "\
small4

VEHICLE
NUMBER     CAPACITY
  2         50

CUSTOMER
CUST NO.  XCOORD.   YCOORD.    DEMAND   READY TIME  DUE DATE   SERVICE TIME

    0      40         50          0          0       300          0
    1      45         68         10         50       150         10
    2      45         70         30         60       160         10
    3      42         -6         10         0        120         20
    4      20         50         20         100      200         10
";

/// A problem in VRPLIB's form, by this project.
pub const VRPLIB: &str = "\
NAME : tiny-n4-k2
COMMENT : (by alliance-sim)
TYPE : CVRP
DIMENSION : 4
EDGE_WEIGHT_TYPE : EUC_2D
CAPACITY : 10
NODE_COORD_SECTION
1 30 40
2 37 52
3 49 49
4 52 64
DEMAND_SECTION
1 0
2 7
3 3
4 5
DEPOT_SECTION
1
-1
EOF
";

/// A problem with two depots in Cordeau's form, by this project: type 6, two vehicles per depot, three customers.
pub const CORDEAU: &str = "\
6 2 3 2
500 200
500 150
1 -29.73 64.14 2 12 1 2 1 2 399 525
2 -30.66 5.46 7 8 1 2 1 2 121 299
3 51.64 5.47 21 16 1 2 1 2 389 483
4 4.16 13.56 0 0 0 0 0 1000
5 21.39 17.11 0 0 0 0 0 900
";

/// A problem in Sadcher's form, by this project: two robots, three tasks, the last after the first.
pub const SADCHER: &str = r#"{
  "Q": [[1, 0], [1, 1]],
  "R": [[0, 0], [1, 0], [0, 1], [1, 1], [0, 0]],
  "T_e": [0, 50, 60, 70.0, 0],
  "T_t": [[0, 1], [1, 0]],
  "task_locations": [
    [30, 30],
    [10, 90],
    [90, 10],
    [90, 90],
    [50, 50]
  ],
  "precedence_constraints": [
    [1, 3]
  ]
}
"#;

pub const CSV: &str = "\
type,id,x_m,y_m,work_s,deadline_s,needs,value,after,skills,speed_m_s
robot,blue,1,1,,,,,,arm=1 camera=0.5,0.4
robot,gold,2,1,,,,,,arm,
,c1,4,5.5,10,120,camera,3,,,
task,c2,6,2,20,,arm=2,,c1,,
,c3,7,7,5,,,,c1 c2,,
";

pub const JSON: &str = r#"{
  "name": "two",
  "speed_m_s": 0.4,
  "tasks": [
    { "id": "a", "x_m": -2.5, "y_m": 3, "work_s": 8, "opens_s": 30, "deadline_s": 90 },
    { "id": "b", "x_m": 3, "y_m": 2, "work_s": 4, "kind": "arm", "priority": 2 }
  ],
  "robots": [{ "id": "blue", "x_m": 0, "y_m": 0 }]
}
"#;

pub const YAML: &str = "\
# A list of tasks alone.
- id: a
  x_m: 4
  y_m: 3.5
  work_s: 8
- {id: b, x_m: 6, y_m: 2, work_s: 4, deliver_to: [2, 2]}
";

/// Converts a text with the properties that today's mission supports.
pub fn import(name: &str, text: &str, options: &Options) -> Result<Converted, Problem> {
    let vocabulary = Registry::built_in().vocabulary();
    let source = Source { name, text };
    convert(source, options, &vocabulary)
}

/// Converts a text without robots, for a team of this size.
pub fn with_robots(name: &str, text: &str, robots: usize) -> Result<Converted, Problem> {
    let options = Options {
        robots: Some(robots),
        ..Options::default()
    };
    import(name, text, &options)
}

pub fn imported(name: &str, text: &str) -> Converted {
    import(name, text, &Options::default()).unwrap()
}

/// Returns the places of the points of a scenario, m.
pub fn places(scenario: &Scenario) -> Vec<[f32; 2]> {
    let points = missions::service::data::points(scenario, 1);
    points.iter().map(|point| point.at.to_array()).collect()
}
