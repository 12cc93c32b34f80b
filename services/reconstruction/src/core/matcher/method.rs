//! Names of the methods of the reference matcher. One word says how disparities are chosen and how pixels are compared, so that
//! a report or a table names what ran; numbers are settings beside it.

use crate::core::study::cost::Cost;

/// One optimiser with one cost function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StudyMethod {
    /// Semi-global, or winner takes all.
    pub semi_global: bool,
    /// How pixels are compared.
    pub cost: Cost,
}

impl StudyMethod {
    /// Every method: winner takes all with each cost function, then semi-global with each.
    pub const ALL: [Self; 12] = {
        let mut all = [Self { semi_global: false, cost: Cost::Sad }; 12];
        let mut i = 0;
        while i < all.len() {
            all[i] = Self { semi_global: i >= Cost::ALL.len(), cost: Cost::ALL[i % Cost::ALL.len()] };
            i += 1;
        }
        all
    };

    /// As on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match (self.semi_global, self.cost) {
            (false, Cost::Sad) => "wta-sad",
            (false, Cost::Ssd) => "wta-ssd",
            (false, Cost::Ncc) => "wta-ncc",
            (false, Cost::Rank) => "wta-rank",
            (false, Cost::Census) => "wta-census",
            (false, Cost::MutualInformation) => "wta-mi",
            (true, Cost::Sad) => "sgm-sad",
            (true, Cost::Ssd) => "sgm-ssd",
            (true, Cost::Ncc) => "sgm-ncc",
            (true, Cost::Rank) => "sgm-rank",
            (true, Cost::Census) => "sgm-census",
            (true, Cost::MutualInformation) => "sgm-mi",
        }
    }

    /// A window that suits the method, pixels: winner takes all has nothing but its window, paths need little of one.
    #[must_use]
    pub(super) fn window_px_default(self) -> u32 {
        if self.semi_global { 5 } else { 9 }
    }
}
