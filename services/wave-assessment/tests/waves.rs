//! `halcyon waves` on files: closed forms, a published table, and what careless people give it.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests fail by panicking")]

use std::f64::consts::{PI, SQRT_2, TAU};
use std::fmt::Write as _;
use std::path::PathBuf;

use halcyon_ocean::{Record, Taper, Welch};
use halcyon_wave_assessment::Config;
use halcyon_wave_assessment::cli::{WavesError, WavesOptions, WavesReport, Witness, newest, verdict, waves};
use halcyon_wave_assessment::table::Choice;
use tempfile::TempDir;

struct Files(TempDir);

impl Files {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn put(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}

fn options(input: PathBuf, rate_hz: Option<f64>) -> WavesOptions {
    let choice = Choice { rate_hz, ..Choice::default() };
    let (band_hz, taper) = ((0.05, f64::INFINITY), Taper::Hann);
    WavesOptions { input, choice, burst_s: None, band_hz, segment_s: 64.0, taper, witness: None, window_s: 60.0, waves_min: 20 }
}

/// A sea of eleven waves that never repeats, 4 √m0 = 0.2 m.
fn sea_m(t_s: f64) -> f64 {
    (0..11).map(|i| 0.0213 * (TAU * (0.21 + 0.0391 * f64::from(i)) * t_s + f64::from(i * i)).sin()).sum()
}

/// The same waves by two sensors, of other rates and clocks, agree; one that sees them a quarter higher does not, and what cannot be
/// compared is no agreement either.
#[test]
fn a_second_witness_must_agree() {
    let files = Files::new();
    let record = files.put("stereo.csv", table(6000, 10.0, sea_m));
    let judged = |text: String| {
        let witness = Witness { input: files.put("probe.csv", text), choice: Choice::default(), max_lag_s: 2.0, noise_m: 0.0 };
        let report = waves(&WavesOptions { witness: Some(witness), ..options(record.clone(), None) }).unwrap();
        let mut verdict =
            verdict(&report.first, &Config { h_s_m_max: 1.0, h_tenth_m_max: 1.0, h_highest_m_max: 1.0, ..Config::default() });
        let alone = verdict.state;
        let witness = report.witness.unwrap();
        witness.weigh(&mut verdict);
        (witness, alone, verdict)
    };
    let (same, alone, weighed) = judged(table(4200, 7.0, |t_s| 0.4 + sea_m(t_s - 0.13)));
    assert_eq!((same.verdict, alone, weighed.state), ("agree", "safe", "safe"), "{same:?} {weighed:?}");
    let found = same.comparison.unwrap();
    assert!((found.lag_s.unwrap() - 0.13).abs() < 0.01, "{found:?}");
    // A copy is no witness.
    let copy = judged(table(6000, 10.0, sea_m));
    assert_eq!((copy.0.verdict, copy.2.state), ("unknown", "inconclusive"), "{copy:?}");
    assert!((found.slope - 1.0).abs() < 0.01 && found.r_squared > 0.99 && (found.bias_m + 0.4).abs() < 0.01, "{found:?}");
    let (higher, _, weighed) = judged(table(4200, 7.0, |t_s| 1.25 * sea_m(t_s)));
    assert_eq!((higher.verdict, weighed.state, weighed.probability), ("disagree", "inconclusive", None), "{higher:?}");
    assert!((higher.comparison.unwrap().height_ratio.unwrap() - 0.8).abs() < 0.01);
    let later: Vec<String> = table(4200, 7.0, sea_m)
        .lines()
        .map(|line| line.replacen("", if line.starts_with('t') { "" } else { "9" }, 1))
        .collect();
    let (elsewhere, _, weighed) = judged(later.join("\n"));
    assert_eq!((elsewhere.verdict, weighed.state), ("unknown", "inconclusive"), "{elsewhere:?}");
    assert!(!weighed.reasons[0].passed && weighed.reasons[0].check == "witness");
}

fn table(samples: usize, rate_hz: f64, elevation_m: impl Fn(f64) -> f64) -> String {
    let mut text = String::from("time_s,eta_m\n");
    for t_s in (0..samples).map(|i| i as f64 / rate_hz) {
        writeln!(text, "{t_s:.6},{:.9}", elevation_m(t_s)).unwrap();
    }
    text
}

/// One sine has one height, one period, and m_n = a²/2 fⁿ.
#[test]
fn a_sine_has_its_closed_form() {
    let files = Files::new();
    let (height_m, period_s) = (0.3, 3.2);
    let wave = |t_s: f64| 1.7 + 0.5 * height_m * (TAU * t_s / period_s + 0.3).sin();
    let report = waves(&options(files.put("sine.csv", table(6400, 10.0, wave)), None)).unwrap();
    let burst = &report.first;
    assert_eq!((burst.samples, burst.filled), (6400, 0));
    assert!((burst.rate_hz - 10.0).abs() < 1e-6 && (burst.mean_m - 1.7).abs() < 1e-3);
    for z in [burst.zero_up.unwrap(), burst.zero_down.unwrap()] {
        // A crest lies at most half a sample from a sample.
        let missed = 1.0 - (PI / 32.0).cos();
        for h_m in [z.h_mean_m, z.h_rms_m, z.h_s_m, z.h_tenth_m, z.h_max_m] {
            assert!((h_m / height_m - 1.0).abs() < missed, "{h_m}");
        }
        assert!((z.t_z_s / period_s - 1.0).abs() < 1e-4 && (z.t_third_s / period_s - 1.0).abs() < 1e-3);
        assert!(z.h_s_m_low.unwrap() <= z.h_s_m && z.h_s_m <= z.h_s_m_high.unwrap());
    }
    let s = burst.spectrum.unwrap();
    let m0 = height_m * height_m / 8.0;
    assert!((s.h_m0_m / (SQRT_2 * height_m) - 1.0).abs() < 1e-3 && (s.t_p_s / period_s - 1.0).abs() < 1e-2);
    for (found, power) in [(s.m_minus1, -1), (s.m0, 0), (s.m1, 1), (s.m2, 2)] {
        let expected = m0 * period_s.powi(-power);
        assert!((found / expected - 1.0).abs() < 1e-2, "m{power}: {found} {expected}");
    }
    assert!(burst.quality.iter().all(|flag| flag.flag <= 2), "{:?}", burst.quality);
}

/// Gaps, missing readings, units, order and columns: the same water, the same waves.
#[test]
fn what_a_logger_does_to_a_record_changes_little() {
    let files = Files::new();
    let wave = |t_s: f64| 0.1 * (TAU * t_s / 2.5).sin() + 0.04 * (TAU * t_s / 1.7 + 1.0).sin();
    let good = waves(&options(files.put("good.csv", table(3000, 8.0, wave)), None)).unwrap();
    let expected = good.first.zero_up.unwrap();
    let lines: Vec<(f64, f64)> = (0..3000).map(|i| (i as f64 / 8.0, wave(i as f64 / 8.0))).collect();
    let write = |line: &dyn Fn(usize, f64, f64) -> String| -> String {
        lines.iter().enumerate().map(|(i, (t_s, eta_m))| line(i, *t_s, *eta_m)).collect()
    };
    let missing = write(&|i, t, z| if i % 50 == 7 { format!("{t};NaN\n") } else { format!("{t};{z}\n") });
    let millimetres = format!("level [mm],t_ms\n{}", write(&|_, t, z| format!("{},{}\n", z * 1e3, t * 1e3)));
    let uneven = write(&|i, t, _| {
        let t = t + 0.02 * (i as f64 * 1.3).sin();
        format!("{t}\t{}\n", wave(t))
    });
    let swapped = write(&|i, _, _| {
        let (t, z) = lines[(i ^ 1).min(2999)];
        format!("{t},{z}\n")
    });
    for (name, text) in [("missing", missing), ("mm", millimetres), ("uneven", uneven), ("swapped", swapped)] {
        let found = waves(&options(files.put(name, text), None)).unwrap().first;
        let z = found.zero_up.unwrap();
        assert_eq!(z.waves, expected.waves, "{name}");
        for (found, expected) in [(z.h_s_m, expected.h_s_m), (z.h_mean_m, expected.h_mean_m), (z.t_z_s, expected.t_z_s)] {
            assert!((found / expected - 1.0).abs() < 0.01, "{name}: {found} for {expected}");
        }
    }
}

fn error(text: impl AsRef<[u8]>, rate_hz: Option<f64>) -> String {
    let files = Files::new();
    let error = waves(&options(files.put("x.csv", text), rate_hz)).unwrap_err();
    let mut text = error.to_string();
    let mut source = std::error::Error::source(&error);
    while let Some(cause) = source {
        text = format!("{text}: {cause}");
        source = cause.source();
    }
    assert!(!text.contains('\n') && text.contains("x.csv"), "{text}");
    text
}

#[test]
fn what_holds_no_waves_gets_one_clear_line() {
    for (text, rate_hz, said) in [
        (String::new(), None, "no line of numbers"),
        ("calm\nrough\n".into(), None, "no line of numbers"),
        ("0,1\n1,2\n2,x\n".into(), None, "line 3, column 2: \"x\" is no number"),
        ("1\n2\n3\n".into(), None, "--rate-hz"),
        ("1\n".into(), Some(2.0), ""),
        ("0,NaN\n1,NaN\n".into(), None, "holds no reading"),
        ("0,1\n0,1\n0,1\n0,1\n0,1\n".into(), None, ""),
        (table(3000, 10.0, f64::sin), Some(2.0), "10.0000 Hz and --rate-hz says 2 Hz"),
    ] {
        let found = error(&text, rate_hz);
        assert!(found.contains(said), "{found}");
    }
    let files = Files::new();
    let folder = waves(&options(files.0.path().into(), None)).unwrap_err();
    assert!(matches!(folder, WavesError::NoFile { .. }));
    assert!(matches!(waves(&options(files.0.path().join("no.csv"), None)), Err(WavesError::Read { .. })));
    for bad in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
        let options = WavesOptions { burst_s: Some(bad), ..options(files.put("y.csv", table(100, 2.0, f64::sin)), None) };
        assert!(matches!(waves(&options), Err(WavesError::Option { option: "--burst", .. })));
    }
}

