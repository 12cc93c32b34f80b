//! The service as a program of its own.

fn main() -> std::process::ExitCode {
    halcyon_chassis::main(halcyon_vehicle_link::run)
}
