//! Acknowledgements that may still come: of commands that were sent more often than they were answered.

use halcyon_model::Stamp;
use mavlink::dialects::ardupilotmega::MavCmd;

/// An answer comes this long after it was asked for, or never, seconds.
const LATE_S: f64 = 3.0;
/// Ended commands that are remembered.
const KEPT: usize = 16;

#[derive(Debug, Clone, Copy)]
struct Debt {
    id: MavCmd,
    count: u8,
    until: Stamp,
}

/// What ended transactions are owed.
#[derive(Debug, Clone, Default)]
pub(super) struct Owed(Vec<Debt>);

impl Owed {
    /// A transaction ended: under this id so many acknowledgements may still come, of what was sent last at that time.
    pub(super) fn remember(&mut self, owes: Option<(MavCmd, u8, Stamp)>, now: Stamp) {
        self.0.retain(|debt| now <= debt.until);
        if let Some((id, count, sent)) = owes
            && self.0.len() < KEPT
        {
            self.0.push(Debt { id, count, until: sent.plus_secs_f64(LATE_S) });
        }
    }

    /// An acknowledgement came that may be a late one: whether it is taken for that. News of progress settles nothing.
    pub(super) fn settle(&mut self, id: MavCmd, ends: bool, now: Stamp) -> bool {
        self.0.retain(|debt| now <= debt.until && debt.count > 0);
        let Some(debt) = self.0.iter_mut().find(|debt| debt.id == id) else { return false };
        debt.count -= u8::from(ends);
        true
    }
}
