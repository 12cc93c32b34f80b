//! The radio of many: what one says reaches each of the others by itself, late, in any order, or never.

use std::collections::BTreeMap;

use halcyon_model::{DispatchPlan, Stamp, VehicleState};

use super::super::chance::Chance;

/// The least delay, seconds.
const DELAY_S_MIN: f64 = 0.02;

#[derive(Debug, Clone)]
pub(super) enum Message {
    State(Box<VehicleState>),
    Plan(DispatchPlan),
}

pub(super) struct Air {
    delay_s: f64,
    loss: f64,
    chance: Chance,
    /// By arrival, then by a running number.
    under_way: BTreeMap<(Stamp, u64), (usize, Message)>,
    sent: u64,
}

impl Air {
    pub(super) fn new(delay_s: f64, loss: f64, chance: Chance) -> Self {
        Self { delay_s: delay_s.max(DELAY_S_MIN), loss, chance, under_way: BTreeMap::new(), sent: 0 }
    }

    pub(super) fn send(&mut self, to: usize, message: Message, now: Stamp) {
        if self.chance.unit() >= self.loss {
            let due = now.plus_secs_f64(self.chance.between(DELAY_S_MIN, self.delay_s));
            self.sent += 1;
            self.under_way.insert((due, self.sent), (to, message));
        }
    }

    /// What has arrived by now, and where.
    pub(super) fn receive(&mut self, now: Stamp) -> impl Iterator<Item = (usize, Message)> {
        let later = self.under_way.split_off(&(now, u64::MAX));
        std::mem::replace(&mut self.under_way, later).into_values()
    }
}
