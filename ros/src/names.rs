//! Names of robots as parts of ROS topics and frames.
//!
//! A part of a topic name contains letters, digits and underscores, does not begin with a digit, and has no repeated
//! underscores (ROS 2 design, "Topic and Service name mapping to DDS").

/// The namespace of topics about the whole team. No robot can have the name.
pub const TEAM: &str = "alliance";

/// A name that ROS cannot have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NameError {
    #[error("a ROS name cannot begin with a digit, as that of robot '{0}' does")]
    Digit(String),
    #[error("the topics of robot '{0}' would be among those of the team, /{TEAM}/…")]
    OfTeam(String),
    #[error("a ROS name needs a letter, and that of robot '{0}' has none")]
    Empty(String),
    #[error("robots '{0}' and '{1}' have the same ROS name '{2}'")]
    Collision(String, String, String),
}

/// Returns the ROS names of robots, in their order. Each character that ROS forbids becomes an underscore, and repeated
/// underscores become one.
///
/// # Errors
/// Returns the first name that ROS cannot have, or the first two names that become equal.
pub fn of_robots<'n>(robots: impl IntoIterator<Item = &'n str>) -> Result<Vec<String>, NameError> {
    let mut found: Vec<(&str, String)> = Vec::new();
    for robot in robots {
        let name = of_robot(robot)?;
        if let Some((other, _)) = found.iter().find(|(_, known)| *known == name) {
            let (other, robot) = ((*other).to_owned(), robot.to_owned());
            return Err(NameError::Collision(other, robot, name));
        }
        found.push((robot, name));
    }
    Ok(found.into_iter().map(|(_, name)| name).collect())
}

fn of_robot(robot: &str) -> Result<String, NameError> {
    let mut name = String::new();
    for c in robot.chars() {
        match c {
            c if c.is_ascii_alphanumeric() => name.push(c),
            // ROS hides names that begin with an underscore.
            _ if name.is_empty() || name.ends_with('_') => {}
            _ => name.push('_'),
        }
    }
    match name.chars().next() {
        None => Err(NameError::Empty(robot.to_owned())),
        Some(first) if first.is_ascii_digit() => Err(NameError::Digit(robot.to_owned())),
        Some(_) if name == TEAM => Err(NameError::OfTeam(robot.to_owned())),
        Some(_) => Ok(name),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forbidden_characters_become_single_underscores() {
        let names = ["blue", "r-2", "a--b_", "_x"];
        let expected = ["blue", "r_2", "a_b_", "x"].map(str::to_owned);
        assert_eq!(of_robots(names), Ok(expected.into()));
    }

    #[test]
    fn names_that_ros_cannot_have_are_refused() {
        let problems: Vec<String> = [
            &["blue", "3po"][..],
            &["alliance"],
            &["--"],
            &["r-2", "blue", "r_2"],
        ]
        .into_iter()
        .map(|names| of_robots(names.iter().copied()).unwrap_err().to_string())
        .collect();
        insta::assert_snapshot!(problems.join("\n"));
    }
}
