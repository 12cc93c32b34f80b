//! The fence: areas to stay in and to stay out of, a height, a circle about home, and what happens outside.

use halcyon_model::{Geodetic, Stamp};
use mavlink::dialects::ardupilotmega as mav;
use nalgebra::{Vector2, Vector3};

use super::{Autopilot, Mode, Param};

/// Most items; ArduPilot's depend on its storage.
pub(super) const ITEMS_MAX: u16 = 128;
/// Between two checks, seconds.
const CHECK_S: f64 = 0.04;
/// So much further outside, height and circle count as left once more, metres.
const BACKUP_M: f64 = 20.0;
/// Further outside than this it lands where it is, metres.
const GIVE_UP_M: f64 = 100.0;
/// FENCE_TYPE's bits, and how texts call them.
const HEIGHT: usize = 0;
const CIRCLE: usize = 1;
const POLYGON: usize = 2;
const NAMES: [&str; 3] = ["Max Alt", "Circle", "Polygon"];

/// One item as it came.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FenceItem {
    pub(super) command: mav::MavCmd,
    /// Vertices of the polygon, or radius of the circle, metres.
    pub(super) param1: f32,
    pub(super) x: i32,
    pub(super) y: i32,
}

impl FenceItem {
    /// Takes an item off the wire, or says why not.
    pub(super) fn check(data: &mav::MISSION_ITEM_INT_DATA) -> Result<Self, mav::MavMissionResult> {
        use mav::MavCmd as Cmd;
        use mav::MavFrame as Frame;
        let frame_ok = matches!(
            data.frame,
            Frame::MAV_FRAME_GLOBAL
                | Frame::MAV_FRAME_GLOBAL_INT
                | Frame::MAV_FRAME_GLOBAL_RELATIVE_ALT
                | Frame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
                | Frame::MAV_FRAME_GLOBAL_TERRAIN_ALT
                | Frame::MAV_FRAME_GLOBAL_TERRAIN_ALT_INT
        );
        let known = matches!(
            data.command,
            Cmd::MAV_CMD_NAV_FENCE_RETURN_POINT
                | Cmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
                | Cmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION
                | Cmd::MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION
                | Cmd::MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION
        );
        if !frame_ok {
            Err(mav::MavMissionResult::MAV_MISSION_UNSUPPORTED_FRAME)
        } else if !known {
            Err(mav::MavMissionResult::MAV_MISSION_UNSUPPORTED)
        } else {
            Ok(Self { command: data.command, param1: data.param1, x: data.x, y: data.y })
        }
    }
}

/// One area, in the fleet's local frame.
#[derive(Debug, Clone, PartialEq)]
enum Area {
    Polygon { vertices_ne_m: Vec<Vector2<f64>>, inside: bool },
    Circle { centre_ne_m: Vector2<f64>, radius_m: f64, inside: bool },
}

impl Area {
    /// How far a place is on the wrong side, metres; `None` on the right one.
    fn breached_by_m(&self, ne_m: Vector2<f64>) -> Option<f64> {
        let (within, edge_m, inside) = match self {
            Self::Polygon { vertices_ne_m, inside } => (contains(vertices_ne_m, ne_m), edge_m(vertices_ne_m, ne_m), inside),
            Self::Circle { centre_ne_m, radius_m, inside } => {
                let away_m = (ne_m - centre_ne_m).norm();
                (away_m <= *radius_m, (away_m - radius_m).abs(), inside)
            }
        };
        (within != *inside).then_some(edge_m)
    }
}

/// The stored fence and what became of it.
#[derive(Debug, Clone, Default)]
pub(super) struct Fence {
    pub(super) items: Vec<FenceItem>,
    areas: Vec<Area>,
    checked_at: Option<Stamp>,
    /// How far outside each kind is, while it is.
    outside_m: [Option<f64>; 3],
    /// From this far outside a kind counts as left again.
    again_m: [f64; 3],
    count: u16,
    at_ms: u32,
    /// The fence chose the mode.
    recovering: bool,
}

impl Fence {
    pub(super) fn is_breached(&self) -> bool {
        self.outside_m.iter().any(Option::is_some)
    }

    /// Someone else chose the mode.
    pub(super) fn mode_left(&mut self) {
        self.recovering = false;
    }

    /// What is left, as texts call it.
    pub(super) fn names(&self) -> String {
        names(&self.outside_m.map(|outside| outside.is_some()))
    }
}

impl Autopilot {
    /// Replaces the fence by these items; `false`, and the old one stays, when they make none.
    pub(super) fn store_fence(&mut self, items: Vec<FenceItem>) -> bool {
        let Some(areas) = self.areas(&items) else { return false };
        self.params.assign(Param::FenceTotal, items.len() as f64);
        self.fence = Fence { items, areas, count: self.fence.count, recovering: self.fence.recovering, ..Fence::default() };
        true
    }

