use own_allocator::Greedy;

fn main() -> std::process::ExitCode {
    launch::main(
        launch::Registry::built_in().with_allocator::<Greedy>("greedy", "the cheapest free task"),
    )
}
