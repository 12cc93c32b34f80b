//! Our own semi-global matching beside OpenCV's threaded one, in one run, by turns:
//! `cargo run -p halcyon-reconstruction --example sgm_speed [THREADS]`. The least of several runs is shown: what other programs do
//! meanwhile can only add.

use std::time::Instant;

use halcyon_model::Image;
use halcyon_reconstruction::core::matcher::{DisparityRange, Engine, match_images};

/// Runs of each, one after the other.
const ROUNDS: usize = 12;

/// Processor time of this process, all threads that live, seconds (Linux).
fn cpu_s() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let ns = tasks.filter_map(|task| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    });
    ns.sum::<f64>() * 1e-9
}

/// A pair with texture at several scales, of a surface that falls away from `near_px` at the bottom.
fn pair(width: u32, height: u32, near_px: u32) -> Result<(Image, Image), Box<dyn std::error::Error>> {
    let level = |x: u32, y: u32, cell: u32| {
        let mixed = (x / cell).wrapping_mul(0x9e37_79b1) ^ (y / cell).wrapping_mul(0x85eb_ca77) ^ cell;
        (mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d) >> 25
    };
    let picture = |shifted: bool| {
        let pixels = (0..width * height).map(|i| {
            let (x, y) = (i % width, i / width);
            let x = if shifted { x + near_px / 2 + near_px * y / (2 * height) } else { x };
            (level(x, y, 2) + level(x, y, 5)) as u8
        });
        Image::new(width, height, pixels.collect::<Vec<u8>>().into())
    };
    Ok((picture(false)?, picture(true)?))
}

#[allow(clippy::print_stdout, reason = "a program for people")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let threads: usize = std::env::args().nth(1).map_or(Ok(1), |text| text.parse())?;
    opencv::core::set_num_threads(threads as i32)?;
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    for (width, height, count) in [(640, 480, 64), (1920, 1080, 128)] {
        let (left, right) = pair(width, height, count - 8)?;
        let range = DisparityRange { min_px: 0, max_px: count - 1 };
        let mut rows = Vec::new();
        for name in ["sgbm-3way", "sgm", "sgm8"] {
            let engine: Engine = name.parse()?;
            rows.push((name, engine.matcher(engine.block_px_default()), f64::INFINITY, f64::INFINITY));
        }
        for _ in 0..ROUNDS {
            for (_, matcher, cpu_min_s, wall_min_s) in &mut rows {
                let (cpu_before_s, wall) = (cpu_s(), Instant::now());
                match_images(matcher.as_mut(), &left, &right, range)?;
                *wall_min_s = wall_min_s.min(wall.elapsed().as_secs_f64());
                *cpu_min_s = cpu_min_s.min(cpu_s() - cpu_before_s);
            }
        }
        println!("{width}x{height}, {count} disparities, {threads} threads");
        let (cpu_3way_s, wall_3way_s) = (rows[0].2, rows[0].3);
        for (name, _, cpu_min_s, wall_min_s) in &rows {
            let (cpu_ms, wall_ms) = (1e3 * cpu_min_s, 1e3 * wall_min_s);
            let (cpu_ratio, wall_ratio) = (cpu_min_s / cpu_3way_s, wall_min_s / wall_3way_s);
            println!("  {name}: CPU {cpu_ms:.1} ms ({cpu_ratio:.2}), wall {wall_ms:.1} ms ({wall_ratio:.2})");
        }
    }
    Ok(())
}
