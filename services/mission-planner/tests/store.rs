//! The store: what it refuses to open, and that it keeps what it was given.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may")]

use std::fs;
use std::path::Path;

use halcyon_mission_planner::core::{Course, Formation, Record, Saved};
use halcyon_mission_planner::store::{Store, StoreError};
use halcyon_model::{
    Approval, Estimate, FormationSpec, LocalPoint, Mission, MissionId, MissionPhase, MissionSpec, Shape, Slot, Stamp,
    Transition, VehicleId, VerdictState,
};

fn records() -> (Vec<Record>, Mission, Course) {
    let id = MissionId::new("m-1").unwrap();
    let spec = MissionSpec {
        name: "quiet bay; DROP TABLE mission; 'é'".into(),
        point: LocalPoint::new(1.0 / 3.0, -1e-300),
        survey_height_m: 5.1,
        approval: Approval::Automatic,
        dispatch_on_approval: true,
        leader: Some(VehicleId::new("leader-1").unwrap()),
        follower: None,
    };
    let step = |phase, ns| Transition { stamp: Stamp::from_nanos(ns), phase, who: "anna".into(), why: "because".into() };
    let history =
        vec![step(MissionPhase::Waiting, 1_760_000_000_000_000_001), step(MissionPhase::Paused, 1_760_000_000_000_000_777)];
    let mission = Mission {
        stamp: history[1].stamp,
        id: id.clone(),
        spec: spec.clone(),
        phase: MissionPhase::Paused,
        leader: Some(VehicleId::new("leader-1").unwrap()),
        follower: Some(VehicleId::new("follower-2").unwrap()),
        verdict: Some(VerdictState::Inconclusive),
        h_s_m: Some(Estimate { value: 0.1, low: 0.05, high: 0.2 }),
        touchdown: Some(LocalPoint::new(0.1, 0.2)),
        release_problem: Some("refused: in the air".into()),
        history: history.clone(),
    };
    let course = Course {
        paused_from: Some(MissionPhase::Landing),
        heading_rad: Some(std::f64::consts::PI),
        abreast_m: -7.0,
        dispatch: true,
        reached_landing: true,
        station_since: Some(Stamp::from_nanos(-5)),
        first_on_station: Some(Stamp::from_nanos(6)),
    };
    let bare = Mission {
        leader: None,
        follower: None,
        verdict: None,
        h_s_m: None,
        touchdown: None,
        release_problem: None,
        ..mission.clone()
    };
    let records = vec![
        Record::Created { id: id.clone(), spec },
        Record::Entered {
            mission: Box::new(Mission { phase: MissionPhase::Waiting, ..bare }),
            course: Course::default(),
            transition: history[0].clone(),
        },
        Record::Entered { mission: Box::new(mission.clone()), course: course.clone(), transition: history[1].clone() },
        Record::Released { mission: id, vehicle: VehicleId::new("leader-1").unwrap(), stamp: Stamp::from_nanos(9) },
        Record::Reserved { generation: 1000 },
        Record::Reserved { generation: 2000 },
    ];
    (records, mission, course)
}

#[test]
fn what_was_stored_comes_back_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep/er/missions.sqlite");
    let (records, mission, course) = records();
    let mut store = Store::open(&path).unwrap();
    assert_eq!(store.load().unwrap(), Saved::default());
    store.append(&records).unwrap();
    drop(store);
    let saved = Store::open(&path).unwrap().load().unwrap();
    assert_eq!(saved.generation, 2000);
    assert_eq!(saved.missions.len(), 1);
    assert_eq!(saved.missions[0].mission, mission);
    assert_eq!(saved.missions[0].course, course);
    assert_eq!(saved.missions[0].crew, [VehicleId::new("follower-2").unwrap()]);
}

#[test]
fn a_batch_is_stored_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missions.sqlite");
    let (records, ..) = records();
    let mut store = Store::open(&path).unwrap();
    // The second creation of one id breaks the batch.
    let broken = [records[0].clone(), records[1].clone(), records[0].clone()];
    assert!(matches!(store.append(&broken), Err(StoreError::Write { .. })));
    assert_eq!(store.load().unwrap(), Saved::default());
    store.append(&records[..2]).unwrap();
    assert_eq!(store.load().unwrap().missions.len(), 1);
}

#[test]
fn lines_can_neither_be_changed_nor_removed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missions.sqlite");
    let (records, ..) = records();
    Store::open(&path).unwrap().append(&records).unwrap();
    let raw = rusqlite::Connection::open(&path).unwrap();
    for table in ["mission", "transition", "released", "generation"] {
        for sql in [format!("DELETE FROM {table}"), format!("UPDATE {table} SET seq = seq + 1")] {
            let error = raw.execute(&sql, []).expect_err(&sql);
            assert!(error.to_string().contains("append only"), "{sql}: {error}");
        }
    }
}

#[track_caller]
fn refused(path: &Path, words: &str) {
    let error = Store::open(path).and_then(|store| store.load()).expect_err("not opened");
    let text = error.to_string();
    assert!(text.contains(words) && text.contains(&*path.to_string_lossy()), "{text}");
}