/// Ten samples, and water that does not move: numbers or nothing, never safe.
#[test]
fn little_and_flat_records_are_not_safe() {
    let files = Files::new();
    let ten = waves(&options(files.put("ten.csv", table(10, 2.0, |t| 0.01 * (3.0 * t).sin())), None)).unwrap();
    let flat = waves(&options(files.put("flat.csv", table(600, 2.0, |_| 0.25)), None)).unwrap();
    assert_eq!(flat.first.zero_up, None);
    assert!((flat.first.mean_m - 0.25).abs() < 1e-9);
    for report in [&ten, &flat] {
        let judged = verdict(&report.first, &Config::default());
        assert_eq!(judged.state, "inconclusive", "{judged:?}");
    }
}

#[test]
fn verdicts_follow_the_limits() {
    let files = Files::new();
    let sea = |scale: f64| {
        let wave = move |t: f64| {
            let parts = (1..40_u32).map(|i| {
                let f = 0.2 + 0.01 * f64::from(i) + 0.001 * f64::from(i * 7 % 5);
                scale * (TAU * f * t + f64::from(i * i)).sin()
            });
            parts.sum::<f64>()
        };
        waves(&options(files.put("sea.csv", table(6000, 10.0, wave)), None)).unwrap()
    };
    // 39 sines of amplitude a: m0 = 39 a²/2, H_m0 = 17.7 a.
    let of = |report: &WavesReport| verdict(&report.first, &Config::default()).state;
    assert_eq!(of(&sea(0.001)), "safe");
    assert_eq!(of(&sea(0.02)), "unsafe");
    assert_eq!(of(&sea(0.15 / 17.7)), "inconclusive");
}

