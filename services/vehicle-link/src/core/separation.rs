//! The separation filter: the last word on every commanded velocity.
//!
//! For each vehicle heard, the speed of closing in is limited to what can still be braked before the kept distance, with a
//! reaction time; inside the kept distance the vehicle opens. Where an obstacle stands between the vehicle and its goal it goes
//! round, by the shorter side, on the right when both are equal.
//!
//! Who follows gives way: a vehicle that isn't following is not pushed along by one that is, or the two would drive each other
//! faster and faster (the follower after its slot, the leader away from the follower). Inside the least separation nobody waits
//! for the other.
//!
//! Where several leave a way, the nearest velocity to the wanted one that keeps every distance is taken; where they leave none, the
//! one that breaks them least.

use nalgebra::Vector3;

use halcyon_model::{Activity, Stamp};

use super::limits::Limits;
use super::track::Track;

/// Braking that the filter counts on, metres per second squared: less than any multicopter can do.
const BRAKING_MPS2: f64 = 1.5;
/// From the decision to the deceleration, seconds: a guidance tick, the link, and the autopilot's attitude loop.
const REACTION_S: f64 = 0.6;
/// Gain with which a kept distance that was broken is restored, 1/s.
const OPENING_HZ: f64 = 1.0;
/// Speed at which it is restored at most, relative to the obstacle, metres per second.
const OPENING_MPS_MAX: f64 = 2.0;
/// How an autopilot goes after a reference that is ahead of it, 1/s: ArduCopter's PSC_POSXY_P, PSC_NE_POS_P since 4.7.
const CHASE_HZ: f64 = 1.0;
/// A silent vehicle may have gone anywhere: its kept distance grows by this much a second, up to [`GROWTH_M_MAX`].
const GROWTH_MPS: f64 = 0.5;
const GROWTH_M_MAX: f64 = 3.0;
/// A state is carried on for so long, seconds; then the vehicle may stand there, or may fly on, for so long.
const STOPPED_S: f64 = 1.0;
const ONWARD_S_MAX: f64 = 5.0;
/// A flying vehicle of which nothing has come for so long is forgotten, seconds; a parked one stays where it was.
const FORGET_S: f64 = 30.0;
/// Passes over all constraints; a handful of vehicles needs two or three, ten in a crowd some dozen.
const PASSES: usize = 60;
/// What is refused by less than this is kept, metres per second.
const KEPT_MPS: f64 = 1e-9;
/// And what is still refused by more than this after all passes can't be kept, metres per second.
const REFUSED_MPS: f64 = 0.05;
/// No constraint presses by more than this, metres per second: far above what flies, and far below where contradicting ones would press
/// each other beyond all numbers.
const PRESSED_MPS_MAX: f64 = 1e3;
/// Where not everything can be kept, how easily a constraint gives at its kept distance. Nearer it gives less.
const GIVE: f64 = 0.5;

/// Something to stay clear of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    /// Fleet-local position, metres.
    pub position_ned_m: Vector3<f64>,
    /// Velocity, metres per second.
    pub velocity_ned_mps: Vector3<f64>,
    /// Distance to keep, metres, margin included.
    pub keep_m: f64,
    /// It gives way to us: only its moving off counts, not its coming on, unless it is nearer than this, metres.
    pub yields_beyond_m: Option<f64>,
}

/// The obstacle that a track is at `now`; `None` once it is forgotten. `own_follows`: whether this vehicle keeps a slot itself.
#[must_use]
pub fn obstacle(track: &Track, own_follows: bool, limits: &Limits, now: Stamp) -> Option<Obstacle> {
    let silent_s = track.silent_s(now);
    if track.parked() {
        let position_ned_m = track.place_ned_m();
        let keep_m = limits.separation_parked_m;
        return Some(Obstacle { position_ned_m, velocity_ned_mps: Vector3::zeros(), keep_m, yields_beyond_m: None });
    }
    // By receipt, not by stamp: one that has lost its autopilot, or the time, is in the way all the same.
    if track.unheard_s(now) > FORGET_S {
        return None;
    }
    let motion = track.predict(now, 0.0);
    let it_follows = matches!(track.state.activity, Activity::Following { .. });
    let growth_m = (GROWTH_MPS * (silent_s - 1.0)).clamp(0.0, GROWTH_M_MAX);
    Some(Obstacle {
        position_ned_m: motion.position_ned_m,
        // Beyond the prediction nobody knows how it moves.
        velocity_ned_mps: if silent_s > 1.5 { Vector3::zeros() } else { motion.velocity_ned_mps },
        keep_m: limits.separation_m_min + limits.separation_margin_m + growth_m,
        yields_beyond_m: (it_follows && !own_follows).then_some(limits.separation_m_min),
    })
}

