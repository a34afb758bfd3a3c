//! Bench.
#![allow(dead_code)]
#[path = "../tests/logs/wrong_recordings.rs"]
mod wrong_recordings;
use backseat_logs::importers;
use wrong_recordings::Verdict;

fn main() {
    for path in std::env::args().skip(1) {
        let log = importers::read(std::path::Path::new(&path)).unwrap().log;
        let began = std::time::Instant::now();
        if let Ok(only) = std::env::var("ONLY") {
            for wrong in wrong_recordings::all().iter().filter(|w| w.name == only) {
                let (verdict, found) = wrong_recordings::judge(wrong, &log).unwrap();
                println!("{verdict:?}");
                found.findings.iter().for_each(|f| println!("  {}", f.message));
                found.untested.iter().filter(|u| !u.why.starts_with("no ")).for_each(|f| println!("  U {} {}", f.test, f.why));
            }
            continue;
        }
        let table = wrong_recordings::table(&log);
        let count = |v: Verdict| table.values().filter(|(found, _)| *found == v).count();
        println!(
            "== {path}: {} wrong: named {} among others {} remarked {} suspicious {} told {} silent {} ({:.1} s)",
            table.len(),
            count(Verdict::Named),
            count(Verdict::AmongOthers),
            count(Verdict::Remarked),
            count(Verdict::Suspicious),
            count(Verdict::Told),
            count(Verdict::Silent),
            began.elapsed().as_secs_f64()
        );
        for (name, (verdict, found)) in &table {
            if *verdict == Verdict::Named {
                continue;
            }
            println!("  {verdict:?}: {name}");
            for f in found.suspicions() {
                println!("      {}", f.message);
            }
        }
    }
}