/// Another sea of the very same spectrum is no witness: nothing but coherence tells.
#[test]
fn another_sea_of_the_same_height_is_no_witness() {
    let sea = |seed: u32| {
        move |t_s: f64| {
            let wave = |i: u32| {
                let phase = TAU * (f64::from(i * 7919 + seed * 104_729).sin() * 43_758.545).fract();
                0.005 * (TAU * (0.25 + 0.001 * f64::from(i)) * t_s + phase).sin()
            };
            (0..300_u32).map(wave).sum::<f64>()
        }
    };
    let files = Files::new();
    let record = files.put("stereo.csv", table(9000, 5.0, sea(1)));
    let against = |seed| {
        let input = files.put("probe.csv", table(9001, 5.0, sea(seed)));
        let witness = Witness { input, choice: Choice::default(), max_lag_s: 2.0, noise_m: 0.0 };
        let report = waves(&WavesOptions { witness: Some(witness), ..options(record.clone(), None) }).unwrap();
        report.witness.unwrap()
    };
    assert_eq!(against(1).verdict, "agree");
    for seed in 2..8 {
        let found = against(seed);
        assert_ne!(found.verdict, "agree", "{seed}: {found:?}");
    }
}

/// Calm for nine minutes, then a minute of waves ten times as high: the mean of all is under the limits, and what comes next is not. The high waves
/// are no spikes. The other way round it is calm now, though a higher wave than is allowed was seen before.
#[test]
fn a_verdict_is_about_the_newest_waves() {
    let files = Files::new();
    let grows = |t: f64| if t < 540.0 { 0.1 * sea_m(t) } else { 1.0 * sea_m(t) };
    let growing = waves(&options(files.put("grows.csv", table(6000, 10.0, grows)), None)).unwrap();
    let limits = Config { h_s_m_max: 0.12, ..Config::default() };
    assert!(growing.first.spectrum.unwrap().h_m0_m < 0.1, "the mean of all is under the limit");
    let judged = newest(&growing, &limits);
    assert_eq!(judged.state, "unsafe", "{judged:?}");
    assert!(judged.judged_from_s > 480.0 && judged.judged_s < 120.0, "{judged:?}");
    let highest_m = (5400..6000).map(|i| sea_m(f64::from(i) / 10.0)).fold(f64::NEG_INFINITY, f64::max);
    assert!((growing.first.zero_up.unwrap().crest_max_m - highest_m).abs() < 0.01, "the spike test has taken a wave away");
    let calms = |t: f64| if t < 60.0 { 1.0 * sea_m(t) } else { 0.1 * sea_m(t) };
    let calming = waves(&options(files.put("calms.csv", table(6000, 10.0, calms)), None)).unwrap();
    assert_eq!(newest(&calming, &limits).state, "safe", "{:?}", newest(&calming, &limits));
    let whole = verdict(&calming.first, &Config { h_highest_m_max: 0.2, ..limits });
    assert!(whole.state != "safe" && whole.reasons.iter().any(|reason| reason.check == "highest_seen"), "{whole:?}");
}

