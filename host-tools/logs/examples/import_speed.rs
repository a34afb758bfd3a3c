//! How long an import takes: `cargo run --release -p backseat-logs --example import_speed [FILE...]`.
//!
//! Without a file: an hour at 100 Hz, every column of the standard vehicle log in every row, and the same as a native
//! Iver mission log, both written first.

use backseat_logs::importers;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let files: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let folder = tempfile::tempdir()?;
    let files = if files.is_empty() { written(folder.path())? } else { files };
    for path in files {
        let began = Instant::now();
        let imported = importers::read(&path)?;
        let elapsed_s = began.elapsed().as_secs_f64();
        let bytes = std::fs::metadata(&path)?.len();
        println!(
            "{}: {}, {} rows, {:.1} MB",
            path.display(),
            imported.format,
            imported.log.rows.len(),
            bytes as f64 * 1e-6
        );
        println!("  {elapsed_s:.3} s");
    }
    Ok(())
}

/// 360,000 rows of either format.
fn written(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    const ROWS: u32 = 360_000;
    let columns = "prop_rpm,fin_top_rad,fin_bottom_rad,fin_port_rad,fin_starboard_rad,depth_m,roll_rad,pitch_rad,heading_rad,\
        p_radps,q_radps,r_radps,dvl_u_mps,dvl_v_mps,dvl_w_mps";
    let mut vehicle = format!("t_s,{columns}\n");
    let mut uvc = String::from(
        "Latitude;Longitude;Time;Date;C True Heading;Pitch Angle;Roll Angle;DFS Depth (m);Vehicle Speed (kn);\n",
    );
    for k in 0..ROWS {
        let _ = write!(vehicle, "{}.{:02}", k / 100, k % 100);
        for column in 0..columns.split(',').count() {
            let _ = write!(vehicle, ",{:.6}", (f64::from(k) * 1e-3 + column as f64).sin());
        }
        vehicle.push('\n');
        let (minute, second) = (k / 6000, f64::from(k % 6000) * 0.01);
        let wave = (f64::from(k) * 1e-3).sin();
        let _ = writeln!(
            uvc,
            "{:.8};{:.8};12:{minute:02}:{second:05.2};10/7/2022;{:.2};{:.2};{:.2};0.1;2.0;",
            25.9 + 1e-4 * wave,
            -80.1 + 1e-4 * wave,
            180.0 + 90.0 * wave,
            wave,
            wave
        );
    }
    let files = vec![folder.join("vehicle.csv"), folder.join("uvc.log")];
    std::fs::write(&files[0], vehicle)?;
    std::fs::write(&files[1], uvc)?;
    Ok(files)
}
