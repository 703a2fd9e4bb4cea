//! Hand-over of a command with controllers in Python to the Python package, which executes it with the same code.

use std::env;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

use terminal::stderr_line;

/// The variable with the Python interpreter that has the package.
const INTERPRETER: &str = "ALLIANCE_PYTHON";

/// Replaces this process by the Python package, with the same arguments.
pub fn execute_this_command() -> ExitCode {
    let python = interpreter();
    let failed = Command::new(&python)
        .args(["-m", "alliance_sim"])
        .args(env::args_os().skip(1))
        .exec();
    stderr_line!(
        "alliance: {}: {failed}; a controller in Python needs Python with the package alliance-sim: set {INTERPRETER} to it",
        python.display()
    );
    ExitCode::from(2)
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