/// One of three bursts is text-book noise of a dead logger; it is named, the others are analysed, and the last decides.
#[test]
fn a_bad_burst_spoils_no_other() {
    let files = Files::new();
    let text = |dead: std::ops::Range<u32>| {
        (0..18_000_u32).fold("t,eta\n".to_owned(), |mut text, i| {
            let t_s = f64::from(i) / 10.0;
            let cell = if dead.contains(&i) { "NaN".to_owned() } else { format!("{:.6}", 0.1 * sea_m(t_s)) };
            writeln!(text, "{t_s},{cell}").unwrap();
            text
        })
    };
    let report = |dead| {
        let options = options(files.put("bursts.csv", text(dead)), None);
        waves(&WavesOptions { burst_s: Some(600.0), ..options }).unwrap()
    };
    let middle = report(6000..12_000);
    assert_eq!(middle.bursts.iter().map(|burst| burst.number).collect::<Vec<_>>(), [Some(1), Some(3)]);
    assert_eq!(middle.unusable.iter().map(|one| one.burst).collect::<Vec<_>>(), [2]);
    let judged = newest(&middle, &Config::default());
    assert!(judged.state == "safe" && judged.judged_from_s > 1200.0, "{judged:?}");
    let last = newest(&report(12_000..18_000), &Config::default());
    assert_eq!(last.state, "inconclusive", "{last:?}");
    assert!(last.reasons[0].text.contains("burst 3"), "{last:?}");
}

/// Two hours about a spring tide's high water: no straight line, and waves a fifth as high. They are those of the sea without the tide.
#[test]
fn waves_on_a_tide_are_those_without_it() {
    let files = Files::new();
    let tide = |t: f64| 1.5 * (TAU * (t - 3600.0) / 44_712.0).cos();
    let still = waves(&options(files.put("still.csv", table(36_000, 5.0, sea_m)), None)).unwrap();
    let tidal = waves(&options(files.put("tidal.csv", table(36_000, 5.0, |t| tide(t) + sea_m(t))), None)).unwrap();
    let (without, with) = (still.first.zero_up.unwrap(), tidal.first.zero_up.unwrap());
    assert_eq!(still.first.slow_deviation_m, None);
    assert!(tidal.first.slow_deviation_m.unwrap() > 0.04);
    for (found, expected) in [
        (with.h_s_m, without.h_s_m),
        (with.h_mean_m, without.h_mean_m),
        (with.t_z_s, without.t_z_s),
        (with.waves as f64, without.waves as f64),
    ] {
        assert!((found / expected - 1.0).abs() < 0.01, "{with:?} {without:?}");
    }
}

