//! Hand-over of a command with controllers in Python to the Python package, which executes it with the same code.

use std::env;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use terminal::stderr_line;

use crate::BUILD;

/// The variable with the Python interpreter that has the package.
const INTERPRETER: &str = "ALLIANCE_PYTHON";

/// A program that prints the build of the package.
const PRINT_BUILD: &str = "from alliance_sim import _engine; print(_engine.BUILD)";

/// An option of Python: the working directory contains no modules. A file there could replace one that the package imports.
const SAFE_PATH: &str = "-P";

/// Replaces this process by the Python package, with the same arguments.
pub fn execute_this_command() -> ExitCode {
    let python = interpreter();
    let execute = || {
        let mut command = Command::new(&python);
        command.args([SAFE_PATH, "-m", "alliance_sim"]);
        command.args(env::args_os().skip(1)).exec().to_string()
    };
    let problem = check_package(&python).map_or_else(|problem| problem, |()| execute());
    stderr_line!(
        "alliance: {}: {problem}; a controller in Python needs Python with the package alliance-sim: set {INTERPRETER} to it",
        python.display()
    );
    ExitCode::from(2)
}

/// Checks that the interpreter has the package, in the build of this program. Errors are the problem in one line.
fn check_package(python: &Path) -> Result<(), String> {
    let mut command = Command::new(python);
    command.args([SAFE_PATH, "-c", PRINT_BUILD]);
    let output = command.stdin(Stdio::null()).output();
    let output = output.map_err(|error| error.to_string())?;
    if !output.status.success() {
        let stderr = String::from_utf8_lossy(&output.stderr);
        let last = stderr.lines().last().map(str::to_owned);
        return Err(last.unwrap_or_else(|| output.status.to_string()));
    }
    let stdout = String::from_utf8_lossy(&output.stdout);
    match stdout.trim() {
        BUILD => Ok(()),
        build => Err(format!(
            "its package has the build {build}, and this program the build {BUILD}"
        )),
    }
}

/// Returns the interpreter: that of the variable, else that of the environment into which this program was installed,
/// else the first on the path.
fn interpreter() -> PathBuf {
    if let Some(stated) = env::var_os(INTERPRETER) {
        return stated.into();
    }
    let beside = env::current_exe().map(|program| program.with_file_name("python3"));
    match beside {
        Ok(python) if python.is_file() => python,
        _ => "python3".into(),
    }
}
