//! The example job for Kubernetes, checked against the published schema.

use alliance_tests::harness::Lab;
use alliance_tests::python::{python, run};
use alliance_tests::testkit::{campaign, in_repository};

#[test]
fn the_kubernetes_job_is_valid() {
    let Some(python) = python(&["kubernetes_validate", "yaml"]) else {
        return;
    };
    let file = in_repository("docs/examples/kubernetes-job.yaml");
    let lab = Lab::new();
    let file_name = file.to_str().unwrap();
    let output = run(&lab, &python, "kubernetes_job.py", &[file_name]);
    assert!(output.starts_with("Job Indexed 8 "), "{output}");
    // The job's command starts correctly and fails only at the missing folder.
    let text = std::fs::read_to_string(&file).unwrap();
    let lines = text.lines().map(str::trim);
    let arguments = lines.skip_while(|line| *line != "args:").skip(1);
    let arguments = arguments.map_while(|line| line.strip_prefix("- "));
    let mut command: Vec<String> = arguments
        .filter(|argument| !argument.starts_with("--out"))
        .map(|argument| match argument {
            "/work/campaigns/allocators.toml" => campaign("allocators-small"),
            other => other.replace("$(JOB_COMPLETION_INDEX)", "3"),
        })
        .collect();
    lab.write("no folder", "");
    command.push("--out=no folder".to_owned());
    assert_eq!(command.len(), 5);
    lab.run(&command).expect(2).shows("no folder");
}
