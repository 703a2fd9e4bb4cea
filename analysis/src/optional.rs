//! Output formats that a program contains only if it was built with the feature of that name.

/// Checks that the program contains the format `name`.
pub fn check(name: &str, is_built_in: bool) -> anyhow::Result<()> {
    anyhow::ensure!(
        is_built_in,
        "--{name}: this program was built without this format; rebuild it with --features {name}"
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_format_is_refused_with_a_remedy() {
        assert!(check("mcap", true).is_ok());
        let error = check("mcap", false).expect_err("the format is missing");
        assert_eq!(
            error.to_string(),
            "--mcap: this program was built without this format; rebuild it with --features mcap"
        );
    }
}
