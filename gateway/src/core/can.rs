//! What can be done with a mission, and if not, why not: the words behind every disabled button.
//!
//! The planner decides; this mirrors its rules so that a person need not try. Only the phase is looked at, since that is all
//! that the rules rest on.

use halcyon_model::{Mission, MissionPhase as Phase};

/// What refuses any change to a mission that has ended.
fn still_open(mission: &Mission) -> Result<(), String> {
    match mission.phase {
        Phase::Completed => Err("The mission is completed".into()),
        Phase::Aborted => Err("The mission was aborted".into()),
        Phase::Failed => Err("The mission has failed".into()),
        _ => Ok(()),
    }
}

/// Whether a person can say that the follower may go.
///
/// # Errors
/// Why not, for people.
pub fn approve(mission: &Mission) -> Result<(), String> {
    still_open(mission)?;
    match mission.phase {
        Phase::AwaitingApproval => Ok(()),
        Phase::Waiting | Phase::Transit => Err("The water is not measured yet".into()),
        Phase::Assessing => Err("There is no safe verdict yet".into()),
        Phase::Paused => Err("The mission is paused".into()),
        _ => Err("It is approved already".into()),
    }
}

/// Whether the follower can be sent; while approval is awaited that approves, too.
///
/// # Errors
/// Why not, for people.
pub fn dispatch(mission: &Mission) -> Result<(), String> {
    still_open(mission)?;
    match mission.phase {
        Phase::Approved if mission.spec.dispatch_on_approval => Err("It goes as soon as a follower is ready".into()),
        Phase::AwaitingApproval | Phase::Approved => Ok(()),
        Phase::Waiting | Phase::Transit => Err("The water is not measured yet".into()),
        Phase::Assessing => Err("There is no safe verdict yet".into()),
        Phase::Paused => Err("The mission is paused".into()),
        _ => Err("The follower is on its way already".into()),
    }
}

/// Whether everyone can be made to hold.
///
/// # Errors
/// Why not, for people.
pub fn pause(mission: &Mission) -> Result<(), String> {
    still_open(mission)?;
    if mission.phase == Phase::Paused { Err("The mission is paused already".into()) } else { Ok(()) }
}

/// Whether it can go on.
///
/// # Errors
/// Why not, for people.
pub fn resume(mission: &Mission) -> Result<(), String> {
    still_open(mission)?;
    if mission.phase == Phase::Paused { Ok(()) } else { Err("The mission is not paused".into()) }
}

/// Whether everyone can be called back: from every phase but the last.
///
/// # Errors
/// Why not, for people.
pub fn abort(mission: &Mission) -> Result<(), String> {
    still_open(mission)
}

/// Whether the payload's release can be tried again, or skipped.
///
/// # Errors
/// Why not, for people.
pub fn release(mission: &Mission) -> Result<(), String> {
    still_open(mission)?;
    match (mission.phase, &mission.release_problem) {
        (Phase::Releasing, Some(_)) => Ok(()),
        (Phase::Releasing, None) => Err("The payload is being released".into()),
        _ => Err("The follower has not landed yet".into()),
    }
}

#[cfg(test)]
mod tests {
    use halcyon_model::{Approval, LocalPoint, MissionId, MissionSpec, Stamp};

    use super::*;

    /// Which of approve, dispatch, pause, resume, abort and release can be done in `phase`, by their first letters.
    #[track_caller]
    fn check(phase: Phase, dispatch_on_approval: bool, expected: &str) {
        check_with(None, phase, dispatch_on_approval, expected);
    }

    #[track_caller]
    fn check_with(release_problem: Option<&str>, phase: Phase, dispatch_on_approval: bool, expected: &str) {
        let spec = MissionSpec {
            name: "m".into(),
            point: LocalPoint::new(0.0, 0.0),
            survey_height_m: 5.0,
            approval: Approval::Manual,
            dispatch_on_approval,
            leader: None,
            follower: None,
        };
        let mission = Mission {
            stamp: Stamp::default(),
            id: MissionId::new("m").unwrap(),
            spec,
            phase,
            leader: None,
            follower: None,
            verdict: None,
            h_s_m: None,
            touchdown: None,
            release_problem: release_problem.map(Into::into),
            history: Vec::new(),
        };
        let rules = [
            ('a', approve(&mission)),
            ('d', dispatch(&mission)),
            ('p', pause(&mission)),
            ('r', resume(&mission)),
            ('x', abort(&mission)),
            ('l', release(&mission)),
        ];
        let able: String = rules.iter().filter(|(_, rule)| rule.is_ok()).map(|(letter, _)| letter).collect();
        assert_eq!(able, expected, "{phase:?}");
        assert!(rules.iter().filter_map(|(_, rule)| rule.as_ref().err()).all(|why| !why.is_empty()));
    }

    #[test]
    fn the_rules_of_every_phase() {
        for phase in Phase::ALL {
            match phase {
                Phase::AwaitingApproval => check(phase, true, "adpx"),
                Phase::Approved => {
                    check(phase, true, "px");
                    check(phase, false, "dpx");
                }
                Phase::Paused => check(phase, true, "rx"),
                Phase::Releasing => {
                    check(phase, true, "px");
                    check_with(Some("refused"), phase, true, "pxl");
                }
                Phase::Completed | Phase::Aborted | Phase::Failed => check(phase, true, ""),
                _ => check(phase, true, "px"),
            }
        }
    }
}
