//! The command protocol against its own rules.

use super::*;

const OWN: (u8, u8) = (7, 191);

fn t(s: f64) -> Stamp {
    Stamp::from_secs_f64(1000.0).plus_secs_f64(s)
}

fn to() -> Address {
    Address::new(7, 1).unwrap()
}

fn ack(command: MavCmd, result: MavResult, target: (u8, u8)) -> ardu::COMMAND_ACK_DATA {
    ardu::COMMAND_ACK_DATA { command, result, target_system: target.0, target_component: target.1, ..Default::default() }
}

fn confirmations(effects: &[Effect]) -> Vec<u8> {
    let confirmation = |effect: &Effect| match effect {
        Effect::Send(MavMessage::COMMAND_LONG(data)) => Some(data.confirmation),
        _ => None,
    };
    effects.iter().filter_map(confirmation).collect()
}

#[test]
fn a_clock_set_back_delays_no_retry() {
    let mut commands = Commands::default();
    commands.submit(1, Command::SetMode(FlightMode::Guided)).unwrap();
    let texts = Texts::default();
    assert_eq!(confirmations(&commands.poll(to(), &texts, t(400.0))), [0]);
    let mut sent = Vec::new();
    for step in 0..60 {
        let effects = commands.poll(to(), &texts, t(0.1 * f64::from(step)));
        sent.extend(confirmations(&effects).into_iter().map(|confirmation| (step, confirmation)));
    }
    assert_eq!(sent, [(10, 1), (20, 2), (30, 3)]);
    assert!(commands.poll(to(), &texts, t(400.0)).is_empty(), "it ended with its last try");
}

#[test]
fn retried_with_confirmation_count_then_timed_out() {
    let mut commands = Commands::default();
    commands.submit(1, Command::Arm).unwrap();
    let mut seen = Vec::new();
    let mut outcome = None;
    for step in 0..100 {
        let effects = commands.poll(to(), &Texts::default(), t(f64::from(step) * 0.1));
        seen.extend(confirmations(&effects));
        outcome = outcome.or(effects.into_iter().find_map(|effect| match effect {
            Effect::Done(1, Command::Arm, outcome) => Some((step, outcome)),
            _ => None,
        }));
    }
    assert_eq!(seen, [0, 1, 2, 3]);
    assert_eq!(outcome, Some((40, Err(CommandError::TimedOut { tries: 4, percent: None }))));
}

/// The acknowledgement is lost, the heartbeat shows it done: whoever undoes it then is not fought with a retry. A heartbeat from before it was sent
/// shows nothing.
#[test]
fn what_the_heartbeat_shows_to_be_done_is_not_asked_for_again() {
    let (guided, loiter) = (FlightMode::Guided, FlightMode::Loiter);
    for command in [Command::Arm, Command::SetMode(guided), Command::Disarm { force: false }] {
        let mut commands = Commands::default();
        commands.submit(1, command).unwrap();
        commands.poll(to(), &Texts::default(), t(0.0));
        let armed = command == Command::Arm;
        commands.observe_heartbeat(guided, armed, t(-0.5));
        assert!(commands.poll(to(), &Texts::default(), t(0.1)).is_empty());
        commands.observe_heartbeat(guided, armed, t(0.5));
        assert!(matches!(commands.poll(to(), &Texts::default(), t(0.6))[..], [Effect::Done(1, _, Ok(()))]));
        commands.observe_heartbeat(loiter, !armed, t(0.8));
        let later = (7..100).flat_map(|step| commands.poll(to(), &Texts::default(), t(0.1 * f64::from(step))));
        assert_eq!(later.count(), 0);
    }
}

#[test]
fn only_our_acknowledgement_of_this_command_counts() {
    let mut commands = Commands::default();
    commands.submit(1, Command::Arm).unwrap();
    commands.poll(to(), &Texts::default(), t(0.0));
    let arm = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
    commands.observe_ack(&ack(MavCmd::MAV_CMD_NAV_TAKEOFF, MavResult::MAV_RESULT_ACCEPTED, OWN), OWN.0, OWN.1, t(0.1));
    commands.observe_ack(&ack(arm, MavResult::MAV_RESULT_ACCEPTED, (255, 190)), OWN.0, OWN.1, t(0.1));
    assert!(commands.poll(to(), &Texts::default(), t(0.2)).is_empty());
    commands.observe_ack(&ack(arm, MavResult::MAV_RESULT_ACCEPTED, OWN), OWN.0, OWN.1, t(0.3));
    assert!(matches!(commands.poll(to(), &Texts::default(), t(0.3))[..], [Effect::Done(1, Command::Arm, Ok(()))]));
}

