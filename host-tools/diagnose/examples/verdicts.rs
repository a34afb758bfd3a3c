//! Verdicts on simulated logs: EFFECT[+EFFECT] SEED.. [excite] [nodvl] [col].
use backseat_data::{Log, VehicleFile};
use backseat_diagnose::bench::Bench;
use backseat_diagnose::diagnosis;
use hil_sim::dataset::{self, Shape, Spec};
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let what = &args[0];
    let (from, to) = args[1].split_once("..").unwrap();
    let has = |f: &str| args.iter().any(|a| a == f);
    let hours: f64 = args.iter().find_map(|a| a.strip_prefix("hours=").map(|h| h.parse().unwrap())).unwrap_or(0.5);
    for seed in from.parse::<u64>().unwrap()..to.parse::<u64>().unwrap() {
        let log = if what.ends_with(".gz") {
            Log::read(what.as_ref()).unwrap()
        } else {
            let mut spec = Spec::new(VehicleFile::reference());
            spec.duration_s = hours * 3600.0;
            if what != "none" {
                for w in what.split('+') {
                    spec.effects.push(hil_sim::scenario::Request::parse(w).unwrap());
                }
            }
            if has("excite") || (has("mixed") && seed % 2 == 0) {
                spec.shape = Shape::Excite;
            }
            spec.dvl = !has("nodvl");
            if has("col") {
                spec.noise = hil_sim::noise::NoiseKind::Coloured;
            }
            let d = dataset::simulate(&spec, seed);
            for e in &d.effects {
                print!("{:?} ", e);
            }
            d.log
        };
        let t = std::time::Instant::now();
        let mut bench = Bench::new(&log, &VehicleFile::reference(), true).unwrap();
        let d = diagnosis::run(&mut bench, |_| {}).unwrap();
        println!("seed {seed} => {} ({:.1} s)", d.verdict.name(), t.elapsed().as_secs_f64());
        for f in &d.effects {
            print!("    {} gain {:.1} p {:.1e} ", f.instance.candidate.label(), f.gain, f.p_value);
            for v in &f.values {
                print!("{} {:.5} [{:.5}, {:.5}] ", v.name, v.value, v.ci95[0], v.ci95[1]);
            }
            println!();
            for r in &f.rivals {
                println!(
                    "        rival {} {:.4?} deficit {:.1} p {:.1e} {}",
                    r.instance.candidate.label(),
                    r.instance.sizes,
                    r.deficit,
                    r.p,
                    r.is_possible()
                );
            }
        }
        for h in &d.structure.hints {
            println!(
                "    hint {} {:.4} gain {:.1} held {:.1} p {:.1e}",
                h.generic.name(),
                h.value,
                h.gain,
                h.held_gain,
                h.p
            );
        }
        if has("v") {
            for n in &d.notes {
                println!("    {n}");
            }
        }
    }
}
