//! Parts that a program contains only if it was built with their feature.

/// Checks that the program was built with `feature`, which the user's words `given` need.
///
/// # Errors
/// Returns an error with the words and the remedy.
pub fn check(given: &str, feature: &str, is_built_in: bool) -> anyhow::Result<()> {
    anyhow::ensure!(
        is_built_in,
        "{given}: this program was built without it; rebuild it with --features {feature}"
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_part_is_refused_with_the_given_words_and_a_remedy() {
        assert!(check("--external", "ros", true).is_ok());
        let error = check("--external", "ros", false).expect_err("the part is missing");
        assert_eq!(
            error.to_string(),
            "--external: this program was built without it; rebuild it with --features ros"
        );
    }
}