    fn areas(&self, items: &[FenceItem]) -> Option<Vec<Area>> {
        use mav::MavCmd as Cmd;
        let mut areas = Vec::new();
        let mut rest = items;
        while let Some(first) = rest.first() {
            let taken = match first.command {
                Cmd::MAV_CMD_NAV_FENCE_RETURN_POINT => {
                    self.fence_place(first)?;
                    1
                }
                Cmd::MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION | Cmd::MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION => {
                    let radius_m = f64::from(first.param1);
                    if !(radius_m.is_finite() && radius_m > 0.0) {
                        return None;
                    }
                    let inside = first.command == Cmd::MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION;
                    areas.push(Area::Circle { centre_ne_m: self.fence_place(first)?, radius_m, inside });
                    1
                }
                _ => {
                    let count = first.param1 as usize;
                    let vertices = rest.get(..count).filter(|_| count >= 3)?;
                    if vertices.iter().any(|item| item.command != first.command || item.param1 != first.param1) {
                        return None;
                    }
                    let vertices_ne_m = vertices.iter().map(|item| self.fence_place(item)).collect::<Option<Vec<_>>>()?;
                    let inside = first.command == Cmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION;
                    areas.push(Area::Polygon { vertices_ne_m, inside });
                    count
                }
            };
            rest = rest.get(taken..)?;
        }
        Some(areas)
    }

    fn fence_place(&self, item: &FenceItem) -> Option<Vector2<f64>> {
        let altitude_m = self.frame.origin().altitude_m;
        let place = Geodetic::from_deg(f64::from(item.x) * 1e-7, f64::from(item.y) * 1e-7, altitude_m);
        place.is_valid().then(|| self.frame.ned_from_geodetic(place).xy())
    }

    /// How far a place is outside each kind of fence in force, metres.
    fn outside_m(&self, place_ned_m: Vector3<f64>) -> [Option<f64>; 3] {
        let in_force = |kind: usize| {
            self.params.get(Param::FenceEnable) != 0.0 && self.params.get(Param::FenceType) as u32 & (1 << kind) != 0
        };
        let home_m = self.home_ned_m.filter(|_| self.sensed.estimate.position_ok);
        let beyond = |value_m: f64, most_m: f64| (value_m >= most_m).then_some(value_m - most_m);
        let height = home_m.and_then(|home_m| beyond(home_m.z - place_ned_m.z, self.params.get(Param::FenceHeight)));
        let circle = home_m.and_then(|home_m| beyond((place_ned_m - home_m).xy().norm(), self.params.get(Param::FenceRadius)));
        let polygon = self.fence.areas.iter().filter_map(|area| area.breached_by_m(place_ned_m.xy())).reduce(f64::max);
        let polygon = polygon.filter(|_| self.sensed.estimate.position_ok);
        [height.filter(|_| in_force(HEIGHT)), circle.filter(|_| in_force(CIRCLE)), polygon.filter(|_| in_force(POLYGON))]
    }

    /// Whether the fence lets a target be.
    pub(super) fn fence_allows(&self, place_ned_m: Vector3<f64>) -> bool {
        self.outside_m(place_ned_m).iter().all(Option::is_none)
    }

    /// Whether the mode may not be changed since the fence chose it.
    pub(super) fn fence_holds_mode(&self) -> bool {
        let option = self.params.get(Param::FenceOptions) as u32 & 1 != 0;
        option && self.fence.recovering && self.fence.is_breached() && self.armed && !self.landed
    }

    pub(super) fn check_fence(&mut self) {
        if self.fence.checked_at.is_some_and(|at| self.now.seconds_since(at) < CHECK_S) {
            return;
        }
        self.fence.checked_at = Some(self.now);
        let was_breached = self.fence.is_breached();
        let outside_m = self.outside_m(self.sensed.estimate.position_ned_m);
        let mut new = [false; 3];
        for (kind, outside) in outside_m.iter().enumerate() {
            let Some(by_m) = *outside else { continue };
            let first = self.fence.outside_m[kind].is_none();
            new[kind] = first || (kind != POLYGON && by_m >= self.fence.again_m[kind]);
            if new[kind] {
                self.fence.again_m[kind] = by_m + BACKUP_M;
            }
        }
        self.fence.outside_m = outside_m;
        if was_breached && !self.fence.is_breached() {
            self.fence.recovering = false;
            if self.armed && !self.landed {
                self.text(mav::MavSeverity::MAV_SEVERITY_NOTICE, "Fence breach cleared");
            }
        }
        if !new.contains(&true) {
            return;
        }
        self.fence.count = self.fence.count.saturating_add(1);
        self.fence.at_ms = self.boot_ms();
        if self.armed {
            self.act_on_breach(&new);
        }
    }