/// Where a vehicle is that has been silent for more than a second and has not stopped, as [`obstacle`] has it, but flies on: nobody
/// knows which. `None` once it may be anywhere.
#[must_use]
pub fn onward(track: &Track, own_follows: bool, limits: &Limits, now: Stamp) -> Option<Obstacle> {
    let silent_s = track.silent_s(now);
    if track.parked() || !(STOPPED_S..ONWARD_S_MAX).contains(&silent_s) {
        return None;
    }
    let stopped = obstacle(track, own_follows, limits, now)?;
    let velocity_ned_mps = track.predict(now, 0.0).velocity_ned_mps;
    let position_ned_m = stopped.position_ned_m + velocity_ned_mps * (silent_s - STOPPED_S);
    let keep_m = limits.separation_m_min + limits.separation_margin_m;
    Some(Obstacle { position_ned_m, velocity_ned_mps, keep_m, ..stopped })
}

/// A climb that must be slower by more than this is blocked, and so fast it goes aside then: metres per second.
const BLOCKED_MPS: f64 = 0.02;
const ASIDE_MPS: f64 = 1.0;
/// A vehicle is below another within 45° of the vertical.
const BELOW: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Least opening speed (negative: greatest closing speed) at a gap to the kept distance, metres per second.
fn opening_mps_min(gap_m: f64) -> f64 {
    if gap_m <= 0.0 {
        (-gap_m * OPENING_HZ).min(OPENING_MPS_MAX)
    } else {
        let reaction_mps = BRAKING_MPS2 * REACTION_S;
        reaction_mps - (reaction_mps * reaction_mps + 2.0 * BRAKING_MPS2 * gap_m).sqrt()
    }
}

/// One half-space of velocities: `normal · v ≥ bound_mps`, corrected along `push`.
struct Constraint {
    normal: Vector3<f64>,
    push: Vector3<f64>,
    bound_mps: f64,
    /// How easily it gives where not everything can be kept.
    give: f64,
}

/// The level direction from `obstacle` to a point, north if there is none.
fn side(point_ned_m: Vector3<f64>, obstacle: &Obstacle) -> Vector3<f64> {
    let away_m = point_ned_m - obstacle.position_ned_m;
    let level_m = Vector3::new(away_m.x, away_m.y, 0.0);
    level_m.try_normalize(1e-6).unwrap_or(Vector3::x())
}

/// What `obstacle` forbids at that point: one half-space, or two. `side` is where the vehicle itself is.
/// It wants to sink by `wanted_down_mps`: where it wants to climb and may not, it goes aside, or it would hang there.
fn constraints(
    point_ned_m: Vector3<f64>,
    obstacle: &Obstacle,
    own_side: Vector3<f64>,
    wanted_down_mps: f64,
) -> impl Iterator<Item = Constraint> {
    let one = constraint(point_ned_m, obstacle);
    if one.normal.z < BELOW {
        return [Some(one), None].into_iter().flatten();
    }
    // Going aside makes little distance right below it: no climbing after it, but no descent either; and where distance must be made, aside
    // as fast as makes it at 45°.
    let up = Constraint { normal: Vector3::z(), push: Vector3::z(), bound_mps: one.bound_mps.min(0.0), give: one.give };
    let side = Some(side(point_ned_m, obstacle)).filter(|side| side.dot(&own_side) >= 0.0).unwrap_or(own_side);
    let is_blocked = wanted_down_mps < up.bound_mps - BLOCKED_MPS;
    let bound_mps = f64::max(one.bound_mps / BELOW, if is_blocked { ASIDE_MPS } else { f64::NEG_INFINITY });
    let aside = (bound_mps > 0.0).then_some(Constraint { normal: side, push: side, bound_mps, give: one.give });
    [Some(up), aside].into_iter().flatten()
}

