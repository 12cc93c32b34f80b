//! `QGC WPL 110`: the plain text that MAVProxy, Mission Planner and QGroundControl share. Columns, by tabs: number, current, frame,
//! command, parameters 1 to 4, latitude, longitude, altitude, autocontinue. Where line 0 is the current one, at a height above
//! the sea, it is home, as ArduPilot's tools write it, and no item.

use halcyon_model::{Item, ItemFrame};

const HEADER: &str = "QGC WPL 110";

/// Latitude, longitude and altitude of home.
pub(super) type Home = (f64, f64, f64);

/// The items of a file.
///
/// # Errors
/// One line that says which line of the file is wrong, and how.
pub(super) fn read(text: &str) -> Result<Vec<Item>, String> {
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    if lines.next().map(|(_, line)| line.trim()) != Some(HEADER) {
        return Err(format!("line 1 is not {HEADER:?}"));
    }
    let mut items = Vec::new();
    for (at, line) in lines {
        let wrong = |what: &str| format!("line {}: {what}", at + 1);
        let columns: Vec<f64> = line
            .split_whitespace()
            .map(|column| column.parse::<f64>().map_err(|_| wrong(&format!("{column:?} is not a number"))))
            .collect::<Result<_, _>>()?;
        let [number, current, frame, command, p1, p2, p3, p4, latitude, longitude, altitude, autocontinue] = columns[..] else {
            return Err(wrong(&format!("{} columns, not 12", columns.len())));
        };
        let whole = |value: f64, most: f64| (value.fract() == 0.0 && (0.0..=most).contains(&value)).then_some(value);
        let command = whole(command, f64::from(u16::MAX)).ok_or_else(|| wrong("the command is not one"))? as u16;
        let frame = whole(frame, 255.0).and_then(|frame| ItemFrame::from_number(frame as u8));
        let frame = frame.ok_or_else(|| wrong("the frame is not supported"))?;
        if number == 0.0 && current == 1.0 && frame == ItemFrame::SeaLevel && command == 16 {
            continue;
        }
        let given = |value: f64| value.is_finite().then_some(value);
        items.push(Item {
            command,
            frame,
            parameters: [p1, p2, p3, p4].map(given),
            latitude_deg: given(latitude),
            longitude_deg: given(longitude),
            altitude_m: given(altitude),
            autocontinue: autocontinue != 0.0,
        });
    }
    Ok(items)
}

/// The file's text, with home in line 0.
pub(super) fn write(items: &[Item], home: Home) -> String {
    use std::fmt::Write as _;
    let mut text = format!("{HEADER}\n0\t1\t0\t16\t0\t0\t0\t0\t{:.7}\t{:.7}\t{}\t1\n", home.0, home.1, home.2);
    for (item, number) in items.iter().zip(1..) {
        let place = |value: Option<f64>| value.map_or_else(|| "nan".to_owned(), |value| format!("{value:.7}"));
        let plain = |value: Option<f64>| value.map_or_else(|| "nan".to_owned(), |value| value.to_string());
        let [p1, p2, p3, p4] = item.parameters.map(plain);
        let (latitude, longitude, altitude) = (place(item.latitude_deg), place(item.longitude_deg), plain(item.altitude_m));
        let (frame, command, on) = (item.frame.number(), item.command, u8::from(item.autocontinue));
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{number}\t0\t{frame}\t{command}\t{p1}\t{p2}\t{p3}\t{p4}\t{latitude}\t{longitude}\t{altitude}\t{on}"
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As MAVProxy writes it.
    const SAMPLE: &str = "QGC WPL 110\n\
        0\t1\t0\t16\t0.000000\t0.000000\t0.000000\t0.000000\t-35.363262\t149.165237\t584.090027\t1\n\
        1\t0\t3\t22\t15.000000\t0.000000\t0.000000\t0.000000\t-35.363261\t149.165230\t20.000000\t1\n\
        2\t0\t3\t16\t0.000000\t0.000000\t0.000000\tnan\t-35.359900\t149.163651\t20.000000\t1\n";

    #[test]
    fn home_is_no_item_and_the_rest_comes_back() {
        let items = read(SAMPLE).unwrap();
        assert_eq!(items.len(), 2);
        assert_eq!((items[0].command, items[0].frame, items[0].parameters[0]), (22, ItemFrame::Home, Some(15.0)));
        assert_eq!((items[1].parameters[3], items[1].latitude_deg, items[1].altitude_m), (None, Some(-35.3599), Some(20.0)));
        assert_eq!(read(&write(&items, (1.0, 2.0, 3.0))), Ok(items));
    }

    #[test]
    fn without_a_home_in_front_every_line_is_an_item() {
        let text = "QGC WPL 110\r\n0\t0\t3\t22\t0\t0\t0\t0\t1\t2\t20\t1\r\n";
        assert_eq!(read(text).map(|items| items.len()), Ok(1));
    }

    #[test]
    fn what_is_wrong_is_named_by_its_line() {
        let line = |text: &str| read(&format!("QGC WPL 110\n{text}\n")).unwrap_err();
        assert!(read("QGC WPL 120\n").unwrap_err().contains("line 1"));
        assert!(line("1\t0\t3").contains("line 2: 3 columns"));
        assert!(line("1\t0\t3\tx\t0\t0\t0\t0\t1\t2\t20\t1").contains("\"x\""));
        assert!(line("1\t0\t1\t16\t0\t0\t0\t0\t1\t2\t20\t1").contains("frame"));
        assert!(line("1\t0\t3\t70000\t0\t0\t0\t0\t1\t2\t20\t1").contains("command"));
    }
}
