//! What is recorded can be read again: by the MCAP library's own reader, by ours, and after a crash.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may")]

use std::collections::BTreeMap;
use std::io::Cursor;

use halcyon_model::{Bytes, Event, InstanceId, LocalPoint, MissionId, Severity, SimTruth, Stamp, VehicleId};
use halcyon_proto::{FILE_DESCRIPTOR_SET, Wire as _};
use halcyon_recorder::core::{Reading, Recorded, Recording, Sample};

fn event(number: i64) -> (Event, Sample) {
    let stamp = Stamp::from_nanos(1_760_000_000_000_000_000 + number * 10_000_001);
    let event = Event {
        stamp,
        source: InstanceId::new("recorder.test").unwrap(),
        severity: Severity::Info,
        what: format!("number {number}"),
        why: "é, to be sure".into(),
        vehicle: None,
        mission: Some(MissionId::new("m-1").unwrap()),
    };
    let sample = Sample {
        key: "halcyon/v1/alpha/event".into(),
        encoding: format!("application/protobuf;halcyon.v1.{}", Event::NAME),
        payload: Bytes::from(halcyon_proto::encode(&event)),
        received: stamp.plus_secs_f64(0.001),
    };
    (event, sample)
}

fn recording() -> Recording<Cursor<Vec<u8>>> {
    let about = BTreeMap::from([("fleet".to_owned(), "alpha".to_owned())]);
    Recording::new(Cursor::new(Vec::new()), FILE_DESCRIPTOR_SET, about).unwrap()
}

fn read(bytes: &[u8]) -> (Vec<Sample>, bool) {
    let mut reading = Reading::new(bytes);
    let mut samples = Vec::new();
    loop {
        match reading.next_sample().unwrap() {
            Recorded::Sample(sample) => samples.push(sample),
            Recorded::End { complete } => return (samples, complete),
        }
    }
}

#[test]
fn the_mcap_library_reads_what_was_recorded() {
    let mut recording = recording();
    let truth = SimTruth {
        stamp: Stamp::from_nanos(5),
        vehicle: VehicleId::new("leader-1").unwrap(),
        position_ned_m: nalgebra_vector(LocalPoint::new(1.0, 2.0)),
        velocity_ned_mps: nalgebra_vector(LocalPoint::new(0.0, 0.0)),
        ned_from_body: Default::default(),
        rate_body_radps: nalgebra_vector(LocalPoint::new(0.0, 0.0)),
        landed: false,
    };
    let events: Vec<(Event, Sample)> = (0..1000).map(event).collect();
    for (_, sample) in &events {
        recording.add(sample).unwrap();
    }
    recording
        .add(&Sample {
            key: "halcyon/v1/alpha/sim/leader-1/truth".into(),
            encoding: format!("application/protobuf;halcyon.v1.{}", SimTruth::NAME),
            payload: Bytes::from(halcyon_proto::encode(&truth)),
            received: Stamp::from_nanos(-1),
        })
        .unwrap();
    recording
        .add(&Sample {
            key: "x/y".into(),
            encoding: "zenoh/bytes".into(),
            payload: Bytes::from_static(b"\x01\x02"),
            received: Stamp::from_nanos(7),
        })
        .unwrap();
    let bytes = recording.finish().unwrap().into_inner();

    let messages: Vec<mcap::Message<'_>> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    assert_eq!(messages.len(), 1002);
    for (index, (message, (event, sample))) in messages.iter().zip(&events).enumerate() {
        let schema = message.channel.schema.as_ref().unwrap();
        assert_eq!((schema.name.as_str(), schema.encoding.as_str()), ("halcyon.v1.Event", "protobuf"));
        assert_eq!(&*schema.data, FILE_DESCRIPTOR_SET);
        assert_eq!(message.channel.topic, "halcyon/v1/alpha/event");
        assert_eq!(message.channel.message_encoding, "protobuf");
        assert_eq!(message.log_time, sample.received.as_nanos() as u64);
        assert_eq!(message.sequence as usize, index);
        assert_eq!(halcyon_proto::decode::<Event>(Bytes::from(message.data.to_vec())).unwrap(), *event);
    }
    assert_eq!((messages[1000].log_time, messages[1000].sequence), (0, 0), "a time before the epoch does not wrap");
    assert_eq!(messages[1001].channel.schema, None);

    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert_eq!(summary.stats.unwrap().message_count, 1002);
    assert_eq!(summary.channels.len(), 3);
    assert_eq!(summary.metadata_indexes.len(), 1);

    let (samples, complete) = read(&bytes);
    assert!(complete);
    assert!(samples.iter().zip(&events).all(|(read, (_, written))| read == written));
    assert_eq!(samples[1001].encoding, "zenoh/bytes");
}

fn nalgebra_vector(point: LocalPoint) -> nalgebra::Vector3<f64> {
    nalgebra::Vector3::new(point.north_m, point.east_m, -5.0)
}

#[test]
fn a_recording_that_was_cut_off_anywhere_gives_back_all_that_was_flushed() {
    let mut recording = recording();
    let samples: Vec<Sample> = (0..300).map(|number| event(number).1).collect();
    let mut flushed_at = Vec::new();
    for (index, sample) in samples.iter().enumerate() {
        recording.add(sample).unwrap();
        if index % 50 == 49 {
            recording.flush().unwrap();
            flushed_at.push(index + 1);
        }
    }
    let whole = recording.finish().unwrap().into_inner();
    // Where each chunk ends, by the index that the library wrote.
    let summary = mcap::Summary::read(&whole).unwrap().unwrap();
    let ends: Vec<usize> =
        summary.chunk_indexes.iter().map(|chunk| (chunk.chunk_start_offset + chunk.chunk_length) as usize).collect();
    assert_eq!(ends.len(), flushed_at.len());
    // Every boundary, what is around it, and every so many bytes between.
    let boundaries = ends.iter().flat_map(|end| end - 20..(end + 20).min(whole.len()));
    for cut in (8..whole.len()).step_by(37).chain(boundaries) {
        let flushed = ends.iter().zip(&flushed_at).filter(|(end, _)| **end <= cut).map(|(_, count)| *count).max().unwrap_or(0);
        let (read, complete) = read(&whole[..cut]);
        assert!(read.len() >= flushed, "cut at {cut}: {} of {flushed}", read.len());
        assert_eq!(read, samples[..read.len()], "cut at {cut}");
        assert!(!complete || read.len() == samples.len());
    }
}

#[test]
fn what_is_no_recording_is_an_error() {
    for bytes in [&b"this is no MCAP file, I should say"[..], &[0u8; 1000][..]] {
        let mut reading = Reading::new(bytes);
        assert!(reading.next_sample().is_err());
    }
    // A bit that flipped in a chunk is found by its checksum.
    let mut recording = recording();
    for number in 0..100 {
        recording.add(&event(number).1).unwrap();
    }
    let mut bytes = recording.finish().unwrap().into_inner();
    let chunk = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes[0].clone();
    let middle = (chunk.chunk_start_offset + chunk.chunk_length / 2) as usize;
    bytes[middle] ^= 1;
    let mut reading = Reading::new(&bytes[..]);
    let outcome = loop {
        match reading.next_sample() {
            Ok(Recorded::Sample(_)) => {}
            other => break other,
        }
    };
    assert!(outcome.is_err(), "{outcome:?}");
}