fn constraint(point_ned_m: Vector3<f64>, obstacle: &Obstacle) -> Constraint {
    let away_m = point_ned_m - obstacle.position_ned_m;
    let distance_m = away_m.norm();
    let normal = if distance_m > 1e-6 { away_m / distance_m } else { Vector3::new(0.0, 0.0, -1.0) };
    let mut coming_mps = normal.dot(&obstacle.velocity_ned_mps);
    if obstacle.yields_beyond_m.is_some_and(|beyond_m| distance_m > beyond_m) {
        coming_mps = coming_mps.min(0.0);
    }
    let bound_mps = coming_mps + opening_mps_min(distance_m - obstacle.keep_m);
    // Up is always free; down is not, so a vehicle below gives way sideways.
    let across = Vector3::new(normal.x, normal.y, 0.0);
    let push = if normal.z <= 0.0 || across.norm() < 1e-6 { normal } else { across / across.norm() };
    let give = GIVE * (distance_m / obstacle.keep_m.max(1e-3)).powi(2);
    Constraint { normal, push, bound_mps, give }
}

/// The velocity nearest to `wanted` that keeps every constraint: Hildreth's method, which presses each constraint by as much as it
/// needs and lets go where another's pressure has made its own needless. Where they contradict each other, the one that breaks
/// them least by their squares, those of near obstacles counting more.
fn resolve(wanted_ned_mps: Vector3<f64>, constraints: &[Constraint]) -> Vector3<f64> {
    let refused_mps =
        |velocity: Vector3<f64>| constraints.iter().map(|one| one.bound_mps - one.normal.dot(&velocity)).fold(0.0, f64::max);
    let exact = pressed(wanted_ned_mps, constraints, 0.0);
    if refused_mps(exact) <= REFUSED_MPS { exact } else { pressed(wanted_ned_mps, constraints, 1.0) }
}

fn pressed(wanted_ned_mps: Vector3<f64>, constraints: &[Constraint], softness: f64) -> Vector3<f64> {
    let mut velocity = wanted_ned_mps;
    let mut pressures_mps = vec![0.0; constraints.len()];
    for _ in 0..PASSES {
        let mut change_mps = 0.0;
        for (one, pressure_mps) in constraints.iter().zip(&mut pressures_mps) {
            let give = softness * one.give;
            let refused_mps = one.bound_mps - one.normal.dot(&velocity) - give * *pressure_mps;
            let pressed_mps = f64::max(*pressure_mps + refused_mps / (one.normal.dot(&one.push).max(0.2) + give), 0.0);
            let pressed_mps = pressed_mps.min(PRESSED_MPS_MAX);
            velocity += one.push * (pressed_mps - *pressure_mps);
            change_mps += (pressed_mps - *pressure_mps).abs();
            *pressure_mps = pressed_mps;
        }
        if change_mps <= KEPT_MPS {
            break;
        }
    }
    velocity
}

/// A way round an obstacle that stands between `own` and `goal`: the tangential unit vector, or `None` if the way is free or
/// the goal itself lies within the kept distance (then there is nowhere to go round to).
fn way_round(own_ned_m: Vector3<f64>, goal_ned_m: Vector3<f64>, obstacle: &Obstacle) -> Option<Vector3<f64>> {
    if (goal_ned_m - obstacle.position_ned_m).norm() < obstacle.keep_m {
        return None;
    }
    let path_m = (goal_ned_m - own_ned_m).xy();
    let to_obstacle_m = (obstacle.position_ned_m - own_ned_m).xy();
    let length_m = path_m.norm();
    if length_m < 1e-6 {
        return None;
    }
    let along_m = to_obstacle_m.dot(&path_m) / length_m;
    if along_m <= 0.0 || to_obstacle_m.norm() > obstacle.keep_m + 3.0 {
        return None;
    }
    // Positive when the obstacle lies to the right of the path: then the left side is the shorter.
    let right_m = (path_m.x * to_obstacle_m.y - path_m.y * to_obstacle_m.x) / length_m;
    if right_m.abs() >= obstacle.keep_m && along_m > 0.0 {
        return None;
    }
    let outward = -to_obstacle_m / to_obstacle_m.norm().max(1e-6);
    let (left, right) = (Vector3::new(-outward.y, outward.x, 0.0), Vector3::new(outward.y, -outward.x, 0.0));
    // `right` leaves the obstacle on the left-hand side. Ties, within what noise can turn over, go right.
    let path_right = Vector3::new(-path_m.y, path_m.x, 0.0) / length_m;
    let wanted = if right_m > 0.5 { -path_right } else { path_right };
    Some(if left.dot(&wanted) > right.dot(&wanted) { left } else { right })
}