/// Slope over a baseline does not hang on how fast the sensor is: a sine of amplitude a and wave number k has a mean square slope of
/// (2 a sin(k b/2)/b)²/2.
#[test]
fn slope_is_that_of_the_baseline_at_any_rate() {
    let (amplitude_m, f_hz, baseline_m) = (0.05, 0.5, 0.4);
    let k_radpm = (TAU * f_hz).powi(2) / 9.806_65;
    let expected = (2.0 * amplitude_m * (0.5 * k_radpm * baseline_m).sin() / baseline_m).powi(2) / 2.0;
    for rate_hz in [4.0, 10.0, 50.0] {
        let noise = |i: usize| 0.001 * ((i as f64 * 12.9898).sin() * 43_758.545).fract();
        let samples_m: Vec<f64> =
            (0..(600.0 * rate_hz) as usize).map(|i| amplitude_m * (TAU * f_hz * i as f64 / rate_hz).sin() + noise(i)).collect();
        let record = Record::new(samples_m, rate_hz).unwrap();
        let spectrum = Welch::with_segments_of_s(64.0, &record).spectrum(&record).unwrap();
        let found = spectrum.slope_variance(baseline_m, 0.05, f64::INFINITY);
        assert!((found / expected - 1.0).abs() < 0.02, "{rate_hz} Hz: {found} {expected}");
    }
}

/// OCEANLYZ's sample record with its published table, where its folder is: `HALCYON_OCEANLYZ`, or `../shared/data/oceanlyz` beside the project.
#[test]
fn the_published_record_has_its_published_waves() {
    let folder = std::env::var_os("HALCYON_OCEANLYZ")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/oceanlyz"), PathBuf::from);
    let path = folder.join("waterlevel_5burst.csv");
    if !path.exists() {
        println!("NOT CHECKED: {} is not there (set HALCYON_OCEANLYZ)", path.display());
        return;
    }
    let options =
        WavesOptions { burst_s: Some(1024.0), band_hz: (0.05, 1.0), segment_s: 128.0, ..options(path.clone(), Some(2.0)) };
    let report = waves(&options).unwrap();
    // H_m0, T_p, f_p, H_s, H_z, T_z, T_s as published, two decimals.
    #[allow(clippy::approx_constant, reason = "a period of 3.14 s is not π")]
    let published = [
        [0.64, 3.01, 0.33, 0.59, 0.39, 2.61, 2.88],
        [0.59, 2.84, 0.35, 0.53, 0.34, 2.44, 2.71],
        [0.36, 2.21, 0.45, 0.32, 0.20, 1.94, 2.13],
        [0.83, 3.28, 0.30, 0.77, 0.48, 2.74, 3.14],
        [0.47, 2.61, 0.38, 0.41, 0.26, 2.25, 2.49],
    ];
    assert_eq!(report.bursts.len(), 5);
    let text = std::fs::read_to_string(&path).unwrap();
    let record: Vec<f64> = text.split_whitespace().map(|line| line.parse().unwrap()).collect();
    for (number, (burst, expected)) in report.bursts.iter().zip(published).enumerate() {
        let (z, s) = (burst.zero_up.unwrap(), burst.spectrum.unwrap());
        // Waves are defined, and a spectrum's estimate is not. Of all windows, lengths and paddings that were tried, these alone give the
        // table's fifteen values: Hamming's window (or Hann's) over 64 samples, half overlapped, followed by zeros to 512; from 0.05 Hz;
        // and an f_p that is the mean of f weighed by S⁵, no line's. That 64 is ⌈√(2n)⌉ hints at a default of GNU Octave's `pwelch`.
        let readings: Vec<f64> = record[number * 2048..][..2048].to_vec();
        let welch = Welch { segment_samples: 64, taper: Taper::Hamming };
        let theirs = welch.spectrum_padded(&Record::new(readings, 2.0).unwrap().without_trend(), 512).unwrap();
        let of_peak = theirs.statistics(0.05, 1.0).unwrap();
        let fifth = |power: i32| -> f64 {
            let lines = theirs.density_m2_per_hz().iter().enumerate().map(|(i, s)| (i as f64 * theirs.df_hz(), s));
            lines.filter(|(f_hz, _)| *f_hz >= 0.05).map(|(f_hz, s)| f_hz.powi(power) * s.powi(5)).sum()
        };
        let found = [of_peak.h_m0_m, of_peak.t_p_s, fifth(1) / fifth(0), z.h_s_m, z.h_mean_m, z.t_z_s, z.t_third_s];
        println!("{}", found.map(|x| format!("{x:.4}")).join("  "));
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() <= 0.005 + 1e-9, "{found} for {expected}");
        }
        // Our own, of other segments and without zeros: a tenth of its interval off at most.
        for ((found, expected), tolerance) in [s.h_m0_m, s.t_p_s, s.f_p_hz].into_iter().zip(expected).zip([0.02, 0.07, 0.01]) {
            assert!((found - expected).abs() <= tolerance + 1e-9, "{found} for {expected}");
        }
    }
}

