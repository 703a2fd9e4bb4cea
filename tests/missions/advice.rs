//! Commands that the program prints as advice, in its output and on its pages: each runs as printed. All paths contain
//! a blank.

use std::collections::BTreeSet;
use std::process::Command;

use alliance_tests::harness::{Arguments, Finished, Lab, join, wait_until};
use alliance_tests::testkit::tracked;

/// A scenario of 5 s.
const SHORT: &str = "limit_s = 5.0\n";

const COMPARISON: &str = "seeds = 2\nscenario = \"short one.toml\"\n\
     [grid]\nallocator = [\"cbba\", \"nearest\"]\n";

const TUNING: &str = "
[missions.one]
scenario = 'short one.toml'
[faults.none]
[tune]
budget = 20
seeds_per_candidate = 1
training = { from = 11, to = 40 }
selection = [51, 52]
finalists = 1
test = 2
[tune.parameters.alliance]
alliance.defaults.fast_impatience = { from = 20.0, to = 200.0, log = true }
";

/// A cluster file without keys.
const CLUSTER: &str = "
scenario = 'short one.toml'
listen = 'tls/127.0.0.1:17451'
keys = 'new keys'
world = 'h1'
hosts = [{ name = 'h1', robots = ['blue', 'green'] }, { name = 'h2', robots = ['gold'] }]
";

/// The labels of advice at the start of a line.
const LABELS: [&str; 5] = ["", "next", "repeat", "scenario", "#"];

/// The commands that are at least printed.
const EXPECTED: &str = "\
alliance clock resume --run …
alliance cluster keys 'my cluster.toml'
alliance compare --merge 'out/shards of compare'
alliance compare 'my comparison.toml' --cell 0
alliance compare 'my comparison.toml' --scenario 0
alliance report 'out/a run'
alliance run
alliance run 'out/a tuning/tuned.toml'
alliance sweep --merge 'out/shards of sweep'
alliance watch 'out/a run'
alliance watch 'out/no log'";

/// A lab with the commands printed so far.
struct Advice {
    lab: Lab,
    commands: BTreeSet<String>,
}

impl Advice {
    /// Runs a command and collects the commands that it prints.
    fn run(&mut self, arguments: impl Arguments) -> Finished {
        let finished = self.lab.run(arguments);
        self.collect(&finished.stdout);
        self.collect(&finished.stderr);
        finished
    }

    fn collect(&mut self, text: &str) {
        let text = text.replace("<code>", "`").replace("</code>", "`");
        let quoted = text.split('`').skip(1).step_by(2);
        let quoted = quoted.filter(|part| is_command(part));
        self.commands.extend(quoted.map(str::to_owned));
        for line in text.lines() {
            let Some((label, command)) = line.split_once("alliance ") else {
                continue;
            };
            let (label, command) = (label.trim(), format!("alliance {command}"));
            if (LABELS.contains(&label) || label.ends_with("with:")) && is_command(&command) {
                self.commands.insert(command);
            }
        }
    }

    /// Runs each collected command. One that serves a page or waits for others is accepted and ended.
    fn assert_all_run(&self) {
        for command in &self.commands {
            let mut process = self.lab.start(&words(command)[1..]);
            let mut serves = false;
            wait_until(command, || {
                let stderr = process.stderr();
                serves = stderr.contains("http://") || stderr.contains("waiting for");
                serves || !process.is_running()
            });
            if !serves {
                let finished = process.wait();
                let status = finished.status.code();
                let is_accepted = status.is_some_and(|status| status != 2);
                assert!(is_accepted, "{command}: {finished:?}");
            }
        }
    }
}

/// Returns whether a text is a command. An error starts with the command and a colon.
fn is_command(text: &str) -> bool {
    text.starts_with("alliance ") && !text.split(' ').take(4).any(|word| word.ends_with(':'))
}

/// Returns whether a text contains a word in capitals in place of a value.
fn has_placeholder(text: &str) -> bool {
    let is_capital = |letter: char| letter.is_ascii_uppercase();
    let mut words = text.split(|letter: char| !letter.is_alphabetic());
    words.any(|word| word.len() > 1 && word.chars().all(is_capital))
}

/// Splits a command as a shell does.
fn words(command: &str) -> Vec<String> {
    let split = format!("printf '%s\\0' {command}");
    let output = Command::new("sh").args(["-c", &split]).output().unwrap();
    assert!(output.status.success(), "{command}: {output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    text.split_terminator('\0').map(str::to_owned).collect()
}

/// Waits that take several machines or seconds, pages and errors contain commands, too. So the sources are checked.
#[test]
fn no_printed_command_has_a_placeholder() {
    let mut commands = 0;
    for text in tracked("*.rs") {
        let is_code = |line: &&str| !line.trim().starts_with("//");
        let code: Vec<&str> = text.lines().filter(is_code).collect();
        let code = code.join("\n").replace("code { \"", "code { \"`");
        for (_, rest) in code
            .match_indices("`alliance ")
            .map(|(at, _)| code.split_at(at + 1))
        {
            let command = rest.split(['`', '"']).next().unwrap_or_default();
            assert!(!has_placeholder(command), "{command}");
            commands += 1;
        }
    }
    assert!(commands > 20, "{commands} commands");
}

#[test]
fn every_printed_command_runs_as_printed() {
    let lab = Lab::new();
    lab.write("short one.toml", SHORT);
    lab.write("my comparison.toml", COMPARISON);
    lab.write("my tuning.toml", TUNING);
    lab.write("my cluster.toml", CLUSTER);
    let commands = BTreeSet::new();
    let mut advice = Advice { lab, commands };
    for (out, level) in [("out/a run", "full"), ("out/no log", "off")] {
        let run = ["run", "short one.toml", "--out", out, "--log", level];
        // The mission is not complete after 5 s.
        advice.run(join(run, "--in-process")).expect(1);
        advice.run(["replay", out]).expect(0);
        advice.run(["report", out]).expect(0);
    }
    for study in ["sweep", "compare"] {
        let plan = [study, "my comparison.toml", "--out"];
        let shards = format!("out/shards of {study}");
        for shard in ["0/2", "1/2"] {
            let part = join(plan, [&*shards, "--shard", shard]);
            advice.run(part).expect(0);
        }
        advice.run(join(plan, [format!("out/a {study}")])).expect(0);
    }
    let merge = ["compare", "--merge", "out/shards of compare"];
    advice.run(merge).expect(0);
    for page in ["out/a sweep/summary.html", "out/a compare/comparison.html"] {
        advice.collect(&advice.lab.text(page));
    }
    let tune = ["tune", "my tuning.toml", "--out", "out/a tuning"];
    advice.run(tune).expect(0);
    advice.run("status").expect(3);
    advice.run("fault kill gold").expect(3);
    advice.run(["cluster", "up", "my cluster.toml"]).expect(2);
    let held = ["run", "short one.toml", "--paused", "--out", "out/held"];
    let mut held = advice.lab.start(held);
    held.wait_for_stderr("clock resume --run");
    advice.collect(&held.stderr());

    advice.assert_all_run();
    for command in EXPECTED.lines() {
        // The name of the live run differs.
        let is_same = |printed: &String| match command.strip_suffix('…') {
            Some(start) => printed.starts_with(start),
            None => printed == command,
        };
        let is_printed = advice.commands.iter().any(is_same);
        assert!(is_printed, "{command} is not printed");
    }
}