#[test]
fn a_termination_goes_out_at_once_and_another_commands_answer_is_not_taken_for_its_own() {
    let mut commands = Commands::default();
    for ticket in 1..=OPEN_MAX as u64 {
        let command = if ticket % 2 == 0 { Command::Arm } else { Command::Disarm { force: false } };
        commands.submit(ticket, command).unwrap();
    }
    commands.poll(to(), &Texts::default(), t(0.0));
    assert_eq!(commands.submit(98, Command::Arm), Err(CommandError::Busy));
    commands.submit(99, Command::Disarm { force: true }).unwrap();
    let effects = commands.poll(to(), &Texts::default(), t(0.1));
    let overtaken = |effect: &&Effect| matches!(effect, Effect::Done(_, _, Err(CommandError::Overtaken)));
    assert_eq!(effects.iter().filter(overtaken).count(), OPEN_MAX);
    let stop = |effects: &[Effect]| {
        let is_stop =
            |effect: &&Effect| matches!(effect, Effect::Send(MavMessage::COMMAND_LONG(data)) if data.param2 == 21196.0);
        effects.iter().filter(is_stop).count()
    };
    assert_eq!(stop(&effects), 1);
    // The first one's answer comes now; the termination itself was lost, and is sent again.
    let accepted = ack(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, MavResult::MAV_RESULT_ACCEPTED, OWN);
    commands.observe_ack(&accepted, OWN.0, OWN.1, t(0.2));
    let effects = commands.poll(to(), &Texts::default(), t(1.2));
    assert_eq!(stop(&effects), 1);
    // Not even the pilot's mode change withdraws it, if a person asked.
    assert!(commands.withdraw(None, None, t(1.5)).is_empty());
    commands.observe_ack(&accepted, OWN.0, OWN.1, t(1.3));
    let effects = commands.poll(to(), &Texts::default(), t(1.3));
    assert!(matches!(effects[..], [Effect::Done(99, Command::Disarm { force: true }, Ok(()))]), "{effects:?}");
    // Our own is.
    commands.submit(0, Command::Disarm { force: true }).unwrap();
    assert_eq!(commands.withdraw(None, None, t(1.5)).len(), 1);
}

#[test]
fn a_refusal_carries_the_autopilots_words_even_if_they_come_after_it() {
    let mut commands = Commands::default();
    let mut texts = Texts::default();
    commands.submit(9, Command::Arm).unwrap();
    commands.poll(to(), &texts, t(0.0));
    let refused = ack(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, MavResult::MAV_RESULT_FAILED, OWN);
    commands.observe_ack(&refused, OWN.0, OWN.1, t(0.1));
    assert!(commands.poll(to(), &texts, t(0.15)).is_empty());
    let text = ardu::STATUSTEXT_DATA {
        severity: ardu::MavSeverity::MAV_SEVERITY_CRITICAL,
        text: "PreArm: Need Position Estimate".into(),
        ..Default::default()
    };
    texts.observe(&text, t(0.2));
    let effects = commands.poll(to(), &texts, t(0.5));
    let [Effect::Done(9, _, Err(error))] = &effects[..] else { panic!("{effects:?}") };
    assert_eq!(error.to_string(), "the autopilot refused: failed (PreArm: Need Position Estimate)");
}

