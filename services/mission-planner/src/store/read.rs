//! Rows to missions.

use std::collections::{BTreeMap, BTreeSet};
use std::str::FromStr;

use halcyon_model::{
    Approval, Estimate, IdError, LocalPoint, Mission, MissionId, MissionPhase, MissionSpec, Stamp, Transition, VehicleId,
    VerdictState,
};
use rusqlite::types::Type;
use rusqlite::{Connection, Row};

use crate::core::{Course, Saved, SavedMission};

/// A word that is not one of those that this build writes.
#[derive(Debug, thiserror::Error)]
#[error("{0:?} is not a word that the store knows here")]
struct UnknownWord(String);

pub(super) fn load(connection: &Connection) -> rusqlite::Result<Saved> {
    let generation: Option<i64> = connection.query_row("SELECT max(reserved) FROM generation", [], |row| row.get(0))?;
    let mut missions = Vec::new();
    let mut index_of = BTreeMap::new();
    let mut statement = connection.prepare("SELECT * FROM mission ORDER BY seq")?;
    for mission in statement.query_map([], mission)? {
        let mission = mission?;
        index_of.insert(mission.mission.id.clone(), missions.len());
        missions.push(mission);
    }
    let mut crews = vec![BTreeSet::new(); missions.len()];
    let mut statement = connection.prepare("SELECT * FROM transition ORDER BY seq")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let id: MissionId = id(row, "mission")?.ok_or(rusqlite::Error::QueryReturnedNoRows)?;
        // The schema's foreign key keeps both in step.
        let Some(&index) = index_of.get(&id) else { continue };
        enter(&mut missions[index], row)?;
        let mission = &missions[index].mission;
        crews[index].extend(mission.leader.iter().chain(&mission.follower).cloned());
    }
    let mut statement = connection.prepare("SELECT mission, vehicle FROM released ORDER BY seq")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let (mission, vehicle): (Option<MissionId>, Option<VehicleId>) = (id(row, "mission")?, id(row, "vehicle")?);
        if let (Some(&index), Some(vehicle)) = (mission.and_then(|id| index_of.get(&id)), vehicle) {
            crews[index].remove(&vehicle);
        }
    }
    for (mission, crew) in missions.iter_mut().zip(crews) {
        mission.crew = crew.into_iter().collect();
    }
    Ok(Saved {
        generation: generation.and_then(|reserved| u64::try_from(reserved).ok()).unwrap_or(0),
        missions,
        formations: super::formation::load(connection)?,
    })
}

fn invalid(error: impl std::error::Error + Send + Sync + 'static) -> rusqlite::Error {
    rusqlite::Error::FromSqlConversionFailure(0, Type::Text, Box::new(error))
}

pub(super) fn id<I: FromStr<Err = IdError>>(row: &Row<'_>, column: &str) -> rusqlite::Result<Option<I>> {
    row.get::<_, Option<String>>(column)?.map(|text| text.parse().map_err(invalid)).transpose()
}

pub(super) fn word<T>(row: &Row<'_>, column: &str, from_name: impl Fn(&str) -> Option<T>) -> rusqlite::Result<Option<T>> {
    let text: Option<String> = row.get(column)?;
    text.map(|text| from_name(&text).ok_or_else(|| invalid(UnknownWord(text)))).transpose()
}

fn approval(name: &str) -> Option<Approval> {
    [Approval::Manual, Approval::Automatic].into_iter().find(|approval| super::write::approval_name(*approval) == name)
}

fn verdict(name: &str) -> Option<VerdictState> {
    [VerdictState::Safe, VerdictState::Unsafe, VerdictState::Inconclusive].into_iter().find(|state| state.as_str() == name)
}

fn mission(row: &Row<'_>) -> rusqlite::Result<SavedMission> {
    let spec = MissionSpec {
        name: row.get("name")?,
        point: LocalPoint::new(row.get("north_m")?, row.get("east_m")?),
        survey_height_m: row.get("survey_height_m")?,
        approval: word(row, "approval", approval)?.unwrap_or(Approval::Manual),
        dispatch_on_approval: row.get("dispatch_on_approval")?,
        leader: id(row, "leader")?,
        follower: id(row, "follower")?,
    };
    let mission = Mission {
        stamp: Stamp::default(),
        id: id(row, "id")?.ok_or(rusqlite::Error::QueryReturnedNoRows)?,
        spec,
        phase: MissionPhase::Waiting,
        leader: None,
        follower: None,
        verdict: None,
        h_s_m: None,
        touchdown: None,
        release_problem: None,
        history: Vec::new(),
    };
    Ok(SavedMission { mission, course: Course::default(), crew: Vec::new() })
}

/// Applies a transition; the last one leaves the mission as it was.
fn enter(saved: &mut SavedMission, row: &Row<'_>) -> rusqlite::Result<()> {
    let stamp = |column| Ok::<_, rusqlite::Error>(row.get::<_, Option<i64>>(column)?.map(Stamp::from_nanos));
    let mission = &mut saved.mission;
    let phase = word(row, "phase", MissionPhase::from_name)?.ok_or(rusqlite::Error::QueryReturnedNoRows)?;
    let at = stamp("stamp_ns")?.unwrap_or_default();
    mission.stamp = at;
    mission.phase = phase;
    mission.leader = id(row, "leader")?;
    mission.follower = id(row, "follower")?;
    mission.verdict = word(row, "verdict", verdict)?;
    mission.h_s_m = match (row.get("h_s_m")?, row.get("h_s_m_low")?, row.get("h_s_m_high")?) {
        (Some(value), Some(low), Some(high)) => Some(Estimate { value, low, high }),
        _ => None,
    };
    mission.touchdown = match (row.get("touchdown_north_m")?, row.get("touchdown_east_m")?) {
        (Some(north_m), Some(east_m)) => Some(LocalPoint::new(north_m, east_m)),
        _ => None,
    };
    mission.release_problem = row.get("release_problem")?;
    mission.history.push(Transition { stamp: at, phase, who: row.get("who")?, why: row.get("why")? });
    saved.course = Course {
        paused_from: word(row, "paused_from", MissionPhase::from_name)?,
        heading_rad: row.get("heading_rad")?,
        abreast_m: row.get("abreast_m")?,
        dispatch: row.get("dispatch")?,
        reached_landing: row.get("reached_landing")?,
        station_since: stamp("station_since_ns")?,
        first_on_station: stamp("first_on_station_ns")?,
    };
    Ok(())
}
