//! The parameter protocol.

use mavlink::dialects::ardupilotmega as mav;
use mavlink::dialects::ardupilotmega::MavMessage;

use super::{Autopilot, LinkId, Outbound, Params};

/// What the index of a parameter says when it was not asked for by index.
const NO_INDEX: u16 = u16::MAX;

impl Autopilot {
    /// Messages of the parameter protocol; `false` for everything else.
    pub(super) fn parameter_protocol(&mut self, link: LinkId, message: &MavMessage) -> bool {
        match message {
            MavMessage::PARAM_REQUEST_LIST(_) => {
                if let Some(link) = self.links.iter_mut().find(|known| known.id == link) {
                    link.next_param = Some(0);
                }
            }
            MavMessage::PARAM_REQUEST_READ(data) => {
                let found = match usize::try_from(data.param_index) {
                    Ok(index) => Some((index, data.param_index as u16)),
                    Err(_) => data.param_id.to_str().ok().and_then(Params::find).map(|index| (index, NO_INDEX)),
                };
                if let Some((index, told_index)) = found
                    && let Some(value) = self.param_value(index, told_index)
                {
                    self.reply(link, value);
                }
            }
            MavMessage::PARAM_SET(data) => {
                // An unknown name is not answered, as on ArduPilot before 4.7; a bad value is answered with the one that stays.
                if let Some(index) = data.param_id.to_str().ok().and_then(Params::find) {
                    self.params.set(index, data.param_value);
                    if let Some(value) = self.param_value(index, NO_INDEX) {
                        self.say(None, Outbound::Message(value));
                    }
                }
            }
            _ => return false,
        }
        true
    }

    /// Sends the next parameter of each list under way: one a step is 400 a second, which no link chokes on.
    pub(super) fn pump_params(&mut self) {
        for place in 0..self.links.len() {
            let (link, next) = (self.links[place].id, self.links[place].next_param);
            let Some(index) = next else { continue };
            match self.param_value(index, index as u16) {
                Some(value) => {
                    self.links[place].next_param = Some(index + 1);
                    self.reply(link, value);
                }
                None => self.links[place].next_param = None,
            }
        }
    }

    fn param_value(&self, index: usize, told_index: u16) -> Option<MavMessage> {
        let (name, param_value, param_type) = self.params.at(index)?;
        Some(MavMessage::PARAM_VALUE(mav::PARAM_VALUE_DATA {
            param_value,
            param_count: Params::count(),
            param_index: told_index,
            param_id: name.into(),
            param_type,
        }))
    }
}
