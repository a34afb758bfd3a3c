//! The least that data sheets state: who declares less of a device says that it is better than it is sold as.

/// One sigma that no device of its kind undercuts.
struct DataSheet {
    parameter: &'static str,
    least: f64,
    unit: &'static str,
    source: &'static str,
}

/// Zero is no declaration: what is known, or left out.
const DATA_SHEETS: [DataSheet; 8] = [
    DataSheet {
        parameter: "app.receiver_bias_m",
        least: 0.4,
        unit: "m",
        source: "a GNSS receiver with satellite corrections, 95 % within 1 m (WAAS Performance Standard, 2008); without \
                 them 1 to 3 m; less by RTK alone",
    },
    DataSheet {
        parameter: "prior.heading_rad",
        least: 0.0087,
        unit: "rad",
        source: "compasses after calibration, 0.5 degrees (OS5000, 3DM-GX3-25)",
    },
    DataSheet {
        parameter: "sensors.attitude_rad",
        least: 0.0035,
        unit: "rad",
        source: "repeatability of a MEMS attitude sensor, 0.2 degrees (3DM-GX3-25)",
    },
    DataSheet {
        parameter: "sensors.rates_radps",
        least: 0.0016,
        unit: "rad/s",
        source: "0.03 degrees/s/sqrt(Hz) over 10 Hz (3DM-GX3-25)",
    },
    DataSheet {
        parameter: "sensors.depth_m",
        least: 0.01,
        unit: "m",
        source: "a quartz cell, 0.01 % of 100 m (Paroscientific Digiquartz)",
    },
    DataSheet {
        parameter: "sensors.dvl_mps",
        least: 0.001,
        unit: "m/s",
        source: "0.2 % and 1 mm/s (Workhorse Navigator)",
    },
    DataSheet {
        parameter: "sensors.range_m",
        least: 0.04,
        unit: "m",
        source: "a modem's times are whole tenths of a millisecond (Micro-Modem)",
    },
    DataSheet { parameter: "sensors.gnss_m", least: 0.01, unit: "m", source: "a fix by RTK" },
];

/// A sentence for each declared one sigma that is below its data sheet; `value` by the parameter's name.
pub fn below(value: impl Fn(&str) -> Option<f64>) -> Vec<(&'static str, String)> {
    DATA_SHEETS
        .iter()
        .filter_map(|sheet| {
            let declared = value(sheet.parameter).filter(|declared| *declared > 0.0 && *declared < sheet.least)?;
            let DataSheet { parameter, least, unit, source } = sheet;
            let text = format!(
                "{declared} {unit} is less than data sheets state, {least} {unit}: {source}; sigma and protection level \
                 are then too small"
            );
            Some((*parameter, text))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::VehicleFile;

    #[test]
    fn the_reference_vehicle_is_as_data_sheets_have_it_and_a_better_one_is_named() {
        let reference = VehicleFile::reference().flatten();
        let of = |name: &str| reference.iter().find(|(other, _)| other == name).map(|(_, value)| *value);
        assert!(below(of).is_empty());
        let known = DATA_SHEETS.iter().filter(|sheet| of(sheet.parameter).is_some()).count();
        assert_eq!(known, DATA_SHEETS.len() - 1, "all but the board's own are in a vehicle file");
        let said = below(|name| (name == "sensors.depth_m").then_some(0.001));
        assert!(said.len() == 1 && said[0].0 == "sensors.depth_m" && said[0].1.contains("Digiquartz"), "{said:?}");
        assert!(below(|_| Some(0.0)).is_empty());
    }
}
