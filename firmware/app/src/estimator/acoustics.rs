//! Packets and pings: the vehicle is cloned where sound leaves or arrives, and its range fused when it is known.

use super::Estimator;
use crate::inputs::installation::arm_along_path_m;
use crate::inputs::{AcousticReport, Loss, Packet, PacketProgress, PeerPacket, TURNAROUND_S};
use crate::parameters::Settings;
use crate::time::UtcClock;
use backseat_core::navigation::{AcousticPath, CloneId, Measurement, NavigationConfig, ShipEnd, VehicleEnd};

impl Estimator {
    /// A report of the modem: the vehicle is cloned when a packet begins, and its range fused when it is complete.
    pub(super) fn follow(&mut self, report: &AcousticReport, settings: &Settings, clock: &UtcClock) {
        match *report {
            AcousticReport::PingSent => self.begin_ping(),
            AcousticReport::PingReply { travel_s } => self.end_ping(travel_s, settings),
            _ => {}
        }
        match self.packets.take(report, self.navigator.time_us(), clock, &settings.app) {
            PacketProgress::Waiting => {}
            PacketProgress::Lost => self.drop_clones(),
            PacketProgress::Begins(id) => {
                self.drop_clones();
                match self.navigator.clone_vehicle_observed(self.naming.observer()) {
                    // as many as packets
                    Ok(clone) => {
                        let _ = self.clones.push((id, clone));
                    }
                    Err(_) => self.packets.give_up(Loss::NotReady),
                }
            }
            PacketProgress::Complete(id, packet) => {
                if let Some(clone) = self.clone_of(id) {
                    self.fuse_packet(clone, &packet, settings);
                }
                self.drop_clones();
            }
            PacketProgress::Peer(id, packet) => {
                if let Some(clone) = self.clone_of(id) {
                    self.fuse_peer(clone, &packet, settings);
                }
                self.drop_clones();
            }
        }
    }

    /// The vehicle when the packet of this number began.
    fn clone_of(&self, id: u8) -> Option<CloneId> {
        self.clones.iter().find(|(packet, _)| *packet == id).map(|(_, clone)| *clone)
    }

    /// Drops the vehicles of packets that are no longer under way.
    pub(super) fn drop_clones(&mut self) {
        let Self { clones, packets, navigator, naming, .. } = self;
        clones.retain(|(id, clone)| {
            let kept = packets.is_under_way(*id);
            if !kept {
                navigator.drop_clone_observed(*clone, naming.observer());
            }
            kept
        });
    }

    fn begin_ping(&mut self) {
        self.drop_ping();
        // without room for it there is no range
        self.ping = self.navigator.clone_vehicle_observed(self.naming.observer()).ok();
    }

    fn drop_ping(&mut self) {
        if let Some(clone) = self.ping.take() {
            self.navigator.drop_clone_observed(clone, self.naming.observer());
        }
    }

    /// The answer to a ping: half of the round trip, with the ship where its last packet and its velocity put it.
    fn end_ping(&mut self, travel_s: Option<f64>, settings: &Settings) {
        let app = &settings.app;
        if let (Some(clone), Some(travel_s), Some(&heard)) = (self.ping, travel_s, self.packets.heard_ship())
            && app.use_range
        {
            let reply_us = self.navigator.time_us();
            if let Some(ship) = heard.moved_on(reply_us) {
                self.adopt_ship_depth(heard.transducer_depth_m);
                let installation = &app.installation;
                let range_m = installation.sound_speed_mps * (travel_s - installation.transducer_delay_s);
                if (0.0..=app.range_max_m).contains(&range_m) {
                    let arm_m = &installation.transducer_arm_m;
                    let arm_m =
                        arm_along_path_m(self.navigator.state(), arm_m, ship.position_m, heard.transducer_depth_m);
                    let path = |bridge_s| AcousticPath {
                        vehicle: VehicleEnd::Delayed { clone, bridge_s },
                        ship: ShipEnd::Reported(ship),
                    };
                    let (outward, back) = (path(0.0), path(2.0 * travel_s + TURNAROUND_S));
                    self.fuse_measurement(&Measurement::TwoWayRange { outward, back, range_m: range_m - arm_m });
                }
            }
        }
        self.drop_ping();
    }

    fn fuse_packet(&mut self, clone: CloneId, packet: &Packet, settings: &Settings) {
        let app = &settings.app;
        let arm_m = &app.installation.transducer_arm_m;
        let arm_m = arm_along_path_m(self.navigator.state(), arm_m, packet.ship.position_m, packet.transducer_depth_m);
        self.adopt_ship_depth(packet.transducer_depth_m);
        self.ship = Some(packet.ship);
        let path = AcousticPath {
            vehicle: VehicleEnd::Delayed { clone, bridge_s: packet.bridge_us as f64 * 1e-6 },
            ship: ShipEnd::Reported(packet.ship),
        };
        if app.use_range {
            self.fuse_measurement(&Measurement::Range { path, range_m: packet.range_m - arm_m });
        }
        if let Some(range_rate_mps) = packet.range_rate_mps.filter(|_| app.use_range_rate) {
            self.fuse_measurement(&Measurement::RangeRate { path, range_rate_mps });
        }
    }

    fn fuse_peer(&mut self, clone: CloneId, packet: &PeerPacket, settings: &Settings) {
        let PeerPacket { bridge_us, range_m, peer } = *packet;
        let [north_m, east_m, depth_m] = peer.position_m;
        let arm_m = &settings.app.installation.transducer_arm_m;
        let arm_m = arm_along_path_m(self.navigator.state(), arm_m, [north_m, east_m], depth_m);
        let path = AcousticPath {
            vehicle: VehicleEnd::Delayed { clone, bridge_s: bridge_us as f64 * 1e-6 },
            ship: ShipEnd::Peer(peer),
        };
        self.fuse_measurement(&Measurement::Range { path, range_m: range_m - arm_m });
    }

    /// The ship's packets give the depth of its transducer.
    fn adopt_ship_depth(&mut self, depth_m: f64) {
        if self.transducer_depth_m != Some(depth_m) {
            let config = NavigationConfig { ship_transducer_depth_m: depth_m, ..*self.navigator.config() };
            if self.navigator.reconfigure(&config).is_ok() {
                self.transducer_depth_m = Some(depth_m);
            }
        }
    }
}
