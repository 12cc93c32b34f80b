//! The gateway as a program of its own.

fn main() -> std::process::ExitCode {
    halcyon_chassis::main(halcyon_gateway::run)
}
