//! A bounded table of latest values.

use std::collections::BTreeMap;

use halcyon_model::{Health, Mission, Preview, SeaState, Stamp, SurfacePatch, VehicleState};

/// A value that knows when it was true.
pub trait Stamped {
    /// When.
    fn stamp(&self) -> Stamp;
}

macro_rules! stamped {
    ($($noun:ty),*) => {$(
        impl Stamped for $noun {
            fn stamp(&self) -> Stamp {
                self.stamp
            }
        }
    )*};
}
stamped!(VehicleState, SeaState, SurfacePatch, Preview, Mission, Health);

/// A stamp this far ahead of the present is an error of its clock, and does not keep newer values out.
const AHEAD_S_MAX: f64 = 5.0;

/// A value with what the stream needs to know about it.
#[derive(Debug, Clone)]
pub struct Kept<V> {
    /// The value.
    pub value: V,
    /// The store's revision at which it last changed, staleness included.
    pub revision: u64,
    /// Older than its table allows, or from the future.
    pub stale: bool,
    /// Whether a validity that it carries has ended; see [`Table::refresh`].
    pub expired: bool,
}

/// The latest value for each key. When full, whatever was silent for longest makes room.
#[derive(Debug)]
pub struct Table<K, V> {
    rows: BTreeMap<K, Kept<V>>,
    capacity: usize,
    age_s_max: f64,
}

impl<K: Ord + Clone, V: Stamped> Table<K, V> {
    /// An empty table of at most `capacity` rows, stale after `age_s_max` (infinite: never).
    #[must_use]
    pub fn new(capacity: usize, age_s_max: f64) -> Self {
        Self { rows: BTreeMap::new(), capacity, age_s_max }
    }

    /// Keeps `value` unless a newer one is there; answers whether it was kept.
    pub fn put(&mut self, key: K, value: V, now: Stamp, revision: u64) -> bool {
        if let Some(old) = self.rows.get(&key) {
            let held = old.value.stamp();
            if value.stamp() < held && held.seconds_since(now) < AHEAD_S_MAX {
                return false;
            }
        } else if self.rows.len() >= self.capacity {
            let silent = self.rows.iter().min_by_key(|(_, kept)| kept.value.stamp()).map(|(key, _)| key.clone());
            silent.and_then(|key| self.rows.remove(&key));
        }
        let stale = self.is_stale(&value, now);
        self.rows.insert(key, Kept { value, revision, stale, expired: false });
        true
    }

    fn is_stale(&self, value: &V, now: Stamp) -> bool {
        let age_s = now.seconds_since(value.stamp());
        age_s > self.age_s_max || age_s < -AHEAD_S_MAX
    }

    /// Judges staleness and expiry anew, and gives every row whose judgement changed `revision`; answers whether any did.
    pub fn refresh(&mut self, now: Stamp, revision: u64, expired: impl Fn(&V) -> bool) -> bool {
        let mut changed = false;
        let age_s_max = self.age_s_max;
        for kept in self.rows.values_mut() {
            let age_s = now.seconds_since(kept.value.stamp());
            let judgement = (age_s > age_s_max || age_s < -AHEAD_S_MAX, expired(&kept.value));
            if judgement != (kept.stale, kept.expired) {
                (kept.stale, kept.expired) = judgement;
                kept.revision = revision;
                changed = true;
            }
        }
        changed
    }

    /// The row of `key`.
    #[must_use]
    pub fn get(&self, key: &K) -> Option<&Kept<V>> {
        self.rows.get(key)
    }

    /// Every row, by key.
    pub fn iter(&self) -> impl Iterator<Item = (&K, &Kept<V>)> {
        self.rows.iter()
    }

    /// Rows that changed after `revision`.
    pub fn since(&self, revision: u64) -> impl Iterator<Item = &Kept<V>> {
        self.rows.values().filter(move |kept| kept.revision > revision)
    }
}

#[cfg(test)]
mod tests {
    use halcyon_model::{HealthState, InstanceId};

    use super::*;

    fn health(instance: &str, stamp_s: f64) -> Health {
        Health {
            stamp: Stamp::from_secs_f64(stamp_s),
            instance: InstanceId::new(instance).unwrap(),
            service: "x".into(),
            state: HealthState::Ready,
            detail: String::new(),
            restarts: 0,
            uptime_s: 0.0,
            version: String::new(),
        }
    }

    #[test]
    fn an_older_value_never_replaces_a_newer_one() {
        let now = Stamp::from_secs_f64(100.0);
        let mut table = Table::new(4, 5.0);
        assert!(table.put("a", health("a", 99.0), now, 1));
        assert!(!table.put("a", health("a", 98.0), now, 2));
        assert_eq!(table.get(&"a").unwrap().revision, 1);
        // One bad clock must not freeze the row for ever.
        assert!(table.put("a", health("a", 1000.0), now, 3));
        assert!(table.get(&"a").unwrap().stale, "a value from the future is not fresh");
        assert!(table.put("a", health("a", 99.5), now, 4));
    }

    #[test]
    fn a_full_table_forgets_the_one_silent_for_longest() {
        let now = Stamp::from_secs_f64(100.0);
        let mut table = Table::new(2, 5.0);
        table.put("a", health("a", 97.0), now, 1);
        table.put("b", health("b", 96.0), now, 2);
        table.put("c", health("c", 98.0), now, 3);
        assert_eq!(table.iter().map(|(key, _)| *key).collect::<Vec<_>>(), ["a", "c"]);
    }

    #[test]
    fn staleness_shows_without_a_message_and_only_once() {
        let mut table = Table::new(2, 5.0);
        table.put("a", health("a", 100.0), Stamp::from_secs_f64(100.0), 1);
        assert!(!table.refresh(Stamp::from_secs_f64(104.9), 2, |_| false));
        assert!(table.refresh(Stamp::from_secs_f64(105.1), 3, |_| false));
        assert_eq!(table.since(2).count(), 1);
        assert!(!table.refresh(Stamp::from_secs_f64(106.0), 4, |_| false));
    }
}
