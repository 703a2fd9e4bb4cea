//! Processor time, which depends little on the load of the machine.

/// The clock ticks per second in which Linux counts processor time.
const HZ: f64 = 100.0;

/// Returns the processor time of all ended child processes that were waited for, in s.
pub fn of_ended_children() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    // The process name, in brackets, may contain spaces. The 14th and 15th field after it are the children's user and
    // system time.
    let (_, fields) = stat.rsplit_once(')').unwrap();
    let times = fields.split_whitespace().skip(13).take(2);
    times.map(|ticks| ticks.parse::<f64>().unwrap() / HZ).sum()
}
