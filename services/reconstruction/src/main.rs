//! Runs reconstruction by itself.

fn main() -> std::process::ExitCode {
    halcyon_chassis::main(halcyon_reconstruction::run)
}
