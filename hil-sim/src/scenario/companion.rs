//! The second vehicle of a scenario, as a scenario of its own.

use super::{Companion, Exchange, Mission, Scenario};

/// Added to the seed, so that the companion's sensors have errors of their own.
const SEED: u64 = 1_000_003;

impl Scenario {
    /// What the companion flies: the same ship and water, start and mission beside those of the first vehicle, and its
    /// own slots.
    #[must_use]
    pub fn companion(&self) -> Option<Self> {
        let Companion { address, shift_m } = self.settings.companion?;
        let mut companion = self.clone();
        let settings = &mut companion.settings;
        settings.name += "-companion";
        settings.seed = settings.seed.wrapping_add(SEED);
        settings.companion = None;
        settings.acoustics.address = address;
        settings.acoustics.slots.retain_mut(|slot| {
            let is_own = slot.companion || slot.exchange == Exchange::Downlink;
            slot.companion = false;
            is_own
        });
        let [north_m, east_m] = shift_m;
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
        Some(companion)
    }
}
