//! The same patches in another order, and the same patches after another life: nothing that is kept between them may tell.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]

mod support;

use halcyon_model::{SeaState, SurfacePatch, Verdict, VerdictState};
use halcyon_wave_assessment::Config;
use halcyon_wave_assessment::core::{Assessor, PatchError};
use proptest::prelude::*;
use support::{Camera, Sea, start};

fn assessor() -> Assessor {
    Assessor::new(Config { window_s: 20.0, window_s_min: 15.0, ..Config::default() }).unwrap()
}

fn film(seed: u64, count: usize) -> Vec<SurfacePatch> {
    let camera = Camera { rate_hz: 10.0, rows: 10, cols: 12, seed, ..Camera::default() };
    let mut film = camera.film(&Sea::jonswap(0.08, 1.2, seed), count);
    // Frames are missing.
    film.retain(|patch| !patch.sequence.is_multiple_of(17) && !(90..95).contains(&patch.sequence));
    film
}

/// What is known after `patches`, which come when the newest so far was taken; and how many were refused.
fn conclude(assessor: &mut Assessor, patches: &[SurfacePatch]) -> (SeaState, usize) {
    let mut now = patches[0].stamp;
    let mut refused = 0;
    for patch in patches {
        now = now.max(patch.stamp);
        match assessor.observe(patch, now) {
            Ok(_) => {}
            Err(PatchError::Duplicate { .. }) => refused += 1,
            Err(error) => panic!("{error}"),
        }
    }
    (assessor.conclude(now).unwrap(), refused)
}

/// A verdict rests on the one before, which came of another part of the patches: its reasons' figures tell, its state need not.
fn without_state(mut state: SeaState) -> SeaState {
    state.verdict = Verdict { state: VerdictState::Inconclusive, reasons: Vec::new(), ..state.verdict };
    state
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn late_patches_are_as_good_as_those_in_order(
        seed in 0_u64..100, delays in prop::collection::vec(0_usize..25, 330), twice in 0_usize..300,
    ) {
        let film = film(seed, 330);
        let in_order = conclude(&mut assessor(), &film).0;
        let mut order: Vec<(usize, usize)> = (0..film.len()).map(|i| (i + delays[i], i)).collect();
        order.sort_unstable();
        let mut late: Vec<SurfacePatch> = order.iter().map(|(_, i)| film[*i].clone()).collect();
        prop_assert_ne!(&late, &film, "delays that change nothing test nothing");
        let again = late[twice.min(film.len() - 1)].clone();
        // The one that comes twice comes while it is still in the window.
        late.insert((twice + 3).min(film.len()), again);
        let (found, refused) = conclude(&mut assessor(), &late);
        prop_assert_eq!(refused, 1);
        prop_assert!(in_order.h_m0_m.is_some() && in_order.spectrum.is_some() && in_order.trace.len() > 150);
        prop_assert_eq!(without_state(found), without_state(in_order));
    }

    /// A clock that is set back begins anew.
    #[test]
    fn a_clock_set_back_leaves_nothing_of_what_was(seed in 0_u64..100, before in 2_usize..330, back_s in 1.0..50.0) {
        let film = film(seed, 300);
        let fresh = conclude(&mut assessor(), &film).0;
        let mut used = assessor();
        let mut other = self::film(seed + 1, before);
        // The other film ends later than this one begins.
        let shift_s = back_s + start().seconds_since(other[other.len() - 1].stamp);
        for patch in &mut other {
            patch.stamp = patch.stamp.plus_secs_f64(shift_s);
            patch.grid.cell_m *= 0.8;
        }
        let _ = conclude(&mut used, &other);
        prop_assert_eq!(conclude(&mut used, &film).0, fresh);
    }
}
