//! What many fly through, drawn from a seed.

use std::f64::consts::FRAC_1_SQRT_2;

use halcyon_model::Slot;
use nalgebra::Vector3;

use super::super::chance::Chance;
use super::craft::Airframe;

/// How the followers stand about their leader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Formation {
    /// Beside it, alternately on its right and left.
    Line,
    /// Behind it on both sides.
    Vee,
    /// Behind it, one after the other.
    Column,
}

impl Formation {
    /// Every one.
    pub const ALL: [Self; 3] = [Self::Line, Self::Vee, Self::Column];

    pub(super) fn slot(self, index: usize, spacing_m: f64) -> Slot {
        let out_m = spacing_m * (index / 2 + 1) as f64;
        let side = if index.is_multiple_of(2) { 1.0 } else { -1.0 };
        let (forward_m, right_m) = match self {
            Self::Line => (0.0, side * out_m),
            Self::Vee => (-out_m * FRAC_1_SQRT_2, side * out_m * FRAC_1_SQRT_2),
            Self::Column => (-spacing_m * (index + 1) as f64, 0.0),
        };
        Slot { forward_m, right_m, up_m: 0.0 }
    }
}

/// What happens to them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trouble {
    /// Nothing but the leader's turns, the wind and the radio.
    None,
    /// Two followers change places, again and again.
    SlotChanges,
    /// Another vehicle flies through, at the same height.
    Passing,
    /// One receiver jumps, and comes back.
    GnssJump {
        /// By so much, metres.
        jump_m: f64,
        /// For so long, seconds.
        for_s: f64,
    },
    /// One vehicle neither hears nor is heard.
    Silence {
        /// For so long, seconds.
        for_s: f64,
    },
}

/// Who flies the leader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lead {
    /// A pilot, in LOITER, who wheels about as he likes.
    Pilot,
    /// Its own vehicle-link, to one place after the other. It says where it means to be.
    Guided,
    /// The same, but nobody hears where it means to be.
    GuidedSilently,
}

/// A flight of a leader and its followers.
#[derive(Debug, Clone, PartialEq)]
pub struct SwarmScenario {
    /// How many follow.
    pub followers: usize,
    /// How they stand.
    pub formation: Formation,
    /// How far apart neighbours stand, metres.
    pub spacing_m: f64,
    /// The longest delay of the radio, seconds; each message has its own, from 20 ms to this, so that they overtake each other.
    pub delay_s: f64,
    /// Fraction of messages lost, for each receiver by itself.
    pub loss: f64,
    /// What happens.
    pub trouble: Trouble,
    /// Who flies the leader.
    pub lead: Lead,
    /// Whether the separation filter keeps distances; without it a formation shows how near it would come.
    pub separation: bool,
    /// Standard deviation of each receiver's error, metres.
    pub wander_m: f64,
    /// Standard deviation of the gusts' push, metres per second squared.
    pub gust_mps2: f64,
    /// How long it lasts after the followers have settled in, seconds.
    pub duration_s: f64,
    /// Seed of everything: the leader's way, airframes, gusts, receivers, losses.
    pub seed: u64,
}

impl SwarmScenario {
    /// One follower at 5 m, as the issue has it: 30 % of states lost, up to 300 ms late, a leader that turns and wheels about.
    #[must_use]
    pub fn pair(seed: u64) -> Self {
        Self {
            followers: 1,
            formation: Formation::Line,
            spacing_m: 5.0,
            delay_s: 0.3,
            loss: 0.3,
            trouble: Trouble::None,
            lead: Lead::Pilot,
            separation: true,
            wander_m: 0.02,
            gust_mps2: 0.3,
            duration_s: 60.0,
            seed,
        }
    }

    /// Nine followers, 7 m apart.
    #[must_use]
    pub fn nine(formation: Formation, trouble: Trouble, seed: u64) -> Self {
        Self { followers: 9, formation, spacing_m: 7.0, trouble, ..Self::pair(seed) }
    }

    pub(super) fn slots(&self) -> Vec<Slot> {
        (0..self.followers).map(|index| self.formation.slot(index, self.spacing_m)).collect()
    }

    /// How far the outermost slot is from the leader, metres.
    fn reach_m(&self) -> f64 {
        self.slots().iter().map(|slot| slot.forward_m.hypot(slot.right_m)).fold(0.0, f64::max)
    }

    /// Gains and a lag within 30 % of what guidance believes.
    pub(super) fn airframe(&self, chance: &mut Chance) -> Airframe {
        Airframe {
            position_gain_hz: chance.between(0.7, 1.3),
            velocity_gain_hz: 2.0 * chance.between(0.7, 1.3),
            lean_lag_s: 0.26 * chance.between(0.7, 1.3),
            gust_mps2: self.gust_mps2,
            wander_m: self.wander_m,
        }
    }
}

/// A pilot who keeps changing his mind, within what the outermost slot can fly.
pub(super) struct Pilot {
    chance: Chance,
    velocity_mps: Vector3<f64>,
    turn_radps: f64,
    left_s: f64,
    turn_radps_max: f64,
}

/// Fastest leader, metres per second.
const LEADER_MPS_MAX: f64 = 3.0;
/// Fastest swing of the outermost slot, metres per second.
const SWING_MPS_MAX: f64 = 2.5;
/// Fastest turn, radians per second: twice the thesis's sweep.
const TURN_RADPS_MAX: f64 = 0.35;
/// Further out than this the pilot turns for home, metres.
const OUT_M: f64 = 100.0;

impl Pilot {
    pub(super) fn new(scenario: &SwarmScenario, chance: Chance) -> Self {
        let turn_radps_max = (SWING_MPS_MAX / scenario.reach_m().max(1.0)).min(TURN_RADPS_MAX);
        Self { chance, velocity_mps: Vector3::zeros(), turn_radps: 0.0, left_s: 5.0, turn_radps_max }
    }

    /// The velocity and the turn that he asks for.
    pub(super) fn sticks(&mut self, here_m: Vector3<f64>, dt_s: f64) -> (Vector3<f64>, f64) {
        self.left_s -= dt_s;
        if self.left_s <= 0.0 {
            self.left_s = self.chance.between(3.0, 9.0);
            let course_rad = if here_m.xy().norm() > OUT_M {
                (-here_m.y).atan2(-here_m.x)
            } else {
                self.chance.between(0.0, std::f64::consts::TAU)
            };
            let speed_mps = if self.chance.unit() < 0.2 { 0.0 } else { self.chance.between(1.0, LEADER_MPS_MAX) };
            self.velocity_mps = Vector3::new(course_rad.cos(), course_rad.sin(), 0.0) * speed_mps;
            let turns = self.chance.unit() < 0.6;
            self.turn_radps = if turns { self.chance.between(-1.0, 1.0) * self.turn_radps_max } else { 0.0 };
        }
        (self.velocity_mps, self.turn_radps)
    }
}
