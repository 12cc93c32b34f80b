//! The thesis's interlocks (§6.7.4.4, §6.8): a follower climbs to a safe height before it follows; it follows only a leader that
//! flies, in an allowed mode, and is heard.

use halcyon_model::{FlightMode, Slot, Stamp, VehicleId};

use super::limits::{FailSafeLimits, Limits};
use super::track::Track;

/// Why a follower may not follow.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FollowRefusal {
    /// Not heard at all, or not for too long.
    #[error("leader {leader} has not been heard for {silent_s:.1} s")]
    Silent {
        /// Whom.
        leader: VehicleId,
        /// For how long; infinite if never.
        silent_s: f64,
    },
    /// Its position has just jumped: nobody knows where it is.
    #[error("leader {leader}'s position jumped")]
    Jumped {
        /// Whom.
        leader: VehicleId,
    },
    /// In a mode that isn't in the list.
    #[error("leader {leader} is in {mode}, which is not one of {allowed}")]
    Mode {
        /// Whom.
        leader: VehicleId,
        /// Its mode.
        mode: String,
        /// The list.
        allowed: String,
    },
    /// On the ground, or its motors are off.
    #[error("leader {leader} is not flying")]
    NotFlying {
        /// Whom.
        leader: VehicleId,
    },
    /// The slot is nearer than the least separation.
    #[error("the slot is {distance_m:.1} m from the leader, and {least_m:.1} m is the least")]
    SlotTooClose {
        /// Distance of the slot from the leader.
        distance_m: f64,
        /// Least separation.
        least_m: f64,
    },
    /// The follower itself isn't under guidance.
    #[error("own mode is {mode}, not GUIDED")]
    OwnMode {
        /// Own mode.
        mode: String,
    },
}

/// Whether the slot leaves the least separation to the leader itself.
///
/// # Errors
/// [`FollowRefusal::SlotTooClose`].
pub fn slot_is_clear(slot: &Slot, limits: &Limits) -> Result<(), FollowRefusal> {
    let distance_m = (slot.forward_m.powi(2) + slot.right_m.powi(2) + slot.up_m.powi(2)).sqrt();
    if distance_m >= limits.separation_m_min {
        Ok(())
    } else {
        // A slot that isn't a number lands here too.
        Err(FollowRefusal::SlotTooClose { distance_m, least_m: limits.separation_m_min })
    }
}

/// Whether the leader may be followed now. Height and own mode are looked at by the caller: they decide how, not whether.
///
/// # Errors
/// Why not, the weightiest reason first.
pub fn may_follow(
    leader: &VehicleId,
    track: Option<&Track>,
    limits: &Limits,
    fail_safe: &FailSafeLimits,
    now: Stamp,
) -> Result<(), FollowRefusal> {
    let leader = leader.clone();
    let Some(track) = track else { return Err(FollowRefusal::Silent { leader, silent_s: f64::INFINITY }) };
    let silent_s = track.silent_s(now);
    if silent_s >= fail_safe.leader_silent_s {
        return Err(FollowRefusal::Silent { leader, silent_s });
    }
    if !track.state.armed || -track.state.position_ned_m.z < 0.4 * limits.safe_height_m {
        return Err(FollowRefusal::NotFlying { leader });
    }
    if !limits.leader_may_be_in(track.mode()) {
        let mode = mode_name(track.mode());
        return Err(FollowRefusal::Mode { leader, mode, allowed: limits.leader_modes.join(", ") });
    }
    Ok(())
}

/// A mode's name, or its number.
#[must_use]
pub fn mode_name(mode: FlightMode) -> String {
    mode.name().map_or_else(|| format!("mode {}", mode.copter_number()), str::to_owned)
}