    fn act_on_breach(&mut self, new: &[bool; 3]) {
        if !self.landed {
            self.text(mav::MavSeverity::MAV_SEVERITY_NOTICE, &format!("{} breached", names(new)));
        }
        let action = self.params.get(Param::FenceAction) as u32;
        if action == 0 {
            return;
        }
        if self.landed {
            self.disarm();
            return;
        }
        let by_m = self.fence.outside_m.iter().flatten().copied().fold(0.0, f64::max);
        let wanted = match action {
            _ if by_m > GIVE_UP_M => Mode::Land,
            2 | 5 => Mode::Land,
            4 => Mode::Brake,
            _ => Mode::Rtl,
        };
        self.fence.recovering = false;
        if self.set_mode(wanted).is_err() {
            self.enter_mode(Mode::Land);
        }
        self.fence.recovering = true;
    }

    /// FENCE_STATUS; `None` while the fence is off.
    pub(super) fn fence_status(&self) -> Option<mav::MavMessage> {
        let breach_type = match self.fence.outside_m {
            [_, Some(_), _] | [_, _, Some(_)] => mav::FenceBreach::FENCE_BREACH_BOUNDARY,
            [Some(_), None, None] => mav::FenceBreach::FENCE_BREACH_MAXALT,
            [None, None, None] => mav::FenceBreach::FENCE_BREACH_NONE,
        };
        let data = mav::FENCE_STATUS_DATA {
            breach_time: self.fence.at_ms,
            breach_count: self.fence.count,
            breach_status: u8::from(self.fence.is_breached()),
            breach_type,
            breach_mitigation: mav::FenceMitigate::FENCE_MITIGATE_NONE,
        };
        (self.params.get(Param::FenceEnable) != 0.0).then_some(mav::MavMessage::FENCE_STATUS(data))
    }
}

/// "Circle and Polygon fences".
fn names(which: &[bool; 3]) -> String {
    let named: Vec<&str> = NAMES.iter().zip(which).filter(|(_, named)| **named).map(|(name, _)| *name).collect();
    match named.split_last() {
        None => String::new(),
        Some((only, [])) => format!("{only} fence"),
        Some((last, others)) => format!("{} and {last} fences", others.join(", ")),
    }
}

/// Whether a polygon contains a place: an odd number of its edges lies to the east of it.
fn contains(vertices_ne_m: &[Vector2<f64>], ne_m: Vector2<f64>) -> bool {
    edges(vertices_ne_m)
        .filter(|(a, b)| (a.x > ne_m.x) != (b.x > ne_m.x) && ne_m.y < a.y + (b.y - a.y) * (ne_m.x - a.x) / (b.x - a.x))
        .count()
        % 2
        == 1
}

/// Distance to a polygon's nearest edge, metres.
fn edge_m(vertices_ne_m: &[Vector2<f64>], ne_m: Vector2<f64>) -> f64 {
    let to_edge = |(a, b): (Vector2<f64>, Vector2<f64>)| {
        let along = b - a;
        let share =
            if along.norm_squared() > 0.0 { ((ne_m - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0) } else { 0.0 };
        (ne_m - a - along * share).norm()
    };
    edges(vertices_ne_m).map(to_edge).fold(f64::INFINITY, f64::min)
}

fn edges(vertices_ne_m: &[Vector2<f64>]) -> impl Iterator<Item = (Vector2<f64>, Vector2<f64>)> + '_ {
    vertices_ne_m.iter().copied().zip(vertices_ne_m.iter().copied().cycle().skip(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_l_shape_knows_its_inside_and_its_edges() {
        // 20 m north by 20 m east without its north-east quarter.
        let corners = [(0.0, 0.0), (20.0, 0.0), (20.0, 10.0), (10.0, 10.0), (10.0, 20.0), (0.0, 20.0)];
        let vertices_ne_m: Vec<_> = corners.iter().map(|(north, east)| Vector2::new(*north, *east)).collect();
        let at = |north, east| Vector2::new(north, east);
        for (place, within, distance_m) in [
            (at(5.0, 5.0), true, 5.0),
            (at(15.0, 5.0), true, 5.0),
            (at(15.0, 15.0), false, 5.0),
            (at(13.0, 14.0), false, 3.0),
            (at(-3.0, -4.0), false, 5.0),
            (at(9.0, 9.0), true, 2.0_f64.sqrt()),
        ] {
            assert_eq!(contains(&vertices_ne_m, place), within, "{place}");
            assert!((edge_m(&vertices_ne_m, place) - distance_m).abs() < 1e-12, "{place}");
        }
    }

    #[test]
    fn texts_name_what_was_left() {
        assert_eq!(names(&[false, false, true]), "Polygon fence");
        assert_eq!(names(&[true, true, false]), "Max Alt and Circle fences");
        assert_eq!(names(&[true, true, true]), "Max Alt, Circle and Polygon fences");
    }
}
