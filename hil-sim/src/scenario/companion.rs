//! The further vehicles of a scenario, each as a scenario of its own.

use super::{Companion, Exchange, Mission, Scenario};

/// Added to the seed for each, so that its sensors have errors of their own.
const SEED: u64 = 1_000_003;

impl Scenario {
    /// What the companions fly: the same ship and water, start and mission beside those of the first vehicle, and slots
    /// of their own.
    pub fn companions(&self) -> Vec<Self> {
        (1_u64..).zip(&self.settings.companions).map(|(place, companion)| self.companion(place, companion)).collect()
    }

    fn companion(&self, place: u64, &Companion { address, shift_m: [north_m, east_m] }: &Companion) -> Self {
        let mut companion = self.clone();
        let settings = &mut companion.settings;
        settings.name += "-companion";
        settings.seed = settings.seed.wrapping_add(SEED * place);
        settings.companions.clear();
        settings.acoustics.address = address;
        settings.acoustics.slots.retain_mut(|slot| {
            let is_own = slot.companion == Some(address) || slot.exchange == Exchange::Downlink;
            slot.companion = None;
            is_own
        });
        settings.start.x_m += north_m;
        settings.start.y_m += east_m;
        for [x_m, y_m] in &mut settings.fence.corners_m {
            *x_m += north_m;
            *y_m += east_m;
        }
        match &mut settings.mission {
            Mission::Lawnmower(lawnmower) => {
                lawnmower.first_line_m[0] += north_m;
                lawnmower.first_line_m[1] += east_m;
            }
            Mission::Waypoints(waypoints) => {
                for waypoint in waypoints {
                    waypoint.x_m += north_m;
                    waypoint.y_m += east_m;
                }
            }
        }
        companion
    }
}
