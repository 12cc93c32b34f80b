//! How well the formation was kept, by the simulator's truth.

use std::collections::BTreeMap;

use halcyon_model::{SimTruth, Slot, Stamp, VehicleId};
use nalgebra::{Vector2, Vector3};

use super::FormationReport;

/// Two truths further apart in time than this are not compared, seconds.
const APART_S_MAX: f64 = 0.5;

#[derive(Debug, Default)]
struct Follower {
    follows: Option<(VehicleId, Slot)>,
    /// Has settled at least once since it was told to follow, and still follows.
    counts: bool,
    last: Option<Stamp>,
}

/// Sums over the run.
#[derive(Debug, Default)]
pub(super) struct Formation {
    followers: BTreeMap<VehicleId, Follower>,
    samples: u64,
    range_m2: f64,
    slot_m2: f64,
    altitude_m2: f64,
    seconds: f64,
    least_separation_m: Option<f64>,
}

impl Formation {
    pub(super) fn observe_task(&mut self, vehicle: &VehicleId, follows: Option<(VehicleId, Slot)>) {
        let follower = self.followers.entry(vehicle.clone()).or_default();
        if follower.follows != follows {
            *follower = Follower { follows, ..Follower::default() };
        }
    }

    /// `settled` is `None` when the vehicle does not follow.
    pub(super) fn observe_activity(&mut self, vehicle: &VehicleId, settled: Option<bool>) {
        if let Some(follower) = self.followers.get_mut(vehicle) {
            follower.counts = settled.is_some_and(|settled| settled || follower.counts);
        }
    }

    pub(super) fn observe_truth(&mut self, truth: &SimTruth, others: &BTreeMap<VehicleId, SimTruth>) {
        if truth.landed {
            return;
        }
        for other in others.values().filter(|other| other.vehicle != truth.vehicle && !other.landed) {
            let Some(position_ned_m) = at(other, truth.stamp) else { continue };
            let distance_m = (position_ned_m - truth.position_ned_m).norm();
            self.least_separation_m = Some(self.least_separation_m.map_or(distance_m, |least_m| least_m.min(distance_m)));
        }
        let Some(follower) = self.followers.get_mut(&truth.vehicle).filter(|follower| follower.counts) else { return };
        let Some((leader, slot)) = &follower.follows else { return };
        let Some(leader) = others.get(leader) else { return };
        let Some(leader_ned_m) = at(leader, truth.stamp) else { return };

        let (_, _, heading_rad) = leader.ned_from_body.euler_angles();
        let (sin, cos) = heading_rad.sin_cos();
        let offset_m = Vector2::new(slot.forward_m * cos - slot.right_m * sin, slot.forward_m * sin + slot.right_m * cos);
        let apart_m = truth.position_ned_m - leader_ned_m;
        self.range_m2 += (apart_m.xy().norm() - offset_m.norm()).powi(2);
        self.slot_m2 += (apart_m.xy() - offset_m).norm_squared();
        self.altitude_m2 += (-apart_m.z - slot.up_m).powi(2);
        self.samples += 1;
        self.seconds += follower.last.map_or(0.0, |last| truth.stamp.seconds_since(last).clamp(0.0, APART_S_MAX));
        follower.last = Some(truth.stamp);
    }

    pub(super) fn report(&self) -> FormationReport {
        let rms_m = |sum_m2: f64| (self.samples > 0).then(|| (sum_m2 / self.samples as f64).sqrt());
        FormationReport {
            range_rms_m: rms_m(self.range_m2),
            slot_rms_m: rms_m(self.slot_m2),
            altitude_rms_m: rms_m(self.altitude_m2),
            least_separation_m: self.least_separation_m,
            seconds: self.seconds,
        }
    }
}

/// Where a vehicle was at `stamp`, its velocity carried on from its last truth.
fn at(truth: &SimTruth, stamp: Stamp) -> Option<Vector3<f64>> {
    let since_s = stamp.seconds_since(truth.stamp);
    (since_s.abs() <= APART_S_MAX).then(|| truth.position_ned_m + truth.velocity_ned_mps * since_s)
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;

    fn truth(name: &str, stamp_s: f64, north_east_up_m: [f64; 3], heading_deg: f64) -> SimTruth {
        let [north_m, east_m, up_m] = north_east_up_m;
        SimTruth {
            stamp: Stamp::from_secs_f64(stamp_s),
            vehicle: VehicleId::new(name).unwrap(),
            position_ned_m: Vector3::new(north_m, east_m, -up_m),
            velocity_ned_mps: Vector3::zeros(),
            ned_from_body: UnitQuaternion::from_euler_angles(0.0, 0.0, heading_deg.to_radians()),
            rate_body_radps: Vector3::zeros(),
            landed: false,
        }
    }

    /// A leader heading east has its right to the south: a follower 7 m to the right is 7 m south.
    #[test]
    fn a_follower_in_its_slot_has_no_error_and_one_beside_it_has_just_that() {
        let (leader, follower) = (VehicleId::new("l").unwrap(), VehicleId::new("f").unwrap());
        let slot = Slot { forward_m: 0.0, right_m: 7.0, up_m: 1.0 };
        let check = |place: [f64; 3], range_m: f64, slot_m: f64, altitude_m: f64, least_m: f64| {
            let mut formation = Formation::default();
            let others = BTreeMap::from([(leader.clone(), truth("l", 1.0, [10.0, 20.0, 5.0], 90.0))]);
            formation.observe_task(&follower, Some((leader.clone(), slot)));
            formation.observe_activity(&follower, Some(true));
            formation.observe_truth(&truth("f", 1.0, place, 0.0), &others);
            let report = formation.report();
            let close = |value: Option<f64>, expected: f64| assert!((value.unwrap() - expected).abs() < 1e-9, "{report:?}");
            close(report.range_rms_m, range_m);
            close(report.slot_rms_m, slot_m);
            close(report.altitude_rms_m, altitude_m);
            close(report.least_separation_m, least_m);
        };
        check([3.0, 20.0, 6.0], 0.0, 0.0, 0.0, 50.0_f64.sqrt());
        check([2.0, 20.0, 5.5], 1.0, 1.0, 0.5, 64.25_f64.sqrt());
        check([10.0, 27.0, 6.0], 0.0, 98.0_f64.sqrt(), 0.0, 50.0_f64.sqrt());
    }

    #[test]
    fn nothing_counts_before_it_settled_or_after_it_left() {
        let (leader, follower) = (VehicleId::new("l").unwrap(), VehicleId::new("f").unwrap());
        let mut formation = Formation::default();
        let others = BTreeMap::from([(leader.clone(), truth("l", 1.0, [0.0; 3], 0.0))]);
        formation.observe_task(&follower, Some((leader, Slot { forward_m: 0.0, right_m: 7.0, up_m: 0.0 })));
        formation.observe_activity(&follower, Some(false));
        formation.observe_truth(&truth("f", 1.0, [0.0, 30.0, 0.0], 0.0), &others);
        formation.observe_activity(&follower, Some(true));
        formation.observe_activity(&follower, None);
        formation.observe_truth(&truth("f", 1.1, [0.0, 30.0, 0.0], 0.0), &others);
        assert_eq!(formation.report().slot_rms_m, None);
        assert_eq!(formation.report().least_separation_m, Some(30.0), "separation always counts");
    }
}
