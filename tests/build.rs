//! Links the programs as those of `launch`, so that tests and benchmarks run the same programs.

#[path = "../launch/link.rs"]
mod link;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    link::at_fixed_address();
}
