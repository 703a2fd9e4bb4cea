fn main() -> std::process::ExitCode {
    launch::main(launch::Registry::built_in().with_mission(own_mission::VISIT))
}
