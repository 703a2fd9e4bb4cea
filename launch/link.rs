//! Links programs to a fixed address. Otherwise each process has 2 MB of relocated data of its own, which displace those
//! of the other robots from the caches.

/// Prints the option for all programs of the package, on Linux with glibc. A static program has its own kind of link.
pub fn at_fixed_address() {
    let target = |name: &str| std::env::var(format!("CARGO_CFG_TARGET_{name}")).unwrap_or_default();
    let is_static = target("FEATURE")
        .split(',')
        .any(|feature| feature == "crt-static");
    if target("OS") == "linux" && target("ENV") == "gnu" && !is_static {
        println!("cargo::rustc-link-arg-bins=-no-pie");
    }
}