/// The velocity nearest to `wanted` that keeps every distance, for the vehicle at `own` and its reference at `reference`.
///
/// If an obstacle comes faster than the vehicle may fly, it flees at its speed limit.
#[must_use]
pub fn filter(
    wanted_ned_mps: Vector3<f64>,
    points_ned_m: [Vector3<f64>; 2],
    goal_ned_m: Vector3<f64>,
    obstacles: &[Obstacle],
    limits: &Limits,
) -> Vector3<f64> {
    let mut velocity = wanted_ned_mps;
    // Sideways first, so that the projections below have the last word.
    for obstacle in obstacles {
        if let Some(tangent) = way_round(points_ned_m[1], goal_ned_m, obstacle) {
            let constraint = constraint(points_ned_m[1], obstacle);
            let refused_mps = constraint.bound_mps - constraint.normal.dot(&velocity);
            if refused_mps > 0.0 {
                velocity += tangent * refused_mps.min(0.5 * limits.cruise_mps);
            }
        }
    }
    let lead_m = points_ned_m[1] - points_ned_m[0];
    let pairs = obstacles.iter().flat_map(|obstacle| {
        let own_side = side(points_ned_m[0], obstacle);
        let [own, reference] = points_ned_m.map(|point| constraints(point, obstacle, own_side, wanted_ned_mps.z));
        // The autopilot flies after its reference by this much faster than it is asked to; after a place that has leapt it doesn't fly.
        let chased = own.map(move |one| {
            let chase_mps = (-one.normal.dot(&lead_m) * CHASE_HZ).clamp(0.0, limits.speed_mps_max);
            Constraint { bound_mps: one.bound_mps + chase_mps, ..one }
        });
        chased.chain(reference)
    });
    // Most are far off, and can't be broken by any speed that is flown.
    let fast_mps = velocity.norm().max(2.0 * limits.speed_mps_max);
    let constraints: Vec<Constraint> = pairs.filter(|one| one.bound_mps > -fast_mps).collect();
    resolve(velocity, &constraints)
}

#[cfg(test)]
mod tests {
    use halcyon_model::VehicleState;

    use super::*;
    use crate::core::track::tests::{state, t};

    fn still(x: f64, y: f64, z: f64) -> Obstacle {
        Obstacle {
            position_ned_m: Vector3::new(x, y, z),
            velocity_ned_mps: Vector3::zeros(),
            keep_m: 5.0,
            yields_beyond_m: None,
        }
    }

    /// Braking from the allowed closing speed after the reaction time stops exactly at the kept distance: v τ + v²/2a = gap.
    #[test]
    fn allowed_closing_speed_is_the_stopping_distance() {
        for gap_m in [0.1, 1.0, 4.0, 20.0] {
            let closing = -opening_mps_min(gap_m);
            let stopping_m = closing * REACTION_S + closing * closing / (2.0 * BRAKING_MPS2);
            assert!((stopping_m - gap_m).abs() < 1e-9, "{gap_m} {stopping_m}");
        }
    }

    #[test]
    fn free_air_changes_nothing() {
        let wanted = Vector3::new(3.0, 1.0, 0.0);
        let own = Vector3::new(0.0, 0.0, -5.0);
        let goal = Vector3::new(100.0, 30.0, -5.0);
        let limits = Limits::default();
        assert_eq!(filter(wanted, [own, own], goal, &[still(-20.0, 0.0, -5.0)], &limits), wanted);
        assert_eq!(filter(wanted, [own, own], goal, &[], &limits), wanted);
    }

    #[test]
    fn an_obstacle_ahead_is_passed_on_the_right_and_never_closed_in_on() {
        let own = Vector3::new(0.0, 0.0, -5.0);
        let goal = Vector3::new(40.0, 0.0, -5.0);
        let velocity = filter(Vector3::new(5.0, 0.0, 0.0), [own, own], goal, &[still(5.5, 0.0, -5.0)], &Limits::default());
        assert!(velocity.y > 0.5, "{velocity}");
        assert!(velocity.x <= -opening_mps_min(0.5) + 1e-9, "{velocity}");
    }

