//! The entries of all commands: examples and exit statuses.

/// The headings of `alliance --help` with their commands.
pub const HEADINGS: [(&str, &[&str]); 6] = [
    ("Run", &["run", "watch", "fault", "clock", "status"]),
    ("Results", &["replay", "diff", "report", "export"]),
    (
        "Studies",
        &["sweep", "compare", "tune", "hunt", "bench", "check"],
    ),
    ("Content", &["import", "list"]),
    ("Processes and machines", &["cluster"]),
    ("Shell", &["generate"]),
];

/// The part of a command's description that clap does not have.
pub(super) struct Entry {
    /// The words after `alliance`, such as "cluster up".
    pub words: &'static str,
    /// Command lines, each with its purpose after a `#`.
    pub examples: &'static [&'static str],
    /// Exit statuses, each with its meaning. Empty if the parent's statuses apply.
    pub exit: &'static [&'static str],
}

const fn entry(
    words: &'static str,
    examples: &'static [&'static str],
    exit: &'static [&'static str],
) -> Entry {
    Entry {
        words,
        examples,
        exit,
    }
}

const CONTROL: &[&str] = &[
    "0 The run applied the command.",
    "2 An argument is invalid, several runs are live, or the run refused the command.",
    "3 No run is live, or it does not answer.",
];

const PRINTED: &[&str] = &[
    "0 The list is complete.",
    "2 An argument or a name is invalid.",
    "3 A folder cannot be read, or the output cannot be written.",
];

const RESUMABLE: &str = "130 The command was interrupted. The same command resumes it.";

const STUDY: &[&str] = &[
    "0 All runs are done. Missions may be incomplete.",
    "1 Runs failed.",
    "2 An argument or the plan is invalid, or runs are missing.",
    "3 A file cannot be written.",
    RESUMABLE,
];

const MEMBER: &[&str] = &[
    "0 The run is over, or the process was interrupted.",
    "2 An argument, a key file or a name is invalid.",
    "3 The world refused the process, or the connection failed.",
];

