//! The example job for Kubernetes, checked against the published schema.

use std::path::Path;

use alliance_tests::harness::Lab;
use alliance_tests::python::{python, run};

#[test]
fn the_kubernetes_job_is_valid() {
    let Some(python) = python(&["kubernetes_validate", "yaml"]) else {
        return;
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let file = root.join("docs/examples/kubernetes-job.yaml");
    let lab = Lab::new();
    let output = run(
        &lab,
        &python,
        "kubernetes_job.py",
        &[file.to_str().unwrap()],
    );
    assert!(output.starts_with("Job Indexed 8 "), "{output}");
    // The job's command starts correctly and fails only at the missing folder.
    let text = std::fs::read_to_string(file).unwrap();
    let lines = text.lines().map(str::trim);
    let arguments = lines.skip_while(|line| *line != "args:").skip(1);
    let arguments = arguments.map_while(|line| line.strip_prefix("- "));
    let plan = root.join("campaigns/allocators-small.toml");
    let mut command: Vec<String> = arguments
        .filter(|argument| !argument.starts_with("--out"))
        .map(|argument| match argument {
            "/work/campaigns/allocators.toml" => plan.display().to_string(),
            other => other.replace("$(JOB_COMPLETION_INDEX)", "3"),
        })
        .collect();
    std::fs::write(lab.path("no folder"), "").unwrap();
    command.push("--out=no folder".to_owned());
    let command: Vec<&str> = command.iter().map(String::as_str).collect();
    assert_eq!(command.len(), 5);
    let stderr = lab.run(&command).expect(2).stderr;
    assert!(stderr.contains("no folder"), "{stderr}");
}