#[test]
fn a_file_that_cannot_be_trusted_is_refused_and_left_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);

    fs::write(
        path("text"),
        "this is no database, though long enough to have a header of one hundred bytes or more, I should think.",
    )
    .unwrap();
    refused(&path("text"), "is not a mission store");
    assert!(fs::read_to_string(path("text")).unwrap().starts_with("this is no database"));

    rusqlite::Connection::open(path("other")).unwrap().execute_batch("CREATE TABLE t (x)").unwrap();
    refused(&path("other"), "is not a mission store");

    drop(Store::open(&path("newer")).unwrap());
    rusqlite::Connection::open(path("newer")).unwrap().execute_batch("PRAGMA user_version = 4").unwrap();
    refused(&path("newer"), "has schema version 4, this build knows 3");

    fs::create_dir(path("folder")).unwrap();
    refused(&path("folder"), "could not be opened");

    fs::write(path("file"), "").unwrap();
    refused(&path("file/under.sqlite"), "folder of the mission store");

    // A device without room. (Permissions would say nothing where tests run as root.)
    #[cfg(target_os = "linux")]
    refused(Path::new("/dev/full"), "/dev/full");
}

#[test]
fn a_damaged_file_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missions.sqlite");
    let (records, ..) = records();
    Store::open(&path).unwrap().append(&records).unwrap();
    let good = fs::read(&path).unwrap();
    let page = 4096;
    assert!(good.len() > 4 * page);
    let mut refusals = 0;
    for start in (page..good.len()).step_by(page) {
        let mut bad = good.clone();
        bad[start..start + 64].fill(0xA5);
        fs::write(&path, &bad).unwrap();
        if Store::open(&path).and_then(|store| store.load()).is_err() {
            refusals += 1;
        }
    }
    assert_eq!(refusals, good.len() / page - 1, "damage to any page is found");
    fs::write(&path, &good[..good.len() - 2 * page]).unwrap();
    refused(&path, "damaged");
}

#[test]
fn two_planners_never_share_a_store() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missions.sqlite");
    let first = Store::open(&path).unwrap();
    assert!(matches!(Store::open(&path), Err(StoreError::Locked { .. })));
    drop(first);
    assert!(Store::open(&path).is_ok());
}

#[test]
fn a_store_in_memory_forgets() {
    let (records, ..) = records();
    let mut store = Store::open(Path::new(":memory:")).unwrap();
    store.append(&records).unwrap();
    assert_eq!(store.load().unwrap().missions.len(), 1);
    assert_eq!(Store::open(Path::new(":memory:")).unwrap().load().unwrap(), Saved::default());
}

/// A file of the first version, as the planner of that time made it, goes on with everything in it.
#[test]
fn a_store_of_the_first_version_is_taken_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missions.sqlite");
    let old = rusqlite::Connection::open(&path).unwrap();
    old.execute_batch(include_str!("../src/store/schema.sql")).unwrap();
    old.execute_batch(
        "PRAGMA application_id = 0x48414C43; PRAGMA user_version = 1; INSERT INTO generation (reserved) VALUES (42);",
    )
    .unwrap();
    drop(old);
    taken_over(&path);
}

/// The second version had formations, and no releases.
#[test]
fn a_store_of_the_second_version_is_taken_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missions.sqlite");
    let old = rusqlite::Connection::open(&path).unwrap();
    old.execute_batch(include_str!("../src/store/schema.sql")).unwrap();
    old.execute_batch(include_str!("../src/store/formation.sql")).unwrap();
    old.execute_batch(
        "PRAGMA application_id = 0x48414C43; PRAGMA user_version = 2; INSERT INTO generation (reserved) VALUES (42);",
    )
    .unwrap();
    drop(old);
    taken_over(&path);
    let (records, mission, _) = records();
    let mut store = Store::open(&path).unwrap();
    store.append(&records).unwrap();
    assert_eq!(store.load().unwrap().missions[0].mission, mission);
}

#[track_caller]
fn taken_over(path: &Path) {
    for _ in 0..2 {
        let store = Store::open(path).unwrap();
        assert_eq!(store.load().unwrap(), Saved { generation: 42, ..Saved::default() });
    }
}

#[test]
fn the_last_word_on_a_formation_counts() {
    let id = |text: &str| VehicleId::new(text).unwrap();
    let slot = |right_m: f64| Slot { forward_m: -1.0 / 3.0, right_m, up_m: 0.5 };
    let spec = |leader: &str, followers: Vec<VehicleId>| FormationSpec {
        leader: id(leader),
        shape: Shape::Vee,
        spacing_m: 7.1,
        followers,
    };
    let first =
        Formation { spec: spec("l-1", vec![id("a"), id("b")]), members: [(id("a"), slot(7.0)), (id("b"), slot(-7.0))].into() };
    // One of the two that were named has left; the other leader's followers were not named.
    let left = Formation { members: [(id("b"), slot(-7.0))].into(), ..first.clone() };
    let other = Formation { spec: spec("l-2", vec![]), members: [(id("c"), slot(1.0))].into() };
    let ended = Formation { members: [].into(), ..other.clone() };
    let formed = |formation: &Formation| Record::Formed {
        formation: formation.clone(),
        who: "anna".into(),
        stamp: Stamp::from_nanos(5),
    };
    let mut store = Store::open(Path::new(":memory:")).unwrap();
    store.append(&[formed(&first), formed(&other)]).unwrap();
    assert_eq!(store.load().unwrap().formations, [first, other.clone()]);
    store.append(&[formed(&left), formed(&ended)]).unwrap();
    assert_eq!(store.load().unwrap().formations, [left]);
}
