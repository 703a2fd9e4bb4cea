//! Formats that a program has only if it is built with a feature of their name.

/// Refuses the argument of that name in a program that is built without it.
///
/// # Errors
/// How to get a program that has it.
pub fn check(name: &str, is_there: bool) -> anyhow::Result<()> {
    anyhow::ensure!(
        is_there,
        "--{name}: this program is built without it; build it with --features {name}"
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_lacks_a_format_is_told_how_to_get_it() {
        assert!(check("mcap", true).is_ok());
        let error = check("mcap", false).expect_err("it is not there");
        assert_eq!(
            error.to_string(),
            "--mcap: this program is built without it; build it with --features mcap"
        );
    }
}
