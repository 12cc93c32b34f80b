//! A bounded inbox where the newest wins: when full, the oldest goes, and is counted.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::Notify;

pub(crate) struct Ring<T> {
    queue: Mutex<VecDeque<T>>,
    depth: usize,
    arrived: Notify,
    dropped: metrics::Counter,
}

impl<T> Ring<T> {
    /// `name` is the topic, for the count of what was dropped.
    pub(crate) fn new(depth: usize, name: &'static str) -> Arc<Self> {
        let depth = depth.max(1);
        let dropped = metrics::counter!("bus_messages_dropped_total", "topic" => name, "reason" => "inbox_full");
        Arc::new(Self { queue: Mutex::new(VecDeque::with_capacity(depth)), depth, arrived: Notify::new(), dropped })
    }

    /// Never blocks: safe on the bus's own threads.
    pub(crate) fn push(&self, item: T) {
        let oldest = {
            let mut queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
            let oldest = if queue.len() == self.depth { queue.pop_front() } else { None };
            queue.push_back(item);
            oldest
        };
        if oldest.is_some() {
            self.dropped.increment(1);
        }
        self.arrived.notify_one();
    }

    /// The oldest item there is. Cancel-safe: nothing is taken until it is returned.
    pub(crate) async fn pop(&self) -> T {
        loop {
            let arrived = self.arrived.notified();
            if let Some(item) = self.queue.lock().unwrap_or_else(PoisonError::into_inner).pop_front() {
                return item;
            }
            arrived.await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn the_oldest_goes_first_and_is_the_one_dropped() {
        let ring = Ring::new(2, "test");
        (1..=3).for_each(|item| ring.push(item));
        assert_eq!((ring.pop().await, ring.pop().await), (2, 3));
        let waiting = tokio::time::timeout(std::time::Duration::from_millis(20), ring.pop()).await;
        assert!(waiting.is_err(), "nothing is left");
    }
}