/// All commands except the faults that missions declare.
pub(super) const ENTRIES: &[Entry] = &[
    entry(
        "",
        &[
            "alliance run --open # run the default mission and watch it",
            "alliance report # figures and metrics of the newest run",
            "alliance list scenarios # the built-in scenarios",
        ],
        &[
            "0 Success.",
            "1 A negative result: an incomplete mission, a difference, failed runs.",
            "2 An argument or a file is invalid.",
            "3 A process, the network or the output failed.",
        ],
    ),
    entry(
        "run",
        &[
            "alliance run --open # the default mission, on its page",
            "alliance run mine.toml --seed 7 --allocator cbba # your own scenario",
            "alliance run --from runs/latest --at 60s --faults none # the run again, then no faults",
        ],
        &[
            "0 The mission is complete.",
            "1 The mission is incomplete, or --check found a violation.",
            "2 The scenario, a parameter or an argument is invalid.",
            "3 A process, the bus or an export failed.",
            "130 The run was interrupted. Its log is complete.",
        ],
    ),
    entry(
        "watch",
        &[
            "alliance watch # the live run, or else the newest finished one",
            "alliance watch runs/latest --open # a finished run, in a browser",
        ],
        &[
            "0 The run is over, or the command was interrupted.",
            "2 The folder contains no run, or the port is in use.",
            "3 No run is live, or the connection failed.",
        ],
    ),
    entry(
        "fault",
        &[
            "alliance fault kill gold --at 60s --for 20s # restarts after 20 s",
            "alliance fault drop --p 0.3 --from gold # lose 30 % of its messages",
            "alliance fault clear # end all faults",
        ],
        CONTROL,
    ),
    entry(
        "fault list",
        &["alliance fault list # id, phase and effect of each fault"],
        &[],
    ),
    entry(
        "fault clear",
        &[
            "alliance fault clear f1 # end the fault f1",
            "alliance fault clear # end all",
        ],
        &[],
    ),
    entry(
        "clock",
        &[
            "alliance clock pause # hold the run",
            "alliance clock step 20 # run 20 ticks, then hold",
            "alliance clock speed 5x # five times real time",
        ],
        CONTROL,
    ),
    entry("clock pause", &["alliance clock pause # hold the run"], &[]),
    entry(
        "clock resume",
        &["alliance clock resume # continue at the chosen speed"],
        &[],
    ),
    entry(
        "clock step",
        &["alliance clock step 20 # run 20 ticks, then hold"],
        &[],
    ),
    entry(
        "clock speed",
        &[
            "alliance clock speed 5x # five times real time",
            "alliance clock speed max # full speed",
        ],
        &[],
    ),
    entry(
        "status",
        &[
            "alliance status # once",
            "alliance status --watch 2 # every 2 s until the run is over",
            "alliance status --json # for programs",
        ],
        CONTROL,
    ),
    entry(
        "replay",
        &[
            "alliance replay # the newest run",
            "alliance replay runs/first --out again # with the log of the replay",
        ],
        &[
            "0 The replay is identical.",
            "1 The replay differs.",
            "2 The folder contains no run that can be replayed.",
        ],
    ),
    entry(
        "diff",
        &[
            "alliance diff runs/first # the first difference from the newest run",
            "alliance diff a b --json # for programs",
        ],
        &[
            "0 The runs are identical.",
            "1 The runs differ.",
            "2 A folder contains no run.",
        ],
    ),
    entry(
        "report",
        &[
            "alliance report # the newest run",
            "alliance report runs/first --from 60s --to 3min --only gantt # one figure",
            "alliance report runs/first runs/latest # two runs side by side",
        ],
        &[
            "0 The report is written.",
            "2 The folder or an option is invalid.",
        ],
    ),
    entry(
        "export",
        &[
            #[cfg(feature = "mcap")]
            "alliance export runs/first --mcap=run.mcap # for Foxglove",
            #[cfg(not(feature = "mcap"))]
            "alliance export runs/first --parquet # as tables for notebooks",
            "alliance export --html=run.html # the page of the newest run, without a server",
            "alliance export --video run.gif --speed 10x # a film for slides",
        ],
        &[
            "0 The files are written.",
            "1 This program does not reproduce the run exactly.",
            "2 The folder contains no run, or a file cannot be written.",
        ],
    ),
    entry(
        "sweep",
        &[
            "alliance sweep mine.toml # all runs, on all cores",
            "alliance sweep mine.toml --shard 0/4 # one of four jobs",
            "alliance sweep --merge job0 job1 job2 job3 # the results of all jobs",
        ],
        STUDY,
    ),
    entry(
        "compare",
        &[
            "alliance compare mine.toml # all runs, then the comparison",
            "alliance compare mine.toml --cell 3 # the runs of cell 3 again, as CSV",
        ],
        STUDY,
    ),
    entry(
        "tune",
        &[
            "alliance tune mine.toml # a plan with a table [tune]",
            "alliance tune mine.toml --out tuned --jobs 4 # four runs at a time",
            "alliance tune mine.toml --merge part-0 part-1 # the journals of two shards",
        ],
        &[
            "0 The search is complete.",
            "2 An argument or the plan is invalid.",
            "3 A file cannot be written.",
            RESUMABLE,
        ],
    ),
    entry(
        "hunt",
        &[
            "alliance hunt mine.toml # search, then shrink what was found",
            "alliance hunt mine.toml --dry-run # the number of runs and their time",
        ],
        &[
            "0 No violation was found, or the plan maximizes the PAR2 time.",
            "1 A violation was found.",
            "2 An argument or the plan is invalid.",
            "3 A file cannot be written.",
            RESUMABLE,
        ],
    ),
    entry(
        "bench",
        &[
            "alliance bench v1 # all allocators",
            "alliance bench v1 --controller mine=mine.py --out mine # your own",
            "alliance bench check bench/v1/result.json # repeats 1 %",
        ],
        &[
            "0 The result is written.",
            "1 Runs failed, so there is no result.",
            "2 An argument is invalid, or the folder belongs to other runs.",
            "3 A file cannot be written.",
            RESUMABLE,
        ],
    ),
    entry(
        "bench check",
        &[
            "alliance bench check bench/v1/result.json # content, and 1 % of the runs",
            "alliance bench check theirs.json --share 100 # all runs again",
        ],
        &[
            "0 The content is complete, and all repeated runs are equal.",
            "1 A repeated run differs.",
            "2 The file is invalid, was changed, or belongs to another suite or program.",
            "130 The command was interrupted.",
        ],
    ),
    entry(
        "check",
        &[
            "alliance check mine.toml # times of takeover, and warnings",
            "alliance check mine.toml --json # for programs",
        ],
        &[
            "0 The scenario is valid, with or without warnings.",
            "2 The scenario is invalid.",
        ],
    ),
    entry(
        "import",
        &[
            "alliance import c101.txt --out c101.toml # vehicle routing",
            "alliance import tasks.csv --robots 5 --map hall.yaml --out hall.toml # with walls",
            "alliance import problem.json > problem.toml # tasks, robots and skills",
        ],
        &[
            "0 The scenario is written.",
            "2 The file or an argument is invalid.",
            "3 The output cannot be written.",
        ],
    ),
    entry(
        "list",
        &[
            "alliance list cbba # the parameters of an allocator",
            "alliance list scenarios reference > mine.toml # a start for your own",
            "alliance list runs # live and recorded runs",
        ],
        PRINTED,
    ),
    entry(
        "list scenarios",
        &[
            "alliance list scenarios # names and descriptions",
            "alliance list scenarios reference > mine.toml # every key, explained",
        ],
        &[],
    ),
    entry(
        "list allocators",
        &[
            "alliance list allocators # names and descriptions",
            "alliance list allocators cbba # its parameters",
        ],
        &[],
    ),
    entry(
        "list missions",
        &[
            "alliance list missions # names and descriptions",
            "alliance list missions service # the keys of its scenario section",
        ],
        &[],
    ),
    entry(
        "list runs",
        &[
            "alliance list runs # live runs, and those in runs/",
            "alliance list runs archive --json # those in archive/, for programs",
        ],
        &[],
    ),
    entry(
        "cluster",
        &[
            "alliance cluster keys lab.toml # certificates and secrets, once",
            "alliance cluster up lab.toml # the world and this host's robots",
            "alliance cluster agent --robot gold # one robot of a live run",
        ],
        MEMBER,
    ),
    entry(
        "cluster up",
        &[
            "alliance cluster up lab.toml # waits for the other hosts",
            "alliance cluster up lab.toml --start 'ssh {at} alliance' # starts them",
        ],
        &[
            "0 The mission is complete.",
            "1 The mission is incomplete.",
            "2 The cluster file, a key file or an argument is invalid.",
            "3 A process, a host or the network failed.",
        ],
    ),
    entry(
        "cluster host",
        &[
            "alliance cluster host --name h2 --connect tls/10.0.0.1:7447 --keys h2 # one run after another",
        ],
        &[],
    ),
    entry(
        "cluster router",
        &[
            "alliance cluster router --name h2 --connect tls/10.0.0.1:7447 --keys h2 # robots by hand",
        ],
        &[],
    ),
    entry(
        "cluster check",
        &[
            "alliance cluster check lab.toml # the world's machine",
            "alliance cluster check lab.toml --name h2 --keys h2 # another host",
        ],
        &[
            "0 The machine is ready.",
            "1 A check failed.",
            "2 The cluster file or an argument is invalid.",
        ],
    ),
    entry(
        "cluster keys",
        &[
            "alliance cluster keys lab.toml # for a cluster file",
            "alliance cluster keys mine.toml --at 10.0.0.1 --out keys # for a world by hand",
        ],
        &[
            "0 The keys are written.",
            "2 The file or an argument is invalid, or the folder exists.",
            "3 The folder cannot be written.",
        ],
    ),
    entry(
        "cluster world",
        &[
            "alliance cluster world --speed 1x # waits for the robots",
            "alliance cluster world --listen tls/10.0.0.1:7447 --keys keys # on a network",
        ],
        &[
            "0 The mission is complete.",
            "1 The mission is incomplete.",
            "2 The scenario, a key file or an argument is invalid.",
            "3 The bus or the log failed.",
        ],
    ),
    entry(
        "cluster ros",
        &[
            "alliance cluster ros # the newest run, from now on",
            "alliance cluster ros runs/mine --domain 7 # to nodes with ROS_DOMAIN_ID=7",
        ],
        &[
            "0 The run is over, or the process was interrupted.",
            "2 An argument is invalid, or the run cannot be published.",
            "3 The log cannot be read, or the connection failed.",
        ],
    ),
    entry(
        "cluster foxglove",
        &[
            "alliance cluster foxglove # the newest run, from now on",
            "alliance cluster foxglove runs/mine --address 127.0.0.1:8766 # at another port",
        ],
        &[
            "0 The run is over, or the process was interrupted.",
            "2 An argument is invalid, or the run cannot be served.",
            "3 The log cannot be read.",
        ],
    ),
    entry(
        "cluster agent",
        &[
            "alliance cluster agent --robot gold # newest live run",
            "alliance cluster agent --robot gold --connect tls/10.0.0.1:7447 --keys keys # remote",
        ],
        &[],
    ),
    entry(
        "generate",
        &[
            "alliance generate completions bash > alliance.bash # then: source alliance.bash",
            "alliance generate man ~/.local/share/man/man1 # then: man alliance-run",
        ],
        &[
            "0 The files are written.",
            "2 An argument is invalid.",
            "3 A file cannot be written.",
        ],
    ),
    entry(
        "generate completions",
        &["alliance generate completions bash > alliance.bash # then: source alliance.bash"],
        &[],
    ),
    entry(
        "generate man",
        &["alliance generate man ~/.local/share/man/man1 # then: man alliance-run"],
        &[],
    ),
];
