//! A vehicle's parameters from its log: `backseat identify`.

pub mod plan;
mod report;

use crate::read_log::{ReadLog, file_name};
use anyhow::{Context, anyhow, bail};
use backseat_core::effects::{EffectSet, water_current};
use backseat_core::identification::Scale;
use backseat_estimation::inputs;
use backseat_identify::{
    Estimate, IdentificationData, LoggedInputs, Method, Options, TimingEstimate, Validation, fold_into_plant, identify,
    learnt, nothing_changes, timing, validate,
};
use backseat_logs::VehicleFile;
use backseat_report::Report;
use backseat_report::console::{Progress, Spinner};
use std::path::PathBuf;
use std::time::Instant;

/// Share of the log that is fitted when nothing else is there to judge by.
const FITTED: f64 = 0.8;

/// How a vehicle is identified.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Method of identification.
    pub method: Method,
    /// The parameter taken as known: forces are not measured, so one must be.
    pub scale: Scale,
    /// Whether the cross drags d26 and d35 are identified too.
    pub cross_drag: bool,
    /// Water current north and east, m/s; empty: that of the vehicle file.
    pub current: Vec<f64>,
}

/// The parameters that can be taken as known, by their names.
pub const SCALES: [(&str, Scale); 2] = [("m11", Scale::M11), ("beta5", Scale::Beta5)];

/// What the estimate is judged on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeldOut {
    /// The last fifth of the log.
    LastPart,
    /// Another log.
    Another,
}

impl HeldOut {
    /// In words.
    pub const fn text(self) -> &'static str {
        match self {
            Self::LastPart => "the last fifth of the log, held out",
            Self::Another => "the other log",
        }
    }
}

/// A vehicle identified from a log, and how well it predicts.
pub struct IdentificationResult {
    /// Where the log came from.
    pub log: PathBuf,
    /// Name of its format.
    pub format: &'static str,
    /// Parameters with intervals, and the steps to them.
    pub estimate: Estimate,
    /// Open-loop prediction with the declared vehicle; `None` if nothing is held out.
    pub before: Option<Validation>,
    /// The same with the identified one.
    pub after: Option<Validation>,
    /// What it is judged on.
    pub held_out: HeldOut,
    /// The samples it is judged on.
    pub judge: IdentificationData,
    /// The vehicle before.
    pub declared: VehicleFile,
    /// The declared vehicle with the identified parameters.
    pub identified: VehicleFile,
    /// When the inputs act; `None` where the log does not show it.
    pub timing: Option<TimingEstimate>,
    /// Any parameter differs from the declared one.
    pub is_changed: bool,
    /// On held-out data it predicts worse than saying that nothing changes.
    pub is_useless: bool,
    /// Why the result should not be trusted.
    pub doubts: Vec<String>,
    /// Time taken with reading, s.
    pub wall_s: f64,
}

impl IdentificationResult {
    /// First lines of the vehicle file.
    fn source(&self) -> String {
        format!(
            "Identified by `backseat identify --method {}` from {}; prior: {}.\nParameters that the log does not show are as \
             declared.",
            self.estimate.method,
            file_name(&self.log),
            self.declared.name
        )
    }
}

impl IdentificationResult {
    /// Identifies the vehicle of a log, without a vehicle from the built-in reference; judged on the other log, or on the
    /// last part of the same.
    ///
    /// # Errors
    /// The log lacks a column that identification needs, or its motion shows nothing.
    pub fn of(
        read: &ReadLog,
        declared: Option<&VehicleFile>,
        other: Option<&ReadLog>,
        settings: &Settings,
    ) -> anyhow::Result<Self> {
        compute(read, declared.cloned().unwrap_or_else(VehicleFile::reference), other, settings)
    }

    /// The vehicle with what was found, and the first lines of its file; `None` if it is as it was declared.
    pub fn vehicle(&self) -> Option<(&VehicleFile, String)> {
        (self.is_changed && !self.is_useless).then(|| (&self.identified, self.source()))
    }

    /// Whether the result is not to be trusted.
    pub fn is_doubtful(&self) -> bool {
        !self.is_changed || self.is_useless || !self.doubts.is_empty()
    }

    /// The report, but for the files that are written.
    pub fn report(&self) -> Report {
        report::report(self)
    }
}

/// Why a log should not be trusted.
fn doubts(read: &ReadLog) -> Vec<String> {
    read.examination.suspicions().map(|finding| finding.message.clone()).collect()
}