#[test]
fn progress_extends_the_wait_but_not_for_ever_and_int_only_is_sent_as_int() {
    let mut commands = Commands::default();
    let takeoff = Command::TakeOff { height_above_home_m: 5.0 };
    commands.submit(1, takeoff).unwrap();
    commands.poll(to(), &Texts::default(), t(0.0));
    let id = MavCmd::MAV_CMD_NAV_TAKEOFF;
    commands.observe_ack(&ack(id, MavResult::MAV_RESULT_COMMAND_INT_ONLY, OWN), OWN.0, OWN.1, t(0.1));
    let effects = commands.poll(to(), &Texts::default(), t(0.1));
    let [Effect::Send(MavMessage::COMMAND_INT(data))] = &effects[..] else { panic!("{effects:?}") };
    assert_eq!((data.z, data.target_system, data.target_component), (5.0, 7, 1));
    let mut ended = None;
    for step in 2..2000 {
        let now = t(f64::from(step) * 0.1);
        commands.observe_ack(&ack(id, MavResult::MAV_RESULT_IN_PROGRESS, OWN), OWN.0, OWN.1, now);
        for effect in commands.poll(to(), &Texts::default(), now) {
            if let Effect::Done(_, _, outcome) = effect {
                ended = Some((step, outcome));
            }
        }
        if ended.is_some() {
            break;
        }
    }
    assert!(matches!(ended, Some((599..=602, Err(CommandError::TimedOut { .. })))), "{ended:?}");
}

/// The new mode's heartbeat often overtakes the acknowledgement, and both come within one step.
#[test]
fn a_mode_that_a_person_asked_for_and_got_was_not_withdrawn() {
    let asked = |acknowledged: bool, mode: FlightMode| {
        let mut commands = Commands::default();
        commands.submit(5, Command::SetMode(FlightMode::Loiter)).unwrap();
        commands.poll(to(), &Texts::default(), t(0.0));
        if acknowledged {
            let ack = ack(MavCmd::MAV_CMD_DO_SET_MODE, MavResult::MAV_RESULT_ACCEPTED, OWN);
            commands.observe_ack(&ack, OWN.0, OWN.1, t(0.1));
        }
        let [Effect::Done(5, _, outcome)] = &commands.withdraw(None, Some(mode), t(0.2))[..] else { panic!("no outcome") };
        outcome.clone()
    };
    assert_eq!(asked(true, FlightMode::Loiter), Ok(()));
    assert_eq!(asked(false, FlightMode::Loiter), Ok(()));
    assert_eq!(asked(false, FlightMode::Stabilize), Err(CommandError::Withdrawn));
}

/// MAVLink: progress 0 to 100, 255 if not known; COMMAND_CANCEL names the command and its target.
#[test]
fn what_is_in_progress_is_cancelled_when_it_is_withdrawn_and_tells_how_far_it_was() {
    let takeoff = Command::TakeOff { height_above_home_m: 5.0 };
    let id = MavCmd::MAV_CMD_NAV_TAKEOFF;
    let progress = |percent| ardu::COMMAND_ACK_DATA { progress: percent, ..ack(id, MavResult::MAV_RESULT_IN_PROGRESS, OWN) };
    let begun = || {
        let mut commands = Commands::default();
        commands.submit(1, takeoff).unwrap();
        commands.poll(to(), &Texts::default(), t(0.0));
        commands
    };
    let mut commands = begun();
    assert!(matches!(commands.withdraw(Some(to()), None, t(0.3))[..], [Effect::Done(1, _, Err(CommandError::Withdrawn))]));
    let mut commands = begun();
    commands.observe_ack(&progress(40), OWN.0, OWN.1, t(0.1));
    commands.observe_ack(&progress(255), OWN.0, OWN.1, t(0.2));
    let effects = commands.withdraw(Some(to()), None, t(0.3));
    let [Effect::Send(MavMessage::COMMAND_CANCEL(data)), Effect::Done(1, _, Err(CommandError::Withdrawn))] = &effects[..]
    else {
        panic!("{effects:?}")
    };
    assert_eq!((data.command, data.target_system, data.target_component), (id, 7, 1));
    let mut commands = begun();
    commands.observe_ack(&progress(40), OWN.0, OWN.1, t(0.1));
    let outcomes = (0..300).flat_map(|step| commands.poll(to(), &Texts::default(), t(f64::from(step) * 0.1)));
    let outcome = outcomes.filter_map(|effect| if let Effect::Done(_, _, outcome) = effect { Some(outcome) } else { None });
    let errors: Vec<_> = outcome.filter_map(Result::err).map(|error| error.to_string()).collect();
    assert_eq!(errors, ["the autopilot did not answer 4 tries, 40 % done"]);
}

