//! `halcyon`: see `halcyon --help`.

fn main() -> std::process::ExitCode {
    halcyon::cli::main()
}
