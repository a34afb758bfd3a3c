//! Whiteness of a log under its declared model.
use backseat_core::effects::EffectSet;
use backseat_core::navigation::SurfaceNoise;
use backseat_data::{Log, VehicleFile};
use backseat_diagnose::samples::{Channel, Samples};
use backseat_diagnose::whitener::{self, Setup};
fn main() {
    for path in std::env::args().skip(1) {
        let log = Log::read(path.as_ref()).unwrap();
        let vehicle = VehicleFile::reference();
        let t = std::time::Instant::now();
        let samples = Samples::of(&log, &vehicle.sensors, true);
        let setup = Setup {
            parameters: vehicle.parameters,
            noise: vehicle.noise,
            surface: SurfaceNoise::DYNAMIC,
            sensors: vehicle.sensors,
            ship_transducer_depth_m: 0.0,
            scale: [1.0; Channel::COUNT],
            outliers: vec![],
            block_s: 60.0,
        };
        let pass = whitener::run(&setup, &samples, &EffectSet::NONE, &[]).unwrap();
        println!("{path} {:?}", t.elapsed());
        for channel in Channel::ALL {
            let e: Vec<f64> = pass.residuals.iter().filter(|r| r.channel == channel).map(|r| r.normalised()).collect();
            let n = e.len() as f64;
            let mean = e.iter().sum::<f64>() / n;
            let var = e.iter().map(|x| x * x).sum::<f64>() / n;
            let lag: Vec<f64> =
                [1, 2, 5].iter().map(|&k| e.windows(k + 1).map(|w| w[0] * w[k]).sum::<f64>() / n / var).collect();
            println!(
                "{:12} n {:6} mean*sqrt(n) {:8.2} var {:7.4} acf {:.3?} (sd {:.3})",
                channel.name(),
                n,
                mean * n.sqrt(),
                var,
                lag,
                1.0 / n.sqrt()
            );
        }
    }
}
