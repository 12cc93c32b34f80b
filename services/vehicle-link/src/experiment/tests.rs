use super::*;
use crate::core::law::Law;

#[test]
fn table() {
    for law in [Law::ThesisQuadratic, Law::PositionOnly, Law::PositionVelocity, Law::PositionVelocityAcceleration, Law::Halcyon] {
        for flight in [Flight::SQUARE, Flight::SWEEP] {
            for separation in [false, true] {
                let scenario = Scenario { separation, ..Scenario::new(law, flight) };
                match fly(&scenario) {
                    Ok(report) => println!(
                        "{law:?} {flight:?} sep {separation} range {:.3} slot {:.3} peak {:.2} least {:.2} alt {:.3} true range {:.3} slot rep {:.3} n {}",
                        report.reported.range_rms_m, report.true_errors.slot_rms_m, report.slot_peak_m, report.least_separation_m,
                        report.reported.altitude_rms_m, report.true_errors.range_rms_m, report.reported.slot_rms_m, report.setpoints),
                    Err(error) => println!("{law:?} {flight:?} {error}"),
                }
            }
        }
    }
}
