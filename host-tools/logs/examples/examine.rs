//! What the examination of logs finds, one line each: `examine FILE…`.
use backseat_logs::importers;
use backseat_logs::log::plausibility::Examination;

fn main() {
    for path in std::env::args().skip(1) {
        match importers::read(std::path::Path::new(&path)) {
            Err(error) => println!("{path}: {error}"),
            Ok(imported) => {
                let began = std::time::Instant::now();
                let found = Examination::of(&imported.log);
                println!("== {path} {} rows, {:.2} s", imported.log.rows.len(), began.elapsed().as_secs_f64());
                for finding in &found.findings {
                    println!("{:?}: {}", finding.severity, finding.message);
                }
                if std::env::var("UNTESTED").is_ok() {
                    for untested in &found.untested {
                        println!("  untested {}: {}", untested.test, untested.why);
                    }
                }
            }
        }
    }
}
