//! Runs wave assessment by itself.

fn main() -> std::process::ExitCode {
    halcyon_chassis::main(halcyon_wave_assessment::run)
}
