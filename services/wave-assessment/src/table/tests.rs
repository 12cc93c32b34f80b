use super::*;

fn read(text: &str) -> Table {
    Table::read(text.as_bytes()).unwrap_or_else(|error| panic!("{text:?}: {error}"))
}

fn readings(text: &str, choice: &Choice) -> Readings {
    read(text).readings(choice).unwrap_or_else(|error| panic!("{text:?}: {error}"))
}

#[test]
fn one_table_written_in_many_ways_is_one_table() {
    let expected = [(0.0, 0.12), (0.5, -0.03), (1.0, f64::NAN), (1.5, 0.2)];
    for text in [
        "0,0.12\n0.5,-0.03\n1.0,\n1.5,0.2\n",
        "\u{feff}time_s,eta\r\n0,0.12\r\n0.5,-0.03\r\n1,NaN\r\n1.5,0.2",
        "t;eta\n0,0;0,12\n0,5;-0,03\n1,0;n/a\n1,5;0,2\n",
        "# a comment\n% and another\n\n\"time\"\t\"eta\"\n0\t.12\n5e-1\t-3e-2\n1\t-\n1.5\t+0.2\n",
        "  0   0.12\n  0.5 -0.03\n  1.0 nan\n  1.5  0.2\n",
        "0|0.12|\n0.5|-0.03|\n1.0|null|\n1.5|0.2|\n",
        "Station 5, June\ntime,elevation\n(s),(m)\n0,0.12\n0.5,-0.03\n1.0,inf\n1.5,0.2\n",
        "time,eta\r0,0.12\r0.5,-0.03\r1,\r1.5,0.2\r",
        "eta_mm,time_ms\n120,0\n-30,500\nNA,1000\n200,1500\n",
        "2026-05-01T00:00:00Z,0.12\n2026-05-01T00:00:00.5Z,-0.03\n2026-05-01T00:00:01Z,\n2026-05-01T00:00:01.5Z,0.2\n",
        "2026-05-01 02:00:00+02:00;0,12\n2026-05-01 00:00:00.500Z;-0,03\n2026-05-01T00:00:01Z;\n2026-05-01T00:00:01.5;0,2\n",
    ] {
        let found = readings(text, &Choice::default());
        assert_eq!(found.stamp_s.len(), 4, "{text:?}");
        for (i, (stamp_s, elevation_m)) in expected.iter().enumerate() {
            assert!((found.stamp_s[i] - found.stamp_s[0] - stamp_s).abs() < 1e-6, "{text:?} {found:?}");
            let is_same = (found.elevation_m[i] - elevation_m).abs() < 1e-12;
            assert!(is_same || (found.elevation_m[i].is_nan() && elevation_m.is_nan()), "{text:?} {found:?}");
        }
    }
}

#[test]
fn dates_are_unix_time() {
    let found = readings("1970-01-02T00:00:00Z,1\n1970-01-02T00:00:01Z,2\n", &Choice::default());
    assert_eq!(found.stamp_s, [86_400.0, 86_401.0]);
    assert!(found.is_dated);
}

#[test]
fn one_column_needs_a_rate() {
    let table = read("0.1\n0.2\n0.3\n");
    assert!(matches!(table.readings(&Choice::default()), Err(ChoiceError::NoTime { .. })));
    for decimal_comma in ["0,1\n0,2\n0,3\n", "eta\n0,1\n0,2\n0,30\n"] {
        assert_eq!(read(decimal_comma).column(0), table.column(0));
    }
    let found = table.readings(&Choice { rate_hz: Some(4.0), ..Choice::default() }).unwrap();
    assert_eq!(found.stamp_s, [0.0, 0.25, 0.5]);
    for rate_hz in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e7] {
        let choice = Choice { rate_hz: Some(rate_hz), ..Choice::default() };
        assert!(matches!(table.readings(&choice), Err(ChoiceError::Rate { .. })));
    }
}