fn compute(
    read: &ReadLog,
    mut declared: VehicleFile,
    other: Option<&ReadLog>,
    settings: &Settings,
) -> anyhow::Result<IdentificationResult> {
    let began = Instant::now();
    let left = fold_into_plant(&mut declared.parameters, &mut declared.effects.set);
    let kept = declared.effects.set;
    declared.effects.ci95.retain(|(id, _)| kept.get(*id) != 0.0);
    let effects = effects(&declared, &settings.current)?;
    let spinner = Spinner::new("identify");
    spinner.set("what the log shows of the motion");
    let data_of = |read: &ReadLog| {
        let log = inputs::at_centre(&read.log, &declared.installation);
        let data = IdentificationData::from_log(&log, &effects).with_context(|| read.log.path.display().to_string())?;
        anyhow::Ok((data, LoggedInputs::of(&log, &effects)))
    };
    let (mut data, inputs) = data_of(read)?;
    data.notes.splice(..0, read.log.notes.iter().cloned());
    data.notes
        .extend(left.iter().map(|name| {
            format!("{name} has an onset time and is ignored: identification assumes constant parameters")
        }));
    let options = options(settings, &declared);
    spinner.set("when the commands act");
    let timing = input_timing(&mut data, &inputs, &declared, &options);
    let other = other.map(data_of).transpose()?.map(|(mut data, inputs)| {
        if let Some(timing) = &timing {
            inputs.act(&timing.timing(), &mut data.samples);
        }
        data
    });
    let method = settings.method;
    let [first, rest] = data.split(FITTED);
    // The automatic method holds the last part out by itself.
    let fitted = if other.is_some() || method == Method::Auto { &data } else { &first };
    let held_out = if other.is_some() { HeldOut::Another } else { HeldOut::LastPart };
    // the bar has the line now
    drop(spinner);
    let progress = Progress::new("identify", 1000);
    let estimate = identify(method, fitted, &declared.parameters, &options, &|share| {
        progress.set((share * 1000.0) as usize);
    })?;
    drop(progress);
    let spinner = Spinner::new("identify");
    spinner.set("predictions on held-out data");
    let judge = other.unwrap_or(rest);
    let [before, after] = [&declared.parameters, &estimate.vehicle].map(|vehicle| validate(vehicle, &judge));
    // the way through the identifier's own coordinates rounds
    let moves = |p: &backseat_identify::EstimatedParameter| (p.value - p.prior).abs() > 1e-9 * p.prior.abs().max(1e-3);
    let is_changed = estimate.parameters.iter().any(moves);
    let is_useless = after.zip(nothing_changes(&judge)).is_some_and(|(after, still)| after.is_worse_than(&still));
    drop(spinner);
    let mut identified = declared.clone();
    identified.parameters = estimate.vehicle;
    identified.learnt = learnt(&estimate, &options, &declared.priors);
    identified.name = format!("{}-identified", declared.name);
    Ok(IdentificationResult {
        log: read.log.path.clone(),
        format: read.format,
        estimate,
        before,
        after,
        held_out,
        judge,
        declared,
        identified,
        timing,
        is_changed,
        is_useless,
        doubts: doubts(read),
        wall_s: read.read_s + began.elapsed().as_secs_f64(),
    })
}

/// Finds out when the inputs act, and lets them.
fn input_timing(
    data: &mut IdentificationData,
    inputs: &LoggedInputs,
    declared: &VehicleFile,
    options: &Options,
) -> Option<TimingEstimate> {
    match timing::estimate(data, inputs, &declared.parameters, options) {
        Ok(found) => {
            inputs.act(&found.timing(), &mut data.samples);
            data.notes.extend(found.notes());
            Some(found)
        }
        Err(error) => {
            data.notes.push(format!("{error}; commands are held until the next"));
            None
        }
    }
}

/// The declared effects, with the current that was given instead of the declared one.
fn effects(declared: &VehicleFile, current: &[f64]) -> anyhow::Result<EffectSet> {
    match current {
        [] => Ok(declared.effects.set),
        [north, east] if north.is_finite() && east.is_finite() => declared
            .effects
            .set
            .with(water_current::INFO.name, current)
            .map_err(|error| anyhow!("water current: {error}")),
        _ => bail!("water current: expected two numbers, north and east in m/s"),
    }
}

fn options(settings: &Settings, declared: &VehicleFile) -> Options {
    let sensors = &declared.sensors;
    Options {
        scale: settings.scale,
        cross_drag: settings.cross_drag,
        ..Options::of_noise(sensors.dvl_mps, sensors.rates_radps, sensors.attitude_rad)
    }
}
