//! How long the autopilot flies on by itself when targets stop coming.
//!
//! ArduCopter goes on with the last velocity and acceleration for `GUID_TIMEOUT` seconds, then stops. A companion computer that dies at 5 m/s
//! sends the vehicle 15 m further by the default of 3 s. Targets come ten times a second, so that one second forgives nine lost ones.

use halcyon_model::{Content, ParameterName};

use super::transfers::{Ending, Request};

/// ArduCopter's name for it, since 4.1.
const NAME: &str = "GUID_TIMEOUT";
/// Longer than this is told, seconds.
const COASTING_S_MAX: f64 = 1.0;

/// What to ask ArduPilot for.
#[must_use]
pub fn request() -> Option<Request> {
    ParameterName::new(NAME).ok().map(Request::Read)
}

/// What is wrong with its answer, in words. `None` if nothing is, or if it has no such parameter.
#[must_use]
pub fn problem(ending: &Ending) -> Option<String> {
    let Some(Content::Parameters(parameters)) = &ending.as_ref().ok()?.content else { return None };
    let timeout_s = parameters.iter().find(|parameter| parameter.name.as_str() == NAME)?.value;
    let fine = timeout_s > 0.0 && timeout_s <= COASTING_S_MAX;
    (!fine).then(|| {
        format!(
            "{NAME} is {timeout_s} s: should this computer fail, the vehicle goes on for so long as it flew; set it to {COASTING_S_MAX} or less"
        )
    })
}

#[cfg(test)]
mod tests {
    use halcyon_model::Parameter;

    use super::super::transfers::{TransferError, Transferred};
    use super::*;

    #[test]
    fn more_than_a_second_is_told_and_no_answer_is_not() {
        let answer = |value: f64| {
            let parameter =
                Parameter { name: ParameterName::new(NAME).unwrap(), value, kind: halcyon_model::ParameterKind::Real32 };
            Ok(Transferred { what: String::new(), content: Some(Content::Parameters(vec![parameter])) })
        };
        assert_eq!((problem(&answer(1.0)), problem(&answer(0.3))), (None, None));
        for value in [3.0, 1.1, 0.0, -1.0, f64::NAN] {
            assert!(problem(&answer(value)).unwrap().contains(NAME), "{value}");
        }
        assert_eq!(problem(&Err(TransferError::LinkLost)), None);
        assert!(matches!(request(), Some(Request::Read(name)) if name.as_str() == NAME));
    }
}
