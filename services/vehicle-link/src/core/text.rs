//! STATUSTEXT: what the autopilot says in words, put together from its chunks.

use std::collections::VecDeque;

use halcyon_model::Stamp;
use mavlink::dialects::ardupilotmega as ardu;

/// Texts kept; old ones go.
const KEPT: usize = 32;
/// A text has at most this many characters, however many chunks come.
const LENGTH_MAX: usize = 254;

/// One text.
#[derive(Debug, Clone, PartialEq)]
pub struct Text {
    /// When it came.
    pub stamp: Stamp,
    /// 0 emergency … 7 debug.
    pub severity: u8,
    /// The words.
    pub text: String,
    chunk_id: u16,
}

/// The last texts.
#[derive(Debug, Clone, Default)]
pub struct Texts(VecDeque<Text>);

impl Texts {
    /// Takes a STATUSTEXT; returns it if it starts a new text.
    pub fn observe(&mut self, data: &ardu::STATUSTEXT_DATA, now: Stamp) -> Option<&Text> {
        let length = data.text.iter().position(|byte| *byte == 0).unwrap_or(data.text.len());
        // Hostile bytes are replaced, control characters dropped: it goes to logs and to people.
        let words: String = String::from_utf8_lossy(&data.text[..length]).chars().filter(|c| !c.is_control()).collect();
        if data.id != 0 && data.chunk_seq > 0 {
            if let Some(open) = self.0.back_mut().filter(|open| open.chunk_id == data.id) {
                let room = LENGTH_MAX.saturating_sub(open.text.chars().count());
                open.text.extend(words.chars().take(room));
            }
            return None;
        }
        if self.0.len() == KEPT {
            self.0.pop_front();
        }
        self.0.push_back(Text { stamp: now, severity: data.severity as u8, text: words, chunk_id: data.id });
        self.0.back()
    }

    /// The newest text no older than `age_s` for which `wanted` holds.
    #[must_use]
    pub fn newest(&self, now: Stamp, age_s: f64, wanted: impl Fn(&Text) -> bool) -> Option<&Text> {
        self.0.iter().rev().take_while(|text| now.seconds_since(text.stamp) <= age_s).find(|text| wanted(text))
    }

    /// Why the autopilot would not arm, if it said so lately.
    #[must_use]
    pub fn arming_complaint(&self, now: Stamp, age_s: f64) -> Option<&str> {
        let complaint = |text: &Text| text.text.starts_with("PreArm") || text.text.starts_with("Arm:");
        self.newest(now, age_s, complaint).map(|text| text.text.as_str())
    }
}
