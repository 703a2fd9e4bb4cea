//! The utility of the published experiments (Jang, Shin, Tsourdos 2018). The source is the recorded data of figure 7.

/// Returns the utility of a task for one of `members` robots: max(0, r / log2(n/m + 1) · log2(p + 1)/p − cost), for n
/// robots, m tasks and a coalition of p members.
pub fn utility(reward: f64, cost_s: f64, members: usize, (robots, tasks): (usize, usize)) -> f64 {
    let [members, robots, tasks] = [members, robots, tasks].map(|count| count as f64);
    let share = libm::log2(members + 1.0) / members;
    (reward / libm::log2(robots / tasks + 1.0) * share - cost_s).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::utility;

    #[test]
    fn utilities_have_the_calculated_values() {
        // 21 robots at 3 tasks: log2(7 + 1) = 3. Three members: log2(3 + 1) / 3 = 2/3.
        let cases = [
            (900.0, 50.0, 1, 250.0),
            (900.0, 50.0, 3, 150.0),
            (900.0, 50.0, 7, 900.0 / 7.0 - 50.0),
            (900.0, 250.0, 3, 0.0),
        ];
        for (reward, cost_s, members, expected) in cases {
            let found = utility(reward, cost_s, members, (21, 3));
            assert!((found - expected).abs() < 1e-9, "{members}: {found}");
        }
    }
}