    /// A place that leapt by hundreds of kilometres, among many: what comes out is a number, and the limits make a speed of it.
    #[test]
    fn among_many_and_with_a_place_that_leapt_far_it_stays_a_number() {
        let limits = Limits::default();
        let crowd: Vec<_> =
            (0..60).map(|index| f64::from(index) * 2.4).map(|a| still(40.0 * a.cos(), 40.0 * a.sin(), a)).collect();
        for leap_m in [10.0, 1e3, 7e5, 1e7] {
            for leap in [Vector3::new(0.0, 0.0, leap_m), Vector3::new(leap_m, 3.0, 0.0), Vector3::new(1.0, -leap_m, leap_m)] {
                let here = Vector3::new(18.0, 17.0, -5.0) + leap;
                let velocity = filter(Vector3::new(0.0, 0.0, -1.5), [here, here - leap], here, &crowd, &limits);
                assert!(velocity.norm() < 1e6, "{leap}: {velocity}");
            }
        }
    }

    #[test]
    fn a_vehicle_above_stops_its_descent_and_one_below_moves_aside() {
        let limits = Limits::default();
        let above = Vector3::new(0.1, 0.0, -6.0);
        let down = filter(Vector3::new(0.0, 0.0, 0.5), [above, above], above, &[still(0.0, 0.0, -1.0)], &limits);
        assert!(down.z < 0.05, "{down}");
        let below = Vector3::new(0.1, 0.0, -5.0);
        let aside = filter(Vector3::zeros(), [below, below], below, &[still(0.0, 0.0, -8.0)], &limits);
        assert!(aside.z.abs() < 1e-9 && aside.x > 0.5, "{aside}");
    }

    /// Exactly below or nearly, it makes room aside no faster than distance is made elsewhere, doesn't sink, and doesn't climb into what is
    /// above; the side is the one that it is on.
    #[test]
    fn right_below_another_it_goes_aside_and_not_faster_than_it_must() {
        let limits = Limits::default();
        let above = still(0.0, 0.0, -8.0);
        for (x, y) in [(0.0, 0.0), (1e-9, 0.0), (0.0, 0.3), (-0.4, 0.0)] {
            let own = Vector3::new(x, y, -5.0);
            let velocity = filter(Vector3::new(0.0, 0.0, -1.5), [own, own], own, &[above], &limits);
            let aside_mps = velocity.xy().norm();
            assert!((0.5..=OPENING_MPS_MAX / BELOW + 1e-6).contains(&aside_mps), "{x} {y}: {velocity}");
            assert!(velocity.z.abs() < 1e-6, "{velocity}");
            let outward_mps = velocity.x * x + velocity.y * y;
            assert!(outward_mps >= 0.0, "{velocity}");
        }
        // Lower by its distance from below, whichever side of the line of 45° it is: no leap.
        for x in [2.0, 2.9, 3.1, 3.5] {
            let own = Vector3::new(x, 0.0, -5.0);
            let velocity = filter(Vector3::new(0.0, 0.0, -1.5), [own, own], own, &[above], &limits);
            let leaves_mps = velocity.dot(&(own - above.position_ned_m).normalize());
            assert!(leaves_mps > 0.3 && velocity.norm() < 4.5, "{x}: {velocity}");
        }
        // Far below it climbs, as fast as it can still stop; faster it may only beside.
        let own = Vector3::new(0.0, 0.0, -1.0);
        let high = still(0.0, 0.0, -9.0);
        let climb = |mps: f64| filter(Vector3::new(0.0, 0.0, -mps), [own, own], own, &[high], &limits);
        assert_eq!(climb(1.0), Vector3::new(0.0, 0.0, -1.0));
        assert!((climb(3.0).z - opening_mps_min(3.0)).abs() < 1e-6 && climb(3.0).xy().norm() > 0.9, "{}", climb(3.0));
    }

