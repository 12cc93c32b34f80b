//! The capture service as a program of its own.

fn main() -> std::process::ExitCode {
    halcyon_chassis::main(halcyon_capture::run)
}
