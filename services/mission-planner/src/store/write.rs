//! Records to rows.

use halcyon_model::{Approval, Mission, MissionSpec, Stamp, Transition, VehicleId, VerdictState};
use rusqlite::{Connection, Transaction, named_params, params};

use crate::core::{Course, Record};

/// One batch, one transaction.
pub(super) fn append(connection: &mut Connection, records: &[Record]) -> rusqlite::Result<()> {
    if records.is_empty() {
        return Ok(());
    }
    let transaction = connection.transaction()?;
    for record in records {
        match record {
            Record::Created { id, spec } => created(&transaction, id.as_str(), spec)?,
            Record::Entered { mission, course, transition } => entered(&transaction, mission, course, transition)?,
            Record::Released { mission, vehicle, stamp } => {
                transaction.execute(
                    "INSERT INTO released (mission, vehicle, stamp_ns) VALUES (?1, ?2, ?3)",
                    params![mission.as_str(), vehicle.as_str(), stamp.as_nanos()],
                )?;
            }
            Record::Formed { formation, who, stamp } => super::formation::formed(&transaction, formation, who, *stamp)?,
            Record::Reserved { generation } => {
                // The planner never gets near 2⁶³; a number that does not fit must not wrap.
                let reserved =
                    i64::try_from(*generation).map_err(|error| rusqlite::Error::ToSqlConversionFailure(Box::new(error)))?;
                transaction.execute("INSERT INTO generation (reserved) VALUES (?1)", params![reserved])?;
            }
        }
    }
    transaction.commit()
}

/// The word for an approval.
pub(super) fn approval_name(approval: Approval) -> &'static str {
    match approval {
        Approval::Manual => "manual",
        Approval::Automatic => "automatic",
    }
}

fn created(transaction: &Transaction<'_>, id: &str, spec: &MissionSpec) -> rusqlite::Result<()> {
    transaction.execute(
        "INSERT INTO mission (id, name, north_m, east_m, survey_height_m, approval, dispatch_on_approval, leader, follower)
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)",
        params![
            id,
            spec.name,
            spec.point.north_m,
            spec.point.east_m,
            spec.survey_height_m,
            approval_name(spec.approval),
            spec.dispatch_on_approval,
            spec.leader.as_ref().map(VehicleId::as_str),
            spec.follower.as_ref().map(VehicleId::as_str),
        ],
    )?;
    Ok(())
}

fn entered(transaction: &Transaction<'_>, mission: &Mission, course: &Course, step: &Transition) -> rusqlite::Result<()> {
    transaction.execute(
        "INSERT INTO transition (mission, stamp_ns, phase, who, why, leader, follower, verdict, h_s_m, h_s_m_low, h_s_m_high,
             touchdown_north_m, touchdown_east_m, paused_from, heading_rad, abreast_m, dispatch, reached_landing,
             station_since_ns, first_on_station_ns, release_problem)
         VALUES (:mission, :stamp_ns, :phase, :who, :why, :leader, :follower, :verdict, :h_s_m, :h_s_m_low, :h_s_m_high,
             :touchdown_north_m, :touchdown_east_m, :paused_from, :heading_rad, :abreast_m, :dispatch, :reached_landing,
             :station_since_ns, :first_on_station_ns, :release_problem)",
        named_params! {
            ":mission": mission.id.as_str(),
            ":stamp_ns": step.stamp.as_nanos(),
            ":phase": step.phase.as_str(),
            ":who": step.who,
            ":why": step.why,
            ":leader": mission.leader.as_ref().map(VehicleId::as_str),
            ":follower": mission.follower.as_ref().map(VehicleId::as_str),
            ":verdict": mission.verdict.map(VerdictState::as_str),
            ":h_s_m": mission.h_s_m.map(|h_s_m| h_s_m.value),
            ":h_s_m_low": mission.h_s_m.map(|h_s_m| h_s_m.low),
            ":h_s_m_high": mission.h_s_m.map(|h_s_m| h_s_m.high),
            ":touchdown_north_m": mission.touchdown.map(|point| point.north_m),
            ":touchdown_east_m": mission.touchdown.map(|point| point.east_m),
            ":paused_from": course.paused_from.map(halcyon_model::MissionPhase::as_str),
            ":heading_rad": course.heading_rad,
            ":abreast_m": course.abreast_m,
            ":dispatch": course.dispatch,
            ":reached_landing": course.reached_landing,
            ":station_since_ns": course.station_since.map(Stamp::as_nanos),
            ":first_on_station_ns": course.first_on_station.map(Stamp::as_nanos),
            ":release_problem": mission.release_problem,
        },
    )?;
    Ok(())
}
