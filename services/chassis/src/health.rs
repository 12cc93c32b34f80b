//! What a service says of itself.

use std::sync::Arc;

use halcyon_model::HealthState;
use tokio::sync::watch;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Report {
    pub(crate) state: HealthState,
    pub(crate) detail: String,
}

/// Through which a service says how it is. Cheap: call it as often as you like, only changes travel at once.
#[derive(Debug, Clone)]
pub struct HealthHandle(Arc<watch::Sender<Report>>);

impl HealthHandle {
    pub(crate) fn new() -> Self {
        Self(Arc::new(watch::Sender::new(Report { state: HealthState::Starting, detail: String::new() })))
    }

    /// Works as it should.
    pub fn ready(&self, detail: impl Into<String>) {
        self.set(HealthState::Ready, detail.into());
    }

    /// Works, but not as it should; `detail` says what is wrong.
    pub fn degraded(&self, detail: impl Into<String>) {
        self.set(HealthState::Degraded, detail.into());
    }

    pub(crate) fn set(&self, state: HealthState, detail: String) {
        let new = Report { state, detail };
        self.0.send_if_modified(|report| {
            let changed = *report != new;
            *report = new;
            changed
        });
    }

    pub(crate) fn subscribe(&self) -> watch::Receiver<Report> {
        self.0.subscribe()
    }
}
