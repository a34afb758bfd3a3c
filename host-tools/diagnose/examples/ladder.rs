//! First round of the ladder.
use backseat_data::{Log, VehicleFile};
use backseat_diagnose::bench::Bench;
use backseat_diagnose::search;
use hil_sim::dataset::{self, Shape, Spec};
fn main() {
    let mut args = std::env::args().skip(1);
    let what = args.next().unwrap();
    let seed: u64 = args.next().map_or(1, |s| s.parse().unwrap());
    let hours: f64 = args.next().map_or(0.5, |s| s.parse().unwrap());
    let flags: Vec<String> = args.collect();
    let t = std::time::Instant::now();
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
        if flags.iter().any(|f| f == "excite") {
            spec.shape = Shape::Excite;
        }
        if flags.iter().any(|f| f == "nodvl") {
            spec.dvl = false;
        }
        if flags.iter().any(|f| f == "col") {
            spec.noise = hil_sim::noise::NoiseKind::Coloured;
        }
        let d = dataset::simulate(&spec, seed);
        for e in &d.effects {
            println!("truth {e:?}");
        }
        d.log
    };
    println!("made {:?}", t.elapsed());
    let t = std::time::Instant::now();
    let bench = Bench::new(&log, &VehicleFile::reference(), true).unwrap();
    println!(
        "bench {:?} scales {:.2?} outliers {}",
        t.elapsed(),
        bench.setup.scale,
        bench.setup.outliers.iter().filter(|o| **o).count()
    );
    let mut accepted = vec![];
    for _ in 0..4 {
        let t = std::time::Instant::now();
        let round = search::round(&bench, &accepted).unwrap();
        println!("round {:?} tried {}", t.elapsed(), round.tried);
        for e in round.ladder.iter().take(9) {
            println!(
                "  {:24} gain {:10.1} infl {:6.2} d {} held {:9.1} p {:.1e} {} {:.5?} {:?}",
                e.instance.candidate.label(),
                e.gain,
                e.inflation,
                e.degrees,
                e.held_gain,
                e.p,
                round.is_significant(e),
                e.instance.sizes,
                e.instance.candidate.onset_s
            );
        }
        let Some(best) = round.ladder.iter().find(|e| round.is_significant(e)) else { break };
        let t = std::time::Instant::now();
        let best = if best.instance.candidate.onset_s.is_some() {
            search::refine_onset(&bench, &accepted, &best.instance).unwrap()
        } else {
            best.instance.clone()
        };
        accepted.push(best);
        let joint = search::refit(&bench, &accepted).unwrap();
        println!(
            "refit {:?} square {} -> {}",
            t.elapsed(),
            bench.declared.normal.sum(|_| true).square,
            joint.whole_square
        );
        for i in &joint.instances {
            println!("   {} {:.6?} {:?}", i.candidate.label(), i.sizes, i.candidate.onset_s);
        }
        println!("   sigmas {:.6?}", joint.sigmas);
        accepted = joint.instances;
    }
}
