//! Logs that the bench is run on: simulated ones by seed, recorded ones by path.

use crate::vessel::ship::{self, Voyage};
use anyhow::Context as _;
use backseat_logs::{Log, VehicleFile, importers};
use hil_sim::dataset::{self, Shape, Spec};
use hil_sim::noise::NoiseKind;
use hil_sim::rng::{Source, Stream};
use hil_sim::scenario::Request;
use std::path::{Path, PathBuf};

/// A log in which wrong recordings are made.
#[derive(Clone, Debug)]
pub enum Base {
    /// A torpedo with dives and legs across, DVL, ranges, fixes at the surface.
    Dives { seed: u64, seconds: f64 },
    /// A torpedo on lines to and fro without a DVL, in a current.
    Lines { seed: u64, seconds: f64 },
    /// Recorded, of any format that the commands read.
    File(PathBuf),
}

impl Base {
    /// As the page names it: a file by its name alone.
    pub fn name(&self) -> String {
        match self {
            Self::Dives { seed, .. } => format!("simulated dives, DVL, seed {seed}"),
            Self::Lines { seed, .. } => format!("simulated lines, no DVL, current, seed {seed}"),
            Self::File(path) => path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
        }
    }

    /// Simulates or reads it.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn log(&self) -> anyhow::Result<Log> {
        Ok(match self {
            Self::Dives { seed, seconds } => {
                let spec = Spec { duration_s: *seconds, shape: Shape::Excite, ..Spec::new(VehicleFile::reference()) };
                dataset::simulate(&spec, *seed).log
            }
            Self::Lines { seed, seconds } => {
                let effects = vec![Request::named("water_current").map_err(anyhow::Error::msg)?];
                let spec = Spec { duration_s: *seconds, effects, dvl: false, ..Spec::new(VehicleFile::reference()) };
                dataset::simulate(&spec, *seed).log
            }
            Self::File(path) => read(path)?,
        })
    }
}

fn read(path: &Path) -> anyhow::Result<Log> {
    Ok(importers::read(path).with_context(|| path.display().to_string())?.log)
}

/// What a clean log is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clean {
    /// A torpedo as declared, some in a current.
    AsDeclared,
    /// A torpedo with an undeclared effect of the catalogue: wrong vehicles and sensors, recorded rightly.
    WithEffect,
    /// A ship on the surface.
    Vessel,
}

/// A log that is recorded rightly, drawn by its seed.
///
/// # Errors
/// None: the names of the effects are those of the catalogue.
pub fn clean(kind: Clean, seed: u64) -> anyhow::Result<(String, Log)> {
    let mut random = Stream::new(seed, Source::Study);
    let mut one_in = |share: f64| random.uniform() < share;
    let [is_excited, is_coloured, dvl, ranges, ramps, is_short, is_long, has_current, ctd] =
        [0.5, 0.5, 0.6, 0.8, 0.5, 0.3, 0.2, 0.5, 0.2].map(&mut one_in);
    let duration_s: f64 = if is_short {
        600.0
    } else if is_long {
        5400.0
    } else {
        1800.0
    };
    if kind == Clean::Vessel {
        let wind_mps = if has_current { [4.0, -3.0] } else { [0.0; 2] };
        let voyage = Voyage { duration_s: duration_s.max(1200.0), velocities: dvl, wind_mps, noise: true };
        return Ok((format!("ship, {voyage:?}"), ship::simulate(&voyage, seed).0));
    }
    let effect = match kind {
        Clean::WithEffect => Some(Request::Random),
        _ if has_current => Some(Request::named("water_current").map_err(anyhow::Error::msg)?),
        _ => None,
    };
    let spec = Spec {
        duration_s,
        effects: effect.into_iter().collect(),
        shape: if is_excited { Shape::Excite } else { Shape::Lawnmower },
        noise: if is_coloured { NoiseKind::Coloured } else { NoiseKind::White },
        dvl,
        ranges,
        ctd,
        ramps,
        ..Spec::new(VehicleFile::reference())
    };
    let what = format!(
        "{:?}, {duration_s:.0} s, {:?} noise, DVL {dvl}, ranges {ranges}, ramps {ramps}, CTD {ctd}",
        spec.shape, spec.noise
    );
    let data = dataset::simulate(&spec, seed);
    let injected: Vec<&str> = data.effects.iter().map(|effect| effect.name()).collect();
    Ok((format!("{what}, {}", injected.join(", ")), data.log))
}
