fn main() -> std::process::ExitCode {
    launch::main(launch::Registry::built_in().mission(own_mission::VISIT))
}
