#![allow(dead_code)]
#[path = "../tests/logs/wrong_recordings.rs"]
mod wrong_recordings;
use backseat_logs::importers;
use wrong_recordings::Verdict;

fn main() {
    for path in std::env::args().skip(1) {
        let log = importers::read(std::path::Path::new(&path)).unwrap().log;
        let began = std::time::Instant::now();
        let table = wrong_recordings::table(&log);
        let count = |v: Verdict| table.values().filter(|(found, _)| *found == v).count();
        println!(
            "== {path}: {} wrong: named {} among others {} suspicious {} told {} silent {} ({:.1} s)",
            table.len(),
            count(Verdict::Named),
            count(Verdict::AmongOthers),
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