#[test]
fn columns_go_by_name_number_and_unit() {
    let text = "count,probe [cm],Sonic (ft),temperature\n1,10,1,20\n2,20,2,20\n3,30,3,20\n";
    let of = |time: Option<&str>, value: &str| {
        let choice = Choice { time_column: time.map(Into::into), value_column: Some(value.into()), ..Choice::default() };
        readings(text, &choice)
    };
    assert_eq!(of(None, "probe [cm]").elevation_m, [0.1, 0.2, 0.3]);
    assert_eq!(of(Some("1"), "sonic (ft)").elevation_m, [0.3048, 0.6096, 0.3048 * 3.0]);
    assert_eq!(of(Some("count"), "4").elevation_m, [20.0; 3]);
    let table = read(text);
    assert!(matches!(table.readings(&Choice::default()), Err(ChoiceError::WhichValue { .. })));
    let wrong = Choice { value_column: Some("eta".into()), ..Choice::default() };
    let error = table.readings(&wrong).unwrap_err().to_string();
    assert_eq!(error, r#"there is no column "eta"; there are "count", "probe [cm]", "Sonic (ft)", "temperature""#);
    let millimetres = Choice { value_column: Some("2".into()), unit: Some(LengthUnit::Millimetres), ..Choice::default() };
    assert_eq!(readings(text, &millimetres).elevation_m, [0.01, 0.02, 0.03]);
}

/// One millimetre, said in as many ways; and what is said to be something else is not taken for metres.
#[test]
fn a_unit_is_read_wherever_it_stands() {
    for (text, factor) in [
        ("time (s),Level (MM)\n0,1\n1,2\n2,3\n", 1e-3),
        ("# time, eta\n# s, mm\n0,1\n1,2\n2,3\n", 1e-3),
        ("#t   eta\n#s   cm\n0 1\n1 2\n2 3\n", 1e-2),
        ("Lake 5\ntime;water level\ns;ft\n0;1\n1;2\n2;3\n", 0.3048),
        ("time,eta\n[s],[in]\n0,1\n1,2\n2,3\n", 0.0254),
        ("time,eta\n0,1\n1,2\n2,3\n", 1.0),
    ] {
        let found = readings(text, &Choice::default());
        let expected: Vec<f64> = [1.0, 2.0, 3.0].iter().map(|x| x * factor).collect();
        assert_eq!(found.elevation_m, expected, "{text:?} {found:?}");
    }
    for text in [
        "time,pressure (dbar)\n0,1\n1,2\n2,3\n",
        "time,level\ns,kPa\n0,1\n1,2\n2,3\n",
        "#time eta\n#s counts\n0 1\n1 2\n2 3\n",
        "time,level_psi\n0,1\n1,2\n2,3\n",
    ] {
        let error = read(text).readings(&Choice::default()).unwrap_err();
        assert!(matches!(error, ChoiceError::NoLength { .. }), "{text:?} {error}");
        let metres = Choice { unit: Some(LengthUnit::Metres), ..Choice::default() };
        assert_eq!(readings(text, &metres).elevation_m, [1.0, 2.0, 3.0]);
    }
    let fortnights = read("time (fortnights),eta\n0,1\n1,2\n2,3\n").readings(&Choice::default());
    assert!(matches!(fortnights, Err(ChoiceError::NoTimeUnit { .. })));
}

#[test]
fn a_rate_that_the_stamps_contradict_is_refused() {
    let text = "time,eta\n0,1\n0.1,2\n0.2,3\n0.3,2\n";
    let with = |rate_hz| read(text).readings(&Choice { rate_hz: Some(rate_hz), ..Choice::default() });
    assert!(with(10.0).is_ok() && with(10.2).is_ok());
    assert!(matches!(with(2.0), Err(ChoiceError::RatesDisagree { .. })));
}

/// A clock that shows whole seconds, read four times a second, from the middle of a second on and with a second lost.
#[test]
fn whole_seconds_and_a_rate_are_the_rate() {
    let truth = |i: usize| 100.5 + 0.25 * i as f64 + if i >= 30 { 1.0 } else { 0.0 };
    let text: String = (0..60).map(|i| format!("{},{i}\n", truth(i).floor())).collect();
    let found = readings(&format!("time,eta\n{text}"), &Choice { rate_hz: Some(4.0), ..Choice::default() });
    for (i, stamp_s) in found.stamp_s.iter().enumerate() {
        assert!((stamp_s - truth(i)).abs() < 1e-9, "{i}: {stamp_s} for {}", truth(i));
    }
    let wrong = read(&format!("time,eta\n{text}")).readings(&Choice { rate_hz: Some(10.0), ..Choice::default() });
    assert!(matches!(wrong, Err(ChoiceError::RatesDisagree { .. })), "four readings a second are no ten");
}

#[test]
fn what_is_no_table_is_told_by_line() {
    let error = |text: &[u8]| Table::read(text).unwrap_err();
    assert_eq!(error(b""), TableError::Empty);
    assert_eq!(error(b"a poem\nof two lines\n"), TableError::Empty);
    assert_eq!(error(b"\xff\xfe0\x001\x00"), TableError::NotText { at: 0 });
    assert_eq!(error(b"0,1\n1,2\n2,calm\n"), TableError::Cell { line: 3, column: 2, text: "calm".into() });
    assert_eq!(
        error(format!("# x\n{}2\n", "0,1\n1,2.5\n".repeat(9)).as_bytes()),
        TableError::Ragged { line: 20, cells: 1, columns: 2 }
    );
    let missing = read("time,eta\n0,\n1,NaN\n").readings(&Choice::default());
    assert!(matches!(missing, Err(ChoiceError::AllMissing { .. })));
    let long = format!("{}\n0,1\n", "word\n".repeat(500));
    assert_eq!(error(long.as_bytes()), TableError::Empty);
}

proptest::proptest! {
    #[test]
    fn any_bytes_are_survived(bytes in proptest::collection::vec(proptest::num::u8::ANY, 0..400), text in "[-0-9,.;\t\n eNa#T:Z]{0,300}") {
        for bytes in [&bytes[..], text.as_bytes()] {
            if let Ok(table) = Table::read(bytes) {
                for rate_hz in [None, Some(2.0)] {
                    if let Ok(found) = table.readings(&Choice { rate_hz, ..Choice::default() }) {
                        proptest::prop_assert_eq!(found.stamp_s.len(), found.elevation_m.len());
                    }
                }
            }
        }
    }
}
