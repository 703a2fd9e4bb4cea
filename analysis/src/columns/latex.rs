//! Tables of results for LaTeX, in the style of the package `booktabs`.

use std::fmt::Write;

/// A cell of a table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LatexCell {
    pub text: String,
    /// `true` for the best of its column.
    pub is_best: bool,
}

impl LatexCell {
    #[must_use]
    pub fn new(text: impl Into<String>) -> Self {
        Self {
            text: text.into(),
            is_best: false,
        }
    }
}

/// Returns a table whose first column is aligned to the left and whose other columns are aligned to the right. The best
/// cells are bold. `note` becomes the caption, and `name` the label `tab:NAME`.
#[must_use]
pub fn table(name: &str, note: &str, heads: &[String], rows: &[Vec<LatexCell>]) -> String {
    let columns = "r".repeat(heads.len().saturating_sub(1));
    let heads: Vec<String> = heads.iter().map(|head| escaped(head)).collect();
    let mut text = format!(
        "% Needs \\usepackage{{booktabs}}.\n\\begin{{table}}\n\\centering\n\\caption{{{}}}\n\\label{{tab:{name}}}\n\\begin{{tabular}}{{l{columns}}}\n\\toprule\n{} \\\\\n\\midrule\n",
        escaped(note),
        heads.join(" & ")
    );
    for row in rows {
        let cells = row.iter().map(|cell| match cell.is_best {
            true => format!("\\textbf{{{}}}", escaped(&cell.text)),
            false => escaped(&cell.text),
        });
        let cells: Vec<String> = cells.collect();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{} \\\\", cells.join(" & "));
    }
    text + "\\bottomrule\n\\end{tabular}\n\\end{table}\n"
}

/// Returns a text in which no character has a meaning for LaTeX.
fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for letter in text.chars() {
        match letter {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => {
                escaped.push('\\');
                escaped.push(letter);
            }
            '\\' => escaped += "\\textbackslash{}",
            '~' => escaped += "\\textasciitilde{}",
            '^' => escaped += "\\textasciicircum{}",
            '–' => escaped += "--",
            '−' => escaped += "$-$",
            '×' => escaped += "$\\times$",
            _ => escaped.push(letter),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_with_escaped_texts_and_a_bold_cell() {
        let best = LatexCell {
            is_best: true,
            ..LatexCell::new("338 [330 – 347]")
        };
        let heads = ["allocator", "drop_p 20 %"].map(str::to_owned);
        let rows = [
            vec![LatexCell::new("cbba"), best],
            vec![LatexCell::new("l-alliance"), LatexCell::default()],
        ];
        insta::assert_snapshot!(table("means", "Means & intervals", &heads, &rows), @r"
        % Needs \usepackage{booktabs}.
        \begin{table}
        \centering
        \caption{Means \& intervals}
        \label{tab:means}
        \begin{tabular}{lr}
        \toprule
        allocator & drop\_p 20 \% \\
        \midrule
        cbba & \textbf{338 [330 -- 347]} \\
        l-alliance &  \\
        \bottomrule
        \end{tabular}
        \end{table}
        ");
    }
}
