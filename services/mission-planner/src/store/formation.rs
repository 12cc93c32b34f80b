//! Formations to rows and back.

use std::collections::{BTreeMap, BTreeSet};

use halcyon_model::{FormationSpec, Shape, Slot, Stamp, VehicleId};
use rusqlite::{Connection, Transaction, params};

use super::read::{id, word};
use crate::core::Formation;

pub(super) fn formed(transaction: &Transaction<'_>, formation: &Formation, who: &str, stamp: Stamp) -> rusqlite::Result<()> {
    let Formation { spec, members } = formation;
    transaction.execute(
        "INSERT INTO formation (leader, shape, spacing_m, who, stamp_ns) VALUES (?1, ?2, ?3, ?4, ?5)",
        params![spec.leader.as_str(), spec.shape.as_str(), spec.spacing_m, who, stamp.as_nanos()],
    )?;
    let seq = transaction.last_insert_rowid();
    let vehicles: BTreeSet<&VehicleId> = members.keys().chain(&spec.followers).collect();
    for vehicle in vehicles {
        let slot = members.get(vehicle);
        transaction.execute(
            "INSERT INTO formation_slot (formation, vehicle, named, forward_m, right_m, up_m) VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
            params![
                seq,
                vehicle.as_str(),
                spec.followers.contains(vehicle),
                slot.map(|slot| slot.forward_m),
                slot.map(|slot| slot.right_m),
                slot.map(|slot| slot.up_m),
            ],
        )?;
    }
    Ok(())
}

/// Those in force.
pub(super) fn load(connection: &Connection) -> rusqlite::Result<Vec<Formation>> {
    let mut found = BTreeMap::new();
    let newest = "SELECT * FROM formation WHERE seq IN (SELECT max(seq) FROM formation GROUP BY leader)";
    let mut statement = connection.prepare(newest)?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let missing = || rusqlite::Error::QueryReturnedNoRows;
        let spec = FormationSpec {
            leader: id(row, "leader")?.ok_or_else(missing)?,
            shape: word(row, "shape", Shape::from_name)?.ok_or_else(missing)?,
            spacing_m: row.get("spacing_m")?,
            followers: Vec::new(),
        };
        found.insert(row.get::<_, i64>("seq")?, Formation { spec, members: BTreeMap::new() });
    }
    let mut statement = connection.prepare("SELECT * FROM formation_slot ORDER BY formation, vehicle")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let Some(formation) = found.get_mut(&row.get::<_, i64>("formation")?) else { continue };
        let Some(vehicle): Option<VehicleId> = id(row, "vehicle")? else { continue };
        if row.get("named")? {
            formation.spec.followers.push(vehicle.clone());
        }
        if let (Some(forward_m), Some(right_m), Some(up_m)) = (row.get("forward_m")?, row.get("right_m")?, row.get("up_m")?) {
            formation.members.insert(vehicle, Slot { forward_m, right_m, up_m });
        }
    }
    Ok(found.into_values().filter(|formation| !formation.members.is_empty()).collect())
}