/// MAVLink has results 0 to 10 here; ArduPilot and PX4 may get more.
#[test]
fn a_result_that_is_not_known_is_a_refusal_that_names_its_number() {
    let mut commands = Commands::default();
    commands.submit(1, Command::Arm).unwrap();
    commands.poll(to(), &Texts::default(), t(0.0));
    let arm = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
    let answer = |target| Unlisted::Ack(ack(arm, MavResult::MAV_RESULT_TEMPORARILY_REJECTED, target), 77);
    commands.observe_unlisted(&answer((255, 190)), OWN.0, OWN.1, t(0.1));
    assert!(commands.poll(to(), &Texts::default(), t(0.5)).is_empty(), "another client's");
    commands.observe_unlisted(&answer(OWN), OWN.0, OWN.1, t(0.5));
    let effects = commands.poll(to(), &Texts::default(), t(0.9));
    let [Effect::Done(1, _, Err(error))] = &effects[..] else { panic!("{effects:?}") };
    assert_eq!(*error, CommandError::Refused { result: Refusal::Unlisted(77), words: None });
    assert_eq!(error.to_string(), "the autopilot refused: result 77, which is not known here");
}

/// GUIDED is sent twice, since its acknowledgement is slow; LAND after it was refused, and its refusal must not be missed for the
/// second acknowledgement of GUIDED.
#[test]
fn a_late_second_acknowledgement_is_not_taken_for_the_next_commands() {
    let mut commands = Commands::default();
    let id = MavCmd::MAV_CMD_DO_SET_MODE;
    let sent = |effects: &[Effect]| effects.iter().filter(|effect| matches!(effect, Effect::Send(_))).count();
    commands.submit(1, Command::SetMode(FlightMode::Guided)).unwrap();
    commands.poll(to(), &Texts::default(), t(0.0));
    assert_eq!(sent(&commands.poll(to(), &Texts::default(), t(1.0))), 1);
    commands.observe_ack(&ack(id, MavResult::MAV_RESULT_ACCEPTED, OWN), OWN.0, OWN.1, t(1.1));
    commands.submit(2, Command::SetMode(FlightMode::Land)).unwrap();
    let effects = commands.poll(to(), &Texts::default(), t(1.1));
    assert!(matches!(effects[..], [Effect::Done(1, _, Ok(())), Effect::Send(_)]), "{effects:?}");
    commands.observe_ack(&ack(id, MavResult::MAV_RESULT_ACCEPTED, OWN), OWN.0, OWN.1, t(1.9));
    assert!(commands.poll(to(), &Texts::default(), t(1.9)).is_empty(), "that was for GUIDED");
    commands.observe_ack(&ack(id, MavResult::MAV_RESULT_FAILED, OWN), OWN.0, OWN.1, t(2.0));
    let effects = commands.poll(to(), &Texts::default(), t(2.4));
    assert!(matches!(effects[..], [Effect::Done(2, _, Err(CommandError::Refused { .. }))]), "{effects:?}");
    // Lost, rather than late, it costs one more try, and no more than that.
    commands.submit(3, Command::SetMode(FlightMode::Guided)).unwrap();
    commands.poll(to(), &Texts::default(), t(10.0));
    commands.poll(to(), &Texts::default(), t(11.0));
    commands.observe_ack(&ack(id, MavResult::MAV_RESULT_ACCEPTED, OWN), OWN.0, OWN.1, t(11.1));
    commands.submit(4, Command::SetMode(FlightMode::Land)).unwrap();
    let mut answered_s = None;
    for tenth in 111..150 {
        let now = t(f64::from(tenth) * 0.1);
        for effect in commands.poll(to(), &Texts::default(), now) {
            match effect {
                Effect::Send(_) => {
                    commands.observe_ack(&ack(id, MavResult::MAV_RESULT_ACCEPTED, OWN), OWN.0, OWN.1, now);
                }
                Effect::Done(4, _, Ok(())) => answered_s = Some(f64::from(tenth) * 0.1),
                _ => {}
            }
        }
    }
    assert!(answered_s.is_some_and(|s| s < 12.5), "{answered_s:?}");
    // Nor is it waited for once it is too late to come.
    commands.submit(5, Command::SetMode(FlightMode::Loiter)).unwrap();
    commands.poll(to(), &Texts::default(), t(30.0));
    commands.observe_ack(&ack(id, MavResult::MAV_RESULT_ACCEPTED, OWN), OWN.0, OWN.1, t(30.1));
    assert!(matches!(commands.poll(to(), &Texts::default(), t(30.1))[..], [Effect::Done(5, _, Ok(()))]));
}

