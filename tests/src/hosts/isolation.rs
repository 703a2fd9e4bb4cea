//! A test that runs once more, in namespaces of its own.

use std::process::Command;
use std::sync::OnceLock;

/// Set for all processes inside, and no others: who began it, and for which test.
pub const INSIDE: &str = "ALLIANCE_TEST_HOSTS";

/// What must be possible inside: a place for namespaces (the machine's own /run stays out of sight), and interfaces.
const TRIAL: &str = "mount -t tmpfs none /run && mkdir /run/netns && ip netns add trial && ip tuntap add dev trial mode tap";

/// Arguments of `unshare` that are needed beside those for everybody.
pub type Way = &'static [&'static str];

/// As root, and as anybody who may be root among namespaces.
const WAYS: [Way; 2] = [&[], &["--user", "--map-root-user"]];

/// Whether this process has been started by [`run`].
pub fn is_inside() -> bool {
    std::env::var_os(INSIDE).is_some()
}

/// Which way this process may make namespaces, or why it may not.
pub fn way() -> Result<Way, &'static str> {
    static FOUND: OnceLock<Result<Way, String>> = OnceLock::new();
    let found = FOUND.get_or_init(|| {
        let mut why = Vec::new();
        for way in WAYS {
            match isolated(way, TRIAL).output() {
                Ok(tried) if tried.status.success() => return Ok(way),
                Ok(tried) => why.push(String::from_utf8_lossy(&tried.stderr).trim().to_owned()),
                Err(error) => why.push(format!("unshare: {error}")),
            }
        }
        Err(why.join("; "))
    });
    found.as_ref().copied().map_err(String::as_str)
}

/// Runs a test of this very binary inside.
///
/// # Errors
/// If it fails or is not there, with what it has said.
pub fn run(way: Way, test: &str) -> Result<(), String> {
    // The shell stays, as the first process of the namespace: it collects orphans, and all end with it.
    let output = isolated(way, &format!("{TRIAL} && \"$@\"; exit $?"))
        .arg("sh")
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", test, "--nocapture", "--include-ignored"])
        .env(INSIDE, inside(test))
        .output()
        .unwrap();
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    print!("{said}");
    if output.status.success() && said.contains("1 passed") {
        Ok(())
    } else {
        Err(format!("{test} ended with {}: {said}", output.status))
    }
}

/// What processes inside have as [`INSIDE`].
pub fn inside(test: &str) -> String {
    format!("{} {test}", std::process::id())
}

/// A shell inside, with this script. It ends with whoever has started it.
fn isolated(way: Way, script: &str) -> Command {
    let mut command = Command::new("setpriv");
    command
        .args(["--pdeathsig", "KILL", "unshare"])
        .args(way)
        .args(["--net", "--mount", "--pid", "--mount-proc"])
        .args(["--fork", "--kill-child", "sh", "-c", script]);
    command
}
