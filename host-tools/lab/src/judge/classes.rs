//! What may be wrong in a drawn flight: one class a line, with its size and where the size comes from.
//!
//! Sizes are log-uniform between what nobody notices and what literature and data sheets still know.

use crate::draw::Draw;

/// One kind of trouble.
pub struct Class {
    /// Its name.
    pub name: &'static str,
    /// Of a group at most one is drawn.
    pub group: &'static str,
    /// Writes it for a scenario.
    pub write: fn(&mut Draw) -> String,
    /// Where its size comes from.
    pub source: &'static str,
}

/// The flight as drawn but for its trouble.
pub const NONE: &str = "none";

macro_rules! classes {
    ($($name:literal $group:literal $write:expr, $source:literal;)*) => {
        &[$(Class { name: $name, group: $group, write: $write, source: $source }),*]
    };
}

/// Every class. Those at even places are used while the bound is made, the others are kept for the judgement.
pub const CLASSES: &[Class] = classes! {
    "current" "current" |d| d.effect("water_current", |d| vec![("north_mps", d.signed(0.02, 0.4)), ("east_mps", d.signed(0.02, 0.4))]), "tidal streams off open coasts: Admiralty tidal stream atlases";
    "front" "water" |d| d.current(|d| vec![("north_mps", d.signed(0.05, 0.3)), ("front_east_m", d.between(20.0, 300.0))]), "shelf and tidal fronts, 0.1 to 0.3 m/s across tens of metres: Simpson and Sharples 2012";
    "onset" "water" |d| d.current(|d| vec![("east_mps", d.signed(0.05, 0.3)), ("onset_s", d.during())]), "wind-driven and tidal streams that set in: Simpson and Sharples 2012";
    "shear" "shear" |d| d.effect("current_shear", |d| vec![("north_mps_per_m", d.signed(0.002, 0.02)), ("east_mps_per_m", d.signed(0.002, 0.02))]), "1e-3 to 2e-2 per second in shelf seas: van Haren et al. 1999";
    "tide" "tide" |d| d.effect("tidal_current", |d| vec![("amplitude_mps", d.size(0.03, 0.3)), ("period_s", d.between(3000.0, 44_714.0)), ("phase_rad", d.between(0.0, 6.2))]), "rotary tides, and seiches of an hour: Pugh and Woodworth 2014";
    "compass" "compass" |d| d.effect("heading_bias", |d| vec![("const_rad", d.signed(0.009, 0.09))]), "0.5 to 5 degrees: data sheets OS5000, 3DM-GX3; declination";
    "compass_harmonic" "compass" |d| d.effect("heading_bias", |d| vec![("sin_rad", d.signed(0.005, 0.05)), ("cos_rad", d.signed(0.005, 0.05))]), "hard iron before swinging: data sheet OS5000";
    "compass_slow" "compass_fault" |d| d.fault("heading_drift", |d| format!("rate_radps = {}", d.signed(2e-6, 2e-5))), "gyro-stabilised headings, 0.5 to 4 degrees an hour";
    "motor_field" "compass_motor" |d| d.effect("compass_crosstalk", |d| vec![("rad_s2", d.signed(5e-7, 4e-6))]), "field of the motor's leads: 0.3 to 2 degrees at cruise";
    "dvl_scale" "dvl" |d| d.effect("dvl_scale", |d| vec![("ratio", d.signed(0.002, 0.03))]), "0.2 to 0.5 % by data sheet (Workhorse), 3 % by sound speed and salinity";
    "dvl_yaw" "dvl_mount" |d| d.effect("dvl_misalignment", |d| vec![("yaw_rad", d.signed(0.004, 0.05))]), "0.2 to 3 degrees as mounted: Kinsey and Whitcomb 2007";
    "dvl_false_lock" "dvl_fault" |d| d.fault("dvl_false_lock", |d| format!("velocity_mps = [{}, {}, 0.0]", d.between(0.0, 1.6), d.signed(0.01, 0.3))), "lock on fish, a layer, its own turbulence";
    "sound_speed" "sound" |d| d.effect("sound_speed", |d| vec![("ratio", d.signed(0.0005, 0.01))]), "0.5 to 15 m/s: Mackenzie 1981 without a cast";
    "ray_bending" "bending" |d| d.effect("ray_bending", |d| vec![("per_m", d.size(2e-6, 3e-5))]), "gradients of summer thermoclines";
    "clock_offset" "clock" |d| d.effect("clock_offset", |d| vec![("s", d.signed(0.0003, 0.01))]), "pulse edges taken wrong, delay of a modem: Micro-Modem manual";
    "clock_drift" "clock_rate" |d| d.effect("clock_drift", |d| vec![("ppm", d.signed(0.02, 2.0))]), "TCXO 2 ppm, CSAC 1e-3 ppm: Eustice et al. 2011";
    "clock_step" "clock_step" |d| d.fault("modem_clock_step", |d| format!("offset_s = {}", d.signed(0.0005, 0.02))), "resynchronisation under way";
    "outliers" "outliers" |d| d.effect("range_outliers", |d| vec![("share", d.size(0.02, 0.2))]), "one-way ranges at sea: Eustice et al. 2011";
    "multipath" "multipath" |d| d.fault("multipath", |d| format!("share = {}\nextra_m = {}", d.between(0.1, 0.7), d.size(2.0, 40.0))), "surface and bottom paths in shallow water: Stojanovic and Preisig 2009";
    "ship_offset" "ship" |d| d.lasting("ship_position", |d| format!("offset_m = [{}, {}]", d.signed(0.7, 70.0), d.signed(0.7, 70.0))), "antenna to transducer 1 to 10 m; datum up to 100 m: NGA.STND.0036";
    "ship_offset_under_way" "ship" |d| d.fault("ship_position", |d| format!("offset_m = [{}, {}]", d.signed(1.0, 40.0), d.signed(1.0, 40.0))), "a receiver that loses its corrections or is spoofed";
    "ship_wander" "ship_wander" |d| d.lasting("ship_wander", |d| format!("sigma_m = {}\nperiod_s = {}", d.size(0.5, 3.0), d.size(600.0, 7200.0))), "GPS SPS Performance Standard 2020: 95 % within 8 m globally, slow";
    "fix_wander" "fix_wander" |d| d.lasting("gnss_wander", |d| format!("sigma_m = {}\nperiod_s = {}", d.size(0.5, 3.0), d.size(600.0, 7200.0))), "the same";
    "first_fixes" "fix" |d| format!("[[fault]]\nname = \"gnss_jump\"\noffset_m = [{}, {}]\nfrom_s = 0\nuntil_s = {}\n", d.signed(1.0, 20.0), d.signed(1.0, 20.0), d.between(60.0, 200.0)), "antenna at the water's surface: reflections";
    "spoof" "fix" |d| format!("[[fault]]\nname = \"gnss_drift\"\ndrift_mps = [{}, {}]\nfrom_s = 0\n", d.signed(0.01, 0.5), d.signed(0.01, 0.5)), "slow pull-off: Humphreys et al. 2008";
    "no_packets" "packets" |d| d.fault("silent", |_| "port = \"modem\"".to_owned()), "modem shadowed, ship away";
    "lost_packets" "loss" |d| d.lasting("lost", |d| format!("port = \"modem\"\nshare = {}", d.between(0.1, 0.8))), "20 to 80 % received at sea: Eustice et al. 2011";
    "thrust" "thrust" |d| d.effect("fouling", |d| vec![("share", d.between(0.6, 0.98)), ("time_s", d.during())]), "weed, a bent blade";
    "thrust_decay" "decay" |d| d.effect("thrust_decay", |d| vec![("per_hour", d.size(0.01, 0.15))]), "battery that sags";
    "drag" "drag" |d| d.effect("entanglement", |d| vec![("factor", d.between(1.02, 1.5)), ("time_s", d.during())]), "growth on the hull, a line in tow";
    "wrong_file" "file" |d| { d.wrong_share = d.size(0.02, 0.1); String::new() }, "parameters from drawings: Prestero 2001, 5 to 10 %";
    "weight" "weight" |d| d.effect("buoyancy_offset", |d| vec![("kg", d.signed(0.05, 0.4))]), "ballasting by hand, salinity";
    "trim" "trim" |d| d.effect("pitch_trim", |d| vec![("rad", d.signed(0.01, 0.06))]), "moved batteries";
    "pitch_bias" "pitch" |d| d.effect("pitch_sensor", |d| vec![("bias_rad", d.signed(0.004, 0.03))]), "0.2 to 2 degrees: data sheets";
    "waves" "waves" |d| d.effect("waves", |d| vec![("amplitude_mps", d.size(0.02, 0.25)), ("period_s", d.between(4.0, 10.0))]), "sea states 1 to 3 at the vehicle";
    "depth_untared" "depth" |d| d.lasting("depth_jump", |d| format!("depth_m = {}", d.signed(0.1, 1.0))), "weather: 10 hPa are 0.1 m; a cell not zeroed: 1 m";
    "depth_drift" "depth" |d| d.fault("depth_drift", |d| format!("rate_mps = {}", d.signed(0.001, 0.01))), "a wet cell, 3 to 36 m an hour";
    "depth_jump" "depth" |d| d.fault("depth_jump", |d| format!("depth_m = {}", d.signed(0.2, 3.0))), "a blocked port";
};

/// Which classes are drawn from.
#[derive(clap::ValueEnum, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Which {
    /// Those that are used while the bound is made
    Work,
    /// Those that are not
    Held,
    /// All
    #[default]
    All,
}

impl Which {
    /// Places in the table.
    pub fn places(self) -> Vec<usize> {
        let wanted = |place: &usize| match self {
            Self::Work => place.is_multiple_of(2),
            Self::Held => !place.is_multiple_of(2),
            Self::All => true,
        };
        (0..CLASSES.len()).filter(wanted).collect()
    }
}
