//! Repeats a test in new namespaces.

use std::process::Command;
use std::sync::OnceLock;

/// The environment variable of all processes in the namespaces. Its value is the process id of the outer test and its
/// name.
pub const INSIDE: &str = "ALLIANCE_TEST_HOSTS";

/// A trial of the required permissions: a mount that hides the machine's own /run, a namespace, and an interface.
const TRIAL: &str = "mount -t tmpfs none /run && mkdir /run/netns && ip netns add trial && ip tuntap add dev trial mode tap";

/// The user-dependent arguments of `unshare`.
pub type UnshareOptions = &'static [&'static str];

/// The arguments for root, and for a user that becomes root in a user namespace.
const UNSHARE_OPTIONS: [UnshareOptions; 2] = [&[], &["--user", "--map-root-user"]];

/// Returns whether this process was started by [`run`].
pub fn is_inside() -> bool {
    std::env::var_os(INSIDE).is_some()
}

/// Returns the arguments with which this process can create namespaces, or the reason why it cannot.
pub fn unshare_options() -> Result<UnshareOptions, &'static str> {
    static FOUND: OnceLock<Result<UnshareOptions, String>> = OnceLock::new();
    let found = FOUND.get_or_init(|| {
        let mut reasons = Vec::new();
        for options in UNSHARE_OPTIONS {
            match isolated(options, TRIAL).output() {
                Ok(tried) if tried.status.success() => return Ok(options),
                Ok(tried) => reasons.push(String::from_utf8_lossy(&tried.stderr).trim().to_owned()),
                Err(error) => reasons.push(format!("unshare: {error}")),
            }
        }
        Err(reasons.join("; "))
    });
    found.as_ref().copied().map_err(String::as_str)
}

/// Runs a test of this binary in new namespaces.
///
/// # Errors
/// Returns the output if the test fails or does not exist.
pub fn run(options: UnshareOptions, test: &str) -> Result<(), String> {
    // The shell is the first process of the namespace: it collects orphans, and all processes end with it.
    let output = isolated(options, &format!("{TRIAL} && \"$@\"; exit $?"))
        .arg("sh")
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", test, "--nocapture", "--include-ignored"])
        .env(INSIDE, inside(test))
        .output()
        .unwrap();
    let output_text = [output.stdout, output.stderr].concat();
    let output_text = String::from_utf8_lossy(&output_text).into_owned();
    print!("{output_text}");
    if output.status.success() && output_text.contains("1 passed") {
        Ok(())
    } else {
        Err(format!(
            "{test} ended with {}: {output_text}",
            output.status
        ))
    }
}

/// Returns the value of [`INSIDE`] in the namespaces.
pub fn inside(test: &str) -> String {
    format!("{} {test}", std::process::id())
}

/// Returns the command for a script in new namespaces. It ends with its parent.
fn isolated(options: UnshareOptions, script: &str) -> Command {
    let mut command = Command::new("setpriv");
    command
        .args(["--pdeathsig", "KILL", "unshare"])
        .args(options)
        .args(["--net", "--mount", "--pid", "--mount-proc"])
        .args(["--fork", "--kill-child", "sh", "-c", script]);
    command
}
