//! The language of comments and documents, measured with the limits of the style guide.

use alliance_tests::testkit::tracked;

/// First words with which no comment of an item begins: they leave its noun open.
const PRONOUNS: &str = " what who whom whose which whether that those these this it its how where when why as of if all none one \
     nobody somebody whoever whatever ";

/// Words that present a thing as a person.
const PERSONS: &str = " who whom whoever whomever nobody somebody anybody everybody himself tell tells told hear hears heard say says \
     said ask asks asked obey obeys know knows believe believes want wants befall befalls forget forgets remember remembers ";

/// Pronouns that name no thing at all.
const VAGUE: &str = " whoever whomever whatever whichever nobody somebody anybody everybody ";

/// First words that end in `s` and are no verbs.
const NO_VERBS: &str =
    " this its as is those others always less status has was names robots runs whether ticks does ";

fn is_in(list: &str, word: &str) -> bool {
    list.contains(&format!(" {} ", word.to_lowercase()))
}

fn words(text: &str) -> Vec<&str> {
    let words = text.split(|c: char| !(c.is_ascii_alphabetic() || c == '\''));
    words.filter(|word| !word.is_empty()).collect()
}

#[derive(Default)]
struct Comments {
    words: usize,
    persons: usize,
    vague: usize,
    docs: usize,
    pronouns: usize,
    functions: usize,
    verbs: usize,
    short: Vec<String>,
}

impl Comments {
    fn read(&mut self, text: &str) {
        let lines: Vec<&str> = text.lines().map(str::trim).collect();
        let is_doc = |line: &str| line.starts_with("///");
        for (at, line) in lines.iter().enumerate() {
            let Some(comment) = line.strip_prefix("//") else {
                continue;
            };
            let all = words(comment);
            self.words += all.len();
            self.persons += all.iter().filter(|word| is_in(PERSONS, word)).count();
            self.vague += all.iter().filter(|word| is_in(VAGUE, word)).count();
            let begins = is_doc(line) && !(at > 0 && is_doc(lines[at - 1]));
            let Some(first) = all.first().filter(|_| begins) else {
                continue;
            };
            self.docs += 1;
            self.pronouns += usize::from(is_in(PRONOUNS, first));
            let rest = lines[at + 1..].iter();
            let item = rest
                .clone()
                .find(|line| !line.is_empty() && !is_doc(line) && !line.starts_with("#["));
            let is_one_line = !lines.get(at + 1).is_some_and(|line| is_doc(line));
            if is_one_line && all.len() <= 3 {
                self.short.push((*line).to_owned());
            }
            let is_function = item.is_some_and(|item| {
                let item = item
                    .trim_start_matches("pub(crate) ")
                    .trim_start_matches("pub(super) ");
                let item = item.trim_start_matches("pub ").trim_start_matches("const ");
                item.trim_start_matches("async ").starts_with("fn ")
            });
            if is_function {
                self.functions += 1;
                let lower = first.to_lowercase();
                let is_verb =
                    lower.ends_with('s') && !is_in(NO_VERBS, first) && !is_in(PRONOUNS, first);
                self.verbs += usize::from(is_verb);
            }
        }
    }
}

/// Compares `count` of `total` with a limit per thousand.
#[track_caller]
fn at_most(count: usize, total: usize, per_thousand: f64) {
    let measured = 1000.0 * count as f64 / total.max(1) as f64;
    assert!(
        measured <= per_thousand,
        "{measured:.2} per 1,000, at most {per_thousand}"
    );
}

#[test]
fn comments_are_plain_technical_english() {
    let sources = tracked("*.rs");
    if sources.is_empty() {
        // A source archive has no list of its files.
        return;
    }
    let mut comments = Comments::default();
    sources.iter().for_each(|text| comments.read(text));
    assert!(comments.docs > 3000, "{}", comments.docs);
    at_most(comments.pronouns, comments.docs, 80.0);
    at_most(
        comments.functions - comments.verbs,
        comments.functions,
        400.0,
    );
    at_most(comments.persons, comments.words, 2.0);
    at_most(comments.vague, comments.words, 0.2);
    assert_eq!(comments.short, Vec::<String>::new());
}

#[test]
fn documents_are_plain_technical_english() {
    let (mut total, mut persons, mut vague) = (0, 0, 0);
    for text in tracked("*.md") {
        // Code blocks and inline code contain names and output.
        let prose = text.split("```").step_by(2).collect::<String>();
        let prose = prose.split('`').step_by(2).collect::<String>();
        let all = words(&prose);
        total += all.len();
        persons += all.iter().filter(|word| is_in(PERSONS, word)).count();
        vague += all.iter().filter(|word| is_in(VAGUE, word)).count();
    }
    at_most(persons, total, 3.0);
    at_most(vague, total, 0.3);
}

/// Tables, code, pictures and comments may be longer.
#[test]
fn lines_of_documents_have_at_most_120_characters() {
    let is_free = |line: &str| {
        ["|", "![", "<!--"]
            .iter()
            .any(|start| line.trim().starts_with(start))
    };
    for text in tracked("*.md") {
        let prose = text.split("\n```").step_by(2).flat_map(str::lines);
        for line in prose.filter(|line| !is_free(line)) {
            assert!(line.chars().count() <= 120, "{line}");
        }
    }
}
