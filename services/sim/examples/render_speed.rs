//! Processor time of one stereo pair: `cargo run -p halcyon-sim --example render_speed [DIR]`; with a folder it also writes PGM pictures.

use std::sync::Arc;

use halcyon_model::Stamp;
use halcyon_sim::render::Renderer;
use halcyon_sim::rig::RigConfig;
use halcyon_sim::sea::SeaConfig;
use halcyon_sim::texture::Texture;
use halcyon_sim::water::Water;
use nalgebra::{UnitQuaternion, Vector3};

/// Pairs per setting.
const FRAMES: u32 = 40;

/// Processor time of this process, seconds: what other programs do meanwhile doesn't count (Linux).
fn cpu_s() -> f64 {
    let text = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(f64::NAN) * 1e-9
}

#[allow(clippy::print_stdout, reason = "a program for people")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let start = cpu_s();
    let texture = Arc::new(Texture::water(4));
    let texture_s = cpu_s() - start;
    let mut renderer = Renderer::new(&RigConfig::default(), texture)?;
    println!("set-up {:.0} ms, of which texture {:.0} ms", 1e3 * (cpu_s() - start), 1e3 * texture_s);
    let attitude = UnitQuaternion::from_euler_angles(0.03, -0.02, 0.7);
    for (name, sea) in
        [("default", SeaConfig::default()), ("rough", SeaConfig::jonswap(0.3, 2.2, 240.0)), ("still", SeaConfig::still())]
    {
        let water = Water::new(&sea, 7)?;
        for height_m in [2.0, 5.0, 10.0, 20.0] {
            let start = cpu_s();
            let mut pair = None;
            for frame in 0..FRAMES {
                let stamp = Stamp::from_nanos(1_780_000_000_000_000_000).plus_secs_f64(0.2 * f64::from(frame));
                pair = Some(renderer.render_pair(&water, &attitude, Vector3::new(3.0, 4.0, -height_m), stamp, 1)?);
            }
            println!("{name}, {height_m} m: {:.1} ms a pair", 1e3 * (cpu_s() - start) / f64::from(FRAMES));
            if let (Some(folder), Some((left, right))) = (std::env::args().nth(1), pair) {
                for (side, image) in [("left", left), ("right", right)] {
                    let mut pgm = format!("P5 {} {} 255\n", image.width_px(), image.height_px()).into_bytes();
                    pgm.extend_from_slice(image.pixels());
                    std::fs::write(format!("{folder}/{name}-{height_m}-{side}.pgm"), pgm)?;
                }
            }
        }
    }
    Ok(())
}