/// MAVLink: whatever else comes while a long command runs is typically rejected with TEMPORARILY_REJECTED, a repetition included.
#[test]
fn busy_with_what_it_was_asked_twice_is_no_refusal_and_given_up_it_is_cancelled() {
    let id = MavCmd::MAV_CMD_NAV_TAKEOFF;
    let answer = |commands: &mut Commands, result, now| {
        commands.observe_ack(&ack(id, result, OWN), OWN.0, OWN.1, now);
    };
    let begun = || {
        let mut commands = Commands::default();
        commands.submit(1, Command::TakeOff { height_above_home_m: 5.0 }).unwrap();
        commands.poll(to(), &Texts::default(), t(0.0));
        answer(&mut commands, MavResult::MAV_RESULT_IN_PROGRESS, t(0.1));
        commands
    };
    let mut commands = begun();
    let effects = commands.poll(to(), &Texts::default(), t(5.2));
    assert!(matches!(effects[..], [Effect::Send(MavMessage::COMMAND_LONG(_))]), "{effects:?}");
    answer(&mut commands, MavResult::MAV_RESULT_TEMPORARILY_REJECTED, t(5.3));
    assert!(commands.poll(to(), &Texts::default(), t(9.0)).is_empty(), "it is at work");
    answer(&mut commands, MavResult::MAV_RESULT_ACCEPTED, t(9.1));
    assert!(matches!(commands.poll(to(), &Texts::default(), t(9.1))[..], [Effect::Done(1, _, Ok(()))]));
    // Not asked twice, it is one.
    let mut commands = begun();
    answer(&mut commands, MavResult::MAV_RESULT_TEMPORARILY_REJECTED, t(0.2));
    assert!(matches!(commands.poll(to(), &Texts::default(), t(1.0))[..], [Effect::Done(1, _, Err(_))]));
    // Silent from then on.
    let mut commands = begun();
    let effects: Vec<Effect> =
        (1..300).flat_map(|step| commands.poll(to(), &Texts::default(), t(f64::from(step) * 0.1))).collect();
    let [.., Effect::Send(MavMessage::COMMAND_CANCEL(data)), Effect::Done(1, _, Err(CommandError::TimedOut { .. }))] =
        &effects[..]
    else {
        panic!("{effects:?}")
    };
    assert_eq!(data.command, id);
}

#[test]
fn one_command_id_at_a_time_and_a_bounded_line() {
    let mut commands = Commands::default();
    commands.submit(1, Command::SetMode(FlightMode::Guided)).unwrap();
    commands.submit(2, Command::SetMode(FlightMode::Land)).unwrap();
    commands.submit(3, Command::Arm).unwrap();
    assert_eq!(commands.poll(to(), &Texts::default(), t(0.0)).len(), 2);
    let mode = ack(MavCmd::MAV_CMD_DO_SET_MODE, MavResult::MAV_RESULT_ACCEPTED, OWN);
    commands.observe_ack(&mode, OWN.0, OWN.1, t(0.1));
    let effects = commands.poll(to(), &Texts::default(), t(0.1));
    assert!(matches!(effects[..], [Effect::Done(1, _, Ok(())), Effect::Send(_)]), "{effects:?}");
    while commands.submit(4, Command::Arm).is_ok() {}
    assert_eq!(commands.submit(4, Command::Arm), Err(CommandError::Busy));
    let ended = commands.abandon();
    assert_eq!(ended.len(), OPEN_MAX);
}

/// The heartbeat that says "disarmed" may be from before the termination came, and the motors may start after it.
#[test]
fn a_termination_is_sent_until_it_is_acknowledged() {
    let mut commands = Commands::default();
    commands.submit(1, Command::Disarm { force: true }).unwrap();
    assert_eq!(confirmations(&commands.poll(to(), &Texts::default(), t(0.0))), [0]);
    commands.observe_heartbeat(FlightMode::Guided, false, t(0.5));
    assert_eq!(confirmations(&commands.poll(to(), &Texts::default(), t(1.1))), [1]);
    commands.observe_ack(&ack(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, MavResult::MAV_RESULT_ACCEPTED, OWN), OWN.0, OWN.1, t(1.2));
    assert!(matches!(commands.poll(to(), &Texts::default(), t(1.3))[..], [Effect::Done(1, _, Ok(()))]));
}