    /// In a crowd that leaves a way: everybody's distance is kept, and of thousands of velocities that keep it none is nearer to
    /// the wanted one.
    #[test]
    fn of_all_velocities_that_keep_every_distance_the_nearest_is_taken() {
        let limits = Limits::default();
        let mut tried = 0;
        for case in 0..300u32 {
            let angle = |index: u32| f64::from(case * 7 + index * index * 13 + index);
            let places = (0..9).map(|index| {
                let distance_m = 5.2 + f64::from((case + 3 * index) % 5);
                Vector3::new(angle(index).cos() * distance_m, angle(index).sin() * distance_m, -5.0)
            });
            let crowd: Vec<Obstacle> = places
                .map(|place| Obstacle {
                    velocity_ned_mps: Vector3::new(angle(case % 7).sin(), angle(case % 5).cos(), 0.0),
                    ..still(place.x, place.y, place.z)
                })
                .collect();
            let own = Vector3::new(0.0, 0.0, -5.0);
            let wanted = Vector3::new(angle(case).cos(), angle(case).sin(), 0.0) * 3.0;
            let keeps = |velocity: Vector3<f64>, slack_mps: f64| {
                crowd.iter().all(|obstacle| {
                    let away = (own - obstacle.position_ned_m).normalize();
                    let gap_m = (own - obstacle.position_ned_m).norm() - obstacle.keep_m;
                    away.dot(&(velocity - obstacle.velocity_ned_mps)) >= opening_mps_min(gap_m) - slack_mps
                })
            };
            let nearest = (0..160i32)
                .flat_map(|x| (0..160i32).map(move |y| Vector3::new(0.05 * f64::from(x - 80), 0.05 * f64::from(y - 80), 0.0)))
                .filter(|velocity| keeps(*velocity, 0.0))
                .map(|velocity| (velocity - wanted).norm())
                .fold(f64::INFINITY, f64::min);
            if nearest > 10.0 {
                continue;
            }
            tried += 1;
            // The goal lies where it stands, so that there is nothing to go round.
            let velocity = filter(wanted, [own, own], own, &crowd, &limits);
            assert!(keeps(velocity, REFUSED_MPS + 1e-6), "{case}: {velocity}");
            assert!((velocity - wanted).norm() <= nearest + 1e-6, "{case}: {velocity}, {nearest}");
        }
        assert!(tried > 100, "{tried}");
    }

    /// Between two that both stand too near nothing can be kept: it makes for the middle, and stays there.
    #[test]
    fn squeezed_between_two_it_makes_for_the_middle_and_in_a_ring_it_stands_still() {
        let limits = Limits::default();
        let between = |east_m: f64| {
            let own = Vector3::new(0.0, east_m, -5.0);
            filter(Vector3::zeros(), [own, own], own, &[still(0.0, -3.0, -5.0), still(0.0, 3.0, -5.0)], &limits)
        };
        assert!(between(0.0).norm() < 1e-3, "{}", between(0.0));
        assert!(between(1.0).y < -0.2 && between(-1.0).y > 0.2, "{} {}", between(1.0), between(-1.0));
        let own = Vector3::new(0.0, 0.0, -5.0);
        let ring: Vec<Obstacle> = (0..9)
            .map(|index| (f64::from(index) * std::f64::consts::TAU / 9.0).sin_cos())
            .map(|(sin, cos)| still(4.0 * cos, 4.0 * sin, -5.0))
            .collect();
        let velocity = filter(Vector3::new(0.0, 0.0, 0.0), [own, own], own, &ring, &limits);
        assert!(velocity.norm() < 0.05, "{velocity}");
    }

    /// At 3 m/s, silent for 3 s: it may stand where its last second brought it, 3 m on, or be 9 m on.
    #[test]
    fn a_silent_vehicle_may_have_stopped_or_flown_on() {
        let limits = Limits::default();
        let moving = VehicleState { velocity_ned_mps: Vector3::new(3.0, 0.0, 0.0), ..state(t(0.0), 0.0) };
        let track = Track::new(moving, t(0.0));
        assert_eq!(onward(&track, false, &limits, t(0.9)), None);
        let stopped = obstacle(&track, false, &limits, t(3.0)).unwrap();
        let flown = onward(&track, false, &limits, t(3.0)).unwrap();
        assert!((stopped.position_ned_m.x - 3.0).abs() < 1e-9 && stopped.velocity_ned_mps.norm() == 0.0);
        assert!((flown.position_ned_m.x - 9.0).abs() < 1e-9 && (flown.velocity_ned_mps.x - 3.0).abs() < 1e-9);
        assert!(flown.keep_m < stopped.keep_m);
        assert_eq!(onward(&track, false, &limits, t(5.1)), None, "it may be anywhere");
    }
}
