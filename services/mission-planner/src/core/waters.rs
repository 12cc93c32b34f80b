//! What is known of the water, and what it says about one spot.

use std::collections::BTreeMap;

use halcyon_model::{LocalPoint, RigId, SeaState, Stamp, VerdictState};

use super::fleet::Ignored;
use crate::config::Config;

/// Rigs that are kept in mind.
const RIGS_MAX: usize = 64;

/// The newest sea state of each rig.
#[derive(Debug, Default)]
pub(super) struct Waters {
    newest: BTreeMap<RigId, SeaState>,
}

impl Waters {
    /// Takes in a sea state.
    ///
    /// # Errors
    /// [`Ignored`] if it says nothing new or nothing credible.
    pub(super) fn observe(&mut self, mut sea: SeaState, now: Stamp, config: &Config) -> Result<(), Ignored> {
        if sea.stamp.seconds_since(now) > config.clock_skew_max_s {
            return Err(Ignored::Future);
        }
        match self.newest.get(&sea.rig) {
            Some(known) if sea.stamp <= known.stamp => return Err(Ignored::Old),
            None if self.newest.len() >= RIGS_MAX => return Err(Ignored::TooMany),
            _ => {}
        }
        sea.trace = Vec::new(); // for the dashboard, and long
        self.newest.insert(sea.rig.clone(), sea);
        Ok(())
    }

    /// What is known now about the water at `spot`, measured entirely since `since`; `None` if nothing is, and unknown is never
    /// safe. Where several rigs look at it, one that says unsafe is believed before one that says safe.
    #[must_use]
    pub(super) fn at(&self, spot: LocalPoint, since: Stamp, now: Stamp, config: &Config) -> Option<&SeaState> {
        let rank = |sea: &SeaState| match sea.verdict.state {
            VerdictState::Unsafe => 2,
            VerdictState::Safe => 1,
            VerdictState::Inconclusive => 0,
        };
        self.newest
            .values()
            .filter(|sea| {
                // Every comparison is false with NaN.
                sea.position.distance_m(&spot) <= config.sea_distance_max_m
                    && sea.window_start >= since
                    && now.seconds_since(sea.stamp) <= config.sea_age_max_s
                    && now <= sea.verdict.valid_until
            })
            .max_by_key(|sea| (rank(sea), sea.stamp))
    }
}

/// The checks that a verdict failed, in words.
#[must_use]
pub(super) fn failed_checks(sea: &SeaState) -> String {
    let failed: Vec<&str> =
        sea.verdict.reasons.iter().filter(|reason| !reason.passed).map(|reason| reason.text.as_str()).collect();
    if failed.is_empty() { "no reason given".into() } else { failed.join("; ") }
}
