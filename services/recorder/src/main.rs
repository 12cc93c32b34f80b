//! The flight recorder: everything on the bus to MCAP, and replay.

fn main() -> std::process::ExitCode {
    halcyon_chassis::main(halcyon_recorder::run)
}
