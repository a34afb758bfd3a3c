//! Ending a mission from the ship: who is meant, and are you sure?

use anyhow::{bail, ensure};
use backseat_analysis::topside_config::Vehicle;
use backseat_report::console;
use backseat_topside::{ABORT_PACKETS, Topside};
use backseat_wire::abort::EVERYBODY;
use std::io::{BufRead, IsTerminal};

/// The name that means every vehicle with the key.
const ALL: &str = "all";

/// The question on the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Prompt {
    /// None.
    #[default]
    Closed,
    /// Whose mission?
    Which,
    /// Really that of this modem address?
    Sure(u8),
}

impl Prompt {
    /// A key was pressed while the question is open, or `a`, which opens it. What there is to say of it.
    pub fn key(&mut self, key: char, topside: &mut Topside, vehicles: &[Vehicle]) -> Option<String> {
        match std::mem::take(self) {
            Self::Closed if key == 'a' && topside.config().key.is_set() => *self = Self::Which,
            Self::Closed if key == 'a' => {
                return Some("no abort without a key: set modem.key to the vehicle's app.acoustic_key".to_owned());
            }
            Self::Closed => {}
            Self::Which => {
                let index = key.to_digit(10).map(|digit| digit as usize);
                let address = match index {
                    Some(0) => Some(EVERYBODY),
                    Some(index) => vehicles.get(index - 1).map(|vehicle| vehicle.address),
                    None => None,
                };
                match address {
                    Some(address) => *self = Self::Sure(address),
                    None => return Some("no abort".to_owned()),
                }
            }
            Self::Sure(address) if key == 'y' => {
                return topside.abort(address).err().map(|refused| refused.to_string());
            }
            Self::Sure(_) => return Some("no abort".to_owned()),
        }
        None
    }

    /// The question in words.
    pub fn text(&self, vehicles: &[Vehicle]) -> Option<String> {
        match self {
            Self::Closed => None,
            Self::Which => {
                let names = vehicles.iter().zip(1..).map(|(vehicle, number)| format!("{number} {}", vehicle.name));
                let names: Vec<String> = names.chain([format!("0 {ALL}")]).collect();
                Some(format!("end the mission of: {}; any other key: of none", names.join(", ")))
            }
            Self::Sure(address) => {
                Some(format!("end the mission of {}? y: yes; any other key: no", name(*address, vehicles)))
            }
        }
    }
}

/// The vehicle with this modem address.
pub fn name(address: u8, vehicles: &[Vehicle]) -> String {
    if address == EVERYBODY {
        return "every vehicle that has the key".to_owned();
    }
    let vehicle = vehicles.iter().find(|vehicle| vehicle.address == address);
    vehicle.map_or_else(|| format!("vehicle {address}"), |vehicle| vehicle.name.clone())
}

/// `--abort NAME`: asks for the name once more, unless `yes`.
pub fn order(topside: &mut Topside, vehicles: &[Vehicle], wanted: &str, yes: bool) -> anyhow::Result<()> {
    let vehicle = vehicles.iter().find(|vehicle| vehicle.name == wanted);
    let address = match vehicle {
        Some(vehicle) => vehicle.address,
        None if wanted == ALL => EVERYBODY,
        None => {
            let names: Vec<&str> = vehicles.iter().map(|vehicle| vehicle.name.as_str()).chain([ALL]).collect();
            bail!("--abort {wanted}: no vehicle of that name; expected {}", names.join(" or "))
        }
    };
    // refused before anybody is asked
    topside.abort(address).map_err(|refused| anyhow::anyhow!("--abort {wanted}: {refused}"))?;
    if !yes {
        ensure!(std::io::stdin().is_terminal(), "--abort {wanted}: needs a terminal to ask on, or --yes");
        console::say(&format!("This ends the mission of {}. Type {wanted} to do it: ", name(address, vehicles)));
        let mut line = String::new();
        std::io::stdin().lock().read_line(&mut line)?;
        ensure!(line.trim() == wanted, "--abort {wanted}: not confirmed; nothing is sent");
    }
    eprintln!("the next {ABORT_PACKETS} downlink slots carry the abort");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_topside::Config;
    use backseat_wire::ship_state::Key;

    #[test]
    fn it_takes_three_keys_and_the_secret() {
        let vehicles = [Vehicle { address: 2, name: "iver3".to_owned() }];
        let mut topside = Topside::new(Config { key: Key::new([9; 16]), ..Config::reference() }).unwrap();
        let mut prompt = Prompt::default();
        let mut press = |keys: &str, topside: &mut Topside| -> Vec<String> {
            keys.chars().filter_map(|key| prompt.key(key, topside, &vehicles)).collect()
        };
        // not meant, not sure, and no such vehicle
        for keys in ["ax", "a1n", "a2", "1", "y", "ay"] {
            press(keys, &mut topside);
            assert_eq!(topside.aborting(), None, "{keys}");
        }
        assert!(press("a1y", &mut topside).is_empty());
        assert_eq!(topside.aborting(), Some((2, ABORT_PACKETS)));
        press("a0y", &mut topside);
        assert_eq!(topside.aborting(), Some((EVERYBODY, ABORT_PACKETS)));
        let mut topside = Topside::new(Config::reference()).unwrap();
        assert!(press("a", &mut topside)[0].contains("without a key") && press("1y", &mut topside).is_empty());
        assert_eq!(topside.aborting(), None);
    }

    #[test]
    fn an_order_names_its_vehicle() {
        let vehicles = [Vehicle { address: 2, name: "iver3".to_owned() }];
        let mut keyed = Topside::new(Config { key: Key::new([9; 16]), ..Config::reference() }).unwrap();
        assert!(order(&mut keyed, &vehicles, "iver4", true).unwrap_err().to_string().contains("expected iver3 or all"));
        assert!(order(&mut keyed, &vehicles, "iver3", true).is_ok() && keyed.aborting().is_some());
        let mut open = Topside::new(Config::reference()).unwrap();
        assert!(order(&mut open, &vehicles, "all", true).unwrap_err().to_string().contains("without a key"));
    }
}
