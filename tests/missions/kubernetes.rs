//! The job for Kubernetes that the documentation has: against the schema that Kubernetes publishes.

use std::path::Path;

use crate::harness::Lab;
use crate::python::{python, run};

#[test]
fn the_job_for_kubernetes_keeps_its_schema() {
    let Some(python) = python(&["kubernetes_validate", "yaml"]) else {
        return;
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let file = root.join("docs/examples/kubernetes-job.yaml");
    let lab = Lab::new();
    let said = run(
        &lab,
        &python,
        "kubernetes_job.py",
        &[file.to_str().unwrap()],
    );
    assert!(said.starts_with("Job Indexed 8 "), "{said}");
    // What it runs is a command that gets as far as its folder, which is none here.
    let text = std::fs::read_to_string(file).unwrap();
    let lines = text.lines().map(str::trim);
    let arguments = lines.skip_while(|line| *line != "args:").skip(1);
    let arguments = arguments.map_while(|line| line.strip_prefix("- "));
    let plan = root.join("campaigns/allocators-small.toml");
    let mut own: Vec<String> = arguments
        .filter(|argument| !argument.starts_with("--out"))
        .map(|argument| match argument {
            "/work/campaigns/allocators.toml" => plan.display().to_string(),
            other => other.replace("$(JOB_COMPLETION_INDEX)", "3"),
        })
        .collect();
    std::fs::write(lab.path("no folder"), "").unwrap();
    own.push("--out=no folder".to_owned());
    let own: Vec<&str> = own.iter().map(String::as_str).collect();
    assert_eq!(own.len(), 5);
    let said = lab.run(&own).expect(2).stderr;
    assert!(said.contains("no folder"), "{said}");
}