/// 0.1 m at 0.25 Hz for 400 s: every wave is in the list, 0.2 m high, 4 s long and 4 s after the one before; the lines' area is its variance,
/// a²/2; a line's interval is chi-square's.
#[test]
fn the_json_lists_every_wave_and_every_line() {
    let files = Files::new();
    let sine = |t_s: f64| 0.1 * (TAU * 0.25 * t_s + 0.3).sin();
    let report = waves(&options(files.put("sine.csv", table(4000, 10.0, sine)), None)).unwrap();
    let json = serde_json::to_value(&report).unwrap();
    let listed = json["waves"].as_array().unwrap();
    assert_eq!(listed.len(), 99, "the first and the last are cut");
    let number = |value: &serde_json::Value, name: &str| value[name].as_f64().unwrap();
    for (i, wave) in listed.iter().enumerate() {
        assert!((number(wave, "height_m") - 0.2).abs() < 1e-3 && (number(wave, "period_s") - 4.0).abs() < 1e-3, "{wave}");
        assert!((number(wave, "crest_m") - 0.1).abs() < 1e-3 && (number(wave, "trough_m") + 0.1).abs() < 1e-3, "{wave}");
        let start_s = 4.0 * (i as f64 + 1.0) - 0.3 / (TAU * 0.25);
        assert!((number(wave, "start_s") - start_s).abs() < 1e-2, "{wave}, {start_s}");
    }
    let column = |name: &str| -> Vec<f64> {
        json["density"][name].as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect()
    };
    let (frequency_hz, density) = (column("frequency_hz"), column("density_m2_per_hz"));
    assert_eq!(frequency_hz.len(), density.len());
    let df_hz = frequency_hz[1] - frequency_hz[0];
    assert!((df_hz - 1.0 / 64.0).abs() < 1e-9 && (frequency_hz.last().unwrap() - 5.0).abs() < 1e-9);
    let variance_m2: f64 = density.iter().map(|line| line * df_hz).sum();
    assert!((variance_m2 - 0.005).abs() < 5e-5, "{variance_m2}");
    let peak = density.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap().0;
    assert!((frequency_hz[peak] - 0.25).abs() < df_hz);
    let shape = &json["shape"];
    let (low, high) = (number(shape, "line_factor_low"), number(shape, "line_factor_high"));
    // Wilson and Hilferty's cube, within a hundredth from five degrees on.
    let dof = number(shape, "line_degrees_of_freedom");
    let ninth = 2.0 / (9.0 * dof);
    let bound = |z: f64| (1.0 - ninth + z * ninth.sqrt()).powi(-3);
    assert!(
        dof > 5.0 && (low / bound(1.959_964) - 1.0).abs() < 0.01 && (high / bound(-1.959_964) - 1.0).abs() < 0.02,
        "{shape}"
    );
}

/// 250 s, a gap of 750 s, 200 s: the first is analysed, and the rest is told to be left out; without a gap nothing is.
#[test]
fn what_lies_beyond_a_long_gap_is_told_to_be_left_out() {
    let files = Files::new();
    let whole = table(12_001, 10.0, sea_m);
    let time_s = |line: &str| line.split(',').next().and_then(|cell| cell.parse::<f64>().ok()).unwrap_or(0.0);
    let gap: Vec<&str> = whole.lines().filter(|line| !(250.0..1000.0).contains(&time_s(line))).collect();
    let found = waves(&options(files.put("gap.csv", gap.join("\n")), None)).unwrap().first;
    assert!(
        (found.duration_s - 250.0).abs() < 0.5 && (found.left_out_s.unwrap() - 950.0).abs() < 1.0,
        "{:?}",
        found.left_out_s
    );
    let found = waves(&options(files.put("whole.csv", &whole), None)).unwrap().first;
    assert_eq!(found.left_out_s, None);
}
