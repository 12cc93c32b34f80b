//! Embeds the dashboard anew whenever its build changes: Cargo sees the files that were embedded, but not new ones beside them.

fn main() {
    // Cargo can only watch what exists. Where it cannot be made, the program says that it has no dashboard.
    let _ = std::fs::create_dir_all("../web/dist");
    println!("cargo:rerun-if-changed=../web/dist");
    println!("cargo:rerun-if-changed=build.rs");
}
