//! Compiles the protobuf files in pure Rust (protox), so that nobody installs protoc.

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-changed=halcyon");
    let mut files: Vec<_> =
        std::fs::read_dir("halcyon/v1")?.map(|entry| entry.map(|entry| entry.path())).collect::<Result<_, _>>()?;
    files.sort();
    let descriptors = protox::compile(&files, ["."])?;
    let out = std::path::PathBuf::from(std::env::var("OUT_DIR")?);
    std::fs::write(out.join("halcyon.v1.bin"), prost::Message::encode_to_vec(&descriptors))?;
    // `Bytes` for pictures: decoding a pair then copies none of its pixels.
    prost_build::Config::new().bytes(["."]).compile_fds(descriptors)?;
    Ok(())
}
