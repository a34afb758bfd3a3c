//! Every tool and the board accept and refuse the same parameters.

use backseat_app::parameters::{PARAMETERS, Parameter, ParameterStore, Settings};
use backseat_core::parameters::{Kind, SECTIONS, joint_check};
use backseat_logs::{BoardFile, VehicleFile};
use std::path::Path;

/// Values below, at, inside and above the range.
fn drawn(parameter: &Parameter) -> [f64; 8] {
    let Parameter { name, .. } = parameter;
    let (min, max) = (parameter.min, parameter.max);
    let share = name.bytes().fold(0.5, |share: f64, byte| (share * 31.0 + f64::from(byte) / 256.0).fract());
    let inside = min + share * (max - min);
    let inside = if parameter.kind == Kind::Whole { inside.trunc() } else { inside };
    let beyond = 1e-9_f64.max((max - min) * 1e-9);
    [min - beyond, min, inside, parameter.default(), max, max + beyond, f64::NAN, f64::INFINITY]
}

/// The file that `navigate` and `params import` read, with one number of its own.
fn file_with(parameter: &Parameter, value: f64) -> String {
    let mut settings = Settings::DEFAULT;
    parameter.set(&mut settings, value);
    let mut file = VehicleFile::reference();
    file.take(&settings);
    let mut text = file.to_toml("");
    if parameter.section() == "app" {
        let key = parameter.name.trim_start_matches("app.");
        text += &format!("\n[app]\n{key} = {}\n", if value.is_nan() { "nan".into() } else { format!("{value:?}") });
    }
    // as TOML writes it
    text.replace("NaN", "nan")
}

/// What the board says to the values of an imported file.
fn board_takes(values: &[(String, f64)]) -> bool {
    let mut store = ParameterStore::new();
    store.begin();
    values.iter().all(|(name, value)| store.set(name, *value, false).is_ok())
        && store.commit(false, |_, _, _| true).is_ok()
}

#[test]
fn navigate_import_and_board_accept_and_refuse_the_same() {
    let (mut accepted, mut refused, mut together) = (0, 0, 0);
    for parameter in PARAMETERS.iter().filter(|parameter| parameter.section() != "effects") {
        for value in drawn(parameter) {
            // What a whole number cannot hold never gets as far as a vehicle file; `[app]` is written as text.
            let mut held = Settings::DEFAULT;
            parameter.set(&mut held, value);
            if parameter.kind == Kind::Whole && parameter.section() != "app" && parameter.get(&held) != value {
                continue;
            }
            let text = file_with(parameter, value);
            let navigate = VehicleFile::parse(&text, Path::new("v.toml"));
            let import = BoardFile::parse(&text, Path::new("v.toml"));
            let board = board_takes(&[(parameter.name.to_owned(), value)]);
            let name = parameter.name;
            assert_eq!(navigate.is_ok(), import.is_ok(), "{name} = {value}");
            // The cruise speed is the board's alone: a file without [app] says nothing of it.
            let mut settings = Settings::DEFAULT;
            parameter.set(&mut settings, value);
            let check = |speed_mps| joint_check(&settings.vehicle, speed_mps, &settings.learnt);
            let too_slow = parameter.section() != "app" && check(None).is_ok();
            let too_slow = too_slow && check(Some(settings.control.cruise_speed_mps)).is_err();
            assert_eq!(
                navigate.is_ok(),
                board || (too_slow && parameter.admits(value)),
                "{name} = {value}: {navigate:?}"
            );
            if let (Ok(import), false) = (&import, too_slow) {
                assert!(board_takes(&import.flatten()), "{name} = {value}");
            }
            match navigate {
                Ok(_) => accepted += 1,
                Err(error) if parameter.admits(value) => {
                    let text = error.to_string();
                    assert!(text.contains("v.toml:") && text.contains("do not go together"), "{text}");
                    together += 1;
                }
                Err(error) => {
                    let text = error.to_string();
                    let (unit, value) = (format!("({})", parameter.unit), format!("{value}"));
                    assert!(
                        [name, "v.toml:", "outside", &unit, &value].iter().all(|part| text.contains(part)),
                        "{text}"
                    );
                    refused += 1;
                }
            }
        }
    }
    println!("{accepted} accepted, {refused} outside their range, {together} that do not go together");
    assert!(accepted > 400 && refused > 400 && together > 5);
}

#[test]
fn every_section_and_row_explains_itself() {
    for parameter in PARAMETERS {
        let section = parameter.section();
        let known = ["app", "effects"].contains(&section) || SECTIONS.iter().any(|known| known.name == section);
        assert!(known, "{}", parameter.name);
        let sentence = section == "effects" || parameter.help.ends_with('.');
        assert!(sentence && !parameter.help.is_empty() && !parameter.unit.is_empty(), "{}", parameter.name);
    }
}
